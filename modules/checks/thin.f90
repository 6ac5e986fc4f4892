! SPDX-License-Identifier: MIT
!> Metal that is too thin, in cells, between a tool and what holds the plate.
module checks_thin
  use base_kinds, only: rp
  use base_text, only: str
  use checks_around, only: plate_of
  use checks_process, only: none, tool_survey_t
  use contact_tool, only: tool_t
  use grid_geometry, only: grid_t
  use heat_setup_cut_cells, only: solids_t
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  use setup_walls, only: wall_of, wall_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: check_clamps, check_depth, check_thickness

  real(rp), parameter :: reach = 3.0_rp           !! of a quadratic B-spline [cells]
  real(rp), parameter :: least_below = 1.0_rp     !! for a node between that neither holds [cells]

contains

  !> Metal so thin between a tool and a wall that holds it, that both have the same nodes: friction
  !> goes from one to the other past the metal and has no limit.
  subroutine check_thickness(input, scene, solids, diagnostics)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(solids_t), intent(in) :: solids(:)
    type(diagnostics_t), intent(inout) :: diagnostics
    type(wall_t) :: wall
    real(rp) :: cells, lower(3), upper(3)
    integer :: i

    do i = 1, input%count('WALL')
      wall = wall_of(input, scene%grid, i)
      if (.not. all(wall%held)) cycle
      call plate_of(scene, solids, lower, upper)
      associate (a => wall%axis, x => wall%position, grid => scene%grid)
        if (merge(lower(a) - x, x - upper(a), wall%faces_up) > grid%h(a)) cycle
        if (wall%faces_up) lower(a) = max(lower(a), x)
        if (.not. wall%faces_up) upper(a) = min(upper(a), x)
        cells = cells_between(grid, a, lower(a), upper(a))
      end associate
      if (cells > reach*(1.0_rp - 1.0e-6_rp)) cycle
      call input%warn(diagnostics, 'WALL', i, 'KIND', &
                      'holds metal of '//str(cells)//' cells between it and a tool: friction '// &
                      'passes through it without a limit below 3 cells')
    end do
  end subroutine check_thickness

  !> The same between a tool and a clamp that holds the other side of the metal under its path.
  subroutine check_clamps(input, scene, solids, survey, diagnostics)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(solids_t), intent(in) :: solids(:)
    type(tool_survey_t), intent(in) :: survey
    type(diagnostics_t), intent(inout) :: diagnostics
    real(rp) :: cells, ends(2), lower(3), upper(3)
    logical :: is_passed(3), is_thin
    integer :: a, i, n

    n = input%count('WALL') - size(scene%symmetry)   ! of walls; those of &CLAMP follow
    call plate_of(scene, solids, lower, upper)
    do i = 1, input%count('CLAMP')
      associate (clamp => scene%clamp(n + i)%clamp, grid => scene%grid)
        if (.not. all(clamp%held)) cycle
        is_passed = clamp%lower < survey%swept(:, 2) .and. clamp%upper > survey%swept(:, 1)
        do a = 1, 3
          is_passed(a) = .true.          ! along this axis the tool is on the other side
          if (clamp%lower(a) <= lower(a) + grid%h(a) .and. survey%lower(a) >= clamp%upper(a)) then
            ends = [max(lower(a), clamp%upper(a)), upper(a)]
          else if (clamp%upper(a) >= upper(a) - grid%h(a) &
                   .and. survey%upper(a) <= clamp%lower(a)) then
            ends = [lower(a), min(upper(a), clamp%lower(a))]
          else
            is_passed(a) = .false.
          end if
          if (all(is_passed)) then
            cells = cells_between(grid, a, ends(1), ends(2))
            is_thin = cells > 0.0_rp .and. cells <= reach*(1.0_rp - 1.0e-6_rp)
            if (is_thin) call input%warn(diagnostics, 'CLAMP', i, '', &
              'holds metal of '//str(cells)//' cells between it and a tool: friction '// &
              'passes through it without a limit below 3 cells')
          end if
          is_passed(a) = clamp%lower(a) < survey%swept(a, 2) .and. clamp%upper(a) &
                         > survey%swept(a, 1)
        end do
      end associate
    end do
  end subroutine check_clamps

  !> Tools that dig so deep into a plate that is held below that the metal left there is heated and
  !> cannot flow. Depths are those of the motion as it is written, up to a phase of which the end is
  !> not known.
  subroutine check_depth(input, scene, tool, solids, survey, diagnostics)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool
    type(solids_t), intent(in) :: solids(:)
    type(tool_survey_t), intent(in) :: survey
    type(diagnostics_t), intent(inout) :: diagnostics
    real(rp) :: cells, floor, lower(3), upper(3)
    integer :: i

    call plate_of(scene, solids, lower, upper)
    floor = floor_below(input, scene, survey, lower(3))
    if (floor <= -none) return
    do i = 1, size(survey%phase)
      associate (phase => survey%phase(i))
        if (phase%motion == 0) cycle
        if (tool%motion%phase(i)%presses .or. tool%motion%phase(i)%ends_early()) return
        if (phase%bottom >= none) cycle
        cells = cells_between(scene%grid, 3, floor, lower(3) + phase%bottom)
        if (cells <= 0.0_rp .or. cells >= least_below*(1.0_rp - 1.0e-6_rp)) cycle
        call input%warn(diagnostics, 'MOTION', phase%motion, 'VELOCITY', &
                        'leaves metal of '//str(cells)//' cells between the tool and what '// &
                        'holds the plate below: with less than a cell no node there is free, '// &
                        'and metal that is heated and cannot flow melts')
        return
      end associate
    end do
  end subroutine check_depth

  !> Height of the highest wall or clamp that holds the plate from below under a tool; -none if
  !> there is no such.
  real(rp) function floor_below(input, scene, survey, bottom) result(floor)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_survey_t), intent(in) :: survey
    real(rp), intent(in) :: bottom                 !! of the plate [m]
    type(wall_t) :: wall
    integer :: i

    floor = -none
    do i = 1, input%count('WALL')
      wall = wall_of(input, scene%grid, i)
      if (wall%axis /= 3 .or. .not. (wall%faces_up .and. all(wall%held))) cycle
      if (wall%position >= bottom - scene%grid%h(3)) floor = max(floor, wall%position)
    end do
    do i = input%count('WALL') - size(scene%symmetry) + 1, size(scene%clamp)
      associate (clamp => scene%clamp(i)%clamp)
        if (.not. all(clamp%held) .or. clamp%upper(3) > survey%lower(3)) cycle
        if (any(clamp%lower(:2) >= survey%swept(:2, 2))) cycle
        if (any(clamp%upper(:2) <= survey%swept(:2, 1))) cycle
        if (clamp%lower(3) > bottom + scene%grid%h(3)) cycle
        if (clamp%upper(3) >= bottom - scene%grid%h(3)) floor = max(floor, bottom, clamp%upper(3))
      end associate
    end do
  end function floor_below

  !> Cells between two places on an axis.
  pure real(rp) function cells_between(grid, axis, from, to) result(cells)
    type(grid_t), intent(in) :: grid
    integer, intent(in) :: axis
    real(rp), intent(in) :: from, to               !! [m]

    cells = (to - from)/grid%h(axis)
    if (grid%grading%axis == axis) cells = grid%grading%place(to) - grid%grading%place(from)
  end function cells_between

end module checks_thin
