! SPDX-License-Identifier: MIT
!> Errors of bodies with known (manufactured) fields: rows of NAME_errors.csv.
module output_error_norms
  use base_kinds, only: nlane, rp
  use io_histories, only: row_t
  use mpm_prescribed, only: compute_elastic_state, velocity_time
  use particles_store, only: f_mass, f_pos, f_tau, f_temp, f_vel
  use physics_field, only: field_t
  use physics_material, only: material_t
  use state_clock, only: clock_t
  use state_parts, only: simulation_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: has_fields, error_headings, make_error_row

  ! Sums of a body: mass, and mass times the squared errors of position, velocity and stress, the
  ! squared exact stress and the squared error of temperature. Maxima of a body: errors of position
  ! and temperature.
  integer, parameter :: n_sums = 6, n_maxima = 2

contains

  !> True if any body has a known field.
  pure logical function has_fields(scene)
    type(scene_t), intent(in) :: scene
    integer :: i

    has_fields = any([(allocated(scene%body(i)%field), i=1, size(scene%body))])
  end function has_fields

  !> Names and units of the columns, without values.
  function error_headings(scene, clock) result(headings)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    character(:), allocatable :: headings(:)
    real(rp) :: sums(n_sums, size(scene%body)), maxima(n_maxima, size(scene%body))
    type(row_t) :: row

    sums = 0.0_rp
    maxima = 0.0_rp
    call add_columns(scene, clock, sums, maxima, row)
    headings = row%headings()
  end function error_headings

  !> Collective. Current errors: mass-weighted rms values and maxima.
  subroutine make_error_row(sim, row)
    type(simulation_t), intent(in) :: sim
    type(row_t), intent(out) :: row
    real(rp) :: sums(n_sums*size(sim%scene%body)), maxima(n_maxima*size(sim%scene%body))
    integer :: b, i

    sums = 0.0_rp
    maxima = 0.0_rp
    do b = 1, sim%particles%nblk
      i = sim%particles%body(b)
      if (.not. allocated(sim%scene%body(i)%field)) cycle
      call add_block(sim, sim%scene%body(i)%field, &
                     sim%scene%material(sim%scene%body(i)%material), sim%particles%count(b), &
                     sim%particles%nf, sim%particles%ps(:, :, b), &
                     sums(n_sums*(i - 1) + 1:n_sums*i), maxima(n_maxima*(i - 1) + 1:n_maxima*i))
    end do
    call sim%world%sum(sums)
    call sim%world%max(maxima)
    call add_columns(sim%scene, sim%clock, sums, maxima, row)
  end subroutine make_error_row

  !> Add the time and the errors of each body.
  subroutine add_columns(scene, clock, sums, maxima, row)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    real(rp), intent(in) :: sums(n_sums, size(scene%body)), maxima(n_maxima, size(scene%body))
    type(row_t), intent(inout) :: row
    character(:), allocatable :: name
    real(rp) :: mean(n_sums)
    integer :: i

    call row%add('time', 's', clock%time)
    do i = 1, size(scene%body)
      associate (body => scene%body(i))
        if (.not. allocated(body%field)) cycle
        name = trim(body%name)
        mean = sqrt(sums(:, i)/max(sums(1, i), tiny(1.0_rp)))
        if (body%field%has_motion) then
          call row%add(name//'_displacement_rms', 'm', mean(2))
          call row%add(name//'_displacement_max', 'm', maxima(1, i))
          call row%add(name//'_velocity_rms', 'm/s', mean(3))
          call row%add(name//'_stress_rms', 'Pa', mean(4))
          call row%add(name//'_exact_stress_rms', 'Pa', mean(5))
        end if
        if (body%field%has_temperature) then
          call row%add(name//'_temperature_rms', 'K', mean(6))
          call row%add(name//'_temperature_max', 'K', maxima(2, i))
        end if
      end associate
    end do
  end subroutine add_columns

  !> Add the errors of a block of particles of one body.
  subroutine add_block(sim, field, material, n, nf, ps, sums, maxima)
    type(simulation_t), intent(in) :: sim
    class(field_t), intent(in) :: field
    type(material_t), intent(in) :: material
    integer, intent(in) :: n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(inout) :: sums(n_sums), maxima(n_maxima)
    real(rp) :: temp(nlane)

    sums(1) = sums(1) + sum(ps(:n, f_mass))
    if (field%has_motion) then
      call compare_motion(sim, field, material, n, ps(1, sim%scene%layout%origin), ps(1, f_mass), &
                          ps(1, f_pos), ps(1, f_vel), ps(1, f_temp), ps(1, f_tau), sums, maxima)
    end if
    if (.not. field%has_temperature) return
    call field%temperature(sim%clock%heat_time, ps(1, sim%scene%layout%origin), temp)
    temp = abs(ps(:, f_temp) - temp)
    sums(6) = sums(6) + sum(ps(:n, f_mass)*temp(:n)**2)
    maxima(2) = max(maxima(2), maxval(temp(:n)))
  end subroutine add_block

  !> Add the errors of position, velocity and stress of a block of particles.
  subroutine compare_motion(sim, field, material, n, x0, mass, x, v, temp, tau, sums, maxima)
    type(simulation_t), intent(in) :: sim
    class(field_t), intent(in) :: field
    type(material_t), intent(in) :: material
    integer, intent(in) :: n
    real(rp), intent(in) :: x0(nlane, 3), mass(nlane), x(nlane, 3), v(nlane, 3), temp(nlane)
    real(rp), intent(in) :: tau(nlane, 6)
    real(rp), intent(inout) :: sums(n_sums), maxima(n_maxima)
    real(rp), dimension(nlane, 3) :: exact_x, exact_v, unused
    real(rp) :: f(nlane, 9), bbar(nlane, 6), jac(nlane), exact_tau(nlane, 6), d(3)
    integer :: p

    call field%motion(velocity_time(sim%scene, sim%clock), x0, unused, exact_v, f)
    call field%motion(sim%clock%time, x0, exact_x, unused, f)
    call compute_elastic_state(material, n, f, temp, bbar, jac, exact_tau)
    do p = 1, n
      d = sim%scene%grid%nearest_image(x(p, :) - exact_x(p, :))
      sums(2) = sums(2) + mass(p)*sum(d**2)
      sums(3) = sums(3) + mass(p)*sum((v(p, :) - exact_v(p, :))**2)
      sums(4) = sums(4) + mass(p)*squared_norm(tau(p, :) - exact_tau(p, :))
      sums(5) = sums(5) + mass(p)*squared_norm(exact_tau(p, :))
      maxima(1) = max(maxima(1), norm2(d))
    end do
  end subroutine compare_motion

  !> s : s of a symmetric tensor in Voigt order.
  pure real(rp) function squared_norm(s)
    real(rp), intent(in) :: s(6)

    squared_norm = sum(s(1:3)**2) + 2.0_rp*sum(s(4:6)**2)
  end function squared_norm

end module output_error_norms
