! SPDX-License-Identifier: MIT
!> Read the grading of the grid along an axis; check what it can be combined with.
module setup_grading
  use base_kinds, only: rp
  use base_text, only: str
  use grid_geometry, only: grade, grid_t
  use grid_grading, only: grading_t, make_grading
  use input_values, only: input_t
  use keys_names, only: find
  use state_scene, only: scene_t, transfer_apic
  implicit none (type, external)
  private

  public :: check_grading, read_grading

contains

  !> Grade the axis of `grid` that GRADED names. After an error the grid has no nodes.
  subroutine read_grading(input, upper, grid)
    type(input_t), intent(in) :: input
    real(rp), intent(in) :: upper(3)         !! upper corner of the grid [m]
    type(grid_t), intent(inout) :: grid
    real(rp) :: cells, ends(2), fine(2), growth, h, largest
    type(grading_t) :: grading
    character(:), allocatable :: key, message
    integer :: a, n

    a = find(['none', 'x   ', 'y   ', 'z   '], input%text('GRID', 1, 'GRADED')) - 1
    if (a <= 0 .or. .not. input%given('GRID', 1, 'FINE')) return   ! the latter is reported already
    fine = input%reals('GRID', 1, 'FINE', 2)
    growth = input%real('GRID', 1, 'GROWTH')
    largest = input%real('GRID', 1, 'LARGEST_CELL')
    if (largest <= 0.0_rp) largest = maxval(grid%h)
    if (growth < 1.0_rp) return              ! is reported already
    ends = [grid%lower(a), upper(a)]
    h = grid%h(a)
    cells = (fine(2) - fine(1))/h
    key = 'FINE'
    message = ''
    n = 0
    if (grid%period(a) > 0) then
      key = 'PERIODIC'
      message = 'a graded axis cannot be periodic'
    else if (fine(2) < fine(1) .or. fine(1) < ends(1) - 1.0e-9_rp*h .or. &
             fine(2) > ends(2) + 1.0e-9_rp*h) then
      message = 'must be two places along '//'xyz'(a:a)//', the lower one first, between LOWER '// &
                'and UPPER'
    else if (abs(cells - anint(cells)) > 1.0e-6_rp) then
      message = 'its length must be a whole number of cells; it is '//str(cells)//' of '// &
                str(1.0e3_rp*h)//' mm'
    else if (largest < h*(1.0_rp + 1.0e-9_rp)) then
      key = 'LARGEST_CELL'
      message = 'must be more than the edge '//str(1.0e3_rp*h)//' mm that CELL gives along '// &
                'xyz'(a:a)
    else
      call make_grading(a, ends(1), ends(2), fine, h, growth, largest, grading, n, message)
    end if
    if (len(message) > 0) then
      call input%report('GRID', 1, key, message)
      grid%n = 0
    else
      call grade(grid, grading, n)
    end if
  end subroutine read_grading

  !> Report methods that cannot be combined with a graded grid.
  subroutine check_grading(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    integer :: b

    if (scene%grid%grading%axis == 0) return
    if (.not. scene%method%is_bspline) call input%report('METHOD', 1, 'SHAPE', &
      'must be bspline on a graded grid: domains of particles are of cells with one length')
    if (scene%method%transfer == transfer_apic) call input%report('METHOD', 1, 'TRANSFER', &
      'cannot be apic on a graded grid: its moments are of cells with one length')
    if (.not. scene%method%has_mechanics) call input%report('METHOD', 1, 'MECHANICS', &
      'must be T on a graded grid: the cells of heat alone follow the shapes by themselves')
    do b = 1, size(scene%body)
      if (scene%body(b)%is_rigid()) call input%report('BODY', b, 'RIGID', 'cannot be on a '// &
        'graded grid: particles of a tool do not become finer with its cells')
      if (scene%body(b)%is_round) call input%report('BODY', b, 'LATTICE', 'cannot be round on '// &
        'a graded grid')
    end do
  end subroutine check_grading

end module setup_grading
