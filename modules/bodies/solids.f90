! SPDX-License-Identifier: MIT
!> Solids of which bodies consist: boxes, cylinders, spheres and trapezoidal prisms, added or
!> subtracted.
module bodies_solids
  use base_kinds, only: rp
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  use keys_names, only: find
  implicit none (type, external)
  private

  public :: solid_t, read_solid, is_inside, holds, bounds, reference

  integer, parameter, public :: solid_box = 1, solid_cylinder = 2, solid_sphere = 3, &
                                solid_trapezoid = 4
  !> Values of KIND for these solids.
  character(9), parameter :: names(4) = ['box      ', 'cylinder ', 'sphere   ', 'trapezoid']

  !> A solid.
  type :: solid_t
    integer :: kind = solid_box
    logical :: adds = .true.
    real(rp) :: lower(3) = 0.0_rp, upper(3) = 0.0_rp   !! box, trapezoid [m]
    real(rp) :: centre(3) = 0.0_rp, radius = 0.0_rp, length = 0.0_rp   !! cylinder, sphere [m]
    integer :: axis = 3                                !! axis of a cylinder
    integer :: along = 1, across = 2                   !! axes of a trapezoid
    real(rp) :: width(2) = 0.0_rp                      !! widths of a trapezoid at both ends [m]
  end type solid_t

contains

  !> Read the solid of the `i`-th &SHAPE; report errors of its keys.
  subroutine read_solid(input, i, solid, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(solid_t), intent(out) :: solid
    type(diagnostics_t), intent(inout) :: diagnostics

    solid%kind = find(names, input%text('SHAPE', i, 'KIND'))
    solid%adds = input%text('SHAPE', i, 'OPERATION') == 'add'
    select case (solid%kind)
    case (solid_box, solid_trapezoid)
      call need('LOWER')
      call need('UPPER')
      solid%lower = input%reals('SHAPE', i, 'LOWER', 3)
      solid%upper = input%reals('SHAPE', i, 'UPPER', 3)
      if (input%given('SHAPE', i, 'UPPER') .and. any(solid%upper <= solid%lower)) then
        call input%report(diagnostics, 'SHAPE', i, 'UPPER', 'must be above LOWER on every axis')
      end if
      if (solid%kind == solid_trapezoid) call read_trapezoid()
    case default
      call need('CENTRE')
      call need('RADIUS')
      solid%centre = input%reals('SHAPE', i, 'CENTRE', 3)
      solid%radius = input%real('SHAPE', i, 'RADIUS')
      if (solid%kind == solid_cylinder) then
        call need('LENGTH')
        solid%length = input%real('SHAPE', i, 'LENGTH')
        solid%axis = index('xyz', input%text('SHAPE', i, 'AXIS'))
      end if
    end select
  contains
    subroutine need(key)
      character(*), intent(in) :: key

      if (.not. input%given('SHAPE', i, key)) then
        call input%report(diagnostics, 'SHAPE', i, key, &
                          "required for KIND = '"//input%text('SHAPE', i, 'KIND')//"'")
      end if
    end subroutine need

    subroutine read_trapezoid()
      call need('WIDTH_LOWER')
      call need('WIDTH_UPPER')
      solid%along = index('xyz', input%text('SHAPE', i, 'ALONG'))
      solid%across = index('xyz', input%text('SHAPE', i, 'ACROSS'))
      solid%width = [input%real('SHAPE', i, 'WIDTH_LOWER'), input%real('SHAPE', i, 'WIDTH_UPPER')]
      if (solid%along == solid%across) then
        call input%report(diagnostics, 'SHAPE', i, 'ACROSS', 'must be another axis than ALONG')
      end if
    end subroutine read_trapezoid
  end subroutine read_solid

  !> True if `x` is in the body made of `solids` in their order.
  pure logical function is_inside(solids, x)
    type(solid_t), intent(in) :: solids(:)
    real(rp), intent(in) :: x(3)
    integer :: i

    is_inside = .false.
    do i = size(solids), 1, -1
      if (.not. holds(solids(i), x)) cycle
      is_inside = solids(i)%adds
      return
    end do
  end function is_inside

  !> True if `x` lies in the solid.
  pure logical function holds(solid, x)
    type(solid_t), intent(in) :: solid
    real(rp), intent(in) :: x(3)
    real(rp) :: d(3), s, w

    select case (solid%kind)
    case (solid_box)
      holds = all(x >= solid%lower .and. x < solid%upper)
    case (solid_trapezoid)
      holds = all(x >= solid%lower .and. x < solid%upper)
      s = (x(solid%along) - solid%lower(solid%along)) &
          /(solid%upper(solid%along) - solid%lower(solid%along))
      w = solid%width(1) + s*(solid%width(2) - solid%width(1))
      holds = holds .and. abs(x(solid%across) - 0.5_rp*(solid%lower(solid%across) &
                                                        + solid%upper(solid%across))) < 0.5_rp*w
    case (solid_cylinder)
      d = x - solid%centre
      holds = abs(d(solid%axis)) < 0.5_rp*solid%length &
              .and. sum(d**2) - d(solid%axis)**2 < solid%radius**2
    case default
      holds = sum((x - solid%centre)**2) < solid%radius**2
    end select
  end function holds

  !> Bounding box of a solid [m].
  pure subroutine bounds(solid, lower, upper)
    type(solid_t), intent(in) :: solid
    real(rp), intent(out) :: lower(3), upper(3)
    real(rp) :: half(3)

    lower = solid%lower
    upper = solid%upper
    if (solid%kind == solid_box .or. solid%kind == solid_trapezoid) return
    half = solid%radius
    if (solid%kind == solid_cylinder) half(solid%axis) = 0.5_rp*solid%length
    lower = solid%centre - half
    upper = solid%centre + half
  end subroutine bounds

  !> Anchor of lattices: a corner of a solid, or the centre of a round one [m].
  pure function reference(solid) result(x)
    type(solid_t), intent(in) :: solid
    real(rp) :: x(3)

    x = solid%lower
    if (solid%kind == solid_box .or. solid%kind == solid_trapezoid) return
    x = solid%centre
    if (solid%kind == solid_cylinder) x(solid%axis) = x(solid%axis) - 0.5_rp*solid%length
  end function reference

end module bodies_solids
