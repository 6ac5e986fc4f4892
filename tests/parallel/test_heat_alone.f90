! SPDX-License-Identifier: MIT
!> Heat alone as it is set up: fractions of cut cells, places of probes, stress under stirring
!> sources, with drawn dimensions against plain formulas.
program test_heat_alone
  use base_kinds, only: pi, rp
  use base_world, only: start_world, world_t
  use check, only: begin_tests, end_tests, expect, expect_close
  use heat_alone_state, only: heat_run_t, place_probes, read_probes
  use heat_curve, only: curve_t, make_property
  use heat_cut_mesh, only: cut_cells_t, cut_mesh, n_halo_planes
  use heat_integrator, only: integrator_t
  use heat_linear, only: backward_euler, by_cg, euler, rkl2, tr_bdf2
  use heat_mesh, only: heat_mesh_t
  use heat_rates, only: heat_t
  use heat_sources, only: heat_source_t, kind_disc, kind_stir
  use input_reading, only: read_input_text
  use input_values, only: input_t
  use setup_cut_cells, only: cut_cells, make_mesh
  use setup_heat_sources, only: read_heat_sources
  use setup_keys, only: key_table
  use setup_solids, only: solid_sphere, solid_t, solids_t
  implicit none (type, external)

  character(*), parameter :: nl = new_line('a')
  type(world_t) :: world

  call start_world(world)
  call begin_tests()
  call random_init(.true., .false.)
  call test_boxes()
  call test_sphere()
  call test_lines()
  call test_probes(.false.)
  call test_probes(.true.)
  call test_sources()
  call test_heat_of_sources()
  call test_steps()
  call end_tests()

contains

  !> Mesh of uneven cells of about 1.
  subroutine draw_mesh(mesh)
    type(heat_mesh_t), intent(out) :: mesh

    call mesh%init(world, lines(9), lines(7), lines(6))
  end subroutine draw_mesh

  function lines(n)
    integer, intent(in) :: n
    real(rp) :: lines(0:n)
    integer :: i

    call random_number(lines)
    lines = [(real(i, rp), i=0, n)] + 0.4_rp*lines
  end function lines

  !> Each sample along an edge of a cell between `low` and `high`, as 0 or 1: 12 on a grid, then
  !> those of the lower and the upper face.
  pure function covered(low, high, cell) result(c)
    real(rp), intent(in) :: low, high, cell(2)
    real(rp) :: c(14)
    integer :: k

    associate (part => [((k - 0.5_rp)/12.0_rp, k=1, 12), 1.0e-6_rp, 1.0_rp - 1.0e-6_rp])
      c = merge(1.0_rp, 0.0_rp, cell(1) + part*(cell(2) - cell(1)) >= low &
                .and. cell(1) + part*(cell(2) - cell(1)) < high)
    end associate
  end function covered

  !> Boxes wider than cells that lie anyhow on the mesh, two in x: a product of fractions along the
  !> axes.
  subroutine test_boxes()
    type(heat_mesh_t) :: mesh
    type(cut_cells_t) :: cuts
    type(solids_t) :: list(2)
    real(rp) :: c(14, 3), part(3), volume, face(6), worst, b(3, 2), low(3), high(3), middle
    integer :: a, draw, first, i, j, k, p
    logical :: bodies_agree

    worst = 0.0_rp
    bodies_agree = .true.
    do draw = 1, 3
      call draw_mesh(mesh)
      call random_number(low)
      call random_number(high)
      low = 0.1_rp + 1.5_rp*low
      high = mesh%n - 0.1_rp - 1.5_rp*high
      middle = mesh%x(5)
      allocate (list(1)%solid(1), list(2)%solid(1))
      list(1)%solid(1) = solid_t(lower=low, upper=[middle, high(2:3)])
      list(2)%solid(1) = solid_t(lower=[middle, low(2:3)], upper=high)
      call cut_cells(list, mesh, cuts)
      first = max(1, mesh%lo - n_halo_planes)
      do i = first, min(mesh%n(1), mesh%hi + n_halo_planes)
        if (mesh%nx == 0) exit
        p = i - first + 1
        do j = 1, mesh%n(2)
          do k = 1, mesh%n(3)
            b = mesh%box(i, j, k)
            do a = 1, 3
              c(:, a) = covered(low(a), high(a), b(a, :))
            end do
            part = sum(c(:12, :), dim=1)/12.0_rp
            volume = product(part)
            do a = 1, 3
              face(2*a - 1:2*a) = c(13:14, a)*product(part, mask=[1, 2, 3] /= a)
            end do
            worst = max(worst, abs(cuts%volume(k, j, p) - volume), &
                        maxval(abs(cuts%face(:, k, j, p) - face)))
            if (volume > 0.0_rp) then
              bodies_agree = bodies_agree .and. cuts%body(k, j, p) == merge(1, 2, i <= 5)
            else if (any(maxval(c, dim=1) <= 0.0_rp)) then
              bodies_agree = bodies_agree .and. cuts%body(k, j, p) == 0
            end if
          end do
        end do
      end do
      deallocate (list(1)%solid, list(2)%solid)
    end do
    call expect_close('boxes: fractions', worst, 0.0_rp, atol=1.0e-12_rp)
    call expect('boxes: bodies', bodies_agree)
  end subroutine test_boxes

  !> A ball, of which another is taken away: volume, and centre of the volume in all own cells.
  subroutine test_sphere()
    type(heat_mesh_t) :: mesh
    type(cut_cells_t) :: cuts
    type(solids_t) :: list(1)
    real(rp), parameter :: centre(3) = [4.4_rp, 3.6_rp, 3.1_rp], away(3) = [4.1_rp, 3.6_rp, 3.4_rp]
    real(rp) :: b(3, 2), moments(0:3), want(0:3), v
    integer :: i, j, k

    call draw_mesh(mesh)
    allocate (list(1)%solid(2))
    list(1)%solid(1) = solid_t(kind=solid_sphere, centre=centre, radius=2.7_rp)
    list(1)%solid(2) = solid_t(kind=solid_sphere, centre=away, radius=1.6_rp, adds=.false.)
    call cut_cells(list, mesh, cuts)
    moments = 0.0_rp
    do i = mesh%lo, mesh%hi
      do j = 1, mesh%n(2)
        do k = 1, mesh%n(3)
          b = mesh%box(i, j, k)
          v = cuts%volume(k, j, i - max(1, mesh%lo - n_halo_planes) + 1)*product(b(:, 2) - b(:, 1))
          moments = moments + v*[1.0_rp, 0.5_rp*sum(b, dim=2)]
        end do
      end do
    end do
    call world%sum(moments)
    want = 4.0_rp*pi/3.0_rp*(2.7_rp**3*[1.0_rp, centre] - 1.6_rp**3*[1.0_rp, away])
    call expect_close('balls: volume', moments(0), want(0), rtol=2.0e-3_rp)
    call expect_close('balls: centre', maxval(abs(moments(1:3)/moments(0) - want(1:3)/want(0))), &
                      0.0_rp, atol=0.02_rp)
  end subroutine test_sphere

  !> Mesh lines: from end to end, on the faces of both boxes and of the one that is taken away, and
  !> cells of h within a quarter.
  subroutine test_lines()
    type(heat_mesh_t) :: mesh
    type(solids_t) :: list(2)
    type(solid_t) :: s
    real(rp), parameter :: h(3) = [0.5_rp, 0.4_rp, 0.3_rp]
    integer :: a, k
    logical :: ok

    allocate (list(1)%solid(2), list(2)%solid(1))
    list(1)%solid = [solid_t(lower=[1.0_rp, 2.0_rp, 3.0_rp], upper=[6.2_rp, 7.3_rp, 8.4_rp]), &
                     solid_t(lower=[2.1_rp, 3.3_rp, 4.7_rp], upper=[4.2_rp, 5.1_rp, 6.3_rp], &
                             adds=.false.)]
    list(2)%solid = [solid_t(lower=[6.2_rp, 1.2_rp, 0.8_rp], upper=[9.1_rp, 5.9_rp, 9.9_rp])]
    call make_mesh(world, h, list, mesh)
    do a = 1, 3
      ok = .true.
      associate (x => pick(mesh, a), n => mesh%n(a))
        do k = 1, 3
          s = list(2)%solid(1)
          if (k < 3) s = list(1)%solid(k)
          ok = ok .and. minval(abs(x - s%lower(a))) <= 0.0_rp &
                 .and. minval(abs(x - s%upper(a))) <= 0.0_rp
        end do
        ok = ok .and. all(abs(x(2:) - x(:n) - h(a)) <= 0.25_rp*h(a)) .and. size(x) == n + 1
        ok = ok .and. abs(x(1) - min(list(1)%solid(1)%lower(a), list(2)%solid(1)%lower(a))) &
             <= 0.0_rp
      end associate
      call expect('mesh lines of axis '//achar(iachar('w') + a), ok)
    end do
  end subroutine test_lines

  function pick(mesh, a) result(x)
    type(heat_mesh_t), intent(in) :: mesh
    integer, intent(in) :: a
    real(rp), allocatable :: x(:)

    select case (a)
    case (1)
      x = mesh%x
    case (2)
      x = mesh%y
    case default
      x = mesh%z
    end select
  end function pick

  !> Probes anywhere in a mesh, with `holes` and without, read a linear field exactly (the small
  !> regularization of the plane: to 1e-7), one on a wall that extrapolates too.
  subroutine test_probes(holes)
    logical, intent(in) :: holes
    type(heat_run_t) :: run
    integer, parameter :: n = 40
    real(rp), parameter :: slope(3) = [3.0_rp, -5.0_rp, 7.0_rp]
    real(rp) :: x(3, n), t(n), upper(3), u
    integer :: c, i, j, k

    associate (mesh => run%heat%mesh)
      call draw_mesh(mesh)
      allocate (mesh%capacity(mesh%np*mesh%nx), source=1.0_rp)
      allocate (run%heat%theta(1 - mesh%np:mesh%np*(mesh%nx + 1)), source=huge(1.0_rp))
      do c = 1, mesh%np*mesh%nx
        run%heat%theta(c) = 300.0_rp + dot_product(slope, mesh%centre(c))
        call mesh%place(c, i, j, k)
        if (holes .and. mod(i + 2*j + 3*k, 7) == 0) mesh%capacity(c) = 0.0_rp
        if (mesh%capacity(c) <= 0.0_rp) run%heat%theta(c) = -1.0e6_rp
      end do
      upper = [mesh%x(mesh%n(1)), mesh%y(mesh%n(2)), mesh%z(mesh%n(3))]
      call random_number(x)
      x = spread([mesh%x(0), mesh%y(0), mesh%z(0)], 2, n)*(1.0_rp - x) + spread(upper, 2, n)*x
      x(2, 1) = mesh%y(0)
      x(3, 2) = upper(3)
    end associate
    call place_probes(world, x, run)
    call read_probes(world, run, t)
    u = maxval(abs(t - 300.0_rp - matmul(slope, x)))
    call expect_close(merge('probes beside holes', 'probes             ', holes), u, 0.0_rp, &
                      atol=merge(1.0e-5_rp, 1.0e-9_rp, holes))
  end subroutine test_probes

  !> Spin, share of the heat and shear stress of stirring sources: sticking by a table or by two
  !> pieces, sliding, the lesser of both, and a mixture.
  subroutine test_sources()
    real(rp), parameter :: piece(5, 2) = reshape([30.0e6_rp, 330.0e6_rp, 600.0_rp, 10.0_rp, &
      670.0_rp, -12.0e6_rp, 390.0e6_rp, 610.0_rp, 9.0_rp, 910.0_rp], [5, 2])
    real(rp), parameter :: table_t(3) = [300.0_rp, 500.0_rp, 900.0_rp], &
                           table_y(3) = [300.0e6_rp, 260.0e6_rp, 40.0e6_rp]
    real(rp), parameter :: melting = 1300.0_rp, k_body = 390.0_rp, c_body = 3.4e6_rp
    type(heat_source_t), allocatable :: source(:)
    type(input_t) :: input
    character(40), parameter :: no_sets(0) = ''
    real(rp) :: stick, slide, t, want(4), worst, e(2)
    integer :: i, j, k, p

    do j = 1, 2
      call read_input_text(key_table(), 't.nml', scene(j), no_sets, input)
      if (input%diagnostics%count() > 0) call input%diagnostics%print(6)
      call read_heat_sources(input, 1, k_body, c_body, source)
      e = sqrt([k_body*c_body, 14.4_rp*7800.0_rp*460.0_rp])
      call expect_close('spin of a source', source(1)%spin, e(1)/sum(e)*2.0_rp*pi*900.0_rp/60.0_rp)
      call expect_close('given share', source(2)%spin, 0.7_rp*2.0_rp*pi*900.0_rp/60.0_rp)
      slide = 0.3_rp*400.0e6_rp
      worst = 0.0_rp
      do k = 1, 48
        t = 27.25_rp*k
        stick = 0.0_rp
        if (j == 1) then
          stick = table_y(1)
          do p = 1, 2
            stick = stick + (table_y(p + 1) - table_y(p)) &
                    *max(0.0_rp, min(1.0_rp, (t - table_t(p))/(table_t(p + 1) - table_t(p))))
          end do
          stick = stick*max(0.0_rp, min(1.0_rp, (melting - t)/(0.05_rp*melting)))
        else
          do p = 2, 1, -1
            if (t <= piece(5, p)) stick = max(0.0_rp, piece(1, p) + (piece(2, p) - piece(1, p)) &
                                              /(1.0_rp + (t/piece(3, p))**piece(4, p)))
          end do
        end if
        stick = stick/sqrt(3.0_rp)
        want = [stick, slide, min(stick, slide), 0.4_rp*slide + 0.6_rp*stick]
        do i = 1, 4
          worst = max(worst, abs(source(i)%shear%at(t) - want(i)))
        end do
      end do
      call expect_close('stress under sources', worst, 0.0_rp, atol=1.0_rp)
    end do
  end subroutine test_sources

  !> Heat of two faces under a disc: shares of its power, and with shear the solution of
  !> T_s = T + q d/k with q = spin r tau(T_s), and its slope.
  subroutine test_heat_of_sources()
    type(heat_source_t) :: disc, s
    type(heat_mesh_t) :: mesh
    real(rp), parameter :: moment(4) = [1.0_rp, 2.0_rp, 1.5_rp, 4.0_rp]
    real(rp) :: part, t, power, slope, m1, at, low, high, other, unused, want
    integer :: i, k

    disc%kind = kind_disc
    disc%power = 80.0_rp
    disc%moment = spread(moment, 2, 1)
    disc%total = [3.0_rp, 5.0_rp]
    call disc%heat_of(1, 0.25_rp, 500.0_rp, 0.1_rp, power, slope)
    call expect_close('power of a part of a disc', power, 0.75_rp*80.0_rp/3.0_rp &
                      + 0.25_rp*80.0_rp*1.5_rp/5.0_rp)
    allocate (mesh%wall(0))
    s%kind = kind_stir
    s%spin = 2.0_rp
    s%shear = curve_t(0.0_rp, 10.0_rp, [(500.0_rp/(1.0_rp + (i/60.0_rp)**4), i=0, 100)])
    call s%find_walls(mesh)
    s%moment = spread(moment, 2, 1)
    s%insulance = [0.7_rp]
    do k = 1, 40
      call random_number(part)
      call random_number(t)
      t = 900.0_rp*t
      m1 = (1.0_rp - part)*moment(2) + part*moment(4)
      call s%heat_of(1, part, t, 0.1_rp, power, slope)
      low = t
      high = t + 1.0e4_rp
      do i = 1, 60
        at = 0.5_rp*(low + high)
        if (at > t + 0.07_rp*s%spin*m1*s%shear%at(at)) then
          high = at
        else
          low = at
        end if
      end do
      want = s%spin*m1*s%shear%at(at)
      call expect_close('heat of a stirred face', power, want, rtol=1.0e-9_rp)
      call s%heat_of(1, part, t + 1.0e-4_rp, 0.1_rp, other, unused)
      if (abs(nint(0.1_rp*at) - 0.1_rp*at) > 1.0e-3_rp) then
        call expect_close('its slope', (other - power)*1.0e4_rp, slope, rtol=1.0e-4_rp)
      end if
    end do
  end subroutine test_heat_of_sources

  !> Insulated block in which a mode decays: each integrator multiplies it by its stability function
  !> in every step; the next step follows from the error of the last, which implicit ones filter by
  !> a solution to 0.1.
  subroutine test_steps()
    type(heat_t) :: heat
    type(integrator_t) :: step
    integer, parameter :: method(4) = [euler, backward_euler, rkl2, tr_bdf2], steps = 5
    real(rp), parameter :: h = 0.1_rp, diffusivity = 0.5_rp, most = 50.0_rp
    real(rp) :: decay, dt, error, factor, gamma, mean, t, x(3), y(2), z
    real(rp), allocatable :: mode(:)
    integer :: c, i, k, s

    decay = 4.0_rp*diffusivity/h**2*sum(sin(0.5_rp*pi*[2.0_rp/12.0_rp, 1.0_rp/5.0_rp])**2)
    gamma = 2.0_rp - sqrt(2.0_rp)
    do k = 1, 8
      call make_block(heat)
      mode = [(0.0_rp, c=1, heat%size())]
      do c = 1, heat%size()
        x = heat%mesh%centre(c)/h
        mode(c) = most*cos(2.0_rp*pi*x(1)/12.0_rp)*cos(pi*x(3)/5.0_rp)
      end do
      mean = 300.0_rp
      heat%theta(1:heat%size()) = mean + mode
      i = 1 + modulo(k - 1, 4)
      dt = 2.0_rp/decay
      if (method(i) == euler) dt = 0.7_rp/heat%max_decay_rate
      if (method(i) == rkl2) dt = 0.35_rp/decay
      z = dt*decay
      s = max(3, ceiling(0.5_rp*(sqrt(9.0_rp + 8.0_rp*dt*heat%max_decay_rate/0.95_rp) - 1.0_rp)))
      error = 0.0_rp
      select case (method(i))
      case (euler)
        factor = 1.0_rp - z
      case (backward_euler)
        factor = 1.0_rp/(1.0_rp + z)
        error = 0.5_rp*z*(1.0_rp - factor)/(1.0_rp + z)
      case (rkl2)
        associate (b => real(s*s + s - 2, rp)/real(2*s*(s + 1), rp))
          factor = 1.0_rp - b + b*legendre(s, 1.0_rp - 4.0_rp*z/real(s*s + s - 2, rp))
        end associate
        error = abs(0.8_rp*(1.0_rp - factor) - 0.4_rp*z*(1.0_rp + factor))
      case default
        y(1) = (1.0_rp - 0.5_rp*gamma*z)/(1.0_rp + 0.5_rp*gamma*z)
        factor = (y(1) - (1.0_rp - gamma)**2)/(gamma*(2.0_rp - gamma))
        factor = factor/(1.0_rp + (1.0_rp - gamma)/(2.0_rp - gamma)*z)
        error = z/3.0_rp*abs(sqrt(2.0_rp) - 1.0_rp - y(1) + gamma*factor)/(1.0_rp + 0.5_rp*gamma*z)
      end select
      step = integrator_t(method=method(i))
      step%implicit%solver = by_cg
      step%implicit%tolerance = 1.0e-11_rp
      t = 0.0_rp
      y = maxval(abs(mode))
      call world%max(y)
      if (k <= 4) then
        step%fixed = dt
        call step%start(heat)
        do c = 1, steps
          call step%advance(heat, t, 1.0e9_rp*dt)
        end do
        call expect_close('time of the steps', t, steps*dt, rtol=1.0e-8_rp)
        y(1) = maxval(abs(heat%theta(1:heat%size()) - mean - factor**steps*mode))
        call expect_close('a mode after some steps', y(1), 0.0_rp, atol=1.0e-8_rp*most)
      else if (method(i) /= euler) then
        step%next = dt
        step%tolerance = 1.5_rp*error*y(1)
        call step%start(heat)
        call step%advance(heat, t, 1.0e9_rp*dt)
        call expect('a step that is good enough', step%steps == 1 .and. step%refused == 0)
        call expect_close('the next step', step%next, 0.8_rp*dt*1.5_rp**(1.0_rp/merge(2.0_rp, &
                          3.0_rp, method(i) == backward_euler)), rtol=merge(1.0e-6_rp, &
                          0.06_rp, method(i) == rkl2))
      end if
    end do
  end subroutine test_steps

  !> Insulated block of 12 x 4 x 5 cells.
  subroutine make_block(heat)
    type(heat_t), intent(out) :: heat
    real(rp), parameter :: h = 0.1_rp
    type(solids_t) :: list(1)
    type(cut_cells_t) :: cuts
    real(rp) :: none(6, 1)

    allocate (list(1)%solid(1), heat%source(0))
    list(1)%solid(1) = solid_t(upper=h*[12.0_rp, 4.0_rp, 5.0_rp])
    call make_mesh(world, [h, h, h], list, heat%mesh)
    call cut_cells(list, heat%mesh, cuts)
    heat%conductivity = [3.0_rp]
    heat%property = make_property(2.0_rp, [298.0_rp], [3.0_rp], [298.0_rp], [3.0_rp])
    call cut_mesh(heat%mesh, cuts, heat%property, heat%conductivity, [6.0_rp])
    none = 0.0_rp
    call heat%add_films(none, none, none)
    call heat%prepare(world)
  end subroutine make_block

  !> Legendre polynomial by its recurrence.
  pure real(rp) function legendre(n, x) result(p)
    integer, intent(in) :: n
    real(rp), intent(in) :: x
    real(rp) :: before, next
    integer :: j

    before = 1.0_rp
    p = x
    do j = 2, n
      next = ((2*j - 1)*x*p - (j - 1)*before)/j
      before = p
      p = next
    end do
  end function legendre

  !> A plate under four stirring sources, with a table (`j` = 1) or pieces.
  function scene(j)
    integer, intent(in) :: j
    character(8), parameter :: mode(4) = ['sticking', 'sliding ', 'limited ', 'mixed   ']
    character(:), allocatable :: scene
    integer :: i

    scene = '&GRID CELL=1 LOWER=3*0 UPPER=3*9 /'//nl//'&TIME END=1 /'//nl// &
            '&METHOD MECHANICS=F /'//nl//'&HEAT /'//nl// &
            "&BODY NAME='b' MATERIAL='m' /"//nl//"&SHAPE BODY='b' LOWER=3*0 UPPER=3*1 /"//nl// &
            "&MATERIAL NAME='m' DENSITY=1 YOUNGS_MODULUS=1 POISSON_RATIO=0 SPECIFIC_HEAT=1 "// &
            'CONDUCTIVITY=1 T_MELT=1300 '
    if (j == 1) then
      scene = scene//'YIELD_TABLE=300,300e6 500,260e6 900,40e6 /'//nl
    else
      scene = scene//'YIELD_LOGISTIC=30e6,330e6,600,10,670 -12e6,390e6,610,9,910 /'//nl
    end if
    do i = 1, 4
      scene = scene//"&SOURCE KIND='stir' POSITION=3*0 RADIUS=1 SPIN_RPM=900 CONTACT='"// &
              trim(mode(i))//"'"
      if (i == 2) scene = scene//' SHARE=0.7'
      if (i > 1) scene = scene//' FRICTION=0.3 PRESSURE=400e6'
      if (i == 4) scene = scene//' SLIP=0.4'
      scene = scene//' /'//nl
    end do
  end function scene

end program test_heat_alone
