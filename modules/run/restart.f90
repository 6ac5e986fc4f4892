! SPDX-License-Identifier: MIT
!> Restart from a checkpoint.
module run_restart
  use base_errors, only: error_t
  use base_kinds, only: rp
  use base_text, only: str
  use comm_world, only: world_t
  use grid_geometry, only: box_t
  use io_checkpoint, only: read_checkpoint
  use io_plausible, only: numbers_t
  use output_checkpoint, only: pass_numbers, pass_sums
  use particles_migrate, only: find_outside
  use particles_store, only: awake, particles_t, set_rest, tag_rest
  use run_balance, only: find_reach, first_partition, store_nodes
  use run_debris, only: remove_debris
  use run_regrid, only: relist, sort_particles
  use run_restart_check, only: check_boxes, check_particles
  use simulation_parts, only: simulation_t
  use sleep_motion, only: start_tracking
  use state_run, only: motion_t, outcome_t
  implicit none (type, external)
  private

  public :: resume

contains

  !> Fill a simulation, whose scene is set up, with the state of a checkpoint.
  subroutine resume(sim, path, error)
    type(simulation_t), intent(inout) :: sim
    character(*), intent(in) :: path
    type(error_t), intent(inout) :: error
    type(box_t), allocatable :: boxes(:)
    character(:), allocatable :: message, wrong
    type(numbers_t) :: of_run, of_rank
    type(box_t) :: cubes
    real(rp) :: last(2), time
    logical :: same_ranks
    integer :: plain

    call read_checkpoint(sim%world, path, sim%particles, boxes, of_run%value, of_rank%value, &
                         same_ranks, error)
    if (error%is_set()) return
    associate (layout => sim%scene%layout)   ! sleeping may change, and with it the last field
      plain = layout%n - merge(1, 0, layout%rest > 0)
      if (all(sim%particles%nf /= [plain, plain + 1])) call error%raise(path// &
        ': /particles/state: '//str(sim%particles%nf)//' fields, not '//str(plain))
    end associate
    of_run%place = '/global'
    call pass_numbers(sim, last, of_run)
    call of_run%finish()
    if (of_run%error%is_set()) call error%raise(path//': '//of_run%error%message)
    if (error%is_set()) return
    sim%step%last = outcome_t(last(1), last(2))
    call sim%particles%change_fields(sim%scene%layout%n)
    of_rank%place = '/ranks/local'
    associate (motion => sim%sleepers%motion)
      cubes = motion%box
      time = motion%time
      if (cubes%count() > 0) call start_tracking(motion, cubes)
      motion%time = time
      call pass_sums(sim, of_rank)
      call of_rank%finish()
      if (.not. sim%scene%method%sleep%is_on .or. cubes%count() == 0) motion = motion_t()
    end associate
    if (of_rank%error%is_set()) then
      wrong = of_rank%error%message
    else if (.not. same_ranks) then
      wrong = check_particles(sim, box_t([0, 0, 0], sim%scene%grid%n - 1))
    else if (check_boxes(sim%scene%grid, boxes)) then
      wrong = check_particles(sim, boxes(sim%world%rank))
    else
      wrong = '/ranks/boxes: they do not divide the grid'
    end if
    call sim%world%share_message(wrong, message)
    if (message /= '') call error%raise(path//': '//message)
    if (error%is_set()) return
    call check_outside(sim, path, same_ranks, error)
    if (error%is_set()) return
    call sim%tool%move_to(sim%clock%time)
    if (.not. sim%scene%method%sleep%is_on) call wake_all(sim%world, sim%particles, same_ranks)
    if (same_ranks) then
      call move_alloc(boxes, sim%exchange%boxes)
      call find_reach(sim)
      call store_nodes(sim)
      call relist(sim, .false., .false.)
    else
      call first_partition(sim)
      call sort_particles(sim, .true.)
    end if
  end subroutine resume

  !> Collective. Raise an error if particles are outside the grid, unless they are debris: debris is
  !> removed at the next sort, or here if the number of ranks has changed.
  subroutine check_outside(sim, path, same_ranks, error)
    type(simulation_t), intent(inout) :: sim
    character(*), intent(in) :: path
    logical, intent(in) :: same_ranks
    type(error_t), intent(inout) :: error
    character(:), allocatable :: outside, reason

    call sim%world%share_message(find_outside(sim%scene%grid, sim%particles%nblk, sim%particles), &
                                 outside)
    if (outside == '' .or. (same_ranks .and. sim%scene%method%debris > 0.0_rp)) return
    if (remove_debris(sim, reason)) return
    call error%raise(path//': '//outside//'; '//reason)
  end subroutine check_outside

  !> Collective, in a run without sleeping. Wake all particles; they are no longer `in_order` if
  !> some slept.
  subroutine wake_all(world, particles, in_order)
    type(world_t), intent(in) :: world
    type(particles_t), intent(inout) :: particles
    logical, intent(inout) :: in_order
    logical :: were_awake

    associate (tag => particles%tag(:, :particles%nblk))
      were_awake = world%all_true(all(tag_rest(tag) == awake))
      in_order = in_order .and. were_awake
      tag = set_rest(tag, awake)
    end associate
  end subroutine wake_all

end module run_restart
