! SPDX-License-Identifier: MIT
!> Survey of the prescribed motion of tools relative to the undeformed bodies, the grid and its
!> walls: depths, distances, first contact.
module setup_process
  use base_kinds, only: rp
  use input_values, only: input_t
  use setup_boundary, only: wall_of
  use setup_solids, only: body_at, extent_of, is_inside, round_points, solid_t, solids_t
  use state_conditions, only: wall_t
  use state_scene, only: scene_t
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: survey_tool, tool_survey_t, undefined

  real(rp), parameter :: undefined = huge(1.0_rp)  !! value of an undefined length or time
  integer, parameter :: most_samples = 1000       !! largest number of time samples of a phase
  real(rp), parameter :: gap_in_cells = 0.05_rp   !! distance that counts as contact [cells]

  !> Surroundings of a tool: bodies, grid and walls.
  type :: surroundings_t
    type(solids_t), allocatable :: solids(:)      !! solids of the other bodies
    real(rp) :: lower(3) = 0.0_rp, upper(3) = 0.0_rp   !! box around deformable bodies [m]
    real(rp) :: grid_lower(3) = 0.0_rp, grid_upper(3) = 0.0_rp   !! corners of the grid [m]
    real(rp) :: side_lower(3) = 0.0_rp, side_upper(3) = 0.0_rp   !! walls or grid sides [m]
    real(rp), allocatable :: body_points(:, :)    !! (3, n) sample points in the bodies [m]
    real(rp), allocatable :: clamp(:, :, :)       !! (3, 2, n) corners of &CLAMP at rest [m]
    real(rp) :: gap = 0.0_rp                      !! distance that counts as contact [m]
  end type surroundings_t

  !> Survey of a phase of a tool's motion, or of its rest after the last one.
  type :: phase_survey_t
    character(8) :: name = 'rest'
    integer :: motion = 0                         !! index of its &MOTION; 0: none
    integer :: n_samples = 48                     !! time samples
    real(rp) :: from = 0.0_rp, to = 0.0_rp        !! start and end time [s]
    real(rp) :: path_length = 0.0_rp              !! length of the path [m]
    real(rp) :: speed = 0.0_rp                    !! largest speed [m/s]
    real(rp) :: spin = 0.0_rp                     !! spin of largest magnitude [rad/s]
    real(rp) :: depth = undefined  !! depth of the lowest tool point below the plate top [m]
    real(rp) :: bottom = undefined     !! least thickness of metal below the tool [m]
    real(rp) :: edge = undefined  !! least distance of the tool rim to a plate edge [m]
    real(rp) :: side = undefined   !! least distance of the tool to a grid side or wall [m]
    real(rp) :: off_plate = 0.0_rp                !! path length beside the plate after contact [m]
    real(rp) :: off_plate_from = undefined  !! time at which the tool leaves the plate [s]
  end type phase_survey_t

  !> Survey of all phases of a tool.
  type :: tool_survey_t
    type(phase_survey_t), allocatable :: phase(:)
    real(rp) :: touch = undefined                 !! time of first contact [s]
    real(rp) :: through = undefined   !! time at which the tool penetrates the plate bottom [s]
    logical :: is_in_grid = .false.               !! the tool is in the grid at some time
    integer :: clamp = 0               !! index of a &CLAMP at rest into which it comes; 0: none
    real(rp) :: plate(3, 2) = 0.0_rp              !! box around the deformable bodies [m]
    real(rp) :: lower(3) = 0.0_rp, upper(3) = 0.0_rp   !! bounding box at t = 0 [m]
  end type tool_survey_t

contains

  !> Survey the motion of a tool through the run.
  subroutine survey_tool(input, scene, solids, k, tool, survey)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(solids_t), intent(in) :: solids(:)
    integer, intent(in) :: k                      !! index of the tool
    type(tool_t), intent(in) :: tool
    type(tool_survey_t), intent(out) :: survey
    type(surroundings_t) :: surroundings
    type(tool_t) :: now
    real(rp), allocatable :: outline(:, :)
    integer :: i

    call collect_surroundings(input, scene, solids, k, surroundings)
    survey%plate = reshape([surroundings%lower, surroundings%upper], [3, 2])
    call draw_outline(scene, solids, k, tool, outline)
    call list_phases(input, scene, tool, survey%phase)
    now = tool
    call now%move_to(0.0_rp)
    survey%lower = minval(spread(now%position, 2, size(outline, 2)) + matmul(now%axes, outline), 2)
    survey%upper = maxval(spread(now%position, 2, size(outline, 2)) + matmul(now%axes, outline), 2)
    do i = 1, size(survey%phase)
      call sample_phase(surroundings, now, outline, survey, survey%phase(i))
    end do
  end subroutine survey_tool

  !> Collect the surroundings of tool `k`: other bodies, their box, the grid and its walls.
  subroutine collect_surroundings(input, scene, solids, k, surroundings)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(solids_t), intent(in) :: solids(:)
    integer, intent(in) :: k
    type(surroundings_t), intent(out) :: surroundings
    type(wall_t) :: wall
    real(rp), allocatable :: points(:)
    real(rp) :: lower(3), upper(3)
    integer :: b, i

    associate (s => surroundings)
      s%gap = gap_in_cells*minval(scene%grid%h)
      s%lower = huge(1.0_rp)
      s%upper = -huge(1.0_rp)
      do b = 1, size(solids)
        if (scene%body(b)%is_rigid()) cycle
        call extent_of(solids(b)%solid, lower, upper)
        s%lower = min(s%lower, lower)
        s%upper = max(s%upper, upper)
      end do
      s%solids = pack(solids, scene%body%tool /= k)
      s%grid_lower = scene%grid%lower
      s%grid_upper = scene%grid%upper()
      s%side_lower = s%grid_lower
      s%side_upper = s%grid_upper
      do i = 1, input%count('WALL')
        wall = wall_of(input, scene%grid, i)
        associate (low => s%side_lower(wall%axis), high => s%side_upper(wall%axis))
          if (wall%faces_up) low = max(low, wall%position)
          if (.not. wall%faces_up) high = min(high, wall%position)
        end associate
      end do
      allocate (s%clamp(3, 2, input%count('CLAMP')), source=0.0_rp)
      do i = 1, size(s%clamp, 3)
        associate (clamp => scene%clamp(size(scene%clamp) - size(s%clamp, 3) + i)%clamp)
          if (.not. clamp%moves()) s%clamp(:, :, i) = reshape([clamp%lower, clamp%upper], [3, 2])
        end associate
      end do
      allocate (points(0))
      do b = 1, size(s%solids)
        points = [points, sample_points(s%solids(b)%solid)]
      end do
      s%body_points = reshape(points, [3, size(points)/3])
    end associate
  end subroutine collect_surroundings

  !> Sample points in a body, (3, n) [m], including points near its faces.
  pure function sample_points(solid) result(x)
    type(solid_t), intent(in) :: solid(:)
    real(rp), allocatable :: x(:, :)
    integer, parameter :: n = 12
    real(rp) :: candidate(3, (n + 1)**3), lower(3), upper(3)
    real(rp), allocatable :: round(:, :)
    logical :: is_in((n + 1)**3)
    integer :: i, j, k, p

    call extent_of(solid, lower, upper)
    p = 0
    do i = 0, n
      do j = 0, n
        do k = 0, n
          p = p + 1
          candidate(:, p) = lower + (upper - lower)*(1.0e-6_rp + (1.0_rp - 2.0e-6_rp)*[i, j, k]/n)
          is_in(p) = is_inside(solid, candidate(:, p))
        end do
      end do
    end do
    allocate (round, source=round_points(solid))
    x = reshape([pack(candidate, spread(is_in, 1, 3)), round], [3, count(is_in) + size(round, 2)])
  end function sample_points

  !> Points on the surface of a tool, or in a rigid body, in its own axes, (3, n) [m]; none for a
  !> tool of infinite extent.
  subroutine draw_outline(scene, solids, k, tool, x)
    type(scene_t), intent(in) :: scene
    type(solids_t), intent(in) :: solids(:)
    integer, intent(in) :: k
    type(tool_t), intent(in) :: tool
    real(rp), allocatable, intent(out) :: x(:, :)

    if (tool%has_shape()) then
      call tool%shape%outline(x)
    else
      x = sample_points(solids(findloc(scene%body%tool, k, dim=1))%solid)
      x = matmul(transpose(tool%frame), x - spread(tool%start, 2, size(x, 2)))
    end if
  end subroutine draw_outline

  !> Phases of the input up to the end of the run, and the rest of the run after them.
  subroutine list_phases(input, scene, tool, phase)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool
    type(phase_survey_t), allocatable, intent(out) :: phase(:)
    type(phase_survey_t) :: current
    real(rp) :: v(3)
    integer :: i, k

    allocate (phase(0))
    k = 0
    do i = 1, input%count('MOTION')
      if (input%text('MOTION', i, 'TOOL') /= tool%name) cycle
      k = k + 1
      if (current%to >= scene%end_time .and. k > 1) return
      current = phase_survey_t(motion=i, from=current%to, to=scene%end_time)
      if (tool%motion%phase(k)%duration > 0.0_rp) then
        current%to = min(current%to, current%from + tool%motion%phase(k)%duration)
      end if
      v = tool%motion%phase(k)%velocity
      current%name = 'travel'
      if (abs(v(3)) > norm2(v(:2))) current%name = merge('plunge ', 'retract', v(3) < 0.0_rp)
      if (all(abs(v) <= 0.0_rp)) current%name = 'dwell'
      if (allocated(tool%motion%phase(k)%path%time)) then
        current%name = 'path'
        current%n_samples = max(current%n_samples, min(most_samples, &
                                                       4*size(tool%motion%phase(k)%path%time)))
      end if
      if (tool%motion%phase(k)%is_force_controlled) current%name = 'press'
      phase = [phase, current]
    end do
    if (current%to < scene%end_time .or. k == 0) then
      phase = [phase, phase_survey_t(from=current%to, to=scene%end_time)]
    end if
  end subroutine list_phases

  !> Sample the distances in a phase by moving a copy of the tool.
  subroutine sample_phase(surroundings, now, outline, survey, phase)
    type(surroundings_t), intent(in) :: surroundings
    type(tool_t), intent(inout) :: now
    real(rp), intent(in) :: outline(:, :)
    type(tool_survey_t), intent(inout) :: survey
    type(phase_survey_t), intent(inout) :: phase
    real(rp) :: before, last(3), t, x(3, size(outline, 2))
    integer :: i

    call now%move_to(phase%from)
    last = now%position
    before = phase%from
    do i = 0, phase%n_samples
      t = phase%from + (phase%to - phase%from)*i/phase%n_samples
      call now%move_to(t)
      x = spread(now%position, 2, size(x, 2)) + matmul(now%axes, outline)
      phase%path_length = phase%path_length + norm2(now%position - last)
      if (i < phase%n_samples) then       ! at its end the next phase begins
        phase%speed = max(phase%speed, norm2(now%velocity))
        if (abs(now%spin) > abs(phase%spin)) phase%spin = now%spin
      end if
      call measure(surroundings, now, x, survey, phase)
      if (survey%touch >= undefined) then
        if (touches(surroundings, now, x)) survey%touch = first_touch(surroundings, now, outline, &
                                                                      before, t)
        call now%move_to(t)
      else if (is_beside(surroundings, x)) then
        phase%off_plate = phase%off_plate + norm2(now%position - last)
        phase%off_plate_from = min(phase%off_plate_from, t)
      end if
      if (survey%through >= undefined .and. penetrates_bottom(surroundings, survey, x, &
                                                              t)) survey%through = t
      last = now%position
      before = t
    end do
  end subroutine sample_phase

  !> Update the distances of a phase at one time.
  subroutine measure(surroundings, now, x, survey, phase)
    type(surroundings_t), intent(in) :: surroundings
    type(tool_t), intent(in) :: now
    real(rp), intent(in) :: x(:, :)
    type(tool_survey_t), intent(inout) :: survey
    type(phase_survey_t), intent(inout) :: phase
    real(rp) :: deepest, lower(3), upper(3)
    integer :: c, p

    if (size(x, 2) == 0) then                     ! tool of infinite extent
      survey%is_in_grid = survey%is_in_grid .or. cuts_grid(surroundings, now)
      deepest = -huge(1.0_rp)
      do p = 1, size(surroundings%body_points, 2)
        deepest = max(deepest, -now%clearance(surroundings%body_points(:, p)))
      end do
      phase%depth = max_defined(phase%depth, deepest)
      return
    end if
    lower = minval(x, 2)
    upper = maxval(x, 2)
    survey%is_in_grid = survey%is_in_grid .or. all(lower < surroundings%grid_upper .and. upper &
                                                   > surroundings%grid_lower)
    phase%side = min(phase%side, minval(lower - surroundings%side_lower), &
                     minval(surroundings%side_upper(:2) - upper(:2)))
    if (is_beside(surroundings, x)) return
    phase%edge = min(phase%edge, minval(lower(:2) - surroundings%lower(:2)), &
                     minval(surroundings%upper(:2) - upper(:2)))
    do p = 1, size(x, 2)
      if (any(x(:2, p) < surroundings%lower(:2) .or. x(:2, p) > surroundings%upper(:2))) cycle
      phase%depth = max_defined(phase%depth, surroundings%upper(3) - x(3, p))
      phase%bottom = min(phase%bottom, min(x(3, p), surroundings%upper(3)) - surroundings%lower(3))
      do c = 1, size(surroundings%clamp, 3)
        if (all(x(:, p) > surroundings%clamp(:, 1, c) .and. &
                x(:, p) < surroundings%clamp(:, 2, c))) survey%clamp = c
      end do
    end do
  end subroutine measure

  !> Maximum of two lengths, the first of which may be undefined.
  pure real(rp) function max_defined(a, b)
    real(rp), intent(in) :: a, b

    max_defined = b
    if (a < undefined) max_defined = max(a, b)
  end function max_defined

  !> True if a tool of infinite extent contains corners of the grid.
  pure logical function cuts_grid(surroundings, now)
    type(surroundings_t), intent(in) :: surroundings
    type(tool_t), intent(in) :: now
    integer :: c

    cuts_grid = .false.
    do c = 0, 7
      cuts_grid = cuts_grid .or. now%clearance(merge(surroundings%grid_upper, &
                                                     surroundings%grid_lower, [btest(c, 0), &
                                                     btest(c, 1), btest(c, 2)])) <= 0.0_rp
    end do
  end function cuts_grid

  !> True if no point of the tool is above, in or below the plate.
  pure logical function is_beside(surroundings, x)
    type(surroundings_t), intent(in) :: surroundings
    real(rp), intent(in) :: x(:, :)

    is_beside = size(x, 2) > 0
    if (is_beside) is_beside = any(maxval(x(:2, :), 2) < surroundings%lower(:2) &
                                   .or. minval(x(:2, :), 2) > surroundings%upper(:2))
  end function is_beside

  !> True if points of the tool lie in a body, or points of a body lie in the tool or next to it.
  pure logical function touches(surroundings, now, x)
    type(surroundings_t), intent(in) :: surroundings
    type(tool_t), intent(in) :: now
    real(rp), intent(in) :: x(:, :)
    real(rp) :: lower(3), upper(3), y(3)
    integer :: a, p, side

    touches = .true.
    do p = 1, size(x, 2)
      if (body_at(surroundings%solids, x(:, p)) > 0) return
      if (now%has_shape()) cycle
      do a = 1, 3
        do side = -1, 1, 2
          y = x(:, p)
          y(a) = y(a) + side*surroundings%gap
          if (body_at(surroundings%solids, y) > 0) return
        end do
      end do
    end do
    call now%bounds(lower, upper)
    lower = lower - 0.02_rp*surroundings%gap
    upper = upper + 0.02_rp*surroundings%gap
    do p = 1, size(surroundings%body_points, 2)
      if (any(surroundings%body_points(:, p) < lower .or. surroundings%body_points(:, &
        p) > upper)) cycle
      if (now%clearance(surroundings%body_points(:, p)) < 0.02_rp*surroundings%gap) return
    end do
    touches = .false.
  end function touches

  !> Time of first contact between `before` (no contact) and `t` (contact), by bisection [s].
  real(rp) function first_touch(surroundings, now, outline, before, t) result(late)
    type(surroundings_t), intent(in) :: surroundings
    type(tool_t), intent(inout) :: now
    real(rp), intent(in) :: outline(:, :), before, t
    real(rp) :: early, middle
    integer :: i

    early = before
    late = t
    do i = 1, 12
      middle = 0.5_rp*(early + late)
      call now%move_to(middle)
      if (touches(surroundings, now, spread(now%position, 2, size(outline, 2)) &
                  + matmul(now%axes, outline))) then
        late = middle
      else
        early = middle
      end if
    end do
  end function first_touch

  !> True if a tool penetrates the bottom of the plate from above, or reaches through it at the
  !> start.
  pure logical function penetrates_bottom(surroundings, survey, x, t)
    type(surroundings_t), intent(in) :: surroundings
    type(tool_survey_t), intent(in) :: survey
    real(rp), intent(in) :: x(:, :), t
    real(rp) :: corner(3)
    integer :: c, p

    penetrates_bottom = .false.
    if (survey%lower(3) < surroundings%lower(3) - surroundings%gap .and. &
        (t > 0.0_rp .or. survey%upper(3) <= surroundings%upper(3))) return
    do p = 1, size(x, 2)
      if (x(3, p) > surroundings%lower(3) - surroundings%gap) cycle
      penetrates_bottom = .true.
      do c = 0, 3
        corner(:2) = x(:2, p) + surroundings%gap*merge(1.0_rp, -1.0_rp, [btest(c, 0), btest(c, 1)])
        corner(3) = surroundings%lower(3) + 1.0e-3_rp*surroundings%gap
        penetrates_bottom = penetrates_bottom .and. body_at(surroundings%solids, corner) > 0
      end do
      if (penetrates_bottom) return
    end do
  end function penetrates_bottom

end module setup_process
