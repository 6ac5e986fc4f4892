! SPDX-License-Identifier: MIT
!> Places of the tracers from &TRACER groups.
module setup_tracers
  use base_kinds, only: rp
  use base_text, only: str
  use heat_setup_cut_cells, only: all_solids, solids_t
  use heat_setup_scene, only: is_held
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  use particles_tracers, only: tracers_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: read_tracers

  integer, parameter :: most_places = 100000
  real(rp), parameter :: most_rows = 2.0e7_rp     !! of a file below 2 GB

contains

  !> All groups; of a line or box those places count that lie in metal.
  subroutine read_tracers(input, scene, tracers, diagnostics)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tracers_t), intent(inout) :: tracers
    type(diagnostics_t), intent(inout) :: diagnostics
    type(solids_t), allocatable :: solids(:)
    real(rp), allocatable :: place(:, :)
    real(rp) :: interval, rows
    integer :: i

    if (input%count('TRACER') == 0 .or. scene%grid%n(1) == 0) return
    call all_solids(input, solids)
    rows = 0.0_rp
    do i = 1, input%count('TRACER')
      call check_name(input, i, diagnostics)
      call list_places(input, i, place, diagnostics)
      if (.not. allocated(place)) cycle
      place = in_metal(scene, solids, place)
      if (size(place, 2) == 0) then
        call input%report(diagnostics, 'TRACER', i, '', 'lies outside the bodies')
        cycle
      end if
      interval = input%real('TRACER', i, 'INTERVAL')
      if (interval <= 0.0_rp) interval = scene%output%history_interval
      if (tracers%n + size(place, 2) > most_places) then
        call input%report(diagnostics, 'TRACER', i, '', 'makes '// &
                          str(tracers%n + size(place, 2))//' tracers; at most '// &
                          str(most_places)//' are possible')
        return
      end if
      rows = rows + size(place, 2)*(1.0_rp + scene%end_time/max(interval, tiny(1.0_rp)))
      if (rows > most_rows .and. scene%max_steps == 0) then
        call input%report(diagnostics, 'TRACER', i, 'INTERVAL', 'makes '//str(rows)// &
                          ' rows until &TIME END; at most '//str(most_rows)//' are possible')
      end if
      call tracers%add_group(input%text('TRACER', i, 'NAME'), interval, place)
    end do
  end subroutine read_tracers

  subroutine check_name(input, i, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: j

    do j = 1, i - 1
      if (input%text('TRACER', i, 'NAME') /= input%text('TRACER', j, 'NAME')) cycle
      call input%report(diagnostics, 'TRACER', i, 'NAME', 'is the name of another &TRACER')
      return
    end do
  end subroutine check_name

  !> The places of group `i`; not allocated if something is wrong with its keys.
  subroutine list_places(input, i, place, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), allocatable, intent(out) :: place(:, :)   !! (3, n) [m]
    type(diagnostics_t), intent(inout) :: diagnostics
    real(rp) :: low(3), side(3), step
    integer :: n(3)

    select case (input%text('TRACER', i, 'KIND'))
    case ('point')
      place = reshape(input%reals('TRACER', i, 'POSITION', 3), [3, 1])
    case ('line')
      low = input%reals('TRACER', i, 'FROM', 3)
      side = input%reals('TRACER', i, 'TO', 3) - low
      if (norm2(side) <= 0.0_rp) then
        if (input%given('TRACER', i, 'TO')) call input%report(diagnostics, 'TRACER', i, 'TO', &
                                                              'must not be the place FROM')
        return
      end if
      call read_numbers(input, i, spread(norm2(side), 1, 3), floor_plus_one, n, step, diagnostics)
      if (n(1) == 0) return
      if (any(n /= n(1))) then
        call input%report(diagnostics, 'TRACER', i, 'NUMBER', 'of a line is one number')
        return
      end if
      if (step <= 0.0_rp .and. n(1) > 1) step = norm2(side)/(n(1) - 1)
      low = low + 0.5_rp*side*(1.0_rp - (n(1) - 1)*step/norm2(side))
      place = lattice(low, spread(step, 1, 3)*side/norm2(side), [n(1), 1, 1], .true.)
    case default
      low = input%reals('TRACER', i, 'LOWER', 3)
      side = input%reals('TRACER', i, 'UPPER', 3) - low
      if (any(side < 0.0_rp)) then
        if (input%given('TRACER', i, 'UPPER')) call input%report(diagnostics, 'TRACER', i, &
                                               'UPPER', 'must not be below LOWER on any axis')
        return
      end if
      call read_numbers(input, i, side, rounded, n, step, diagnostics)
      if (n(1) == 0) return
      place = lattice(low + 0.5_rp*side/n, side/n, n, .false.)
    end select
  end subroutine list_places

  !> NUMBER, or that which follows from SPACING along each side; 0 if something is wrong.
  subroutine read_numbers(input, i, side, number_of, n, spacing, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: side(3)          !! [m]
    interface
      pure integer function number_of(ratio)
        import :: rp
        implicit none (type, external)
        real(rp), intent(in) :: ratio
      end function number_of
    end interface
    integer, intent(out) :: n(3)
    real(rp), intent(out) :: spacing         !! [m]; 0: not given
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: a
    real(rp) :: all

    n = 0
    spacing = input%real('TRACER', i, 'SPACING')
    if (input%given('TRACER', i, 'NUMBER') .eqv. input%given('TRACER', i, 'SPACING')) then
      call input%report(diagnostics, 'TRACER', i, '', 'needs NUMBER or SPACING, one of them')
      return
    end if
    if (spacing > 0.0_rp) then
      all = product(side/spacing + 1.0_rp)
      if (input%text('TRACER', i, 'KIND') == 'line') all = side(1)/spacing
      if (all < most_places) n = [(max(1, number_of(side(a)/spacing)), a=1, 3)]
    else
      spacing = 0.0_rp
      n = input%integers('TRACER', i, 'NUMBER', 3)
      where (n == 0) n = n(1)
      if (any(n < 1)) then
        n = 0
        return                               ! is reported already
      end if
      all = product(real(n, rp))
      if (input%text('TRACER', i, 'KIND') == 'line') all = n(1)
      if (all > most_places) n = 0
    end if
    if (n(1) == 0) call input%report(diagnostics, 'TRACER', i, '', 'makes '//str(all)// &
                                     ' places; at most '//str(most_places)//' are possible')
  end subroutine read_numbers

  !> Points of a line whose ends are points, for a length over the spacing.
  pure integer function floor_plus_one(ratio)
    real(rp), intent(in) :: ratio

    floor_plus_one = floor(ratio*(1.0_rp + 1.0e-9_rp)) + 1
  end function floor_plus_one

  !> Parts of a side, for its length over the spacing.
  pure integer function rounded(ratio)
    real(rp), intent(in) :: ratio

    rounded = nint(ratio)
  end function rounded

  !> Points from `first` on, `step` apart along the axes or, of a line, by the vector `step`.
  pure function lattice(first, step, n, is_line) result(place)
    real(rp), intent(in) :: first(3), step(3)   !! [m]
    integer, intent(in) :: n(3)
    logical, intent(in) :: is_line
    real(rp) :: place(3, product(n))
    integer :: c, i, j, k

    c = 0
    do i = 0, n(1) - 1
      do j = 0, n(2) - 1
        do k = 0, n(3) - 1
          c = c + 1
          place(:, c) = first + step*merge([i, i, i], [i, j, k], is_line)
        end do
      end do
    end do
  end function lattice

  !> The places that lie in a body or on its surface.
  pure function in_metal(scene, solids, place) result(kept)
    type(scene_t), intent(in) :: scene
    type(solids_t), intent(in) :: solids(:)
    real(rp), intent(in) :: place(:, :)         !! (3, n) [m]
    real(rp), allocatable :: kept(:, :)
    integer :: i

    kept = place(:, pack([(i, i=1, size(place, 2))], &
                         [(is_held(solids, place(:, i), minval(scene%grid%h)), &
                           i=1, size(place, 2))]))
  end function in_metal

end module setup_tracers
