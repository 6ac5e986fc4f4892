! SPDX-License-Identifier: MIT
!> Checks that a run of this scene can have written the numbers in a checkpoint (io_plausible):
!> those of the run and of a rank, the boxes of the ranks, and the particles.
module run_restart_check
  use base_kinds, only: i8, nlane, rp
  use base_text, only: str
  use contact_tool, only: n_tool_sums
  use grid_geometry, only: box_t, grid_t, halo, nearest_node
  use io_plausible, only: counts, is_between, least, most, numbers_t, speed_of_light
  use output_checkpoint, only: n_clock
  use output_diagnostics, only: field_name
  use particles_store, only: asleep, f_bbar, f_flow, f_jac, f_mass, f_plastic, f_pos, f_rate, &
                             f_temp, f_vel, layout_t, particles_t, tag_id, tag_rest, tracer_bit
  use simulation_parts, only: simulation_t
  use sleep_cubes, only: edge
  use sleep_sleepers, only: n_motion
  use state_budget, only: n_sums
  implicit none (type, external)
  private

  public :: check_boxes, check_global, check_local, check_particles

  real(rp), parameter :: strained = 1.0e6_rp   !! bound of volume ratios and their inverse

contains

  !> Check the numbers of the run, in the order of output_checkpoint.
  subroutine check_global(sim, global)
    type(simulation_t), intent(in) :: sim
    type(numbers_t), intent(inout) :: global
    real(rp) :: far, probes, time
    integer :: a, i, k, n

    n = size(global%value)
    if (n < n_clock) then
      call global%expect(n_clock, '')
      call global%finish()
      return
    end if
    time = global%value(2)
    probes = real(sim%probes%n, rp)
    far = maxval(abs(sim%scene%grid%lower)) + 1.0e9_rp*minval(sim%scene%grid%h)
    call global%expect(1, 'the step', 0.0_rp, counts)
    call global%expect(1, 'the time [s]', 0.0_rp)
    call global%expect(1, 'the length of the last step [s]', 0.0_rp)
    call global%expect(1, 'the displacement since the last sort [m]', 0.0_rp)
    call global%expect(1, 'the step of the last sort', -1.0_rp, global%value(1))
    call global%expect(1, 'the time of the last conduction step [s]', 0.0_rp, time)
    call global%expect(1, 'the largest velocity [m/s]', 0.0_rp, speed_of_light)
    call global%expect(1, 'the squared wave speed [m2/s2]', least, speed_of_light**2)
    call global%expect(1, 'the kinetic energy at t = 0 [J]', 0.0_rp)
    call global%expect(1, 'the elastic energy at t = 0 [J]')
    call global%expect(1, 'the reference energy of the balance [J]', 0.0_rp)
    call global%expect(1, 'the time of the last row [s]', 0.0_rp, time)
    call global%expect(1, 'the number of probes', probes, probes)
    call global%expect(1, 'the number of frames', 0.0_rp, real(n, rp))
    call global%expect(2, 'a squared speed of the last step [m2/s2]', 0.0_rp, speed_of_light**2)
    call global%expect(1, 'the number of refused steps', 0.0_rp, counts)
    call global%expect(1, 'the mass scaling', least)
    call global%expect(2, 'the inertial stress or the next conduction step [s]', 0.0_rp)
    call global%expect(1, 'the number of rows', 0.0_rp, counts)
    do a = 1, 6
      call global%expect(1, 'a bound of the cubes of nodes', -1.0_rp, &
                         real(sim%scene%grid%n(1 + mod(a - 1, 3))/edge + 1, rp))
    end do
    call global%expect(1, 'the time since sleep was last decided [s]', 0.0_rp)
    if (global%error%is_set()) return
    call global%expect(3*sim%probes%n, 'the position of a probe [m]', -far, far)
    call global%expect(sim%probes%n, 'the temperature of a probe [K]', least)
    call global%expect(nint(global%value(14)), 'the time of a frame [s]', 0.0_rp, time)
    call global%expect(size(sim%history%row_impulse) + size(sim%history%row_sums), &
                       'a sum at the last row')
    do k = 1, size(sim%tool)
      associate (phases => real(sim%tool(k)%n_phases + 1, rp))
        if (sim%tool(k)%drive%is_free) then
          call global%expect(1, 'the shift of a tool [m]', -far, far)
          call global%expect(1, 'the velocity of a tool [m/s]', -speed_of_light, speed_of_light)
          call global%expect(1, 'the neutral position of a tool [m]', -far, far)
          call global%expect(2, 'the force on a tool [N]')
          call global%expect(1, 'the flag of a tool that presses', 0.0_rp, 1.0_rp)
          call global%expect(1, 'the phase of a tool', 0.0_rp, phases)
          call global%expect(1, 'the force at the beginning of the phase of a tool [N]')
        end if
        if (sim%tool(k)%monitor%is_on) then
          call global%expect(4, 'the load of a tool')
          call global%expect(1, 'the phase of a tool', 1.0_rp, phases)
          call global%expect(1, 'the flag of an ended phase of a tool', 0.0_rp, 1.0_rp)
          call global%expect(1, 'the time at which a tool was stopped [s]', -1.0_rp, time)
          call global%expect(1, 'the spin of a stopped tool [rad/s]')
          call global%expect(sim%tool(k)%n_phases, 'the duration of a phase of a tool [s]', 0.0_rp)
        end if
      end associate
      call global%expect_sink(size(sim%tool(k)%heat%state()))
    end do
    do k = 1, size(sim%backing)
      do i = 1, size(sim%backing(k)%column)
        call global%expect_sink(size(sim%backing(k)%column(i)%state()))
      end do
    end do
    if (sim%tracers%n > 0) then
      call global%expect(1, 'the number of rows of the tracers', 0.0_rp, counts)
      call global%expect(size(sim%tracers%row_time), 'the time of the last row of tracers [s]', &
                         -1.0_rp, time)
      call global%expect(sim%tracers%n, 'the number of a particle', 0.0_rp, counts)
    end if
    call global%finish()
  end subroutine check_global

  !> Check the numbers of a rank, in the order of output_checkpoint.
  subroutine check_local(sim, cubes, local)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: cubes
    type(numbers_t), intent(inout) :: local

    call local%expect(n_sums, 'an energy of the balance [J]')
    call local%expect(1, 'the number of failed returns', 0.0_rp, real(huge(1), rp))
    call local%expect(size(sim%budget%warnings), 'the number of warnings', 0.0_rp)
    call local%expect(size(sim%budget%impulse), 'the impulse of a wall or clamp [N s]')
    call local%expect(n_tool_sums*size(sim%tool), 'a sum of a tool')
    call local%expect(n_motion*cubes, 'the motion of a cube of nodes')
    call local%finish()
  end subroutine check_local

  !> Whether the boxes of the ranks divide the grid.
  pure logical function check_boxes(grid, boxes) result(is_good)
    type(grid_t), intent(in) :: grid
    type(box_t), intent(in) :: boxes(:)
    type(box_t) :: both
    integer(i8) :: nodes
    integer :: i, k

    is_good = .true.
    nodes = 0
    do k = 1, size(boxes)
      if (boxes(k)%is_empty()) cycle
      is_good = is_good .and. all(boxes(k)%lo >= 0 .and. boxes(k)%hi < grid%n)
      if (.not. is_good) return
      nodes = nodes + product(int(boxes(k)%hi - boxes(k)%lo + 1, i8))
      do i = 1, k - 1
        both = boxes(i)%meet(boxes(k))
        is_good = is_good .and. both%is_empty()
      end do
    end do
    is_good = is_good .and. nodes == product(int(grid%n, i8))
  end function check_boxes

  !> Error message for the particles of this rank; '' if they are valid. Their nearest nodes must be
  !> in `box` or next to it, and unused lanes must be neutral (particles_sort).
  function check_particles(sim, box) result(text)
    type(simulation_t), intent(in) :: sim
    type(box_t), intent(in) :: box
    character(:), allocatable :: text
    real(rp) :: low(sim%particles%nf), high(sim%particles%nf)
    integer(i8), parameter :: tags = ishft(1_i8, tracer_bit + 1)
    type(box_t) :: reach
    integer :: b, f, p
    logical :: fits(nlane)

    call ranges(sim, low, high)
    reach = box%grown(1)
    text = ''
    do b = 1, sim%particles%nblk
      associate (ps => sim%particles%ps(:, :, b), tag => sim%particles%tag(:, b), &
                 n => sim%particles%count(b), body => sim%particles%body(b))
        if (n < 0 .or. n > nlane) then
          text = '/particles/count: a block of '//str(n)//' particles'
        else if (body < 1 .or. body > size(sim%scene%body)) then
          text = '/particles/body: body '//str(body)//' of '//str(size(sim%scene%body))
        else if (any(tag(:n) < 0 .or. tag(:n) >= tags) .or. any(tag_rest(tag(:n)) > asleep)) then
          text = '/particles/tag: a tag that no particle can have'
        end if
        if (text /= '') return
        do f = 1, size(low)
          fits = is_between(ps(:, f), low(f), high(f))
          if (f == f_mass) fits(n + 1:) = is_between(ps(n + 1:, f), 0.0_rp, 0.0_rp)
          if (all(fits)) cycle
          p = findloc(fits, .false., 1)
          text = '/particles/state: particle '//str(tag_id(tag(p)))//' has a '// &
                 field_name(sim%scene%layout, f)//' of '//str(ps(p, f))//', not from '// &
                 str(low(f))//' to '//str(high(f))
          if (p > n) text = '/particles/state: there is a particle behind the '//str(n)// &
                            ' of its block'
          return
        end do
        do p = 1, n
          if (reach%has(nearest_node(sim%scene%grid, ps(p, f_pos:f_pos + 2)))) cycle
          text = '/particles/state: particle '//str(tag_id(tag(p)))//' is outside the box of '// &
                 'nodes of its rank'
          return
        end do
      end associate
    end do
  end function check_particles

  !> Ranges of the fields of particles. Particles that leave the grid are removed before they are
  !> outside the patch of a rank.
  pure subroutine ranges(sim, low, high)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(out) :: low(:), high(:)

    low = -most
    high = most
    associate (grid => sim%scene%grid)
      low(f_pos:f_pos + 2) = grid%lower - halo*grid%h
      high(f_pos:f_pos + 2) = grid%upper() + halo*grid%h
    end associate
    low([f_mass, f_temp]) = least
    low([f_plastic, f_rate, f_flow]) = 0.0_rp
    low(f_jac) = 1.0_rp/strained
    high(f_jac) = strained
    low(f_vel:f_vel + 2) = -speed_of_light
    high(f_vel:f_vel + 2) = speed_of_light
    low(f_bbar:f_bbar + 5) = -strained
    low(f_bbar:f_bbar + 2) = 1.0_rp/strained
    high(f_bbar:f_bbar + 5) = strained
  end subroutine ranges

end module run_restart_check
