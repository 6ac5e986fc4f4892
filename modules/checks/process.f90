! SPDX-License-Identifier: MIT
!> The motion of tools against the plate as it is drawn, before anything deforms: how deep, how far,
!> how near to what.
module checks_process
  use base_kinds, only: rp
  use checks_around, only: around_t, look_around, points_in
  use contact_tool, only: tool_t
  use heat_setup_cut_cells, only: holder_of, solids_t
  use input_values, only: input_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: survey_tool, tool_survey_t, phase_survey_t, none

  real(rp), parameter :: none = huge(1.0_rp)      !! of a length that is not defined
  integer, parameter :: times = 48                !! samples of a phase

  !> One phase of a tool's motion, or its rest.
  type :: phase_survey_t
    character(8) :: name = 'rest'
    integer :: motion = 0                         !! number of its &MOTION; 0: none
    real(rp) :: from = 0.0_rp, to = 0.0_rp        !! [s]
    real(rp) :: way = 0.0_rp, speed = 0.0_rp      !! [m], at most [m/s]
    real(rp) :: spin = 0.0_rp                     !! of the largest size [rad/s]
    real(rp) :: depth = none                   !! of the lowest point below the top of the plate [m]
    real(rp) :: bottom = none          !! least height of the tool above the bottom of the plate [m]
    real(rp) :: edge = none     !! least distance of the rim of the tool to an edge of the plate [m]
    real(rp) :: side = none        !! least distance of the tool to a side of the grid or a wall [m]
    real(rp) :: off = 0.0_rp                      !! distance beside the plate after contact [m]
    real(rp) :: off_from = none                   !! since when [s]
  end type phase_survey_t

  !> All phases of a tool.
  type :: tool_survey_t
    type(phase_survey_t), allocatable :: phase(:)
    real(rp) :: touch = none                      !! first touch [s]
    real(rp) :: through = none                    !! when it comes out at the bottom [s]
    logical :: is_in_grid = .false.               !! at any time
    real(rp) :: lower(3) = 0.0_rp, upper(3) = 0.0_rp   !! box around it at t = 0 [m]
    real(rp) :: swept(3, 2) = 0.0_rp              !! box around it there and at ends of phases [m]
  end type tool_survey_t

contains

  !> Follow a tool through the run.
  subroutine survey_tool(input, scene, solids, k, tool, survey)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(solids_t), intent(in) :: solids(:)
    integer, intent(in) :: k                      !! number of the tool
    type(tool_t), intent(in) :: tool
    type(tool_survey_t), intent(out) :: survey
    type(around_t) :: around
    type(tool_t) :: now
    real(rp), allocatable :: outline(:, :)
    real(rp) :: start(3)
    integer :: i

    call look_around(input, scene, solids, k, around)
    call draw_outline(scene, solids, k, tool, outline)
    call list_phases(input, scene, tool, survey%phase)
    now = tool
    call now%move_to(0.0_rp)
    start = now%position
    survey%lower = minval(spread(now%position, 2, size(outline, 2)) + matmul(now%axes, outline), 2)
    survey%upper = maxval(spread(now%position, 2, size(outline, 2)) + matmul(now%axes, outline), 2)
    survey%swept = reshape([survey%lower, survey%upper], [3, 2])
    do i = 1, size(survey%phase)
      call follow_phase(around, now, outline, survey, survey%phase(i))
      survey%swept(:, 1) = min(survey%swept(:, 1), survey%lower + now%position - start)
      survey%swept(:, 2) = max(survey%swept(:, 2), survey%upper + now%position - start)
    end do
  end subroutine survey_tool

  !> Points of a tool's surface in its own axes; of a rigid body those in it; none of a tool without
  !> ends [m].
  subroutine draw_outline(scene, solids, k, tool, x)
    type(scene_t), intent(in) :: scene
    type(solids_t), intent(in) :: solids(:)
    integer, intent(in) :: k
    type(tool_t), intent(in) :: tool
    real(rp), allocatable, intent(out) :: x(:, :)

    if (tool%has_shape()) then
      call tool%shape%outline(x)
    else
      x = points_in(solids(findloc(scene%body%tool, k, dim=1)))
      x = matmul(transpose(tool%frame), x - spread(tool%start, 2, size(x, 2)))
    end if
  end subroutine draw_outline

  !> The phases as they are written, up to the end of the run, and the rest after them.
  subroutine list_phases(input, scene, tool, phase)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool
    type(phase_survey_t), allocatable, intent(out) :: phase(:)
    type(phase_survey_t) :: one
    real(rp) :: v(3)
    integer :: i, k

    allocate (phase(0))
    k = 0
    do i = 1, input%count('MOTION')
      if (input%text('MOTION', i, 'TOOL') /= tool%name) cycle
      k = k + 1
      if (one%to >= scene%end_time .and. k > 1) return
      one = phase_survey_t(motion=i, from=one%to, to=scene%end_time)
      if (tool%motion%phase(k)%duration > 0.0_rp) then
        one%to = min(one%to, one%from + tool%motion%phase(k)%duration)
      end if
      v = tool%motion%phase(k)%velocity
      one%name = 'travel'
      if (abs(v(3)) > norm2(v(:2))) one%name = merge('plunge ', 'retract', v(3) < 0.0_rp)
      if (all(abs(v) <= 0.0_rp)) one%name = 'dwell'
      if (tool%motion%phase(k)%presses) one%name = 'press'
      phase = [phase, one]
    end do
    if (one%to < scene%end_time .or. k == 0) then
      phase = [phase, phase_survey_t(from=one%to, to=scene%end_time)]
    end if
  end subroutine list_phases

  !> Sample a phase; `now` is a copy of the tool to move about.
  subroutine follow_phase(around, now, outline, survey, phase)
    type(around_t), intent(in) :: around
    type(tool_t), intent(inout) :: now
    real(rp), intent(in) :: outline(:, :)
    type(tool_survey_t), intent(inout) :: survey
    type(phase_survey_t), intent(inout) :: phase
    real(rp) :: before, last(3), t, x(3, size(outline, 2))
    integer :: i

    call now%move_to(phase%from)
    last = now%position
    before = phase%from
    do i = 0, times
      t = phase%from + (phase%to - phase%from)*i/times
      call now%move_to(t)
      x = spread(now%position, 2, size(x, 2)) + matmul(now%axes, outline)
      phase%way = phase%way + norm2(now%position - last)
      if (i < times .or. phase%to > phase%from) phase%speed = max(phase%speed, norm2(now%velocity))
      if (abs(now%spin) > abs(phase%spin)) phase%spin = now%spin
      call measure(around, now, x, survey, phase)
      if (survey%touch >= none) then
        if (touches(around, now, x)) survey%touch = first_touch(around, now, outline, before, t)
        call now%move_to(t)
      else if (is_beside(around, x)) then
        phase%off = phase%off + norm2(now%position - last)
        phase%off_from = min(phase%off_from, t)
      end if
      if (survey%through >= none .and. comes_through(around, survey, x, t)) survey%through = t
      last = now%position
      before = t
    end do
  end subroutine follow_phase

  !> Distances at one time.
  subroutine measure(around, now, x, survey, phase)
    type(around_t), intent(in) :: around
    type(tool_t), intent(in) :: now
    real(rp), intent(in) :: x(:, :)
    type(tool_survey_t), intent(inout) :: survey
    type(phase_survey_t), intent(inout) :: phase
    real(rp) :: deepest, lower(3), upper(3)
    integer :: p

    if (size(x, 2) == 0) then                     ! it has no ends
      survey%is_in_grid = survey%is_in_grid .or. cuts_grid(around, now)
      deepest = -huge(1.0_rp)
      do p = 1, size(around%metal, 2)
        deepest = max(deepest, -now%clearance(around%metal(:, p)))
      end do
      phase%depth = larger(phase%depth, deepest)
      return
    end if
    lower = minval(x, 2)
    upper = maxval(x, 2)
    survey%is_in_grid = survey%is_in_grid .or. all(lower < around%grid_upper .and. upper &
                                                   > around%grid_lower)
    phase%side = min(phase%side, minval(lower - around%side_lower), &
                     minval(around%side_upper(:2) - upper(:2)))
    if (is_beside(around, x)) return
    phase%edge = min(phase%edge, minval(lower(:2) - around%lower(:2)), &
                     minval(around%upper(:2) - upper(:2)))
    do p = 1, size(x, 2)
      if (any(x(:2, p) < around%lower(:2) .or. x(:2, p) > around%upper(:2))) cycle
      phase%depth = larger(phase%depth, around%upper(3) - x(3, p))
      phase%bottom = min(phase%bottom, x(3, p) - around%lower(3))
    end do
  end subroutine measure

  !> The larger of two lengths, of which the first may not be defined.
  pure real(rp) function larger(a, b)
    real(rp), intent(in) :: a, b

    larger = b
    if (a < none) larger = max(a, b)
  end function larger

  !> Whether a tool without ends has corners of the grid in it.
  pure logical function cuts_grid(around, now)
    type(around_t), intent(in) :: around
    type(tool_t), intent(in) :: now
    integer :: c

    cuts_grid = .false.
    do c = 0, 7
      cuts_grid = cuts_grid .or. now%clearance(merge(around%grid_upper, around%grid_lower, &
                                                     [btest(c, 0), btest(c, 1), btest(c, 2)])) &
                                                     <= 0.0_rp
    end do
  end function cuts_grid

  !> Whether nothing of the tool is above, in or below the plate.
  pure logical function is_beside(around, x)
    type(around_t), intent(in) :: around
    real(rp), intent(in) :: x(:, :)

    is_beside = size(x, 2) > 0
    if (is_beside) is_beside = any(maxval(x(:2, :), 2) < around%lower(:2) &
                                   .or. minval(x(:2, :), 2) > around%upper(:2))
  end function is_beside

  !> Whether points of the tool lie in a body, or points of a body in the tool or next to it.
  pure logical function touches(around, now, x)
    type(around_t), intent(in) :: around
    type(tool_t), intent(in) :: now
    real(rp), intent(in) :: x(:, :)
    real(rp) :: lower(3), upper(3), y(3)
    integer :: a, p, side

    touches = .true.
    do p = 1, size(x, 2)
      if (holder_of(around%solids, x(:, p)) > 0) return
      if (now%has_shape()) cycle
      do a = 1, 3
        do side = -1, 1, 2
          y = x(:, p)
          y(a) = y(a) + side*around%gap
          if (holder_of(around%solids, y) > 0) return
        end do
      end do
    end do
    call now%bounds(lower, upper)
    lower = lower - 0.02_rp*around%gap
    upper = upper + 0.02_rp*around%gap
    do p = 1, size(around%metal, 2)
      if (any(around%metal(:, p) < lower .or. around%metal(:, p) > upper)) cycle
      if (now%clearance(around%metal(:, p)) < 0.02_rp*around%gap) return
    end do
    touches = .false.
  end function touches

  !> The time between `before` and `t`, when it touches, at which that begins [s].
  real(rp) function first_touch(around, now, outline, before, t) result(late)
    type(around_t), intent(in) :: around
    type(tool_t), intent(inout) :: now
    real(rp), intent(in) :: outline(:, :), before, t
    real(rp) :: early, middle
    integer :: i

    early = before
    late = t
    do i = 1, 12
      middle = 0.5_rp*(early + late)
      call now%move_to(middle)
      if (touches(around, now, spread(now%position, 2, size(outline, 2)) &
                  + matmul(now%axes, outline))) then
        late = middle
      else
        early = middle
      end if
    end do
  end function first_touch

  !> Whether a tool that was above the bottom of the plate, or reaches through it from the start,
  !> looks out below it.
  pure logical function comes_through(around, survey, x, t)
    type(around_t), intent(in) :: around
    type(tool_survey_t), intent(in) :: survey
    real(rp), intent(in) :: x(:, :), t
    real(rp) :: corner(3)
    integer :: c, p

    comes_through = .false.
    if (survey%lower(3) < around%lower(3) - around%gap .and. &
        (t > 0.0_rp .or. survey%upper(3) <= around%upper(3))) return
    do p = 1, size(x, 2)
      if (x(3, p) > around%lower(3) - around%gap) cycle
      comes_through = .true.
      do c = 0, 3
        corner(:2) = x(:2, p) + around%gap*merge(1.0_rp, -1.0_rp, [btest(c, 0), btest(c, 1)])
        corner(3) = around%lower(3) + 1.0e-3_rp*around%gap
        comes_through = comes_through .and. holder_of(around%solids, corner) > 0
      end do
      if (comes_through) return
    end do
  end function comes_through

end module checks_process
