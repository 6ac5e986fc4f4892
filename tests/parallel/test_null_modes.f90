! SPDX-License-Identifier: MIT
!> Removal of null modes: what no node sees goes, what nodes see stays, momentum is kept.
program test_null_modes
  use base_kinds, only: rp
  use check, only: begin_tests, end_tests, expect, expect_close
  use comm_world, only: start_world, world_t
  use node_samples, only: gather_nodes, gather_particles, map_particles
  use particles_store, only: f_mass, f_pos, f_vel
  use step_null_modes, only: remove_null_modes
  use step_samples, only: add_plane_of_symmetry, fill, h, make_flow, rho, settle, shake, start_scene
  use step_simulation, only: free_simulation, simulation_t
  implicit none (type, external)

  integer, parameter :: margin = 3
  type(world_t) :: world

  call start_world(world)
  call begin_tests()
  call test_alternating()
  call test_seen()
  call test_momentum()
  call test_elastic()
  call end_tests()

contains

  !> Removal from the present velocities, whose nodal records are made first.
  subroutine remove(sim)
    type(simulation_t), intent(inout) :: sim

    call map_particles(world, sim, 0.0_rp, sim%nodes%g)
    call remove_null_modes(world, sim)
  end subroutine remove

  !> A block of 2 particles a cell and direction that may flow, on a periodic grid or a free one.
  subroutine prepare(sim, cells, is_periodic, flows)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: cells(3)
    logical, intent(in) :: is_periodic, flows

    call start_scene(sim, cells, margin, 1, spread(is_periodic, 1, 3))
    if (flows) call make_flow(sim, 1.0e8_rp)
    sim%scene%method%null_steps = 1
    call sim%scene%layout%add(3, sim%scene%layout%seen)
    sim%clock%mass_scaling = 3.0_rp
    call fill(world, sim, 1, [0.0_rp, 0.0_rp, 0.0_rp], real(cells, rp), 2)
  end subroutine prepare

  !> On an even lattice velocities that alternate from particle to particle go to nothing at once,
  !> and leave a common velocity.
  subroutine test_alternating()
    real(rp), parameter :: common = 2.0_rp, amplitude = 5.0_rp
    type(simulation_t) :: sim
    real(rp) :: worst(1)
    integer :: b, p

    call prepare(sim, [6, 6, 6], .true., .true.)
    do b = 1, sim%particles%nblk
      do p = 1, sim%particles%count(b)
        associate (ps => sim%particles%ps(p, :, b))
          ps(f_vel:f_vel + 2) = common + merge(amplitude, -amplitude, &
            mod(sum(floor(2.0_rp*ps(f_pos:f_pos + 2)/h)), 2) == 0)
        end associate
      end do
    end do
    call settle(world, sim)
    call remove(sim)
    worst = 0.0_rp
    do b = 1, sim%particles%nblk
      associate (n => sim%particles%count(b))
        worst = max(worst(1), maxval(abs(sim%particles%ps(:n, f_vel:f_vel + 2, b) - common)))
      end associate
    end do
    call world%max(worst)
    call expect_close('an alternating velocity', worst(1), 0.0_rp, atol=1.0e-12_rp)
    call free_simulation(sim)
  end subroutine test_alternating

  !> Shear of a free block that stands on a plane of symmetry: by one term of the series removal
  !> drags at its surfaces, later ones leave the velocities of the nodes as they are.
  subroutine test_seen()
    integer, parameter :: often = 40
    type(simulation_t) :: sim
    real(rp), allocatable :: before(:, :, :, :), after(:, :, :, :)
    real(rp), allocatable :: kept(:, :, :)
    real(rp) :: change(often), first
    integer :: b, i, p

    call prepare(sim, [4, 4, 4], .false., .true.)
    call add_plane_of_symmetry(sim, 3, 0, .true., [.true., .true., .true.])
    do b = 1, sim%particles%nblk
      do p = 1, sim%particles%count(b)
        associate (ps => sim%particles%ps(p, :, b))
          ps(f_vel:f_vel + 2) = [ps(f_pos + 2)/h, 0.0_rp, 0.0_rp]
        end associate
      end do
    end do
    call settle(world, sim)
    call map_particles(world, sim, 0.0_rp, sim%nodes%g)
    call gather_nodes(world, sim, sim%nodes%g(:, :, 1), before)
    allocate (kept, source=sim%particles%ps(:, :, :sim%particles%nblk))
    call remove_null_modes(world, sim)
    call map_particles(world, sim, 0.0_rp, sim%nodes%g)
    call gather_nodes(world, sim, sim%nodes%g(:, :, 1), after)
    first = largest(after - before, before)
    sim%particles%ps(:, :, :sim%particles%nblk) = kept
    sim%clock%step = 10                        ! not the first removal
    do i = 1, often
      call map_particles(world, sim, 0.0_rp, sim%nodes%g)
      call gather_nodes(world, sim, sim%nodes%g(:, :, 1), before)
      call remove_null_modes(world, sim)
      call map_particles(world, sim, 0.0_rp, sim%nodes%g)
      call gather_nodes(world, sim, sim%nodes%g(:, :, 1), after)
      change(i) = largest(after - before, before)
    end do
    call expect('one term drags', change(1) > 1.0e-2_rp)
    call expect_close('later ones do not', change(often), 0.0_rp, atol=0.02_rp*change(1))
    call expect_close('nor does the first removal of a run', first, 0.0_rp, atol=0.02_rp*change(1))
    call free_simulation(sim)
  end subroutine test_seen

  !> Largest change of velocity along x of nodes with mass.
  pure real(rp) function largest(change, records)
    real(rp), intent(in) :: change(:, :, :, :), records(:, :, :, :)

    largest = maxval(abs(change(1, :, :, :)), mask=records(8, :, :, :) > 0.1_rp*rho*h**3)
  end function largest

  !> Noise loses energy and no momentum, by one removal and by many.
  subroutine test_momentum()
    integer, parameter :: cells(3) = [3, 2, 2], n = 8*product(cells)
    type(simulation_t) :: sim
    real(rp) :: energy(0:20), momentum(3, 0:20), ps(f_vel + 2, n)
    integer :: a, i

    call prepare(sim, cells, .false., .true.)
    call shake(sim, 10.0_rp, 0.3_rp)
    call settle(world, sim)
    sim%clock%step = 10
    do i = 0, 20
      if (i > 0) call remove(sim)
      call gather_particles(world, sim, 1, 1, n, ps)
      do a = 1, 3
        momentum(a, i) = sum(ps(f_mass, :)*ps(f_vel + a - 1, :))
      end do
      energy(i) = sum(ps(f_mass, :)*sum(ps(f_vel:f_vel + 2, :)**2, dim=1))
    end do
    call expect_close('momentum', norm2(momentum(:, 20) - momentum(:, 0)), 0.0_rp, &
                      atol=1.0e-12_rp*sum(ps(f_mass, :))*10.0_rp)
    call expect('noise loses most of its energy', energy(1) < 0.5_rp*energy(0))
    call expect('and never gains any', all(energy(1:) <= energy(:19)*(1.0_rp + 1.0e-12_rp)))
    call free_simulation(sim)
  end subroutine test_momentum

  !> Bodies that cannot flow keep their velocities to the bit.
  subroutine test_elastic()
    integer, parameter :: cells(3) = [3, 2, 2], n = 8*product(cells)
    type(simulation_t) :: sim
    real(rp) :: before(3, n), after(3, n)

    call prepare(sim, cells, .false., .false.)
    call shake(sim, 10.0_rp, 0.3_rp)
    call settle(world, sim)
    call gather_particles(world, sim, 1, f_vel, n, before)
    call remove(sim)
    call gather_particles(world, sim, 1, f_vel, n, after)
    call expect('an elastic body', all(abs(after - before) <= 0.0_rp) &
                .and. sum(abs(after)) > 0.0_rp)
    call free_simulation(sim)
  end subroutine test_elastic

end program test_null_modes
