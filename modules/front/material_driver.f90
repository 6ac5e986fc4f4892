! SPDX-License-Identifier: MIT
!> `stirpoint --material INPUT`: flow laws along paths of a material point, one CSV file a &PATH.
module front_material_driver
  use, intrinsic :: iso_fortran_env, only: error_unit
  use base_errors, only: error_t
  use base_kinds, only: i8, nlane, rp
  use base_log, only: log_line
  use base_system, only: make_directory
  use base_world, only: world_t
  use front_command_line, only: command_t
  use front_help, only: log_sources
  use front_point_watch, only: validity_checker_t
  use input_key_table, only: find
  use input_reading, only: read_input
  use input_tables, only: read_columns
  use input_values, only: input_t
  use io_histories, only: row_t, table_t
  use physics_material, only: material_t
  use physics_point, only: point_t
  use physics_stress, only: advance_stress, stress_sums_t
  use setup_keys, only: key_table
  use setup_materials, only: read_materials, require_property
  implicit none (type, external)
  private

  public :: drive_material

  character(*), parameter :: group = 'PATH'
  !> Largest temperature change of an increment of a history [K].
  real(rp), parameter :: max_temperature_step = 2.0_rp
  !> Slowest rate of a shear path over its given rate.
  real(rp), parameter :: slowest_share = 1.0e-6_rp
  integer, parameter :: min_increments = 8   !! increments per line of a history with annealing

  !> Additional columns of the curve of simple shear.
  type :: shear_output_t
    real(rp) :: strain                       !! von Mises strain
    real(rp) :: stress                       !! shear stress [Pa]
    real(rp) :: det_error                    !! determinant of bbar less 1
  end type shear_output_t

contains

  !> Collective. Compute the curves of all &PATH groups.
  subroutine drive_material(world, command, io_status, status)
    type(world_t), intent(in) :: world
    type(command_t), intent(in) :: command
    integer, intent(in) :: io_status         !! status if a file cannot be written
    integer, intent(inout) :: status         !! 2: invalid input
    type(input_t) :: input
    type(material_t), allocatable :: material(:)
    type(error_t) :: error
    character(:), allocatable :: directory
    integer :: i, m
    logical :: ok

    call read_input(key_table(), command%input, command%overrides, input, point=.true.)
    if (input%count('MATERIAL') > 0) call read_materials(input, material)
    if (input%diagnostics%count() == 0) call check_paths(input, material, command%input)
    if (input%diagnostics%count() > 0) then
      status = 2
      if (world%is_root()) call input%diagnostics%print()
      return
    end if
    if (world%is_root() .and. .not. command%is_quiet) call log_sources(input)
    directory = input%text('RUN', 1, 'NAME')//'.out'
    if (command%directory /= '') directory = command%directory
    call make_directory(directory, ok)
    if (.not. world%all_true(ok)) call error%raise('cannot make directory '//directory)
    do i = 1, input%count(group)
      if (error%is_set()) exit
      m = find(material%name, input%text(group, i, 'MATERIAL'))
      call compute_path(world, input, i, material(m), command%input, directory, error)
    end do
    if (error%is_set()) then
      status = io_status
      if (world%is_root()) write (error_unit, '(2a)') 'stirpoint: error: ', error%message
    else if (world%is_root() .and. .not. command%is_quiet) then
      call log_line('curves in '//directory)
    end if
  end subroutine drive_material

  !> Check the &PATH groups.
  subroutine check_paths(input, material, file)
    type(input_t), intent(in) :: input
    type(material_t), intent(in) :: material(:)
    character(*), intent(in) :: file
    real(rp), allocatable :: rows(:, :)
    integer :: i, m

    do i = 1, input%count(group)
      m = find(material%name, input%text(group, i, 'MATERIAL'))
      if (m == 0) cycle                              ! reported before
      if (.not. allocated(material(m)%flow)) then
        call input%report(group, i, 'MATERIAL', 'does not flow (LAW = elastic)')
      else
        if (input%logical(group, i, 'ADIABATIC')) then
          if (.not. material(m)%has_heat_capacity) call require_property(input, m, &
            'SPECIFIC_HEAT', 'an ADIABATIC &PATH heats it')
          call require_property(input, m, 'T_MELT', 'an ADIABATIC &PATH may melt it')
        end if
        if (material(m)%flow%has_own_melting()) then
          call require_property(input, m, 'T_MELT', "LAW = '"//input%text('MATERIAL', m, 'LAW')// &
                                "' softens towards it")
        end if
      end if
      if (input%text(group, i, 'KIND') /= 'history') cycle
      call read_history(input, i, file, rows)
    end do
  end subroutine check_paths

  !> Compute a path and write its curve to directory/NAME.csv.
  subroutine compute_path(world, input, i, material, file, directory, error)
    type(world_t), intent(in) :: world
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(material_t), intent(in) :: material
    character(*), intent(in) :: file, directory
    type(error_t), intent(inout) :: error
    type(table_t) :: curve
    type(point_t) :: point
    type(validity_checker_t) :: checker
    type(row_t) :: row

    call point%init(material, material%t_ref, 1.0_rp)
    row = point_row(material, 0.0_rp, point)
    if (input%text(group, i, 'KIND') == 'shear') then
      row = point_row(material, 0.0_rp, point, shear_output_t(0.0_rp, 0.0_rp, 0.0_rp))
    end if
    call curve%open(world, directory//'/'//input%text(group, i, 'NAME')//'.csv', &
                    input%text('RUN', 1, 'TITLE'), row%headings(), -1_i8, 0.0_rp, error)
    if (error%is_set()) return
    select case (input%text(group, i, 'KIND'))
    case ('shear')
      call compute_shear(input, i, material, curve, checker)
    case ('history')
      call compute_history(input, i, material, file, curve, checker)
    case default
      call compute_strain(input, i, material, curve, checker)
    end select
    call curve%close(error)
    if (world%is_root()) call checker%log_warnings(material, input%text(group, i, 'NAME'))
  end subroutine compute_path

  !> Write a row of the curve.
  subroutine write_point(curve, material, time, point, sheared)
    type(table_t), intent(inout) :: curve
    type(material_t), intent(in) :: material
    real(rp), intent(in) :: time
    type(point_t), intent(in) :: point
    type(shear_output_t), intent(in), optional :: sheared
    type(row_t) :: row

    row = point_row(material, time, point, sheared)
    call curve%write_row(row%values())
  end subroutine write_point

  !> Row of a curve.
  type(row_t) function point_row(material, time, point, sheared) result(row)
    type(material_t), intent(in) :: material
    real(rp), intent(in) :: time                          !! [s]
    type(point_t), intent(in) :: point
    type(shear_output_t), intent(in), optional :: sheared
    real(rp), allocatable :: values(:)
    integer :: k

    call row%add('time', 's', time)
    call row%add('plastic_strain', '1', point%alpha)
    call row%add('strain_rate', '1/s', point%rate)
    call row%add('temperature', 'K', point%temp)
    call row%add('stress', 'Pa', point%sigma)
    associate (output => material%flow%outputs())
      allocate (values, source=point%outputs(material, size(output)))
      do k = 1, size(output)
        call row%add(output(k)%name, output(k)%unit, values(k))
      end do
    end associate
    if (.not. present(sheared)) return
    call row%add('strain', '1', sheared%strain)
    call row%add('shear_stress', 'Pa', sheared%stress)
    call row%add('det_error', '1', sheared%det_error)
  end function point_row

  !> Number of rows of equal strain, of increments per row, and the strain increment, from STEP.
  subroutine divide(input, i, strain, rows, parts, x)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: strain
    integer, intent(out) :: rows, parts
    real(rp), intent(out) :: x               !! strain increment

    rows = input%integer(group, i, 'ROWS')
    parts = max(1, ceiling(strain/(rows*input%real(group, i, 'STEP'))*(1.0_rp - 1.0e-12_rp)))
    x = strain/(real(rows, rp)*parts)
  end subroutine divide

  !> Path of constant strain rate.
  subroutine compute_strain(input, i, material, curve, checker)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(material_t), intent(in) :: material
    type(table_t), intent(inout) :: curve
    type(validity_checker_t), intent(inout) :: checker
    type(point_t) :: point
    real(rp) :: rate, x
    integer :: k, part, parts, rows
    logical :: is_adiabatic

    rate = input%real(group, i, 'RATE')
    is_adiabatic = input%logical(group, i, 'ADIABATIC')
    call divide(input, i, input%real(group, i, 'STRAIN'), rows, parts, x)
    call point%init(material, input%real(group, i, 'TEMPERATURE'), rate)
    call write_point(curve, material, 0.0_rp, point)
    do k = 1, rows
      do part = 1, parts
        if (is_adiabatic) then
          call point%strain_adiabatic(material, x, rate)
        else
          call point%strain_to(material, x, rate, point%temp)
        end if
        call point%anneal(material, x/rate)
        call checker%inspect(material, ((k - 1)*parts + part)*x/rate, point)
      end do
      call write_point(curve, material, k*parts*x/rate, point)
    end do
  end subroutine compute_strain

  !> Simple shear xy with elasticity and return mapping, in steps of at most STEP of von Mises
  !> strain.
  subroutine compute_shear(input, i, material, curve, checker)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(material_t), intent(in) :: material
    type(table_t), intent(inout) :: curve
    type(validity_checker_t), intent(inout) :: checker
    type(material_t) :: mat
    type(stress_sums_t) :: sums
    type(point_t) :: point
    real(rp), dimension(nlane) :: j, alpha, temp, rate, flow, mass, t_begin
    real(rp) :: l(nlane, 9), b(nlane, 6), tau(nlane, 6), state(nlane, material%flow%n_state), x, dt
    integer :: k, part, parts, rows

    mat = material
    if (.not. input%logical(group, i, 'ADIABATIC')) mat%plastic_heat = 0.0_rp
    call divide(input, i, input%real(group, i, 'STRAIN'), rows, parts, x)
    dt = x/input%real(group, i, 'RATE')
    call point%init(mat, input%real(group, i, 'TEMPERATURE'), input%real(group, i, 'RATE'))
    mat%t_ref = point%temp
    mat%flow%min_rate = min(mat%flow%min_rate, slowest_share*input%real(group, i, 'RATE'))
    mass = 1.0_rp
    b = 0.0_rp
    b(:, 1:3) = 1.0_rp
    j = 1.0_rp
    l = 0.0_rp
    l(:, 2) = sqrt(3.0_rp)*input%real(group, i, 'RATE')
    tau = 0.0_rp
    alpha = 0.0_rp
    rate = 0.0_rp
    flow = 0.0_rp
    temp = point%temp
    state = spread(point%state, 1, nlane)
    do k = 1, rows
      do part = 1, parts
        t_begin = temp
        call advance_stress(mat, nlane, dt, l, t_begin, mass, b, j, alpha, temp, tau, rate, &
                            flow, mat%flow%n_state, state, sums)
        call mat%flow%anneal(dt, temp, rate, state)
        point = point_t(alpha(1), temp(1), rate(1), flow(1), state(1, :))
        call checker%inspect(mat, ((k - 1)*parts + part)*dt, point, sums%failed)
        sums%failed = 0
      end do
      call write_point(curve, mat, k*parts*dt, point, &
                       shear_output_t(k*parts*x, tau(1, 4)/j(1), determinant(b(1, :)) - 1.0_rp))
    end do
  end subroutine compute_shear

  !> Determinant of a symmetric tensor.
  pure real(rp) function determinant(b)
    real(rp), intent(in) :: b(6)

    determinant = b(1)*(b(2)*b(3) - b(5)**2) - b(4)*(b(4)*b(3) - b(5)*b(6)) &
                  + b(6)*(b(4)*b(5) - b(2)*b(6))
  end function determinant

  !> Read rows (time [s], temperature [K], plastic strain) from the file of a history.
  subroutine read_history(input, i, file, rows)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    character(*), intent(in) :: file
    real(rp), allocatable, intent(out) :: rows(:, :)
    character(20), parameter :: names(4) = [character(20) :: 'time[s]', 'temperature[K]', &
                                            'plastic_strain[1]', 'strain_rate[1/s]']
    character(:), allocatable :: path
    integer, allocatable :: lines(:)
    logical :: found(4), opened
    integer :: before, k, n

    path = file(:index(file, '/', back=.true.))//input%text(group, i, 'FILE')
    before = input%diagnostics%count()
    call read_columns(path, names, rows, lines, found, opened, input%diagnostics)
    if (.not. opened) call input%report(group, i, 'FILE', path//' cannot be read')
    if (input%diagnostics%count() > before) return
    if (.not. all(found(1:2)) .or. .not. any(found(3:4))) then
      call input%diagnostics%add(path, 0, 'needs columns time[s], temperature[K] and '// &
                                 'plastic_strain[1] or strain_rate[1/s], with commas between them')
      return
    end if
    n = size(rows, 1)
    if (n < 2) then
      call input%diagnostics%add(path, 0, 'has fewer than two rows')
      return
    end if
    call input%diagnostics%add_first(path, lines, rows(:, 2) <= 0.0_rp, &
                                     'temperature is not above 0 K')
    call input%diagnostics%add_first(path, lines, [.false., rows(2:, 1) <= rows(:n - 1, 1)], &
                                     'time does not rise')
    if (found(3)) then
      call input%diagnostics%add_first(path, lines, rows(:, 3) < 0.0_rp, &
                                       'plastic strain is below 0')
      call input%diagnostics%add_first(path, lines, [.false., rows(2:, 3) < rows(:n - 1, 3)], &
                                       'plastic strain falls')
      return
    end if
    call input%diagnostics%add_first(path, lines, rows(:, 4) < 0.0_rp, 'strain rate is below 0')
    rows(1, 3) = 0.0_rp
    do k = 2, n                      ! the rate is linear between rows
      rows(k, 3) = rows(k - 1, 3) &
                   + 0.5_rp*(rows(k, 4) + rows(k - 1, 4))*(rows(k, 1) - rows(k - 1, 1))
    end do
  end subroutine read_history

  !> History of temperature and strain, with constant rates between rows.
  subroutine compute_history(input, i, material, file, curve, checker)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(material_t), intent(in) :: material
    character(*), intent(in) :: file
    type(table_t), intent(inout) :: curve
    type(validity_checker_t), intent(inout) :: checker
    type(point_t) :: point
    real(rp), allocatable :: rows(:, :)
    real(rp) :: dt, temp, temperature_change, x
    integer :: k, n, part

    call read_history(input, i, file, rows)       ! errors were reported by `check_paths`
    call point%init(material, rows(1, 2), 1.0_rp)
    point%alpha = rows(1, 3)
    point%rate = 0.0_rp
    call write_point(curve, material, rows(1, 1), point)
    do k = 2, size(rows, 1)
      x = rows(k, 3) - rows(k - 1, 3)
      temperature_change = rows(k, 2) - rows(k - 1, 2)
      n = max(1, ceiling(x/input%real(group, i, 'STEP')), &
              ceiling(abs(temperature_change)/max_temperature_step), merge(min_increments, 1, &
                                                                           material%flow%anneals))
      dt = (rows(k, 1) - rows(k - 1, 1))/n
      do part = 1, n
        temp = rows(k - 1, 2) + part*temperature_change/n
        call point%strain_to(material, x/n, x/(n*dt), temp)
        call point%anneal(material, dt)
        call checker%inspect(material, rows(k - 1, 1) + part*dt, point)
      end do
      call write_point(curve, material, rows(k, 1), point)
    end do
  end subroutine compute_history

end module front_material_driver
