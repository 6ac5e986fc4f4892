! SPDX-License-Identifier: MIT
!> State of a heat-only run, its checkpoints, and its output: temperatures at given positions, by
!> trilinear interpolation between the eight surrounding cell centres if all are in the solid,
!> otherwise by a least-squares plane through the solid ones of the 27 surrounding cells; molten
!> mass and hottest cell.
module heat_alone_state
  use base_errors, only: error_t
  use base_kinds, only: i8, rp
  use base_world, only: world_t
  use heat_integrator, only: integrator_t, n_kept
  use heat_mesh, only: heat_mesh_t
  use heat_rates, only: heat_t, n_heats
  use io_checkpoint, only: notes_t, read_heat_checkpoint, write_heat_checkpoint
  use io_plausible, only: counts, is_between, max_magnitude, min_positive, numbers_t
  use output_checkpoint, only: checkpoint_path, make_notes
  use output_guards, only: melt_sample_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: heat_run_t, place_probes, read_probes, sample_cells, resume_heat, save_heat

  type :: heat_run_t
    type(heat_t) :: heat
    type(integrator_t) :: integrator
    real(rp) :: time = 0.0_rp                !! simulated time [s]
    real(rp) :: content0 = 0.0_rp            !! heat content at t = 0 [J]
    real(rp) :: row_time = -1.0_rp           !! time of the last history row [s]
    !> Heat of sources and films until the last history row [J].
    real(rp) :: row_heats(n_heats) = 0.0_rp
    integer(i8) :: rows = 0                  !! history rows written so far
    !> Largest molten share of the mass and excess over a melting temperature so far [K].
    real(rp) :: molten(2) = 0.0_rp
    logical :: lost_row = .false.            !! a row could not be written, on rank 0
    real(rp), allocatable :: frame_times(:)  !! times of the frames written so far [s]
    integer(i8) :: cells = 0                 !! cells in the solid, of all ranks
    integer, allocatable :: probe_cell(:, :)       !! (27, probes) own cells; 0: on another rank
    real(rp), allocatable :: probe_weight(:, :)    !! (27, probes) interpolation weights
  end type heat_run_t

contains

  !> Collective. Find cells and weights of the probes.
  subroutine place_probes(world, x, run)
    type(world_t), intent(in) :: world
    real(rp), intent(in) :: x(:, :)             !! (3, n) positions of the probes [m]
    type(heat_run_t), intent(inout) :: run
    real(rp) :: is_solid(27)
    integer :: at(3, 27), n, near(3)

    allocate (run%probe_cell(27, size(x, 2)), source=0)
    allocate (run%probe_weight(27, size(x, 2)), source=0.0_rp)
    do n = 1, size(x, 2)
      associate (mesh => run%heat%mesh, cell => run%probe_cell(:, n))
        near = [cell_index(mesh%x, x(1, n)), cell_index(mesh%y, x(2, n)), cell_index(mesh%z, x(3, &
                                                                                               n))]
        call block_around(mesh, near, at, cell)
        is_solid = 0.0_rp
        where (cell > 0) is_solid = merge(1.0_rp, 0.0_rp, mesh%capacity(max(1, cell)) > 0.0_rp)
        call world%sum(is_solid)
        run%probe_weight(:, n) = weights_at(mesh, x(:, n), at, is_solid > 0.5_rp)
        where (abs(run%probe_weight(:, n)) <= 0.0_rp) cell = 0
      end associate
    end do
  end subroutine place_probes

  !> Index of the cell between mesh lines that contains `x`.
  pure integer function cell_index(lines, x)
    real(rp), intent(in) :: lines(0:), x

    cell_index = max(1, min(ubound(lines, 1), count(lines <= x)))
  end function cell_index

  !> Indices of a cell and its 26 neighbours, 0 outside the mesh, and their numbers on this rank.
  pure subroutine block_around(mesh, near, at, cell)
    type(heat_mesh_t), intent(in) :: mesh
    integer, intent(in) :: near(3)
    integer, intent(out) :: at(3, 27), cell(27)
    integer :: c

    do c = 1, 27
      at(:, c) = near + [mod(c - 1, 3), mod((c - 1)/3, 3), (c - 1)/9] - 1
      cell(c) = 0
      if (any(at(:, c) < 1) .or. any(at(:, c) > mesh%n)) then
        at(:, c) = 0
      else if (at(1, c) >= mesh%lo .and. at(1, c) <= mesh%hi) then
        cell(c) = (at(1, c) - mesh%lo)*mesh%np + (at(2, c) - 1)*mesh%n(3) + at(3, c)
      end if
    end do
  end subroutine block_around

  !> Interpolation weights of the 27 cells.
  pure function weights_at(mesh, x, at, is_solid) result(w)
    type(heat_mesh_t), intent(in) :: mesh
    real(rp), intent(in) :: x(3)
    integer, intent(in) :: at(3, 27)
    logical, intent(in) :: is_solid(27)
    real(rp) :: w(27), d(3, 27), h(3), f
    integer :: a, c, other

    w = 0.0_rp
    d = 0.0_rp
    h = 1.0_rp
    do c = 1, 27
      if (at(1, c) == 0) cycle
      associate (box => mesh%box(at(1, c), at(2, c), at(3, c)))
        d(:, c) = 0.5_rp*(box(:, 1) + box(:, 2)) - x
        if (c == 14) h = box(:, 2) - box(:, 1)
      end associate
    end do
    ! products of linear weights along the axes, also extrapolating beyond the last centre
    w(14) = 1.0_rp
    do a = 1, 3
      other = merge(1, -1, d(a, 14) < 0.0_rp)*3**(a - 1)
      if (at(1, 14 + other) == 0) other = -other
      if (at(1, 14 + other) == 0) cycle
      f = -d(a, 14)/(d(a, 14 + other) - d(a, 14))
      w = (1.0_rp - f)*w + f*cshift(w, -other)
    end do
    if (all(is_solid .or. abs(w) <= 0.0_rp)) return
    w = plane_weights(d/spread(h, 2, 27), is_solid)
  end function weights_at

  !> Weights of the value at the origin of a least-squares plane through the solid cells, weighted
  !> by distance. A small regularization gives the mean for degenerate sets.
  pure function plane_weights(d, is_solid) result(w)
    real(rp), intent(in) :: d(3, 27)            !! cell centres from the probe [cells]
    logical, intent(in) :: is_solid(27)
    real(rp) :: w(27), a(4, 4), b(4), near, row(4)
    integer :: c, i, j

    a = 0.0_rp
    w = 0.0_rp
    do c = 1, 27
      if (.not. is_solid(c)) cycle
      near = exp(-2.0_rp*sum(d(:, c)**2))
      row = [1.0_rp, d(:, c)]
      do i = 1, 4
        a(:, i) = a(:, i) + near*row(i)*row
      end do
    end do
    do i = 2, 4
      a(i, i) = a(i, i) + 1.0e-9_rp
    end do
    b = [1.0_rp, 0.0_rp, 0.0_rp, 0.0_rp]        ! solve a y = e1 (a is positive definite)
    do i = 1, 4
      do j = i + 1, 4
        b(j) = b(j) - a(j, i)/a(i, i)*b(i)
        a(j, :) = a(j, :) - a(j, i)/a(i, i)*a(i, :)
      end do
    end do
    do i = 4, 1, -1
      b(i) = (b(i) - sum(a(i, i + 1:)*b(i + 1:)))/a(i, i)
    end do
    do c = 1, 27
      if (is_solid(c)) w(c) = exp(-2.0_rp*sum(d(:, c)**2))*(b(1) + sum(b(2:)*d(:, c)))
    end do
  end function plane_weights

  !> Collective. Temperatures at the probes [K].
  subroutine read_probes(world, run, t)
    type(world_t), intent(in) :: world
    type(heat_run_t), intent(in) :: run
    real(rp), intent(out) :: t(:)
    integer :: c, n

    t = 0.0_rp
    do n = 1, size(t)
      do c = 1, 27
        if (run%probe_cell(c, n) == 0) cycle
        t(n) = t(n) + run%probe_weight(c, n)*run%heat%property%temperature_at( &
               run%heat%theta(run%probe_cell(c, n)))
      end do
    end do
    call world%sum(t)
  end subroutine read_probes

  !> Molten mass and hottest cell of this rank.
  type(melt_sample_t) function sample_cells(scene, run) result(sample)
    type(scene_t), intent(in) :: scene
    type(heat_run_t), intent(in) :: run
    real(rp) :: mass, temp
    integer :: c

    associate (heat => run%heat, mesh => run%heat%mesh)
      do c = 1, heat%size()
        if (mesh%capacity(c) <= 0.0_rp) cycle
        associate (material => scene%material(scene%body(mesh%body(c))%material))
          mass = mesh%capacity(c)/material%c_p
          if (scene%body(mesh%body(c))%material == scene%body(1)%material) then
            mass = mesh%capacity(c)/heat%property%c_ref      ! from a table, if given
          end if
          temp = heat%property%temperature_at(heat%theta(c))
          sample%mass = sample%mass + mass
          if (temp > material%t_melt) sample%melted = sample%melted + mass
          if (temp - material%t_melt <= sample%over) cycle
          sample%over = temp - material%t_melt
        end associate
        sample%temp = temp
        sample%x = mesh%centre(c)
        sample%body = mesh%body(c)
      end do
    end associate
  end function sample_cells

  !> Write the state between two steps to the checkpoint of the run.
  subroutine save_heat(scene, run, error)
    type(scene_t), intent(in) :: scene
    type(heat_run_t), intent(inout) :: run
    type(error_t), intent(inout) :: error
    type(notes_t) :: notes
    type(numbers_t) :: of_run
    real(rp), allocatable :: memory(:, :), numbers(:)

    call make_notes(scene%output, run%time, notes)
    allocate (memory(run%heat%size(), n_kept))
    call run%integrator%pack_restart_data(run%heat, memory, numbers)
    of_run%is_read = .false.
    allocate (of_run%value(0))
    call pass_numbers(run, of_run)
    call of_run%pass(size(numbers), numbers, 'the state of the integrator')
    associate (mesh => run%heat%mesh, theta => run%heat%theta(1:run%heat%size()))
      ! a column for each plane, with the values of all fields
      call write_heat_checkpoint(run%heat%world, checkpoint_path(scene), &
                                 reshape(reshape([theta, memory], [mesh%np, 1 + n_kept, mesh%nx], &
                                                 order=[1, 3, 2]), &
                                         [mesh%np*(1 + n_kept), mesh%nx]), &
                                 of_run, notes, error)
    end associate
  end subroutine save_heat

  !> Read the state of a run, whose scene is set up, from a checkpoint.
  subroutine resume_heat(path, run, error)
    character(*), intent(in) :: path
    type(heat_run_t), intent(inout) :: run
    type(error_t), intent(inout) :: error
    real(rp), allocatable :: planes(:, :), fields(:, :)
    type(numbers_t) :: of_run
    character(:), allocatable :: message, wrong
    integer :: n_own

    associate (mesh => run%heat%mesh, n => run%heat%size())
      allocate (planes(mesh%np*(1 + n_kept), mesh%nx), source=0.0_rp)
      call read_heat_checkpoint(run%heat%world, path, mesh%lo - 1, planes, of_run, error)
      if (error%is_set()) return
      of_run%place = path//': /global'
      call pass_numbers(run, of_run)
      n_own = of_run%n
      call check_restart_data(of_run)
      if (of_run%error%is_set()) error = of_run%error
      if (error%is_set()) return
      fields = reshape(reshape(planes, [mesh%np, mesh%nx, 1 + n_kept], order=[1, 3, 2]), &
                       [n, 1 + n_kept])
      run%heat%theta(1:n) = fields(:, 1)
      wrong = ''
      if (.not. all(is_between(fields, -max_magnitude, max_magnitude))) then
        wrong = 'a number that is not finite'
      else if (any(run%heat%property%temperature_at(fields(:, 1)) < min_positive)) then
        wrong = 'a temperature that is not above 0 K'
      end if
      call run%heat%world%share_message(wrong, message)
      if (message /= '') call error%raise(path//': /heat/state: '//message)
      if (error%is_set()) return
    end associate
    call run%integrator%start(run%heat)
    call run%integrator%unpack_restart_data(run%heat, fields(:, 2:), of_run%value(n_own + 1:))
  end subroutine resume_heat

  !> Write or read the numbers of the run.
  subroutine pass_numbers(run, numbers)
    type(heat_run_t), intent(inout) :: run
    type(numbers_t), intent(inout) :: numbers
    integer :: frames

    frames = size(run%frame_times)
    associate (s => numbers, i => run%integrator)
      call s%pass_one(run%time, 'the time [s]', 0.0_rp)
      call s%pass_one(i%next, 'the next step [s]', 0.0_rp)
      call s%pass_one(i%steps, 'the number of steps or refused steps', 0.0_rp, counts)
      call s%pass_one(i%refused, 'the number of steps or refused steps', 0.0_rp, counts)
      call s%pass(n_heats, i%heats, 'a heat of the balance [J]')
      call s%pass_one(run%content0, 'the heat at t = 0 [J]')
      call s%pass_one(run%row_time, 'the time of the last row [s]', 0.0_rp, run%time)
      call s%pass_one(i%last, 'the last step [s]', 0.0_rp)
      call s%pass(n_heats, run%row_heats, 'a heat of the balance at the last row [J]')
      call s%pass_one(run%rows, 'the number of rows', 0.0_rp, counts)
      call s%pass(size(run%molten), run%molten, 'the largest molten share or excess', 0.0_rp)
      call s%pass_one(frames, 'the number of frames', 0.0_rp, real(size(s%value), rp))
      if (s%is_read) run%frame_times = spread(0.0_rp, 1, merge(frames, 0, s%has_set()))
      call s%pass(size(run%frame_times), run%frame_times, 'the time of a frame [s]', 0.0_rp, &
                  run%time)
    end associate
  end subroutine pass_numbers

  !> Check the restart data of the integrator, which follow the numbers of the run.
  subroutine check_restart_data(numbers)
    type(numbers_t), intent(inout) :: numbers
    integer :: ranks, sources

    if (numbers%error%is_set()) return
    sources = 0
    associate (s => numbers)
      call s%expect(1, 'the flag of a known mean rate', 0.0_rp, 1.0_rp)
      call s%expect(1, 'the step of the preconditioner [s]', 0.0_rp)
      call s%expect(1, 'the number of sources', 0.0_rp, real(size(s%value), rp))
      if (s%error%is_set()) return
      if (s%has_set()) sources = nint(s%value(s%n))
      call s%expect(sources + 1, 'the flag of a source or of known rates', 0.0_rp, 1.0_rp)
      ranks = max(1, (size(s%value) - s%n)/n_heats)
      call s%expect(n_heats*ranks, 'the power in or out of a rank [W]')
      call s%finish()
    end associate
  end subroutine check_restart_data

end module heat_alone_state
