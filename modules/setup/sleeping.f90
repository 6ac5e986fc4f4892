! SPDX-License-Identifier: MIT
!> Whether material may sleep in this scene, and when.
module setup_sleeping
  use base_kinds, only: rp
  use contact_tool, only: kind_particles
  use setup_complaints, only: complaints_t
  use setup_input, only: input_t
  use time_scene, only: scheme_usl, transfer_flip
  use time_state, only: simulation_t
  implicit none (type, external)
  private

  public :: read_sleeping

contains

  !> Fill `sim%scene%method%sleep`; the tools and bodies stand.
  subroutine read_sleeping(input, sim, complaints)
    type(input_t), intent(in) :: input
    type(simulation_t), intent(inout) :: sim
    type(complaints_t), intent(inout) :: complaints

    associate (sleep => sim%scene%method%sleep)
      sleep%is_on = input%switches_on(complaints, 'METHOD', 'SLEEPING', what_forbids(input, sim), &
                                      is_quasi_static(sim))
      if (.not. sleep%is_on) return
      sleep%distance = input%real('METHOD', 1, 'SLEEP_DISTANCE')
      if (sleep%distance <= 0.0_rp) sleep%distance = 0.5_rp*maxval(sim%tool%radius)
      sleep%strain = input%real('METHOD', 1, 'SLEEP_STRAIN')
      sleep%rate = input%real('METHOD', 1, 'SLEEP_RATE')
      sleep%heat = input%real('METHOD', 1, 'SLEEP_HEAT')
    end associate
    call sim%scene%layout%add(1, sim%scene%layout%rest)
  end subroutine read_sleeping

  !> Whether waves are of no interest: the inertia of the material is not the true one.
  pure logical function is_quasi_static(sim)
    type(simulation_t), intent(in) :: sim

    is_quasi_static = sim%scene%method%mass_scaling > 1.0_rp
  end function is_quasi_static

  !> What in the scene sleeping does not go with; '' if nothing.
  function what_forbids(input, sim) result(text)
    type(input_t), intent(in) :: input
    type(simulation_t), intent(in) :: sim
    character(:), allocatable :: text

    text = ''
    if (size(sim%tool) == 0) then
      text = 'no &TOOL'
    else if (any(sim%tool%kind == kind_particles) .or. sim%n_groups > 1) then
      text = 'bodies in contact'
    else if (input%count('LOAD') > 0) then
      text = 'a &LOAD'
    else if (input%count('FIELD') > 0) then
      text = 'a &FIELD'
    else if (any(sim%scene%grid%period > 0)) then
      text = 'a periodic grid'
    else if (sim%scene%method%scheme /= scheme_usl) then
      text = 'a SCHEME other than usl'
    else if (sim%scene%method%transfer /= transfer_flip) then
      text = 'a TRANSFER other than flip'
    end if
  end function what_forbids

end module setup_sleeping
