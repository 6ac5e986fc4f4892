! SPDX-License-Identifier: MIT
!> Shapes of tools: each that the input can name obeys what `shape_t` promises; distances against
!> those of the sides of an outline, dense sampling and known places.
program test_shapes
  use base_kinds, only: rp
  use base_text, only: str
  use check, only: begin_tests, end_tests, expect, expect_close
  use input_reading, only: read_input_text
  use input_values, only: input_t
  use setup_keys, only: key_table
  use tools_shape, only: shape_t
  use tools_shape_box, only: box_shape_t
  use tools_shape_shoulder, only: new_shoulder, shoulder_t
  use tools_shapes, only: make_shape, read_shape, shape_names
  implicit none (type, external)

  !> What a revolved tool is made of [m]; see `new_shoulder`.
  type :: made_t
    real(rp) :: radius = 0.0_rp, height = 0.0_rp, concavity = 0.0_rp
    real(rp) :: pin_radius = 0.0_rp, tip_radius = 0.0_rp, pin_length = 0.0_rp
  end type made_t

  real(rp), parameter :: deg = 0.017453292519943295_rp
  real(rp), parameter :: unit(3, 3) = reshape([1.0_rp, 0.0_rp, 0.0_rp, 0.0_rp, 1.0_rp, 0.0_rp, &
                                               0.0_rp, 0.0_rp, 1.0_rp], [3, 3])

  call begin_tests()
  call random_init(.true., .false.)
  call test_revolved('flat', made_t(0.010_rp, 0.020_rp))
  call test_revolved('concave', made_t(0.010_rp, 0.020_rp, concavity=7.0_rp*deg))
  call test_revolved('flat with pin', made_t(0.010_rp, 0.020_rp, pin_radius=0.003_rp, &
                                             tip_radius=0.003_rp, pin_length=0.005_rp))
  call test_revolved('concave with tapered pin', &
                     made_t(0.010_rp, 0.015_rp, concavity=10.0_rp*deg, pin_radius=0.004_rp, &
                            tip_radius=0.002_rp, pin_length=0.006_rp))
  call test_revolved('flat with cone', &
                     made_t(0.010_rp, 0.020_rp, pin_radius=0.004_rp, pin_length=0.005_rp))
  call test_shapes_of_input()
  call test_known_points()
  call test_box()
  call end_tests()

contains

  !> Triangles on the surface that close it, seen from outside counterclockwise: the volume inside
  !> them is that of the places with a negative distance.
  subroutine test_surface(name, shape)
    character(*), intent(in) :: name
    class(shape_t), intent(in) :: shape
    real(rp), allocatable :: x(:, :), outline(:, :)
    real(rp) :: d, middle(3), half(3), normal(3), room, sampled, total(3), volume, y(3)
    integer, allocatable :: corner(:, :)
    integer, parameter :: n_places = 20000
    integer :: i

    call shape%outline(outline)
    call shape%surface(x, corner)
    call expect(name//': has a surface if it has ends', &
                size(outline) > 0 .eqv. size(corner) > 0)
    if (size(corner) == 0) return
    call expect(name//': corners are points', all(corner >= 1 .and. corner <= size(x, 2)))
    d = 0.0_rp
    do i = 1, size(x, 2)
      call shape%distance(x(:, i), room, normal, y(1))
      d = max(d, abs(room))
    end do
    call expect_close(name//': points lie on the surface', d, 0.0_rp, atol=1.0e-12_rp)
    volume = 0.0_rp
    total = 0.0_rp
    do i = 1, size(corner, 2)
      associate (a => x(:, corner(1, i)), b => x(:, corner(2, i)), c => x(:, corner(3, i)))
        normal = cross(b - a, c - a)/2.0_rp
        volume = volume + dot_product(a, normal)/3.0_rp
        total = total + normal
      end associate
    end do
    call expect_close(name//': it is closed', norm2(total), 0.0_rp, atol=1.0e-12_rp)
    call shape%bounds(unit, middle, half)
    sampled = 0.0_rp
    do i = 1, n_places     ! of an additive recurrence, whose error falls as 1/n (Roberts 2018)
      y = modulo(i*[0.8191725133961645_rp, 0.6710436067037893_rp, 0.5497004779019703_rp], 1.0_rp)
      call shape%distance(middle + half*(2.0_rp*y - 1.0_rp), d, normal, room)
      if (d < 0.0_rp) sampled = sampled + 8.0_rp*product(half)/n_places
    end do
    call expect_close(name//': its volume', volume, sampled, rtol=0.01_rp)
  end subroutine test_surface

  pure function cross(a, b) result(c)
    real(rp), intent(in) :: a(3), b(3)
    real(rp) :: c(3)

    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

  !> What all shapes promise, of each that KIND can name.
  subroutine test_shapes_of_input()
    class(shape_t), allocatable :: shape
    character(32), allocatable :: names(:)
    real(rp) :: frame(3, 3)
    integer :: k

    allocate (names, source=[character(32) :: shape_names, 'thread', 'flats', 'scroll', 'all', &
                              'bobbin', 'sleeve'])
    do k = 1, size(names)
      call read_sample(trim(names(k)), shape, frame)
      call expect_close(trim(names(k))//': axes are of length 1 and upright on each other', &
                        norm2(matmul(transpose(frame), frame) - unit), 0.0_rp, atol=1.0e-12_rp)
      call test_distances(trim(names(k)), shape)
      call test_normals(trim(names(k)), shape)
      call test_bounds(trim(names(k)), shape)
      call test_outline(trim(names(k)), shape)
      call test_surface(trim(names(k)), shape)
      call test_sweep(trim(names(k)), shape)
    end do
    call make_shape('no such shape', shape)
    call expect('a name of no shape', .not. allocated(shape))
  end subroutine test_shapes_of_input

  !> KIND of a sample: a name of `shape_names`, or a shoulder with cuts.
  pure function kind_of(name) result(kind)
    character(*), intent(in) :: name
    character(:), allocatable :: kind

    kind = name
    if (any(name == [character(8) :: 'thread', 'flats', 'scroll', 'all', 'bobbin', &
                     'sleeve'])) kind = 'shoulder'
  end function kind_of

  !> A wedge with a slot in it, in inches, as an STL file: a shape without any symmetry.
  subroutine write_stl(file)
    character(*), intent(in) :: file
    real(rp), parameter :: x(8) = [-0.3_rp, 0.3_rp, 0.3_rp, 0.1_rp, 0.0_rp, -0.05_rp, -0.1_rp, &
                                   -0.3_rp]
    real(rp), parameter :: y(8) = [-0.2_rp, -0.3_rp, 0.3_rp, 0.3_rp, 0.0_rp, 0.0_rp, 0.2_rp, &
                                   0.25_rp]
    integer, parameter :: cap(3, 6) = reshape([1, 2, 5, 2, 3, 4, 2, 4, 5, 1, 5, 6, 1, 6, 7, &
                                               1, 7, 8], [3, 6])
    integer :: i, next, unit

    open (newunit=unit, file=file, action='write', status='replace')
    write (unit, '(a)') 'solid wedge'
    do i = 1, 8
      next = modulo(i, 8) + 1
      call put_facet(unit, [x(i), y(i), -0.25_rp], [x(next), y(next), -0.25_rp], &
                     [x(next), y(next), 0.2_rp])
      call put_facet(unit, [x(i), y(i), -0.25_rp], [x(next), y(next), 0.2_rp], &
                     [x(i), y(i), 0.2_rp])
    end do
    do i = 1, 6
      associate (a => cap(1, i), b => cap(2, i), c => cap(3, i))
        call put_facet(unit, [x(a), y(a), 0.2_rp], [x(b), y(b), 0.2_rp], [x(c), y(c), 0.2_rp])
        call put_facet(unit, [x(a), y(a), -0.25_rp], [x(c), y(c), -0.25_rp], [x(b), y(b), -0.25_rp])
      end associate
    end do
    write (unit, '(a)') 'endsolid wedge'
    close (unit)
  end subroutine write_stl

  !> A facet of a text.
  subroutine put_facet(unit, a, b, c)
    integer, intent(in) :: unit
    real(rp), intent(in) :: a(3), b(3), c(3)

    write (unit, '(a)') 'facet normal 0 0 0', '  outer loop'
    write (unit, '(a,3es24.15)') '    vertex ', a, '    vertex ', b, '    vertex ', c
    write (unit, '(a)') '  endloop', 'endfacet'
  end subroutine put_facet

  !> A shape as the input describes it; sizes are some 10 mm. A new shape is a case here.
  subroutine read_sample(name, shape, frame)
    character(*), intent(in) :: name
    class(shape_t), allocatable, intent(out) :: shape
    real(rp), intent(out) :: frame(3, 3)
    character(40), parameter :: no_sets(0) = ''
    character(*), parameter :: nl = new_line('a')
    character(*), parameter :: rest = ' /'//nl//'&GRID CELL=1 LOWER=3*0 UPPER=3*9 /'//nl// &
      '&TIME END=1 /'//nl//"&MATERIAL NAME='m' DENSITY=1 YOUNGS_MODULUS=1 POISSON_RATIO=0 /"//nl// &
      "&BODY NAME='b' MATERIAL='m' /"//nl//"&SHAPE BODY='b' LOWER=3*0 UPPER=3*1 /"//nl
    character(*), parameter :: pin = 'RADIUS=10e-3 HEIGHT=5e-3 CONCAVITY_DEG=7 PIN_RADIUS=4e-3 '// &
      'PIN_TIP_RADIUS=3e-3 PIN_LENGTH=5e-3 '
    character(:), allocatable :: keys
    type(input_t) :: input

    select case (name)
    case ('shoulder')
      keys = 'RADIUS=10e-3 CONCAVITY_DEG=7 PIN_RADIUS=4e-3 PIN_TIP_RADIUS=3e-3 PIN_LENGTH=5e-3 '// &
             'TILT_DEG=3'
    case ('plane')
      keys = 'NORMAL=0.3,-0.4,1.2'
    case ('sphere')
      keys = 'RADIUS=8e-3 TILT_DEG=-2'
    case ('box')
      keys = 'SIZE=12e-3,18e-3,8e-3 TILT_DEG=5'
    case ('stl')
      call write_stl('test_shapes.stl')
      keys = "FILE='test_shapes.stl' UNIT='in' AXIS=0.3,-0.4,1.2 TURN_DEG=20 ORIGIN=1e-3,0,2e-3"
    case ('thread')
      keys = pin//"THREAD_DEPTH=0.6e-3 THREAD_PITCH=1.3e-3 THREAD_PROFILE='v' THREAD_HAND='right'"
    case ('flats')
      keys = pin//'FLATS=3 FLAT_DEPTH=0.8e-3'
    case ('scroll')
      keys = 'RADIUS=10e-3 SCROLL_DEPTH=0.9e-3 SCROLL_PITCH=1.7e-3 SCROLL_ARMS=2 '// &
             "SCROLL_PROFILE='round' CONCAVITY_DEG=4 HEIGHT=6e-3"
    case ('all')
      keys = pin//'THREAD_DEPTH=0.5e-3 THREAD_PITCH=1e-3 THREAD_STARTS=2 FLATS=4 '// &
             "FLAT_DEPTH=0.4e-3 SCROLL_DEPTH=0.7e-3 SCROLL_PITCH=1.9e-3 SCROLL_SENSE='outward' "// &
             'SCROLL_ARMS=3'
    case ('bobbin')
      keys = pin//'BOBBIN_RADIUS=8e-3'
    case ('sleeve')
      keys = 'RADIUS=10e-3 HEIGHT=8e-3 CONCAVITY_DEG=7 BORE_RADIUS=5e-3'
    case default
      keys = ''
    end select
    call expect('there is a sample of '//name, keys /= '')
    keys = "&TOOL KIND='"//kind_of(name)//"' POSITION=3*0 "//keys//rest
    call read_input_text(key_table(), 't.nml', keys, no_sets, input)
    call read_shape(input, 1, shape, frame)
    call expect(name//': nothing is wrong with its sample', input%diagnostics%count() == 0)
    if (input%diagnostics%count() > 0) call input%diagnostics%print(6)
  end subroutine read_sample

  !> A random place, often near the surface of shapes of some 10 mm.
  function random_place() result(x)
    real(rp) :: x(3)

    call random_number(x)
    x = 0.036_rp*(x - 0.5_rp)
  end function random_place

  !> Random axes.
  function random_axes() result(axes)
    real(rp) :: axes(3, 3), q(4)

    call random_number(q)
    q = q - 0.5_rp
    q = q/norm2(q)
    associate (w => q(1), x => q(2), y => q(3), z => q(4))
      axes(:, 1) = [1.0_rp - 2.0_rp*(y*y + z*z), 2.0_rp*(x*y + w*z), 2.0_rp*(x*z - w*y)]
      axes(:, 2) = [2.0_rp*(x*y - w*z), 1.0_rp - 2.0_rp*(x*x + z*z), 2.0_rp*(y*z + w*x)]
      axes(:, 3) = [2.0_rp*(x*z + w*y), 2.0_rp*(y*z - w*x), 1.0_rp - 2.0_rp*(x*x + y*y)]
    end associate
  end function random_axes

  !> Exact: distances of many places are those of each, to rounding.
  subroutine test_distances(name, shape)
    character(*), intent(in) :: name
    class(shape_t), intent(in) :: shape
    integer, parameter :: n = 1000
    real(rp), parameter :: most = 1.0e-3_rp
    real(rp) :: many(n), normal(3), one(n), room, x(n, 3)
    integer :: p

    do p = 1, n
      x(p, :) = random_place()
      call shape%distance(x(p, :), one(p), normal, room)
    end do
    call shape%distances(n, x, huge(1.0_rp), many)
    call expect(name//': some inside, some outside', &
                count(one < 0.0_rp) > 20 .and. count(one > 0.0_rp) > 20)
    call expect(name//': many distances at once', all(abs(many - one) < 1.0e-15_rp))
    call shape%distances(n, x, most, many)
    call expect(name//': those that are not far', all(abs(many - one) < 1.0e-15_rp .or. &
                                                      one > most .and. many > most))
  end subroutine test_distances

  !> From outside, the way along the normal ends on the surface: the distance there is zero. The
  !> normal is the gradient of the distance (by differences) but for a few places where two faces
  !> are equally near. A distance is never less than the way to the surface.
  subroutine test_normals(name, shape)
    character(*), intent(in) :: name
    class(shape_t), intent(in) :: shape
    real(rp), parameter :: step = 1.0e-8_rp
    real(rp) :: d, d1, d2, gradient(3), left, length, normal(3), room, unused(3), x(3), y(3)
    integer :: a, i, n_kinks

    left = 0.0_rp
    length = 0.0_rp
    n_kinks = 0
    do i = 1, 1000
      x = random_place()
      call shape%distance(x, d, normal, room)
      length = max(length, abs(norm2(normal) - 1.0_rp))
      if (d > 0.0_rp) then
        call shape%distance(x - d*normal, d1, unused, room)
        left = max(left, abs(d1))
      end if
      do a = 1, 3
        y = x
        y(a) = x(a) + step
        call shape%distance(y, d1, unused, room)
        y(a) = x(a) - step
        call shape%distance(y, d2, unused, room)
        gradient(a) = (d1 - d2)/(2.0_rp*step)
      end do
      if (norm2(gradient - normal) > 1.0e-5_rp) n_kinks = n_kinks + 1
    end do
    call expect_close(name//': the way to the surface ends there', left, 0.0_rp, atol=1.0e-15_rp)
    call expect_close(name//': length of the normal', length, 0.0_rp, atol=1.0e-12_rp)
    call expect(name//': the normal is the gradient', n_kinks < 3)
  end subroutine test_normals

  !> Places inside lie in the bounds, however the shape is turned, and no less than most of them is
  !> needed; a shape without ends has none.
  subroutine test_bounds(name, shape)
    character(*), intent(in) :: name
    class(shape_t), intent(in) :: shape
    real(rp) :: axes(3, 3), d, half(3), middle(3), most, normal(3), room, x(3), y(3)
    logical :: is_in
    integer :: i, k

    is_in = .true.
    most = 0.0_rp
    do k = 1, 20
      axes = random_axes()
      call shape%bounds(axes, middle, half)
      do i = 1, 2000
        x = random_place()
        call shape%distance(x, d, normal, room)
        if (d >= 0.0_rp) cycle
        y = matmul(axes, x) - middle
        is_in = is_in .and. all(abs(y) <= half + 1.0e-14_rp)
        most = max(most, maxval(abs(y)/half))
      end do
    end do
    call expect(name//': bounds contain it', is_in)
    ! a turned wedge does not fill the box around its box
    if (all(half < huge(1.0_rp))) call expect(name//': bounds are close', &
                                              most > merge(0.7_rp, 0.9_rp, name == 'stl'))
  end subroutine test_bounds

  !> The outline is on the surface or in the shape, and reaches to its bounds; none without ends.
  subroutine test_outline(name, shape)
    character(*), intent(in) :: name
    class(shape_t), intent(in) :: shape
    real(rp), allocatable :: x(:, :), d(:)
    real(rp) :: half(3), middle(3)

    call shape%outline(x)
    call shape%bounds(unit, middle, half)
    call expect(name//': an outline if it has ends', size(x, 2) > 0 .eqv. all(half < huge(1.0_rp)))
    if (size(x, 2) == 0) return
    allocate (d(size(x, 2)))
    call shape%distances(size(d), transpose(x), huge(1.0_rp), d)
    call expect(name//': the outline is nowhere outside', maxval(d) < 1.0e-15_rp)
    call expect(name//': most of it on the surface', count(abs(d) < 1.0e-15_rp) > size(d)/3)
    call expect_close(name//': it reaches down', minval(x(3, :)), middle(3) - half(3), &
                      rtol=1.0e-12_rp)
    call expect_close(name//': it reaches up', maxval(x(3, :)), middle(3) + half(3), &
                      rtol=1.0e-12_rp)
  end subroutine test_outline

  !> A turn about the last axis brings the surface no nearer to any place than `sweep` says; what
  !> is round needs none.
  subroutine test_sweep(name, shape)
    character(*), intent(in) :: name
    class(shape_t), intent(in) :: shape
    real(rp) :: after(3, 3), angle, before, d, nearer, normal(3), room, sweep, x(3)
    integer :: i, k

    nearer = -huge(1.0_rp)
    do k = 1, 10
      angle = 0.02_rp*k
      after(:, 1) = [cos(angle), sin(angle), 0.0_rp]
      after(:, 2) = [-sin(angle), cos(angle), 0.0_rp]
      after(:, 3) = [0.0_rp, 0.0_rp, 1.0_rp]
      sweep = shape%sweep(unit, after)
      do i = 1, 1000
        x = random_place()
        call shape%distance(x, before, normal, room)
        call shape%distance(matmul(x, after), d, normal, room)
        nearer = max(nearer, before - d - sweep)
      end do
    end do
    call expect(name//': comes no nearer than by its sweep ('//str(nearer)//' m)', &
                nearer < 1.0e-15_rp)
  end subroutine test_sweep

  pure type(shoulder_t) function shoulder_of(made)
    type(made_t), intent(in) :: made

    shoulder_of = new_shoulder(made%radius, made%height, made%concavity, made%pin_radius, &
                               made%tip_radius, made%pin_length)
  end function shoulder_of

  !> Corners (r, z) from the axis round to the axis, written down independently of the profile.
  subroutine corners_of(made, corner, n)
    type(made_t), intent(in) :: made
    real(rp), intent(out) :: corner(2, 6)
    integer, intent(out) :: n

    corner = 0.0_rp
    corner(:, 1) = [0.0_rp, made%height]
    corner(:, 2) = [made%radius, made%height]
    corner(:, 3) = [made%radius, 0.0_rp]
    n = 4
    corner(:, 4) = [0.0_rp, face_of(made, 0.0_rp)]
    if (made%pin_radius > 0.0_rp) then
      corner(:, 4) = [made%pin_radius, face_of(made, made%pin_radius)]
      corner(:, 5) = [made%tip_radius, -made%pin_length]
      corner(:, 6) = [0.0_rp, -made%pin_length]
      n = 6
    end if
  end subroutine corners_of

  !> Height of the shoulder's face at radius r.
  pure real(rp) function face_of(made, r)
    type(made_t), intent(in) :: made
    real(rp), intent(in) :: r

    face_of = (made%radius - r)*tan(made%concavity)
  end function face_of

  !> Is (r, z) in the shoulder or in the pin?
  pure logical function is_in_tool(made, r, z)
    type(made_t), intent(in) :: made
    real(rp), intent(in) :: r, z
    real(rp) :: top, part

    is_in_tool = r <= made%radius .and. z <= made%height .and. z >= face_of(made, r)
    if (made%pin_radius <= 0.0_rp) return
    top = face_of(made, made%pin_radius)
    if (z >= -made%pin_length .and. z <= top) then
      part = (z + made%pin_length)/(top + made%pin_length)
      is_in_tool = is_in_tool .or. r <= made%tip_radius + part*(made%pin_radius - made%tip_radius)
    end if
  end function is_in_tool

  !> Distance of (r, z) from the sides of the outline.
  real(rp) function distance_of_sides(made, r, z) result(best)
    type(made_t), intent(in) :: made
    real(rp), intent(in) :: r, z
    real(rp) :: corner(2, 6), side(2), part
    integer :: i, n

    call corners_of(made, corner, n)
    best = huge(best)
    do i = 1, n - 1
      side = corner(:, i + 1) - corner(:, i)
      part = dot_product([r, z] - corner(:, i), side)/max(dot_product(side, side), tiny(r))
      part = max(0.0_rp, min(1.0_rp, part))
      best = min(best, norm2([r, z] - corner(:, i) - part*side))
    end do
  end function distance_of_sides

  !> Distance, sign, gradient and its length at random points around the tool.
  subroutine test_revolved(name, made)
    character(*), intent(in) :: name
    type(made_t), intent(in) :: made
    type(shoulder_t) :: shoulder
    real(rp), parameter :: step = 1.0e-8_rp
    real(rp) :: x(3), y(3), normal(3), far(3), d, d1, d2, gradient(3), r, room, want
    real(rp) :: off, off_length, off_gradient, jump
    integer :: a, i, n_inside, n_kinks
    logical :: signs_agree

    shoulder = shoulder_of(made)
    off = 0.0_rp
    off_length = 0.0_rp
    off_gradient = 0.0_rp
    n_inside = 0
    n_kinks = 0
    signs_agree = .true.
    do i = 1, 400
      call random_number(x)
      x = [-0.012_rp, -0.012_rp, -0.010_rp] + x*[0.024_rp, 0.024_rp, 0.030_rp]
      r = norm2(x(1:2))
      call shoulder%distance(x, d, normal, room)
      want = distance_of_sides(made, r, x(3))
      off = max(off, abs(abs(d) - want))
      if (is_in_tool(made, r, x(3))) n_inside = n_inside + 1
      signs_agree = signs_agree .and. (is_in_tool(made, r, x(3)) .eqv. d < 0.0_rp)
      off_length = max(off_length, abs(norm2(normal) - 1.0_rp))
      jump = 0.0_rp
      do a = 1, 3
        y = x
        y(a) = x(a) + step
        call shoulder%distance(y, d1, far, room)
        jump = max(jump, norm2(far - normal))
        y(a) = x(a) - step
        call shoulder%distance(y, d2, far, room)
        jump = max(jump, norm2(far - normal))
        gradient(a) = (d1 - d2)/(2.0_rp*step)
      end do
      if (jump > 1.0e-3_rp) then         ! two sides are equally near: no gradient there
        n_kinks = n_kinks + 1
      else
        off_gradient = max(off_gradient, norm2(gradient - normal))
      end if
    end do
    call expect(name//': points inside', n_inside > 60)
    call expect_close(name//': distance', off, 0.0_rp, atol=1.0e-15_rp)
    call expect(name//': sign', signs_agree)
    call expect_close(name//': length of the gradient', off_length, 0.0_rp, atol=1.0e-12_rp)
    call expect_close(name//': gradient', off_gradient, 0.0_rp, atol=1.0e-6_rp)
    call expect(name//': few kinks', n_kinks < 3)
  end subroutine test_revolved

  !> Places that random points miss: on the axis, on the faces, below the rim.
  subroutine test_known_points()
    type(shoulder_t) :: flat, pin
    real(rp) :: d, normal(3), room

    flat = shoulder_of(made_t(0.010_rp, 0.020_rp))
    pin = shoulder_of(made_t(0.010_rp, 0.020_rp, pin_radius=0.003_rp, tip_radius=0.003_rp, &
                             pin_length=0.005_rp))
    call flat%distance([0.0_rp, 0.0_rp, -1.0e-3_rp], d, normal, room)
    call expect_close('below the axis', d, 1.0e-3_rp)
    call expect('below the axis, gradient', all(normal == [0.0_rp, 0.0_rp, -1.0_rp]))
    call flat%distance([0.0_rp, 0.0_rp, 2.0e-3_rp], d, normal, room)
    call expect_close('on the axis inside', d, -2.0e-3_rp)
    call flat%distance([5.0e-3_rp, 0.0_rp, 0.0_rp], d, normal, room)
    call expect_close('on the face', d, 0.0_rp, atol=1.0e-18_rp)
    call expect_close('on the face, gradient', normal(3), -1.0_rp)
    call flat%distance([0.013_rp, 0.0_rp, -0.004_rp], d, normal, room)
    call expect_close('off the rim', d, 0.005_rp)
    call expect_close('off the rim, gradient', norm2(normal - [0.6_rp, 0.0_rp, -0.8_rp]), 0.0_rp, &
                      atol=1.0e-12_rp)
    call pin%distance([0.0_rp, 3.5e-3_rp, -2.0e-3_rp], d, normal, room)
    call expect_close('beside the pin', d, 0.5e-3_rp)
    call expect_close('beside the pin, gradient', normal(2), 1.0_rp)
    call pin%distance([0.0_rp, 0.0_rp, -4.0e-3_rp], d, normal, room)
    call expect_close('in the pin, near its tip', d, -1.0e-3_rp)
    call expect_close('in the pin, gradient', normal(3), -1.0_rp)
  end subroutine test_known_points

  !> Box: distance to the sampled closest point, sign and gradient.
  subroutine test_box()
    real(rp), parameter :: half(3) = [0.3_rp, 0.5_rp, 0.2_rp], step = 1.0e-7_rp
    real(rp) :: x(3), y(3), d, d1, d2, want, normal(3), unused(3), gradient(3), room
    real(rp) :: off, off_gradient
    type(box_shape_t) :: box
    integer :: a, i, n_inside

    box%half = half
    off = 0.0_rp
    off_gradient = 0.0_rp
    n_inside = 0
    do i = 1, 2000
      call random_number(x)
      x = 1.6_rp*(x - 0.5_rp)
      call box%distance(x, d, normal, room)
      want = norm2(x - max(-half, min(half, x)))
      if (all(abs(x) < half)) then
        n_inside = n_inside + 1
        want = -min(half(1) - abs(x(1)), half(2) - abs(x(2)), half(3) - abs(x(3)))
      end if
      off = max(off, abs(d - want))
      do a = 1, 3
        y = x
        y(a) = x(a) + step
        call box%distance(y, d1, unused, room)
        y(a) = x(a) - step
        call box%distance(y, d2, unused, room)
        gradient(a) = (d1 - d2)/(2.0_rp*step)
      end do
      if (d < 0.0_rp .and. maxval(abs(gradient)) < 1.0_rp - 1.0e-6_rp) cycle   ! two faces are near
      off_gradient = max(off_gradient, norm2(gradient - normal))
    end do
    call expect('box: points inside', n_inside > 50)
    call expect_close('box: distance', off, 0.0_rp, atol=1.0e-14_rp)
    call expect_close('box: gradient', off_gradient, 0.0_rp, atol=1.0e-5_rp)
  end subroutine test_box

end program test_shapes
