! SPDX-License-Identifier: MIT
!> Clamps, nodes in a box that move with a given velocity (boundary_clamps). A condition that
!> prescribes another velocity, of position and time, is a type that extends this one in a file of
!> its own (its keys, reading them, the velocity), and one line in `state_conditions`.
module state_clamp
  use base_kinds, only: rp
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  implicit none (type, external)
  private

  public :: add_box_keys, clamp_t

  type :: clamp_t
    integer :: place = 0                  !! index among the conditions of the scene
    real(rp) :: lower(3) = -huge(1.0_rp)  !! lower corner [m]; -huge: no face on this side
    real(rp) :: upper(3) = huge(1.0_rp)
    logical :: held(3) = .true.       !! held components of the velocity
    logical :: is_wall = .false.      !! a &WALL, not a &CLAMP
    real(rp) :: velocity(3) = 0.0_rp  !! velocity of all nodes at all times if it is uniform [m/s]
    real(rp) :: until = huge(1.0_rp)  !! time of its release [s]
    logical :: is_uniform = .true.    !! the velocity is uniform; otherwise `velocity_at` gives it
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, moves, velocity_at
    procedure, non_overridable :: read_box
  end type clamp_t

contains

  !> Add the group and its keys to the table.
  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t

    call t%group('CLAMP', 'repeat', 'Nodes of the grid in a box, moved at a given velocity.')
    call add_box_keys(t)
    call t%key('VELOCITY', 'real', 3, 'm/s', '0 0 0', '', 'velocity of the nodes')
    call t%may_change('CLAMP', 'VELOCITY')
  end subroutine add_keys

  !> Add the keys of box and components to the group opened last.
  subroutine add_box_keys(t)
    type(key_table_t), intent(inout) :: t

    call t%key('LOWER', 'real', 3, 'm', 'required', '', 'lower corner of the box')
    call t%key('UPPER', 'real', 3, 'm', 'required', '', 'upper corner of the box')
    call t%key('COMPONENTS', 'text', 1, '', 'xyz', 'xyz', &
               'components of the velocity that are prescribed')
    call t%key('UNTIL', 'real', 1, 's', '', '(0,inf)', &
               'time at which the nodes are released; not given: never')
  end subroutine add_box_keys

  !> Read the keys of the `i`-th group.
  subroutine read_keys(self, input, i)
    class(clamp_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i

    call self%read_box(input, 'CLAMP', i)
    self%velocity = input%reals('CLAMP', i, 'VELOCITY', 3)
  end subroutine read_keys

  !> Read the box and the held components of the `i`-th `group`.
  subroutine read_box(self, input, group, i)
    class(clamp_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    character(*), intent(in) :: group
    integer, intent(in) :: i
    character(:), allocatable :: letters
    integer :: a

    self%lower = input%reals(group, i, 'LOWER', 3)
    self%upper = input%reals(group, i, 'UPPER', 3)
    self%until = input%real(group, i, 'UNTIL', otherwise=self%until)
    letters = input%text(group, i, 'COMPONENTS')
    self%held = [(index(letters, 'xyz'(a:a)) > 0, a=1, 3)]
    if (any(self%upper < self%lower)) then
      call input%report(group, i, 'UPPER', 'must not be below LOWER')
    end if
  end subroutine read_box

  !> False if the held nodes are always at rest.
  pure logical function moves(self)
    class(clamp_t), intent(in) :: self

    moves = .not. self%is_uniform .or. any(abs(self%velocity) > 0.0_rp)
  end function moves

  !> Velocity of a node at `x` in the step from time `t` [m/s], if it is not uniform.
  pure function velocity_at(self, x, t) result(v)
    class(clamp_t), intent(in) :: self
    real(rp), intent(in) :: x(3), t                !! position [m], time [s]
    real(rp) :: v(3)

    v = self%velocity
  end function velocity_at

end module state_clamp
