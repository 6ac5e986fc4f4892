! SPDX-License-Identifier: MIT
!> Which cubes may sleep: limits of stress by strain, by waves and by what held nodes take; what a
!> held node records.
program test_sleep
  use base_kinds, only: rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use grid_geometry, only: box_t, grade, make_grid, section_across
  use grid_grading, only: grading_t, make_grading
  use physics_material, only: material_t
  use sleep_cubes, only: cube_middle, cube_size, start_tracking, track_motion
  use sleep_held_layer, only: hold_layer, record_sleeper_impulse
  use sleep_stress, only: c_wake_requests, c_mass, c_stress, find_active_cubes, n_cube_sums, &
                          n_particle_sums
  use state_budget, only: budget_t, e_sleep
  use state_clock, only: clock_t
  use state_nodes, only: nodes_t
  use state_scene, only: scene_t
  use state_sleepers, only: m_impulse, m_mass, m_momentum, sleepers_t
  implicit none (type, external)

  integer, parameter :: n(3) = 3
  real(rp), parameter :: young = 70.0e9_rp, poisson = 0.3_rp, rho = 2700.0_rp, h = 2.0e-3_rp
  real(rp), parameter :: stress = 100.0e6_rp, tolerance = 0.02_rp, limit = tolerance*stress
  type(scene_t) :: scene
  type(clock_t) :: clock
  integer :: axis

  call begin_tests()
  call set_scene()
  call test_strain()
  call test_wave()
  call test_traction()
  call test_calls()
  do axis = 1, 3
    call grade_cells(axis)
    call test_strain()
    call test_wave()
    call test_traction()
  end do
  call set_scene()
  call test_held_node()
  call test_far_impulse()
  call end_tests()

contains

  subroutine set_scene()
    if (.not. allocated(scene%material)) allocate (scene%material(1))
    call scene%material(1)%set_elastic(young, poisson)
    scene%material(1)%rho = rho
    scene%grid = make_grid([h, h, h], [0.0_rp, 0.0_rp, 0.0_rp], spread(5*h, 1, 3))
    scene%method%sort_interval = 50
    scene%method%sleep%stress = tolerance
    clock%dt = 1.0e-6_rp
    clock%stiffness = scene%material(1)%wave_speed()**2
    clock%mass_scaling = 1.0e-20_rp            ! no waves, unless a test wants them
  end subroutine set_scene

  !> Cells that grow by a fifth from the second on.
  subroutine grade_cells(axis)
    integer, intent(in) :: axis
    type(grading_t) :: grading
    integer :: nodes
    character(:), allocatable :: message

    scene%grid = make_grid([h, h, h], [0.0_rp, 0.0_rp, 0.0_rp], spread(9*h, 1, 3))
    call make_grading(0.0_rp, 9*h, [0.0_rp, h], h, 1.2_rp, 3*h, grading, nodes, message)
    call expect('graded', len(message) == 0)
    call grade(scene%grid, axis, grading, nodes)
    associate (first => cube_size(scene%grid, [0, 0, 0]), last => cube_size(scene%grid, [2, 2, 2]))
      call expect('cubes grow', last(axis) > 1.4_rp*first(axis))
    end associate
  end subroutine grade_cells

  !> Cubes full of awake metal, the one in the middle of which bears the mean stress `stress`, with
  !> the velocity `gradient` x + `v0`.
  function cubes(gradient, v0) result(sums)
    real(rp), intent(in) :: gradient(3, 3), v0(3)
    real(rp) :: sums(n_cube_sums, n(1), n(2), n(3))
    integer :: i, j, k

    sums = 0.0_rp
    do k = 1, n(3)
      do j = 1, n(2)
        do i = 1, n(1)
          sums(c_mass, i, j, k) = 3.0_rp
          sums(n_particle_sums + m_mass, i, j, k) = 7.0_rp
          sums(n_particle_sums + m_momentum:n_particle_sums + m_momentum + 2, i, j, k) &
            = 7.0_rp*(v0 + matmul(gradient, cube_middle(scene%grid, [i, j, k] - 1) &
                     - cube_middle(scene%grid, [1, 1, 1])))
        end do
      end do
    end do
    sums(c_stress + 3, 2, 2, 2) = 3.0_rp*stress/sqrt(2.0_rp)   ! a shear stress counts twice
  end function cubes

  logical function is_active(sums, at)
    real(rp), intent(in) :: sums(n_cube_sums, n(1), n(2), n(3))
    integer, intent(in) :: at(3)
    logical :: marked(n(1), n(2), n(3))

    call find_active_cubes(scene, clock, 1.0e-4_rp, box_t([0, 0, 0], n - 1), n, sums, marked)
    is_active = marked(at(1), at(2), at(3))
  end function is_active

  !> A cube stays awake just when its elastic stress will have changed by the limit at the next
  !> sort; a rotation changes none.
  subroutine test_strain()
    real(rp) :: change(2), gradient(3, 3, 2), rate, spin(3, 3), still(3)
    integer :: a, k

    still = 0.0_rp
    rate = 1.0_rp/(scene%method%sort_interval*clock%dt)
    gradient = 0.0_rp
    gradient(2, 2, 1) = rate                   ! strain along y: lambda, lambda + 2 G, lambda
    gradient(1, 3, 2) = rate                   ! shear: G twice
    associate (lambda => scene%material(1)%lambda(), g => scene%material(1)%g)
      change = [sqrt(2.0_rp*lambda**2 + (lambda + 2.0_rp*g)**2), sqrt(2.0_rp)*g]
    end associate
    do k = 1, 2
      do a = -1, 1, 2
        associate (size_of => a*limit/change(k)*gradient(:, :, k))
          call expect('strain below the limit', &
                      .not. is_active(cubes(0.99_rp*size_of, still), [2, 2, 2]))
          call expect('strain above the limit', is_active(cubes(1.01_rp*size_of, still), [2, 2, 2]))
          call expect('one-sided at a corner', is_active(cubes(1.01_rp*size_of, still), [1, 1, 1]))
        end associate
      end do
    end do
    spin = 0.0_rp
    spin(1, 2) = rate
    spin(2, 1) = -rate
    call expect('rotation', .not. is_active(cubes(100.0_rp*limit/change(2)*spin, still), [2, 2, 2]))
  end subroutine test_strain

  !> What moves as a whole stays awake just when stopping it sends out a wave of the limit,
  !> rho c v with scaled inertia.
  subroutine test_wave()
    real(rp) :: v(3)

    clock%mass_scaling = 1.0e4_rp
    v = [0.6_rp, 0.0_rp, -0.8_rp]*limit/(rho*scene%material(1)%wave_speed()*100.0_rp)
    associate (none => reshape([0.0_rp], [3, 3], [0.0_rp]))
      call expect('wave below the limit', .not. is_active(cubes(none, 0.99_rp*v), [2, 2, 2]))
      call expect('wave above the limit', is_active(cubes(none, 1.01_rp*v), [2, 2, 2]))
    end associate
    clock%mass_scaling = 1.0e-20_rp
  end subroutine test_wave

  !> Sleepers wake just when the mean force on their held nodes is the limit over the section of
  !> their cube.
  subroutine test_traction()
    real(rp) :: impulse(3), sums(n_cube_sums, n(1), n(2), n(3))

    impulse = [0.0_rp, -0.6_rp, 0.8_rp]*limit*1.0e-4_rp
    impulse = impulse*section_across(cube_size(scene%grid, [0, 1, 2]), [0.0_rp, -0.6_rp, 0.8_rp])
    associate (none => reshape([0.0_rp], [3, 3], [0.0_rp]), first => n_particle_sums + m_impulse)
      sums = cubes(none, none(:, 1))
      sums(c_mass, 1, 2, 3) = 0.0_rp           ! all asleep
      sums(first:first + 2, 1, 2, 3) = 0.99_rp*impulse
      call expect('load below the limit', .not. is_active(sums, [1, 2, 3]))
      sums(first:first + 2, 1, 2, 3) = 1.01_rp*impulse
      call expect('load above the limit', is_active(sums, [1, 2, 3]))
    end associate
  end subroutine test_traction

  subroutine test_calls()
    real(rp) :: sums(n_cube_sums, n(1), n(2), n(3))

    associate (none => reshape([0.0_rp], [3, 3], [0.0_rp]))
      sums = cubes(none, none(:, 1))
      call expect('nobody calls', .not. is_active(sums, [1, 1, 2]))
      sums(c_wake_requests, 1, 1, 2) = 1.0_rp
      call expect('one calls', is_active(sums, [1, 1, 2]))
    end associate
  end subroutine test_calls

  !> A held node stands still; its impulse is what it had and got, the budget takes the work of that
  !> on the awake particles, and their velocity change takes their own velocity away.
  subroutine test_held_node()
    real(rp), parameter :: mass = 5.0_rp, asleep = 2.0_rp
    real(rp) :: awake_velocity(3), force_step(3), g(8, 8)
    type(budget_t) :: budget
    type(nodes_t) :: nodes
    type(sleepers_t) :: sleepers

    awake_velocity = [3.0_rp, -1.0_rp, 2.0_rp]
    force_step = [-4.0_rp, 2.0_rp, 6.0_rp]
    g = 1.0_rp
    g(1:3, 7) = (awake_velocity*(mass - asleep) + force_step)/mass
    g(5:7, 7) = force_step/mass
    g(8, 7) = mass
    sleepers%layer%held = [7]
    sleepers%layer%mass = [asleep]
    sleepers%layer%is_own = [.true.]
    allocate (sleepers%layer%impulse(3, 1))
    nodes%patch%nn = 8
    nodes%patch%stride = [4, 2, 1]
    nodes%patch%all = box_t([2, 3, 6], [3, 4, 7])
    nodes%n_ranges = 4
    nodes%range = reshape([1, 2, 1, 3, 4, 1, 5, 6, 1, 7, 8, 1], [3, 4])
    call hold_layer(scene, clock, nodes, sleepers, budget, g)
    call expect('a held node stands still', maxval(abs(g(1:3, 7))) <= 0.0_rp)
    call expect_close('its change', norm2(g(5:7, 7) + awake_velocity), 0.0_rp, atol=1.0e-12_rp)
    call expect_close('its impulse', norm2(sleepers%layer%impulse(:, 1) &
      - (awake_velocity*(mass - asleep) + force_step)), 0.0_rp, atol=1.0e-12_rp)
    call expect_close('its energy', budget%sums(e_sleep), 0.5_rp*((mass - asleep) &
      *sum(awake_velocity**2) + dot_product(force_step, awake_velocity)))
    call start_tracking(sleepers%motion, box_t([1, 1, 3], [1, 2, 3]))
    call track_motion(nodes, sleepers, 0.5_rp, g)
    associate (sums => sleepers%motion%sums)
      call expect_close('mass of the cube', sums(m_mass, 2), 0.5_rp*(3.0_rp + mass))
      call expect_close('momentum', sums(m_momentum, 2), 0.5_rp*3.0_rp)
      call expect_close('impulse of the cube', sums(m_impulse + 2, 2), &
                        awake_velocity(3)*(mass - asleep) + force_step(3))
      call expect('no impulse in the other', maxval(abs(sums(m_impulse:, 1))) <= 0.0_rp)
    end associate
  end subroutine test_held_node

  !> What walls and clamps bear of sleepers adds to their impulse, if it is known.
  subroutine test_far_impulse()
    type(sleepers_t) :: sleepers
    type(budget_t) :: budget
    real(rp) :: before(3, 2)

    allocate (budget%impulse(3, 2))
    call random_number(budget%impulse)
    before = budget%impulse
    call record_sleeper_impulse(sleepers, budget, 0.5_rp)
    call expect('nothing is known', all(abs(budget%impulse - before) <= 0.0_rp))
    allocate (sleepers%far_force(3, 2))
    call random_number(sleepers%far_force)
    call record_sleeper_impulse(sleepers, budget, 0.5_rp)
    call expect_close('impulse of sleepers', maxval(abs(budget%impulse - before &
                      - 0.5_rp*sleepers%far_force)), 0.0_rp, atol=1.0e-15_rp)
  end subroutine test_far_impulse

end program test_sleep
