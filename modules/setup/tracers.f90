! SPDX-License-Identifier: MIT
!> Read the positions of the tracers from the &TRACER groups.
module setup_tracers
  use base_kinds, only: rp
  use base_text, only: str
  use input_values, only: input_t
  use particles_tracers, only: tracers_t
  use setup_solids, only: is_in_body, read_all_solids, solids_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: read_tracers

  integer, parameter :: max_tracers = 100000
  real(rp), parameter :: max_rows = 2.0e7_rp      !! rows of an output file below 2 GB

contains

  !> Read all &TRACER groups; positions outside the bodies are left out.
  subroutine read_tracers(input, scene, tracers)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tracers_t), intent(inout) :: tracers
    type(solids_t), allocatable :: solids(:)
    real(rp), allocatable :: position(:, :)
    real(rp) :: interval, rows
    integer :: i, k

    if (input%count('TRACER') == 0 .or. scene%grid%n(1) == 0) return
    call read_all_solids(input, solids)
    rows = 0.0_rp
    do i = 1, input%count('TRACER')
      call list_positions(input, i, position)
      if (.not. allocated(position)) cycle
      position = position(:, pack([(k, k=1, size(position, 2))], &
        [(is_in_body(solids, position(:, k), minval(scene%grid%h)), k=1, size(position, 2))]))
      if (size(position, 2) == 0) then
        call input%report('TRACER', i, '', 'lies outside the bodies')
        cycle
      end if
      interval = input%real('TRACER', i, 'INTERVAL')
      if (interval <= 0.0_rp) interval = scene%output%history_interval
      if (tracers%n + size(position, 2) > max_tracers) then
        call input%report('TRACER', i, '', 'makes '//str(tracers%n + size(position, 2))// &
                          ' tracers; at most '//str(max_tracers)//' are possible')
        return
      end if
      rows = rows + size(position, 2)*(1.0_rp + scene%end_time/max(interval, tiny(1.0_rp)))
      if (rows > max_rows .and. scene%max_steps == 0) then
        call input%report('TRACER', i, 'INTERVAL', 'makes '//str(rows)//' rows until &TIME '// &
                          'END; at most '//str(max_rows)//' are possible')
      end if
      call tracers%add_group(input%text('TRACER', i, 'NAME'), interval, position)
    end do
  end subroutine read_tracers

  !> Positions of the `i`-th &TRACER; not allocated after an error.
  subroutine list_positions(input, i, position)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), allocatable, intent(out) :: position(:, :)  !! positions, (3, n) [m]
    real(rp) :: low(3), side(3), step
    integer :: n(3)

    select case (input%text('TRACER', i, 'KIND'))
    case ('point')
      position = reshape(input%reals('TRACER', i, 'POSITION', 3), [3, 1])
    case ('line')
      low = input%reals('TRACER', i, 'FROM', 3)
      side = input%reals('TRACER', i, 'TO', 3) - low
      if (norm2(side) <= 0.0_rp) then
        if (input%given('TRACER', i, 'TO')) call input%report('TRACER', i, 'TO', &
          'must not be the place FROM')
        return
      end if
      call read_numbers(input, i, spread(norm2(side), 1, 3), n, step)
      if (n(1) == 0) return
      if (any(n /= n(1))) then
        call input%report('TRACER', i, 'NUMBER', 'of a line is one number')
        return
      end if
      if (step <= 0.0_rp .and. n(1) > 1) step = norm2(side)/(n(1) - 1)
      low = low + 0.5_rp*side*(1.0_rp - (n(1) - 1)*step/norm2(side))
      position = lattice(low, spread(step, 1, 3)*side/norm2(side), [n(1), 1, 1], .true.)
    case default
      low = input%reals('TRACER', i, 'LOWER', 3)
      side = input%reals('TRACER', i, 'UPPER', 3) - low
      if (any(side < 0.0_rp)) then
        if (input%given('TRACER', i, 'UPPER')) call input%report('TRACER', i, 'UPPER', &
          'must not be below LOWER on any axis')
        return
      end if
      call read_numbers(input, i, side, n, step)
      if (n(1) == 0) return
      position = lattice(low + 0.5_rp*side/n, side/n, n, .false.)
    end select
  end subroutine list_positions

  !> Numbers of tracers along each side, from NUMBER or from SPACING; 0 after an error.
  subroutine read_numbers(input, i, side, n, spacing)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: side(3)          !! edges of the box, or the length of the line [m]
    integer, intent(out) :: n(3)
    real(rp), intent(out) :: spacing         !! [m]; 0: not given
    logical :: is_line                       ! the ends of the line are among the points
    real(rp) :: all

    n = 0
    is_line = input%text('TRACER', i, 'KIND') == 'line'
    spacing = input%real('TRACER', i, 'SPACING')
    if (input%given('TRACER', i, 'NUMBER') .eqv. input%given('TRACER', i, 'SPACING')) then
      call input%report('TRACER', i, '', 'needs NUMBER or SPACING, one of them')
      return
    end if
    if (spacing > 0.0_rp) then
      all = product(side/spacing + 1.0_rp)
      if (is_line) all = side(1)/spacing
      if (all < max_tracers) n = max(1, merge(floor(side/spacing*(1.0_rp + 1.0e-9_rp)) + 1, &
                                              nint(side/spacing), is_line))
    else
      spacing = 0.0_rp
      n = input%integers('TRACER', i, 'NUMBER', 3)
      where (n == 0) n = n(1)
      if (any(n < 1)) then
        n = 0
        return                               ! reported before
      end if
      all = product(real(n, rp))
      if (is_line) all = n(1)
      if (all > max_tracers) n = 0
    end if
    if (n(1) == 0) call input%report('TRACER', i, '', 'makes '//str(all)//' places; at most '// &
                                     str(max_tracers)//' are possible')
  end subroutine read_numbers

  !> Lattice of points that starts at `first`, with spacings `step` along the axes; for a line
  !> points that are the vector `step` apart.
  pure function lattice(first, step, n, is_line) result(position)
    real(rp), intent(in) :: first(3)         !! first point [m]
    real(rp), intent(in) :: step(3)          !! spacing along each axis, or of a line [m]
    integer, intent(in) :: n(3)              !! points along each axis
    logical, intent(in) :: is_line           !! n(1) points along a line
    real(rp) :: position(3, product(n))
    integer :: c, i, j, k

    c = 0
    do i = 0, n(1) - 1
      do j = 0, n(2) - 1
        do k = 0, n(3) - 1
          c = c + 1
          position(:, c) = first + step*merge([i, i, i], [i, j, k], is_line)
        end do
      end do
    end do
  end function lattice

end module setup_tracers
