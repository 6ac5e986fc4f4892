! SPDX-License-Identifier: MIT
!> Conditions on nodes: planes of symmetry, and conditions that prescribe velocities, by the groups
!> of the input.
module state_conditions
  use base_kinds, only: rp
  use input_key_table, only: key_table_t
  use state_clamp, only: clamp_t
  implicit none (type, external)
  private

  public :: add_clamp_keys, append_clamp, clamp_groups, held_t, make_clamp, symmetry_t, &
            wall_t

  !> Groups of the conditions that prescribe velocities. A new one is a name here and a case in
  !> `make_clamp`.
  character(16), parameter :: clamp_groups(1) = [character(16) :: 'CLAMP']

  !> A condition that prescribes velocities, of any type.
  type :: held_t
    class(clamp_t), allocatable :: clamp
  end type held_t

  !> A wall: bodies are on one side of a plane.
  type :: wall_t
    integer :: axis = 1                   !! axis of its normal
    logical :: faces_up = .true.          !! the bodies are on its upper side
    real(rp) :: position = 0.0_rp         !! coordinate along the axis [m]
    logical :: held(3) = .false.          !! velocity components that are zero
  end type wall_t

  !> A symmetry plane: a wall on a row of nodes with no material behind it (boundary_symmetry).
  type :: symmetry_t
    integer :: place = 0                  !! index among the conditions of the scene
    integer :: axis = 1                   !! axis normal to the plane
    integer :: row = 0                    !! row of grid nodes on the plane, from 0
    logical :: faces_up = .true.          !! the bodies are above the plane
    logical :: odd(3) = .false.           !! components of the velocity that change sign
    real(rp) :: temperature = 0.0_rp      !! temperature of the plane [K]; 0: insulated
    real(rp) :: friction_coefficient = 0.0_rp  !! Coulomb coefficient of friction
  end type symmetry_t

contains

  !> Add the groups of all kinds to the table.
  subroutine add_clamp_keys(t)
    type(key_table_t), intent(inout) :: t
    class(clamp_t), allocatable :: clamp
    integer :: k

    do k = 1, size(clamp_groups)
      call make_clamp(clamp_groups(k), clamp)
      call clamp%add_keys(t)
    end do
  end subroutine add_clamp_keys

  !> Make a condition of this group, with its keys not yet read; unallocated if the group is
  !> unknown.
  subroutine make_clamp(group, clamp)
    character(*), intent(in) :: group
    class(clamp_t), allocatable, intent(out) :: clamp

    select case (group)
    case ('CLAMP')
      allocate (clamp, source=clamp_t())
    case default
    end select
  end subroutine make_clamp

  !> Append a condition to a list.
  subroutine append_clamp(list, clamp)
    type(held_t), allocatable, intent(inout) :: list(:)
    class(clamp_t), intent(in) :: clamp
    type(held_t), allocatable :: longer(:)
    integer :: k

    allocate (longer(size(list) + 1))
    do k = 1, size(list)
      call move_alloc(list(k)%clamp, longer(k)%clamp)
    end do
    allocate (longer(size(longer))%clamp, source=clamp)
    call move_alloc(longer, list)
  end subroutine append_clamp

end module state_conditions
