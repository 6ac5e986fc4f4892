! SPDX-License-Identifier: MIT
!> Solids of which bodies consist: boxes, cylinders, spheres, trapezoidal prisms and the insides of
!> closed surfaces, added or subtracted.
module setup_solids
  use base_kinds, only: pi, rp
  use input_key_table, only: find
  use input_values, only: input_t
  use tools_mesh, only: new_mesh, surface_mesh_t
  use tools_mesh_facets, only: facets_t
  use tools_shape_stl, only: read_facets
  implicit none (type, external)
  private

  public :: solid_t, solids_t
  public :: read_all_solids, body_at, read_body_solids, bounds, extent_of, holds, is_in_body, &
            is_inside, read_solid, reference, round_points, shapes_of

  integer, parameter, public :: solid_box = 1, solid_cylinder = 2, solid_sphere = 3, &
                                solid_trapezoid = 4, solid_mesh = 5
  !> Values of KIND of the solids.
  character(9), parameter :: names(5) = ['box      ', 'cylinder ', 'sphere   ', 'trapezoid', &
                                         'stl      ']

  !> A solid.
  type :: solid_t
    integer :: kind = solid_box
    logical :: adds = .true.
    real(rp) :: lower(3) = 0.0_rp, upper(3) = 0.0_rp   !! box, trapezoid, box of a mesh [m]
    real(rp) :: centre(3) = 0.0_rp, radius = 0.0_rp, length = 0.0_rp   !! cylinder, sphere [m]
    integer :: axis = 3                                !! axis of a cylinder
    integer :: along = 1, across = 2                   !! axes of a trapezoid
    real(rp) :: width(2) = 0.0_rp                      !! widths of a trapezoid at both ends [m]
    type(surface_mesh_t), allocatable :: mesh
  end type solid_t

  !> The solids of one body.
  type :: solids_t
    type(solid_t), allocatable :: solid(:)
  end type solids_t

contains

  !> Indices of the &SHAPE groups of a body.
  function shapes_of(input, body) result(shapes)
    type(input_t), intent(in) :: input
    integer, intent(in) :: body
    integer, allocatable :: shapes(:)
    character(:), allocatable :: name
    integer :: i, n

    name = input%text('BODY', body, 'NAME')
    n = input%count('SHAPE')
    shapes = pack([(i, i=1, n)], [(input%text('SHAPE', i, 'BODY') == name, i=1, n)])
  end function shapes_of

  !> Read the solids of a body in the order of the file.
  subroutine read_body_solids(input, body, solids)
    type(input_t), intent(in) :: input
    integer, intent(in) :: body
    type(solid_t), allocatable, intent(out) :: solids(:)
    integer, allocatable :: shapes(:)
    integer :: k

    allocate (shapes, source=shapes_of(input, body))
    allocate (solids(size(shapes)))
    do k = 1, size(shapes)
      call read_solid(input, shapes(k), solids(k))
    end do
  end subroutine read_body_solids

  !> Read the solids of all bodies.
  subroutine read_all_solids(input, list)
    type(input_t), intent(in) :: input
    type(solids_t), allocatable, intent(out) :: list(:)
    integer :: b

    allocate (list(input%count('BODY')))
    do b = 1, size(list)
      call read_body_solids(input, b, list(b)%solid)
    end do
  end subroutine read_all_solids

  !> Read the solid of the `i`-th &SHAPE; report errors of its keys.
  subroutine read_solid(input, i, solid)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(solid_t), intent(out) :: solid

    solid%kind = find(names, input%text('SHAPE', i, 'KIND'))
    solid%adds = input%text('SHAPE', i, 'OPERATION') == 'add'
    select case (solid%kind)
    case (solid_box, solid_trapezoid)
      call require_key('LOWER')
      call require_key('UPPER')
      solid%lower = input%reals('SHAPE', i, 'LOWER', 3)
      solid%upper = input%reals('SHAPE', i, 'UPPER', 3)
      if (input%given('SHAPE', i, 'UPPER') .and. any(solid%upper <= solid%lower)) then
        call input%report('SHAPE', i, 'UPPER', 'must be above LOWER on every axis')
      end if
      if (solid%kind == solid_trapezoid) call read_trapezoid()
    case (solid_mesh)
      call read_mesh()
    case default
      call require_key('CENTRE')
      call require_key('RADIUS')
      solid%centre = input%reals('SHAPE', i, 'CENTRE', 3)
      solid%radius = input%real('SHAPE', i, 'RADIUS')
      if (solid%kind == solid_cylinder) then
        call require_key('LENGTH')
        solid%length = input%real('SHAPE', i, 'LENGTH')
        solid%axis = index('xyz', input%text('SHAPE', i, 'AXIS'))
      end if
    end select
  contains
    subroutine require_key(key)
      character(*), intent(in) :: key

      if (.not. input%given('SHAPE', i, key)) then
        call input%report('SHAPE', i, key, "required for KIND = '"//input%text('SHAPE', i, &
                          'KIND')//"'")
      end if
    end subroutine require_key

    subroutine read_trapezoid()
      call require_key('WIDTH_LOWER')
      call require_key('WIDTH_UPPER')
      solid%along = index('xyz', input%text('SHAPE', i, 'ALONG'))
      solid%across = index('xyz', input%text('SHAPE', i, 'ACROSS'))
      solid%width = [input%real('SHAPE', i, 'WIDTH_LOWER'), input%real('SHAPE', i, 'WIDTH_UPPER')]
      if (solid%along == solid%across) then
        call input%report('SHAPE', i, 'ACROSS', 'must be another axis than ALONG')
      end if
    end subroutine read_trapezoid

    subroutine read_mesh()
      type(facets_t) :: facets
      logical :: ok

      allocate (solid%mesh)
      call require_key('FILE')
      call require_key('UNIT')
      call read_facets(input, 'SHAPE', i, facets, ok)
      if (.not. ok) return
      facets%x = facets%x + spread(input%reals('SHAPE', i, 'POSITION', 3), 2, size(facets%x, 2))
      call new_mesh(facets, solid%mesh)
      solid%lower = solid%mesh%lower
      solid%upper = solid%mesh%upper
    end subroutine read_mesh
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

  !> First body that contains `x`; 0 for none.
  pure integer function body_at(list, x)
    type(solids_t), intent(in) :: list(:)
    real(rp), intent(in) :: x(3)

    do body_at = 1, size(list)
      if (is_inside(list(body_at)%solid, x)) return
    end do
    body_at = 0
  end function body_at

  !> True if a position lies in a body or on its surface.
  pure logical function is_in_body(list, x, h)
    type(solids_t), intent(in) :: list(:)
    real(rp), intent(in) :: x(3)                       !! position [m]
    real(rp), intent(in) :: h                          !! cell edge that scales the tolerance [m]
    integer :: c

    is_in_body = .false.
    do c = 0, 7
      is_in_body = is_in_body .or. body_at(list, x + 1.0e-6_rp*h*merge(1.0_rp, -1.0_rp, &
                [btest(c, 0), btest(c, 1), btest(c, 2)])) > 0
    end do
  end function is_in_body

  !> True if `x` lies in the solid.
  pure logical function holds(solid, x)
    type(solid_t), intent(in) :: solid
    real(rp), intent(in) :: x(3)
    real(rp) :: apart, d(3), edge, s, w

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
    case (solid_mesh)
      holds = all(x > solid%lower .and. x < solid%upper)
      if (.not. holds) return
      call solid%mesh%distance(x, apart, d, edge)
      holds = apart < 0.0_rp
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
    if (.not. is_round(solid)) return
    half = solid%radius
    if (solid%kind == solid_cylinder) half(solid%axis) = 0.5_rp*solid%length
    lower = solid%centre - half
    upper = solid%centre + half
  end subroutine bounds

  !> Bounding box of the solids that add material [m]; lower > upper if there is none.
  pure subroutine extent_of(solids, lower, upper)
    type(solid_t), intent(in) :: solids(:)
    real(rp), intent(out) :: lower(3), upper(3)
    real(rp) :: low(3), high(3)
    integer :: i

    lower = huge(1.0_rp)
    upper = -huge(1.0_rp)
    do i = 1, size(solids)
      if (.not. solids(i)%adds) cycle
      call bounds(solids(i), low, high)
      lower = min(lower, low)
      upper = max(upper, high)
    end do
  end subroutine extent_of

  !> Points of a body on both sides of its round surfaces, also of holes, (3, n) [m].
  pure function round_points(solids) result(x)
    type(solid_t), intent(in) :: solids(:)
    real(rp), allocatable :: x(:, :)
    integer, parameter :: n = 12, n_angles = 48
    real(rp), parameter :: near = 1.0e-6_rp          ! distance from the surface over the radius
    real(rp) :: candidate(3, 2*n_angles*(n + 1)*size(solids)), high(3), low(3), lower(3), r, &
                upper(3), z
    logical :: is_in(size(candidate, 2))
    integer :: axis, i, j, k, p, side

    call extent_of(solids, lower, upper)
    p = 0
    do i = 1, size(solids)
      if (.not. is_round(solids(i))) cycle
      axis = merge(solids(i)%axis, 3, solids(i)%kind == solid_cylinder)
      call bounds(solids(i), low, high)
      low = max(low, lower)
      high = min(high, upper)
      do k = 0, n
        z = low(axis) + (high(axis) - low(axis))*(near + (1.0_rp - 2.0_rp*near)*k/n)
        r = solids(i)%radius
        if (solids(i)%kind /= solid_cylinder) r = sqrt(max(0.0_rp, r**2 &
                                                           - (z - solids(i)%centre(axis))**2))
        do j = 1, n_angles
          do side = -1, 1, 2
            p = p + 1
            candidate(:, p) = solids(i)%centre + (1.0_rp + side*near)*r*cshift( &
                              [cos(2.0_rp*pi*j/n_angles), sin(2.0_rp*pi*j/n_angles), 0.0_rp], -axis)
            candidate(axis, p) = z
            is_in(p) = is_inside(solids, candidate(:, p))
          end do
        end do
      end do
    end do
    x = reshape(pack(candidate(:, :p), spread(is_in(:p), 1, 3)), [3, count(is_in(:p))])
  end function round_points

  !> True for cylinders and spheres.
  pure logical function is_round(solid)
    type(solid_t), intent(in) :: solid

    is_round = solid%kind == solid_cylinder .or. solid%kind == solid_sphere
  end function is_round

  !> Anchor of lattices: a corner of a solid, or the centre of a round one [m].
  pure function reference(solid) result(x)
    type(solid_t), intent(in) :: solid
    real(rp) :: x(3)

    x = solid%lower
    if (.not. is_round(solid)) return
    x = solid%centre
    if (solid%kind == solid_cylinder) x(solid%axis) = x(solid%axis) - 0.5_rp*solid%length
  end function reference

end module setup_solids
