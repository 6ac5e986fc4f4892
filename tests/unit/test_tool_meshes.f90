! SPDX-License-Identifier: MIT
!> Tools of facets: distance and normal against all facets and the winding number, volumes of
!> threads, flats and scrolls against exact ones, where grooves are, a cylinder from an STL file
!> against the exact one.
program test_tool_meshes
  use, intrinsic :: iso_fortran_env, only: int32, real32
  use base_kinds, only: pi, rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use input_diagnostics, only: diagnostics_t
  use tools_mesh, only: surface_mesh_t, new_mesh
  use tools_mesh_drawing, only: triangulate_surface
  use tools_mesh_facets, only: cross, facets_t
  use tools_mesh_stl_file, only: read_stl
  use tools_shape, only: shape_t
  use tools_shape_cuts, only: cut_pin_shape_t, make_mesh
  use tools_shape_shoulder, only: new_shoulder
  implicit none (type, external)

  character(6), parameter :: profiles(3) = [character(6) :: 'square', 'v', 'round']

  call begin_tests()
  call random_init(.true., .false.)
  call test_brute_force()
  call test_thread_volumes()
  call test_flat_volumes()
  call test_scroll_volumes()
  call test_groove_places()
  call test_stl_cylinder()
  call end_tests()

contains

  pure type(cut_pin_shape_t) function plain() result(shape)
    shape = cut_pin_shape_t(radius=9.0e-3_rp, height=4.0e-3_rp, pin_radius=3.0e-3_rp, &
                           tip_radius=3.0e-3_rp, pin_length=5.0e-3_rp)
  end function plain

  real(rp) function random(from, to)
    real(rp), intent(in) :: from, to

    call random_number(random)
    random = from + random*(to - from)
  end function random

  !> A shoulder with random cuts of all kinds.
  type(cut_pin_shape_t) function random_cuts(k) result(shape)
    integer, intent(in) :: k

    shape = plain()
    shape%slope = random(0.0_rp, 0.15_rp)
    shape%tip_radius = random(2.0e-3_rp, 3.0e-3_rp)
    shape%thread%depth = random(0.2e-3_rp, 0.8e-3_rp)
    shape%thread%pitch = random(0.7e-3_rp, 2.0e-3_rp)
    shape%thread%rise = nint(random(1.0_rp, 2.0_rp))*(-1)**k
    call shape%thread%set_profile(trim(profiles(modulo(k, 3) + 1)))
    shape%n_flats = nint(random(1.0_rp, 5.0_rp))
    shape%flat_depth = random(0.1e-3_rp, 0.8e-3_rp)
    shape%scroll%depth = random(0.2e-3_rp, 1.5e-3_rp)
    shape%scroll%pitch = random(0.8e-3_rp, 2.5e-3_rp)
    shape%scroll%rise = nint(random(1.0_rp, 4.0_rp))*(-1)**(k + 1)
    call shape%scroll%set_profile(trim(profiles(modulo(k + 1, 3) + 1)))
  end function random_cuts

  !> Distance, side and normal at random places, of which many are near the surface.
  subroutine test_brute_force()
    type(surface_mesh_t) :: mesh
    real(rp), allocatable :: x(:, :)
    integer, allocatable :: corner(:, :)
    real(rp) :: away, d, exact, normal(3), room, to(3), y(3), worst(2)
    logical :: inside, right
    integer :: i, k, n_in

    worst = 0.0_rp
    right = .true.
    n_in = 0
    do k = 1, size(profiles)
      call make_mesh(random_cuts(k), mesh)
      call triangulate_surface(mesh%facets, mesh%ridges%patch, x, corner)
      do i = 1, 60
        if (modulo(i, 2) == 0) then
          y = [random(-10.0e-3_rp, 10.0e-3_rp), random(-10.0e-3_rp, 10.0e-3_rp), &
               random(-6.0e-3_rp, 5.0e-3_rp)]
        else
          y = x(:, nint(random(1.0_rp, real(size(x, 2), rp))))
          y = y + [random(-3.0e-4_rp, 3.0e-4_rp), random(-3.0e-4_rp, 3.0e-4_rp), &
                   random(-3.0e-4_rp, 3.0e-4_rp)]
        end if
        call mesh%distance(y, d, normal, room)
        call nearest_of_all(x, corner, y, exact, to)
        inside = winding(x, corner, y) > 0.5_rp
        if (inside) n_in = n_in + 1
        worst(1) = max(worst(1), abs(abs(d) - exact))
        right = right .and. (d < 0.0_rp .eqv. inside)
        away = merge(-1.0_rp, 1.0_rp, inside)
        worst(2) = max(worst(2), norm2(normal - away*(y - to)/exact)*exact)
      end do
    end do
    call expect_close('distance to the nearest of all facets', worst(1), 0.0_rp, atol=1.0e-15_rp)
    call expect('the side is that of the winding number', right)
    call expect('places on both sides', n_in > 36 .and. n_in < 144)
    call expect_close('the normal is the way to it', worst(2), 0.0_rp, atol=1.0e-12_rp)
  end subroutine test_brute_force

  !> The nearest place of all facets: by their planes and their edges.
  pure subroutine nearest_of_all(x, corner, y, d, to)
    real(rp), intent(in) :: x(:, :), y(3)
    integer, intent(in) :: corner(:, :)
    real(rp), intent(out) :: d, to(3)
    real(rp) :: a(3), b(3), n(3), p(3), t
    logical :: inside
    integer :: i, k

    d = huge(1.0_rp)
    do i = 1, size(corner, 2)
      a = x(:, corner(1, i))
      n = cross(x(:, corner(2, i)) - a, x(:, corner(3, i)) - a)
      n = n/norm2(n)
      p = y - dot_product(y - a, n)*n
      inside = .true.
      do k = 1, 3
        a = x(:, corner(k, i))
        b = x(:, corner(modulo(k, 3) + 1, i)) - a
        inside = inside .and. dot_product(cross(b, p - a), n) >= 0.0_rp
        t = max(0.0_rp, min(1.0_rp, dot_product(y - a, b)/dot_product(b, b)))
        if (norm2(y - a - t*b) < d) then
          d = norm2(y - a - t*b)
          to = a + t*b
        end if
      end do
      if (inside .and. norm2(y - p) < d) then
        d = norm2(y - p)
        to = p
      end if
    end do
  end subroutine nearest_of_all

  !> How often the surface winds around `y`: solid angles (Van Oosterom & Strackee 1983).
  pure real(rp) function winding(x, corner, y)
    real(rp), intent(in) :: x(:, :), y(3)
    integer, intent(in) :: corner(:, :)
    real(rp) :: a(3), b(3), c(3)
    integer :: i

    winding = 0.0_rp
    do i = 1, size(corner, 2)
      a = x(:, corner(1, i)) - y
      b = x(:, corner(2, i)) - y
      c = x(:, corner(3, i)) - y
      winding = winding + atan2(dot_product(a, cross(b, c)), norm2(a)*norm2(b)*norm2(c) &
                + dot_product(a, b)*norm2(c) + dot_product(b, c)*norm2(a) &
                + dot_product(c, a)*norm2(b))/(2.0_rp*pi)
    end do
  end function winding

  real(rp) function volume_of(shape)
    type(cut_pin_shape_t), intent(in) :: shape
    type(surface_mesh_t) :: mesh

    call make_mesh(shape, mesh)
    volume_of = mesh%volume
  end function volume_of

  !> Means of a profile and of its square.
  pure function means(name) result(m)
    character(*), intent(in) :: name
    real(rp) :: m(2)

    m = 0.5_rp
    if (name == 'v') m(2) = 1.0_rp/3.0_rp
    if (name == 'round') m(2) = 3.0_rp/8.0_rp
  end function means

  !> A helical groove takes the same from each cross-section: with its part g of the depth d that of
  !> the circle is (2 R d g - d^2 g^2) pi.
  subroutine test_thread_volumes()
    type(cut_pin_shape_t) :: shape
    real(rp) :: exact, m(2), made
    integer :: k

    do k = 1, 6
      shape = plain()
      shape%thread%depth = random(0.2e-3_rp, 1.0e-3_rp)
      shape%thread%pitch = random(0.6e-3_rp, 3.0e-3_rp)
      shape%thread%rise = nint(random(1.0_rp, 3.0_rp))*(-1)**k
      call shape%thread%set_profile(trim(profiles(modulo(k, 3) + 1)))
      m = means(trim(profiles(modulo(k, 3) + 1)))
      exact = pi*shape%pin_length*(2.0_rp*shape%pin_radius*shape%thread%depth*m(1) &
                                   - shape%thread%depth**2*m(2))
      made = volume_of(plain()) - volume_of(shape)
      call expect_close('volume of a thread, '//profiles(modulo(k, 3) + 1), made, exact, &
                        rtol=0.01_rp)
    end do
    exact = pi*(9.0e-3_rp**2*4.0e-3_rp + 3.0e-3_rp**2*5.0e-3_rp)
    call expect_close('volume without cuts', volume_of(plain()), exact, rtol=1.0e-3_rp)
  end subroutine test_thread_volumes

  !> A flat cuts a segment of the circle; so many that they meet make a prism.
  subroutine test_flat_volumes()
    type(cut_pin_shape_t) :: shape
    real(rp) :: exact, half

    shape = plain()
    shape%n_flats = 3
    shape%flat_depth = random(0.3e-3_rp, 1.2e-3_rp)
    half = acos(1.0_rp - shape%flat_depth/shape%pin_radius)
    exact = 3.0_rp*shape%pin_length*shape%pin_radius**2*(half - sin(half)*cos(half))
    call expect_close('volume of flats', volume_of(plain()) - volume_of(shape), exact, rtol=0.01_rp)
    shape%n_flats = 4
    shape%flat_depth = 0.3_rp*shape%pin_radius
    exact = shape%pin_length*(pi*shape%pin_radius**2 - (1.4_rp*shape%pin_radius)**2)
    call expect_close('volume of a square pin', volume_of(plain()) - volume_of(shape), exact, &
                      rtol=0.01_rp)
  end subroutine test_flat_volumes

  !> A spiral groove takes the same part of each ring of the face.
  subroutine test_scroll_volumes()
    type(cut_pin_shape_t) :: shape
    real(rp) :: exact
    integer :: k

    do k = 1, 6
      shape = plain()
      shape%scroll%depth = random(0.2e-3_rp, 1.5e-3_rp)
      shape%scroll%pitch = random(0.6e-3_rp, 1.5e-3_rp)
      shape%scroll%rise = nint(random(1.0_rp, 6.0_rp))*(-1)**k
      call shape%scroll%set_profile(trim(profiles(modulo(k, 3) + 1)))
      exact = 0.5_rp*pi*(shape%radius**2 - shape%pin_radius**2)*shape%scroll%depth
      call expect_close('volume of a scroll, '//profiles(modulo(k, 3) + 1), &
                        volume_of(plain()) - volume_of(shape), exact, rtol=0.01_rp)
    end do
  end subroutine test_scroll_volumes

  !> A right-handed groove rises counterclockwise, seen from above; a flat looks along x.
  subroutine test_groove_places()
    type(cut_pin_shape_t) :: shape
    type(surface_mesh_t) :: mesh
    real(rp) :: angle, d(2), normal(3), r, room, z
    integer :: hand, k

    do k = 0, 1
      hand = merge(1, -1, k == 0)                ! right, left
      shape = plain()
      shape%thread%depth = 0.5e-3_rp
      shape%thread%pitch = 2.0e-3_rp
      shape%thread%rise = -hand
      call shape%thread%set_profile('square')
      call make_mesh(shape, mesh)
      angle = random(0.0_rp, 2.0_rp*pi)
      r = shape%pin_radius - 0.25e-3_rp
      z = -2.0e-3_rp + hand*shape%thread%pitch*angle/(2.0_rp*pi)   ! on a ridge
      if (z < -4.0e-3_rp) z = z + shape%thread%pitch
      if (z > -1.0e-3_rp) z = z - shape%thread%pitch
      call mesh%distance([r*cos(angle), r*sin(angle), z], d(1), normal, room)
      z = z + 0.5_rp*shape%thread%pitch
      if (z > -0.2e-3_rp) z = z - shape%thread%pitch
      call mesh%distance([r*cos(angle), r*sin(angle), z], d(2), normal, room)
      call expect('the ridge of a thread', d(1) < 0.0_rp)
      call expect('its groove', d(2) > 0.0_rp)
    end do
    shape = plain()
    shape%n_flats = 2
    shape%flat_depth = 0.5e-3_rp
    call make_mesh(shape, mesh)
    call mesh%distance([2.6e-3_rp, 0.1e-3_rp, -3.0e-3_rp], d(1), normal, room)
    call expect_close('distance of a flat', d(1), 0.1e-3_rp, rtol=1.0e-9_rp)
    call expect_close('a flat looks ahead', normal(1), 1.0_rp, rtol=1.0e-12_rp)
    call expect_close('room to the end of a flat', room, 2.0e-3_rp, rtol=1.0e-9_rp)
    call mesh%distance([2.6e-3_rp, 1.5e-3_rp, -2.5e-3_rp], d(1), normal, room)
    call expect_close('room to the edge of a flat', room, (sqrt(3.0e-3_rp**2 - 2.5e-3_rp**2) &
                      - 1.5e-3_rp)/(1.0_rp - 2.5_rp/3.0_rp), rtol=0.15_rp)   ! a chord is beside it
    call mesh%distance([8.0e-3_rp, 0.0_rp, -1.0e-4_rp], d(1), normal, room)
    call expect_close('room to the rim of the face', room, 1.0e-3_rp, rtol=0.01_rp)
    call mesh%distance([9.3e-3_rp, 0.0_rp, -4.0e-4_rp], d(1), normal, room)
    call expect_close('beyond the rim', room, -3.0e-4_rp, rtol=0.01_rp)
    call mesh%distance([5.0e-3_rp, 0.0_rp, 2.0e-3_rp], d(1), normal, room)
    call expect('no rim between the facets of the wall', room > 1.0e-3_rp)
  end subroutine test_groove_places

  !> A cylinder written in either way: distances are those of the exact one within its facets.
  subroutine test_stl_cylinder()
    class(shape_t), allocatable :: exact
    type(facets_t) :: facets
    type(surface_mesh_t) :: mesh
    type(diagnostics_t) :: diagnostics
    real(rp), allocatable :: x(:, :)
    integer, allocatable :: corner(:, :)
    real(rp), parameter :: radius = 5.0_rp, chord = radius*(1.0_rp - cos(pi/72.0_rp))
    real(rp) :: d(2), high, low, n(3, 2), room, turned, y(3)
    logical :: opened
    integer :: i, k

    allocate (exact, source=new_shoulder(radius, 8.0_rp, 0.0_rp, 0.0_rp, 0.0_rp, 0.0_rp))
    call exact%surface(x, corner)
    x = real(real(x, real32), rp)
    do k = 1, 2
      if (k == 1) call write_binary('test_tool_meshes.stl', x, corner)
      if (k == 2) call write_text('test_tool_meshes.stl', x, corner)
      call read_stl('test_tool_meshes.stl', facets, opened, diagnostics)
      call expect('the file can be read', opened .and. diagnostics%count() == 0)
      if (diagnostics%count() > 0) call diagnostics%print(6)
      call expect('facets of the file', size(facets%corner, 2) == size(corner, 2))
      call new_mesh(facets, mesh)
      high = 0.0_rp
      low = 0.0_rp
      turned = 0.0_rp
      do i = 1, 2000
        y = [random(-7.0_rp, 7.0_rp), random(-7.0_rp, 7.0_rp), random(-2.0_rp, 10.0_rp)]
        call exact%distance(y, d(1), n(:, 1), room)
        call mesh%distance(y, d(2), n(:, 2), room)
        high = max(high, d(2) - d(1))
        low = min(low, d(2) - d(1))
        if (d(1) > 0.5_rp) turned = max(turned, norm2(n(:, 1) - n(:, 2)))
      end do
      call expect('facets lie inside the cylinder', low > -1.0e-5_rp)
      call expect('no deeper than their chords', high < chord + 1.0e-5_rp)
      call expect('and some as deep', high > 0.5_rp*chord)
      call expect('normals are within half a facet', turned < 1.1_rp*pi/72.0_rp)
    end do
  end subroutine test_stl_cylinder

  subroutine write_binary(file, x, corner)
    character(*), intent(in) :: file
    real(rp), intent(in) :: x(:, :)
    integer, intent(in) :: corner(:, :)
    integer :: i, unit

    open (newunit=unit, file=file, access='stream', form='unformatted', action='write', &
          status='replace')
    write (unit) repeat('x', 80), int(size(corner, 2), int32)
    do i = 1, size(corner, 2)
      write (unit) [0.0_real32, 0.0_real32, 0.0_real32], real(x(:, corner(:, i)), real32), '  '
    end do
    close (unit)
  end subroutine write_binary

  subroutine write_text(file, x, corner)
    character(*), intent(in) :: file
    real(rp), intent(in) :: x(:, :)
    integer, intent(in) :: corner(:, :)
    integer :: i, unit

    open (newunit=unit, file=file, action='write', status='replace')
    write (unit, '(a)') 'SOLID'
    do i = 1, size(corner, 2)
      write (unit, '(a)') '  Facet Normal 0 0 0'//char(13), char(9)//'outer loop'
      write (unit, '(a,3es16.8)') '      vertex', x(:, corner(1, i)), '      vertex', &
        x(:, corner(2, i)), '      vertex', x(:, corner(3, i))
      write (unit, '(a)') '    endloop', '  endfacet'
    end do
    write (unit, '(a)') 'endsolid'
    close (unit)
  end subroutine write_text

end program test_tool_meshes
