! SPDX-License-Identifier: MIT
!> How far the bodies are from their known fields: the rows of NAME_errors.csv.
module time_deviation
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use fields_field, only: field_t
  use grid_geometry, only: grid_t
  use particles_store, only: f_mass, f_pos, f_tau, f_temp, f_vel
  use physics_material, only: material_t
  use time_known, only: elastic_state, velocity_time
  use time_state, only: simulation_t
  implicit none (type, external)
  private

  public :: has_fields, deviation_columns, deviation_row

  ! Per body: mass, and mass times the squared errors of place, velocity, stress, the squared exact
  ! stress and the squared error of temperature; the largest errors of place and temperature.
  integer, parameter :: n_sums = 6, n_most = 2

contains

  pure logical function has_fields(sim)
    type(simulation_t), intent(in) :: sim
    integer :: i

    has_fields = any([(allocated(sim%scene%body(i)%field), i=1, size(sim%scene%body))])
  end function has_fields

  !> Column names with units: time, then what each body's field knows.
  function deviation_columns(sim) result(columns)
    type(simulation_t), intent(in) :: sim
    character(64), allocatable :: columns(:)
    character(64) :: all(1 + 7*size(sim%scene%body))
    integer :: c, i

    all(1) = 'time[s]'
    c = 1
    do i = 1, size(sim%scene%body)
      associate (body => sim%scene%body(i))
        if (.not. allocated(body%field)) cycle
        if (body%field%has_motion) then
          all(c + 1) = trim(body%name)//'_displacement_rms[m]'
          all(c + 2) = trim(body%name)//'_displacement_max[m]'
          all(c + 3) = trim(body%name)//'_velocity_rms[m/s]'
          all(c + 4) = trim(body%name)//'_stress_rms[Pa]'
          all(c + 5) = trim(body%name)//'_exact_stress_rms[Pa]'
          c = c + 5
        end if
        if (body%field%has_temperature) then
          all(c + 1) = trim(body%name)//'_temperature_rms[K]'
          all(c + 2) = trim(body%name)//'_temperature_max[K]'
          c = c + 2
        end if
      end associate
    end do
    allocate (columns(c))
    columns = all(:c)
  end function deviation_columns

  !> Collective: the present errors, mass-weighted rms values and maxima.
  subroutine deviation_row(world, sim, row)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(in) :: sim
    real(rp), allocatable, intent(out) :: row(:)
    real(rp) :: sums(n_sums*size(sim%scene%body)), most(n_most*size(sim%scene%body))
    real(rp) :: mean(n_sums)
    integer :: b, i

    sums = 0.0_rp
    most = 0.0_rp
    do b = 1, sim%particles%nblk
      i = sim%particles%body(b)
      if (.not. allocated(sim%scene%body(i)%field)) cycle
      call add_block(sim, sim%scene%body(i)%field, &
                     sim%scene%material(sim%scene%body(i)%material), sim%particles%count(b), &
                     sim%particles%nf, sim%particles%ps(:, :, b), &
                     sums(n_sums*(i - 1) + 1:n_sums*i), most(n_most*(i - 1) + 1:n_most*i))
    end do
    call world%sum(sums)
    call world%max(most)
    row = [sim%clock%time]
    do i = 1, size(sim%scene%body)
      associate (body => sim%scene%body(i))
        if (.not. allocated(body%field)) cycle
        mean = sqrt(sums(n_sums*(i - 1) + 1:n_sums*i)/sums(n_sums*(i - 1) + 1))
        if (body%field%has_motion) row = [row, mean(2), most(n_most*(i - 1) + 1), mean(3:5)]
        if (body%field%has_temperature) row = [row, mean(6), most(n_most*i)]
      end associate
    end do
  end subroutine deviation_row

  subroutine add_block(sim, field, material, n, nf, ps, sums, most)
    type(simulation_t), intent(in) :: sim
    class(field_t), intent(in) :: field
    type(material_t), intent(in) :: material
    integer, intent(in) :: n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(inout) :: sums(n_sums), most(n_most)
    real(rp) :: temp(nlane)

    sums(1) = sums(1) + sum(ps(:n, f_mass))
    if (field%has_motion) call compare_motion(sim, field, material, n, &
      ps(1, sim%scene%layout%origin), ps(1, f_mass), ps(1, f_pos), ps(1, f_vel), ps(1, f_temp), &
      ps(1, f_tau), sums, most)
    if (.not. field%has_temperature) return
    call field%temperature(sim%clock%heat_time, ps(1, sim%scene%layout%origin), temp)
    temp = abs(ps(:, f_temp) - temp)
    sums(6) = sums(6) + sum(ps(:n, f_mass)*temp(:n)**2)
    most(2) = max(most(2), maxval(temp(:n)))
  end subroutine add_block

  subroutine compare_motion(sim, field, material, n, x0, mass, x, v, temp, tau, sums, most)
    type(simulation_t), intent(in) :: sim
    class(field_t), intent(in) :: field
    type(material_t), intent(in) :: material
    integer, intent(in) :: n
    real(rp), intent(in) :: x0(nlane, 3), mass(nlane), x(nlane, 3), v(nlane, 3), temp(nlane)
    real(rp), intent(in) :: tau(nlane, 6)
    real(rp), intent(inout) :: sums(n_sums), most(n_most)
    real(rp), dimension(nlane, 3) :: exact_x, exact_v, unused
    real(rp) :: f(nlane, 9), bbar(nlane, 6), jac(nlane), exact_tau(nlane, 6), d(3)
    integer :: p

    call field%motion(velocity_time(sim), x0, unused, exact_v, f)
    call field%motion(sim%clock%time, x0, exact_x, unused, f)
    call elastic_state(material, n, f, temp, bbar, jac, exact_tau)
    do p = 1, n
      d = nearest_image(sim%scene%grid, x(p, :) - exact_x(p, :))
      sums(2) = sums(2) + mass(p)*sum(d**2)
      sums(3) = sums(3) + mass(p)*sum((v(p, :) - exact_v(p, :))**2)
      sums(4) = sums(4) + mass(p)*square(tau(p, :) - exact_tau(p, :))
      sums(5) = sums(5) + mass(p)*square(exact_tau(p, :))
      most(1) = max(most(1), norm2(d))
    end do
  end subroutine compare_motion

  !> A difference of places less whole periods of the box.
  pure function nearest_image(grid, d) result(r)
    type(grid_t), intent(in) :: grid
    real(rp), intent(in) :: d(3)            !! [m]
    real(rp) :: r(3), length(3)

    length = grid%h*grid%period
    r = d
    where (length > 0.0_rp) r = d - length*anint(d/max(length, tiny(1.0_rp)))
  end function nearest_image

  !> s : s of a symmetric tensor.
  pure real(rp) function square(s)
    real(rp), intent(in) :: s(6)

    square = sum(s(1:3)**2) + 2.0_rp*sum(s(4:6)**2)
  end function square

end module time_deviation
