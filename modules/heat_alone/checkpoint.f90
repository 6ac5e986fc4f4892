! SPDX-License-Identifier: MIT
!> Writing and reading of checkpoints of heat-only runs.
module heat_alone_checkpoint
  use base_errors, only: error_t
  use base_kinds, only: i8, rp
  use heat_alone_state, only: heat_run_t
  use heat_solvers_integrator, only: n_kept
  use heat_solvers_rates, only: n_books
  use io_checkpoint, only: notes_t, read_heat_checkpoint, write_heat_checkpoint
  use io_plausible, only: counts, is_between, least, most, numbers_t
  use output_checkpoint, only: make_notes
  use state_scene, only: output_t, scene_t
  implicit none (type, external)
  private

  public :: heat_checkpoint_path, resume_heat, save_heat

  integer, parameter :: n_global = 13   !! numbers before the frame times

contains

  !> File of the latest checkpoint of a heat-only run.
  pure function heat_checkpoint_path(output) result(path)
    type(output_t), intent(in) :: output
    character(:), allocatable :: path

    path = output%directory//'/'//output%name//'_checkpoint.h5'
  end function heat_checkpoint_path

  !> Write the state between two steps to heat_checkpoint_path.
  subroutine save_heat(scene, run, error)
    type(scene_t), intent(in) :: scene
    type(heat_run_t), intent(inout) :: run
    type(error_t), intent(inout) :: error
    type(notes_t) :: notes
    integer :: n
    real(rp), allocatable :: memory(:, :), numbers(:)

    call make_notes(scene%output, run%time, notes)
    n = run%heat%size()
    allocate (memory(n, n_kept))
    call run%integrator%pack_memory(run%heat, memory, numbers)
    associate (integrator => run%integrator)
      call write_heat_checkpoint(run%heat%world, heat_checkpoint_path(scene%output), &
                                 by_planes(run, reshape([run%heat%theta(1:n), memory], &
                                                        [n, 1 + n_kept])), &
                                 [run%time, integrator%next, real(integrator%steps, rp), &
                                  real(integrator%rejected, rp), integrator%books, run%content0, &
                                  run%row_time, integrator%last, run%row_books, &
                                  real(run%rows, rp), real(size(run%frame_times), rp), &
                                  run%frame_times, numbers], notes, error)
    end associate
  end subroutine save_heat

  !> Rearrange fields (cells, n) into one column per plane with the values of all fields.
  pure function by_planes(run, fields) result(planes)
    type(heat_run_t), intent(in) :: run
    real(rp), intent(in) :: fields(:, :)
    real(rp), allocatable :: planes(:, :)

    associate (np => run%heat%mesh%np, nx => run%heat%mesh%nx, n => size(fields, 2))
      planes = reshape(reshape(fields, [np, n, nx], order=[1, 3, 2]), [np*n, nx])
    end associate
  end function by_planes

  !> Read the state of a run, whose scene is set up, from a checkpoint.
  subroutine resume_heat(path, run, error)
    character(*), intent(in) :: path
    type(heat_run_t), intent(inout) :: run
    type(error_t), intent(inout) :: error
    real(rp), allocatable :: planes(:, :), global(:), fields(:, :)
    type(numbers_t) :: of_run
    character(:), allocatable :: message, wrong
    integer :: frames

    associate (mesh => run%heat%mesh, n => run%heat%size())
      allocate (planes(mesh%np*(1 + n_kept), mesh%nx), source=0.0_rp)
      call read_heat_checkpoint(run%heat%world, path, mesh%lo - 1, planes, of_run%value, error)
      if (error%is_set()) return
      of_run%place = path//': /global'
      call check_numbers(of_run)
      if (of_run%error%is_set()) error = of_run%error
      if (error%is_set()) return
      call move_alloc(of_run%value, global)
      frames = nint(global(n_global))
      fields = reshape(reshape(planes, [mesh%np, mesh%nx, 1 + n_kept], order=[1, 3, 2]), &
                       [n, 1 + n_kept])
      run%heat%theta(1:n) = fields(:, 1)
      wrong = ''
      if (.not. all(is_between(fields, -most, most))) then
        wrong = 'a number that is not finite'
      else if (any(run%heat%property%temperature_at(fields(:, 1)) < least)) then
        wrong = 'a temperature that is not above 0 K'
      end if
      call run%heat%world%share_message(wrong, message)
      if (message /= '') call error%raise(path//': /heat/state: '//message)
      if (error%is_set()) return
    end associate
    associate (integrator => run%integrator)
      run%time = global(1)
      integrator%next = global(2)
      integrator%steps = nint(global(3), i8)
      integrator%rejected = nint(global(4), i8)
      integrator%books = global(5:6)
      run%content0 = global(7)
      run%row_time = global(8)
      integrator%last = global(9)
      run%row_books = global(10:11)
      run%rows = nint(global(12), i8)
      run%frame_times = global(n_global + 1:n_global + frames)
      call integrator%start(run%heat)
      call integrator%unpack_memory(run%heat, fields(:, 2:), global(n_global + frames + 1:))
    end associate
  end subroutine resume_heat

  !> Check the numbers of the run, in the order of `save_heat` and of `pack_memory` of the
  !> integrator.
  subroutine check_numbers(global)
    type(numbers_t), intent(inout) :: global
    integer :: ranks, sources
    real(rp) :: most_values, time

    most_values = real(size(global%value), rp)
    sources = 0
    time = most
    if (size(global%value) > 0) time = global%value(1)
    call global%expect(1, 'the time [s]', 0.0_rp)
    call global%expect(1, 'the next step [s]', 0.0_rp)
    call global%expect(2, 'the number of steps or refused steps', 0.0_rp, counts)
    call global%expect(2, 'a heat of the balance [J]')
    call global%expect(1, 'the heat at t = 0 [J]')
    call global%expect(1, 'the time of the last row [s]', 0.0_rp, time)
    call global%expect(1, 'the last step [s]', 0.0_rp)
    call global%expect(2, 'a heat of the balance at the last row [J]')
    call global%expect(1, 'the number of rows', 0.0_rp, counts)
    call global%expect(1, 'the number of frames', 0.0_rp, most_values)
    if (global%error%is_set()) return
    if (size(global%value) >= n_global) then
      call global%expect(nint(global%value(n_global)), 'the time of a frame [s]', 0.0_rp, time)
    end if
    call global%expect(1, 'the flag of a known mean rate', 0.0_rp, 1.0_rp)
    call global%expect(1, 'the step of the preconditioner [s]', 0.0_rp)
    call global%expect(1, 'the number of sources', 0.0_rp, most_values)
    if (global%error%is_set()) return
    if (size(global%value) >= global%n) sources = nint(global%value(global%n))
    call global%expect(sources + 1, 'the flag of a source or of known rates', 0.0_rp, 1.0_rp)
    ranks = max(1, (size(global%value) - global%n)/n_books)
    call global%expect(n_books*ranks, 'the power in or out of a rank [W]')
    call global%finish()
  end subroutine check_numbers

end module heat_alone_checkpoint
