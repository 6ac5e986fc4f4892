! SPDX-License-Identifier: MIT
!> Tool shape: a shoulder with a thread or flats on its pin, or a scroll in its face, as a mesh.
module tools_shape_cut_shoulder
  use base_kinds, only: pi, rp
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  use tools_shape_cut_keys, only: add_cut_keys, check_cuts, read_cuts
  use tools_shape_cuts, only: cut_pin_shape_t, make_mesh
  use tools_shape_meshed, only: meshed_t
  use tools_shape_shoulder, only: shoulder_t
  implicit none (type, external)
  private

  public :: cut_shoulder_t

  type, extends(meshed_t) :: cut_shoulder_t
    type(shoulder_t) :: plain          !! the shoulder without cuts, which checks the sizes
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, check_size
  end type cut_shoulder_t

contains

  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t

    call add_cut_keys(t)
  end subroutine add_keys

  subroutine read_keys(self, input, i, frame)
    class(cut_shoulder_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(out) :: frame(3, 3)
    type(cut_pin_shape_t) :: cuts
    logical :: is_sound

    call self%plain%read_keys(input, i, frame)
    self%radius = self%plain%radius
    self%pin_radius = self%plain%pin_radius
    cuts%radius = input%real('TOOL', i, 'RADIUS')
    cuts%height = input%real('TOOL', i, 'HEIGHT')
    cuts%slope = tan(input%real('TOOL', i, 'CONCAVITY_DEG')*pi/180.0_rp)
    cuts%pin_radius = input%real('TOOL', i, 'PIN_RADIUS')
    cuts%tip_radius = input%real('TOOL', i, 'PIN_TIP_RADIUS')
    cuts%pin_length = input%real('TOOL', i, 'PIN_LENGTH')
    if (cuts%tip_radius <= 0.0_rp) cuts%tip_radius = cuts%pin_radius
    call read_cuts(input, i, cuts, is_sound)
    if (is_sound) call make_mesh(cuts, self%mesh)
  end subroutine read_keys

  subroutine check_size(self, input, i, grid, cell, width, spins)
    class(cut_shoulder_t), intent(in) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: grid, cell(3), width
    logical, intent(in) :: spins

    call self%plain%check_size(input, i, grid, cell, width, spins)
    call check_cuts(input, i, cell)
  end subroutine check_size

end module tools_shape_cut_shoulder
