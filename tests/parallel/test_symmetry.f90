! SPDX-License-Identifier: MIT
!> Planes of symmetry: a plate at one, two or three of them does what a part of the body does that
!> is made whole by its images and has no walls.
program test_symmetry
  use base_kinds, only: rp
  use base_world, only: start_world, world_t
  use check, only: begin_tests, end_tests, expect, expect_close
  use node_samples, only: all_of, gather_nodes, gather_particles, map_particles, step_once
  use particles_store, only: f_mass, f_pos, f_tau, f_temp, f_vel
  use state_parts, only: free_simulation, simulation_t
  use state_scene, only: average_never, transfer_fmpm
  use step_constraints, only: apply_boundary
  use step_samples, only: add_plane_of_symmetry, fill, h, noise, rho, settle, &
                          start_scene
  implicit none (type, external)

  integer, parameter :: cells(3) = [2, 2, 3], margin = 5, n = 8*product(cells)
  real(rp), parameter :: dt = 5.0e-8_rp, warm = 430.0_rp   !! [s], [K]
  type(world_t) :: world

  !> Planes of symmetry around a plate.
  type :: corner_t
    logical :: is_wall(3) = .false.          !! across each axis
    logical :: faces_up(3) = .true.
    logical :: sticks = .false.              !! all components are odd
    logical :: is_bspline = .false., filters = .false.
    logical :: is_warm(3) = .false.          !! it has a temperature
    real(rp) :: lower(3) = 0.0_rp            !! corner of the plate [cells]
  end type corner_t

  call start_world(world)
  call begin_tests()
  call random_init(.true., .false.)
  call test_doubled_body()
  call end_tests()

contains

  !> Walls that the bits of `i` tell.
  type(corner_t) function draw(i) result(c)
    integer, intent(in) :: i
    real(rp) :: u(3)
    integer :: a

    call random_number(u)
    c%is_wall = [(btest(i, a - 1), a=1, 3)]
    c%faces_up = u > 0.5_rp
    c%faces_up(1 + mod(i, 3)) = .false.
    c%sticks = i > 8
    c%is_bspline = mod(i, 3) == 0
    c%filters = mod(i, 5) == 4
    call random_number(u)
    c%is_warm = u > 0.3_rp
    call random_number(u)
    c%lower = merge(-0.1_rp - 0.3_rp*u, 0.1_rp + 0.3_rp*u, c%faces_up)   ! some reach behind
    where (.not. c%is_wall) c%lower = u
  end function draw

  !> Row of nodes on a wall [cells].
  pure integer function row_of(c, a) result(row)
    type(corner_t), intent(in) :: c
    integer, intent(in) :: a

    row = merge(0, cells(a), c%faces_up(a))
  end function row_of

  !> Particles at the walls, or, without these, all images in bodies of one velocity field.
  subroutine prepare(c, has_walls, sim)
    type(corner_t), intent(in) :: c
    logical, intent(in) :: has_walls
    type(simulation_t), intent(inout) :: sim
    real(rp) :: lower(3), upper(3)
    integer :: a, b

    call start_scene(sim, cells, margin, 8)
    sim%scene%method%is_bspline = c%is_bspline
    sim%scene%method%fbar = .false.
    sim%scene%body%averaging = average_never   ! which is done for each body
    if (c%filters) then
      sim%scene%method%transfer = transfer_fmpm
      sim%scene%method%order = 3
    end if
    do a = 3, 1, -1
      if (.not. (has_walls .and. c%is_wall(a))) cycle
      call add_plane_of_symmetry(sim, a, row_of(c, a), c%faces_up(a), &
                                 c%sticks .or. [1, 2, 3] == a, merge(warm, 0.0_rp, c%is_warm(a)))
    end do
    do b = 1, 8
      if (has_walls .and. b > 1) exit
      lower = c%lower
      upper = c%lower + cells
      do a = 1, 3
        if (.not. btest(b - 1, a - 1)) cycle
        if (.not. c%is_wall(a)) exit
        lower(a) = 2*row_of(c, a) - c%lower(a) - cells(a)
        upper(a) = lower(a) + cells(a)
      end do
      if (a > 3) call fill(world, sim, b, lower, upper, 2)
    end do
    call dress(c, sim)
    call settle(world, sim)
  end subroutine prepare

  !> Mass, velocity, stress and temperature of each particle; images have those of their originals,
  !> turned round.
  subroutine dress(c, sim)
    type(corner_t), intent(in) :: c
    type(simulation_t), intent(inout) :: sim
    real(rp) :: mirror(3), s(3), x(3)
    integer :: a, b, i, p

    do b = 1, sim%particles%nblk
      do p = 1, sim%particles%count(b)
        associate (ps => sim%particles%ps(p, :, b))
          x = ps(f_pos:f_pos + 2)/h
          mirror = 1.0_rp
          s = 1.0_rp
          do a = 1, 3
            if (.not. btest(sim%particles%body(b) - 1, a - 1)) cycle
            x(a) = 2.0_rp*row_of(c, a) - x(a)
            mirror(a) = -1.0_rp
            s(a) = -s(a)
            if (c%sticks) s([1 + mod(a, 3), 1 + mod(a + 1, 3)]) = &
              -s([1 + mod(a, 3), 1 + mod(a + 1, 3)])
          end do
          i = 1 + sum(floor(2.0_rp*(x - c%lower))*[1, 61, 3721])
          ps(f_mass) = ps(f_mass)*(0.7_rp + 0.6_rp*noise(i, 0))
          ps(f_vel:f_vel + 2) = 40.0_rp*s*(noise(i, [1, 2, 3]) - 0.5_rp)
          ps(f_tau:f_tau + 5) = 2.0e9_rp*(noise(i, [4, 5, 6, 7, 8, 9]) - 0.5_rp)
          ps(f_tau:f_tau + 2) = ps(f_tau:f_tau + 2)*s*mirror
          ps(f_tau + 3:f_tau + 5) = ps(f_tau + 3:f_tau + 5)*s([1, 2, 1])*mirror([2, 3, 3])
          if (c%sticks) ps(f_tau + 3:f_tau + 5) = 0.0_rp   ! else images have no symmetric stress
          ps(f_temp) = 300.0_rp + 100.0_rp*noise(i, 10)
          do a = 1, 3
            if (mirror(a) < 0.0_rp .and. c%is_warm(a)) ps(f_temp) = 2.0_rp*warm - ps(f_temp)
          end do
        end associate
      end do
    end do
  end subroutine dress

  !> All sets of walls, across each axis, facing up and down, that glide and stick: nodes, particles
  !> after some steps, impulses of the walls.
  subroutine test_doubled_body()
    type(corner_t) :: c
    type(simulation_t) :: sim, whole
    integer :: i

    do i = 1, 15
      if (i == 8) cycle
      c = draw(i)
      call prepare(c, .true., sim)
      call prepare(c, .false., whole)
      call compare_nodes(c, sim, whole)
      call compare_steps(c, sim, whole)
      call free_simulation(sim)
      call free_simulation(whole)
    end do
  end subroutine test_doubled_body

  !> Mass, velocities and temperature; a node on a wall has the mass of the plate alone.
  subroutine compare_nodes(c, sim, whole)
    type(corner_t), intent(in) :: c
    type(simulation_t), intent(inout) :: sim, whole
    real(rp), allocatable :: g1(:, :, :, :), g2(:, :, :, :)
    real(rp) :: off(4), scale(4), share
    integer :: a, i, j, k, ijk(3), n_behind

    call map_particles(world, sim, dt, sim%nodes%g)
    call apply_boundary(sim, dt, sim%nodes%g, .false.)
    call map_particles(world, whole, dt, whole%nodes%g)
    call gather_nodes(world, sim, sim%nodes%g(:, :, 1), g1)
    call gather_nodes(world, whole, whole%nodes%g(:, :, 1), g2)
    off = 0.0_rp
    n_behind = 0
    do k = 0, ubound(g1, 4)
      do j = 0, ubound(g1, 3)
        do i = 0, ubound(g1, 2)
          if (g1(8, i, j, k) <= 1.0e-9_rp*rho*h**3) cycle
          ijk = [i, j, k] - margin
          share = 1.0_rp
          do a = 1, 3
            if (.not. c%is_wall(a)) cycle
            if (ijk(a) == row_of(c, a)) share = 0.5_rp*share
            if (ijk(a) == row_of(c, a) - merge(1, -1, c%faces_up(a))) n_behind = n_behind + 1
          end do
          scale = [norm2(g2(1:3, i, j, k)), abs(g2(4, i, j, k)), norm2(g2(5:7, i, j, k)), &
                   g2(8, i, j, k)] + [1.0_rp, 1.0_rp, 1.0_rp, 0.0_rp]
          off = max(off, [norm2(g1(1:3, i, j, k) - g2(1:3, i, j, k)), &
                          abs(g1(4, i, j, k) - g2(4, i, j, k)), &
                          norm2(g1(5:7, i, j, k) - g2(5:7, i, j, k)), &
                          abs(g1(8, i, j, k) - share*g2(8, i, j, k))]/scale)
        end do
      end do
    end do
    call expect('nodes behind the walls have mass', n_behind > 0)
    call expect_close('velocities of the nodes', off(1), 0.0_rp, atol=1.0e-9_rp)
    call expect_close('temperatures of the nodes', off(2), 0.0_rp, atol=1.0e-9_rp)
    call expect_close('their changes', off(3), 0.0_rp, atol=1.0e-9_rp)
    call expect_close('masses of the nodes', off(4), 0.0_rp, atol=1.0e-9_rp)
  end subroutine compare_nodes

  !> Whole steps: particles do the same, and the walls give what the images give.
  subroutine compare_steps(c, sim, whole)
    type(corner_t), intent(in) :: c
    type(simulation_t), intent(inout) :: sim, whole
    real(rp) :: before(f_tau + 5, n), ours(f_tau + 5, n), theirs(f_tau + 5, n), change(3)
    real(rp) :: impulse(3)
    integer :: a, i, place, step

    call gather_particles(world, sim, 1, 1, n, before)
    do step = 1, merge(1, 3, c%sticks)       ! images that stick would soon need odd stresses
      call step_once(world, sim, dt)
      call step_once(world, whole, dt)
    end do
    call gather_particles(world, sim, 1, 1, n, ours)
    call gather_particles(world, whole, 1, 1, n, theirs)
    call expect_close('places', &
                      maxval(abs(ours(f_pos:f_pos + 2, :) - theirs(f_pos:f_pos + 2, :))), 0.0_rp, &
                      atol=1.0e-12_rp*h)
    call expect_close('velocities', &
                      maxval(abs(ours(f_vel:f_vel + 2, :) - theirs(f_vel:f_vel + 2, :))), 0.0_rp, &
                      atol=1.0e-8_rp)
    call expect_close('stresses', &
                      maxval(abs(ours(f_tau:f_tau + 5, :) - theirs(f_tau:f_tau + 5, :))), 0.0_rp, &
                      atol=1.0e-2_rp)
    do a = 1, 3
      change(a) = sum([(ours(f_mass, i)*(ours(f_vel + a - 1, i) - before(f_vel + a - 1, i)), &
                        i=1, n)])
    end do
    if (c%filters) return                    ! a filter changes momentum at the ends of bodies
    impulse = change
    place = 0
    do a = 3, 1, -1
      if (.not. c%is_wall(a)) cycle
      place = place + 1
      associate (given => all_of(world, sim%budget%impulse(:, place)))
        impulse = impulse - given
        if (c%sticks) cycle
        call expect_close('impulse of a wall', given(a), change(a), rtol=1.0e-9_rp)
        call expect('across it alone', count(abs(given) > 0.0_rp) == 1)
      end associate
    end do
    where (.not. (c%is_wall .or. (c%sticks .and. any(c%is_wall)))) impulse = 0.0_rp
    call expect_close('momentum is given by walls', norm2(impulse), 0.0_rp, &
                      atol=1.0e-9_rp*norm2(change))
  end subroutine compare_steps

end program test_symmetry
