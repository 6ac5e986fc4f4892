! SPDX-License-Identifier: MIT
!> Clamps: what is held gets its velocity, at nodes and at faces between nodes, and the budget gets
!> just the change of momentum and the work of the clamps.
program test_clamps
  use base_kinds, only: rp
  use base_world, only: start_world, world_t
  use boundary_clamps, only: hold_walls, release_held
  use check, only: begin_tests, end_tests, expect, expect_close
  use node_samples, only: all_of, gather_nodes, map_particles, shake_nodes
  use state_budget, only: e_wall
  use state_parts, only: free_simulation, simulation_t
  use step_samples, only: add_clamp, fill, h, noise, rho, settle, shake, start_scene
  implicit none (type, external)

  real(rp), parameter :: far = 1.0e9_rp
  type(world_t) :: world

  !> Two clamps on a plate, one at each end of an axis.
  type :: grip_t
    integer :: axis = 1
    real(rp) :: face(2) = 0.0_rp             !! where they end [cells]
    logical :: held(3, 2) = .true.
    real(rp) :: v(3, 2) = 0.0_rp             !! [m/s]
    real(rp) :: fraction = 1.0_rp            !! of it that is wanted
    logical :: is_bspline = .false., scales = .false.
  end type grip_t

  call start_world(world)
  call begin_tests()
  call random_init(.true., .false.)
  call test_budget()
  call test_increments()
  call end_tests()

contains

  !> Faces on rows of nodes, between them, and with nodes of several clamps.
  type(grip_t) function draw(i) result(c)
    integer, intent(in) :: i
    real(rp) :: u(8)

    call random_number(u)
    c%axis = 1 + mod(i, 3)
    c%face = [1.0_rp, 5.0_rp]
    if (i > 3) c%face = c%face + 0.9_rp*(u(1:2) - 0.5_rp)
    c%held = reshape(u([3, 4, 5, 6, 7, 8]) > 0.3_rp, [3, 2])
    c%held(1 + mod(i, 2), 1) = .true.
    c%v = 20.0_rp*(reshape(u([8, 7, 6, 5, 4, 3]), [3, 2]) - 0.5_rp)
    if (mod(i, 4) == 3) c%fraction = u(2)
    c%is_bspline = mod(i, 3) == 1
    c%scales = mod(i, 4) == 0
  end function draw

  !> A plate six cells long with nodes of random mass, velocity and change of it.
  subroutine prepare(c, sim)
    type(grip_t), intent(in) :: c
    type(simulation_t), intent(inout) :: sim
    real(rp) :: corner(3)
    integer :: a, cells(3), i, r

    cells = 2
    cells(c%axis) = 6
    call start_scene(sim, cells, 3, 1)
    sim%scene%method%is_bspline = c%is_bspline
    sim%scene%method%scales_light_nodes = c%scales
    corner = far
    corner(c%axis) = c%face(1)
    call add_clamp(sim, [(-far, a=1, 3)], corner, c%held(:, 1), c%v(:, 1))
    corner = -far
    corner(c%axis) = c%face(2)
    call add_clamp(sim, corner, [(far, a=1, 3)], c%held(:, 2), c%v(:, 2))
    corner = [0.1_rp, 0.2_rp, -0.1_rp]
    corner(c%axis) = corner(c%axis) - 1.0_rp
    cells(c%axis) = 8
    call fill(world, sim, 1, corner, corner + cells, 2)
    call shake(sim, 0.0_rp, 0.2_rp)
    call settle(world, sim)
    call map_particles(world, sim, 0.0_rp, sim%nodes%g)
    call shake_nodes(sim%nodes, 10.0_rp, 3.0_rp, 1, sim%nodes%g(:, :, 1))
    do r = 1, sim%nodes%n_ranges             ! some nodes have little mass
      do i = sim%nodes%range(1, r), sim%nodes%range(2, r)
        associate (ijk => nint(sim%nodes%patch%position(i)/h) + 3, mass => sim%nodes%g(8, i, 1))
          mass = mass*10.0_rp**(-2.0_rp*noise(1 + sum(ijk*[1, 61, 3721]), 1))
        end associate
      end do
    end do
  end subroutine prepare

  !> Weights of the nodes of a line at the face of a clamp. A node with less than half of the mass
  !> that it would have at the end of a body counts by its mass.
  pure function weights_at(c, k, mass) result(w)
    type(grip_t), intent(in) :: c
    integer, intent(in) :: k
    real(rp), intent(in) :: mass(0:)
    real(rp) :: w(0:ubound(mass, 1))
    integer :: i

    w = [(shape_of(c, abs(c%face(k) + 3.0_rp - i)), i=0, ubound(mass, 1))]
    where (mass <= 0.0_rp) w = 0.0_rp
    associate (at_end => merge(sqrt(2.0_rp)/3.0_rp*w**1.5_rp, 0.5_rp*w**2, c%is_bspline) &
               *maxval(mass, mask=w > 0.0_rp))
      where (w > 0.0_rp) w = w*min(1.0_rp, 2.0_rp*mass/at_end)
    end associate
    w = w/max(sum(w), tiny(w))
  end function weights_at

  pure real(rp) function shape_of(c, x) result(s)
    type(grip_t), intent(in) :: c
    real(rp), intent(in) :: x                !! distance from the node [cells]

    if (.not. c%is_bspline) then
      s = max(0.0_rp, 1.0_rp - x)
    else if (x < 0.5_rp) then
      s = 0.75_rp - x**2
    else
      s = 0.5_rp*max(0.0_rp, 1.5_rp - x)**2
    end if
  end function shape_of

  !> Nodes of the grid as lines along an axis: (8, along, across).
  function lines_of(c, g) result(lines)
    type(grip_t), intent(in) :: c
    real(rp), intent(in) :: g(:, 0:, 0:, 0:)
    real(rp), allocatable :: lines(:, :, :)
    integer :: i, j, n(4)

    n = shape(g)
    allocate (lines(8, 0:n(1 + c%axis) - 1, n(2)*n(3)*n(4)/n(1 + c%axis)))
    do i = 0, n(1 + c%axis) - 1
      do j = 1, 8
        select case (c%axis)
        case (1)
          lines(j, i, :) = pack(g(j, i, :, :), .true.)
        case (2)
          lines(j, i, :) = pack(g(j, :, i, :), .true.)
        case default
          lines(j, i, :) = pack(g(j, :, :, i), .true.)
        end select
      end do
    end do
  end function lines_of

  !> Velocities held, others left; impulse of each clamp, and work by the mean velocities.
  subroutine test_budget()
    type(grip_t) :: c
    type(simulation_t) :: sim
    real(rp), allocatable :: g1(:, :, :, :), g2(:, :, :, :), one(:, :, :), two(:, :, :)
    integer :: i

    do i = 1, 18
      c = draw(i)
      call prepare(c, sim)
      call gather_nodes(world, sim, sim%nodes%g(:, :, 1), g1)
      call hold_walls(sim%scene, sim%clock, sim%nodes, c%fraction, sim%nodes%g, &
                      sim%budget%impulse, sim%budget%sums(e_wall))
      call gather_nodes(world, sim, sim%nodes%g(:, :, 1), g2)
      one = lines_of(c, g1)
      two = lines_of(c, g2)
      call expect('faces between nodes have columns', &
                  (sim%nodes%boundary%n_columns > 0) .eqv. (c%is_bspline .or. i > 3))
      call expect('all ranks have the velocities of the owners', off_owners(sim, g2) <= 0.0_rp)
      call check_held(c, sim, one, two)
      call check_budget(c, sim, one, two)
      call free_simulation(sim)
    end do
  end subroutine test_budget

  !> Largest difference of the records of nodes with mass from those of the owners.
  real(rp) function off_owners(sim, g) result(off)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: g(:, 0:, 0:, 0:)
    integer :: i, ijk(3), r

    off = 0.0_rp
    do r = 1, sim%nodes%n_ranges
      do i = sim%nodes%range(1, r), sim%nodes%range(2, r)
        ijk = nint((sim%nodes%patch%position(i) - sim%scene%grid%lower)/h)
        if (any(ijk < 0) .or. any(ijk >= sim%scene%grid%n)) cycle
        if (sim%nodes%g(8, i, 1) <= 0.0_rp) cycle
        off = max(off, maxval(abs(sim%nodes%g(:, i, 1) - g(:, ijk(1), ijk(2), ijk(3)))))
      end do
    end do
  end function off_owners

  !> What is held, at the faces and beyond; what is not. Nodes at a face share its impulse by their
  !> weights.
  subroutine check_held(c, sim, one, two)
    type(grip_t), intent(in) :: c
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: one(:, 0:, :), two(:, 0:, :)
    real(rp) :: off(5), w(0:ubound(two, 2)), want
    integer :: a, k, l, n_inside

    off = 0.0_rp
    n_inside = 0
    do l = 1, size(two, 3)
      do k = 1, 2
        w = weights_at(c, k, one(8, :, l))
        if (all(w <= 0.0_rp)) cycle
        do a = 1, 3
          want = c%fraction*c%v(a, k)
          associate (impulse => inertia_of(c, sim, one(8, :, l))*(two(a, :, l) - one(a, :, l)), &
                     is_in => one(8, :, l) > 0.0_rp .and. depth(c, k, ubound(w, 1)) &
                     > merge(1.5_rp, 1.0_rp, c%is_bspline))
            if (c%held(a, k)) then
              off(1) = max(off(1), abs(dot_product(w, two(a, :, l)) - want))
              off(2) = max(off(2), maxval(abs(two(a, :, l) - want), mask=is_in))
              off(3) = max(off(3), maxval(abs(impulse - w*dot_product(w, impulse)/sum(w**2)), &
                                          mask=w > 0.0_rp)/norm2(impulse))
              n_inside = n_inside + count(is_in)
            else
              off(4) = max(off(4), maxval(abs(two(a, :, l) - one(a, :, l)), &
                                          mask=is_in .or. w > 0.0_rp))
            end if
          end associate
        end do
      end do
      off(5) = max(off(5), maxval(abs(two(1:3, :, l) - two(5:7, :, l) - one(1:3, :, l) &
                                      + one(5:7, :, l))))
    end do
    call expect('nodes deep in a clamp', n_inside > 0)
    call expect_close('velocity at the faces', off(1), 0.0_rp, atol=1.0e-11_rp)
    call expect_close('velocity in the clamps', off(2), 0.0_rp, atol=1.0e-12_rp)
    call expect_close('shares of the impulse', off(3), 0.0_rp, atol=1.0e-11_rp)
    call expect_close('what is free stays', off(4), 0.0_rp)
    call expect_close('changes of velocity follow', off(5), 0.0_rp, atol=1.0e-11_rp)
  end subroutine check_held

  !> How deep the nodes of a line lie in a clamp [cells].
  pure function depth(c, k, n)
    type(grip_t), intent(in) :: c
    integer, intent(in) :: k, n
    real(rp) :: depth(0:n)
    integer :: i

    depth = [((c%face(k) + 3.0_rp - i)*(3 - 2*k), i=0, n)]
  end function depth

  !> Inertia of nodes against impulses [kg].
  elemental real(rp) function inertia_of(c, sim, mass) result(inertia)
    type(grip_t), intent(in) :: c
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: mass

    inertia = mass
    if (c%scales) inertia = max(mass, 0.25_rp*sim%clock%mass_scaling*rho*h**3)
    if (mass <= 0.0_rp) inertia = 0.0_rp
  end function inertia_of

  !> Impulse: change of momentum on the clamp's side of the middle; work: that times the mean of the
  !> velocities before and after the step, with forces.
  subroutine check_budget(c, sim, one, two)
    type(grip_t), intent(in) :: c
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: one(:, 0:, :), two(:, 0:, :)
    real(rp) :: given(3), inertia(0:ubound(two, 2), size(two, 3)), momentum(3), work
    integer :: a, k, n(3)

    inertia = inertia_of(c, sim, one(8, :, :))
    n = [0, 6, ubound(two, 2) + 1]
    work = 0.0_rp
    do k = 1, 2
      do a = 1, 3
        momentum(a) = sum(inertia(n(k):n(k + 1) - 1, :)*(two(a, n(k):n(k + 1) - 1, :) &
                                                         - one(a, n(k):n(k + 1) - 1, :)))
        work = work + sum(inertia(n(k):n(k + 1) - 1, :)*(two(a, n(k):n(k + 1) - 1, :) &
          - one(a, n(k):n(k + 1) - 1, :))*(two(a, n(k):n(k + 1) - 1, :) &
                                           - 0.5_rp*two(4 + a, n(k):n(k + 1) - 1, :)))
      end do
      given = all_of(world, sim%budget%impulse(:, k))
      call expect_close('impulse of a clamp', norm2(given - momentum), 0.0_rp, &
                        atol=1.0e-12_rp*norm2(momentum))
    end do
    associate (sums => all_of(world, sim%budget%sums))
      call expect_close('work of the clamps', sums(e_wall), work, rtol=1.0e-11_rp)
      call expect('nothing else is booked', count(abs(sums) > 0.0_rp) == 1)
    end associate
  end subroutine check_budget

  !> Increments of velocities: none where nodes or faces are held.
  subroutine test_increments()
    type(grip_t) :: c
    type(simulation_t) :: sim
    real(rp), allocatable :: g1(:, :, :, :), g2(:, :, :, :)
    real(rp), allocatable :: increment(:, :, :)
    integer :: i

    do i = 1, 9
      c = draw(i)
      c%scales = .false.
      c%fraction = 0.0_rp
      call prepare(c, sim)
      increment = sim%nodes%g
      call release_held(sim%scene, sim%nodes, sim%nodes%g, increment)
      call gather_nodes(world, sim, sim%nodes%g(:, :, 1), g1)
      sim%nodes%g(5:7, :, 1) = increment(5:7, :, 1)
      call gather_nodes(world, sim, sim%nodes%g(:, :, 1), g2)
      call expect('increments of all ranks', off_owners(sim, g2) <= 0.0_rp)
      g1(1:3, :, :, :) = g1(5:7, :, :, :)
      g2(1:3, :, :, :) = g2(5:7, :, :, :)
      call check_held(c, sim, lines_of(c, g1), lines_of(c, g2))
      call free_simulation(sim)
    end do
  end subroutine test_increments

end program test_clamps
