! SPDX-License-Identifier: MIT
!> Whether nodes with little mass have more inertia in this scene (selective mass scaling).
module setup_scaling
  use base_kinds, only: rp
  use setup_complaints, only: complaints_t
  use setup_input, only: input_t
  use time_state, only: scheme_usl, simulation_t, transfer_flip
  implicit none (type, external)
  private

  public :: read_selective_scaling

contains

  !> Set `scales_light_nodes`; method and groups of bodies stand.
  subroutine read_selective_scaling(input, sim, complaints)
    type(input_t), intent(in) :: input
    type(simulation_t), intent(inout) :: sim
    type(complaints_t), intent(inout) :: complaints
    character(:), allocatable :: choice, obstacle

    choice = input%text('METHOD', 1, 'SELECTIVE_SCALING')
    obstacle = what_forbids(sim)
    if (choice == 'on' .and. obstacle /= '') then
      call input%complain(complaints, 'METHOD', 1, 'SELECTIVE_SCALING', 'cannot be on with '//obstacle)
    end if
    associate (method => sim%scene%method)
      method%scales_light_nodes = obstacle == '' .and. (choice == 'on' &
                                  .or. (choice == 'auto' .and. is_quasi_static(sim)))
    end associate
  end subroutine read_selective_scaling

  !> Whether waves are of no interest, and what a tool stirs is held: light nodes do not pass on all of the
  !> momentum of internal forces, which sets free bodies in motion.
  pure logical function is_quasi_static(sim)
    type(simulation_t), intent(in) :: sim

    is_quasi_static = sim%scene%method%mass_scaling > 1.0_rp .and. size(sim%tool) > 0 &
                      .and. size(sim%scene%constraint) > 0
  end function is_quasi_static

  !> What in the scene its limits were not measured with; '' if nothing.
  pure function what_forbids(sim) result(text)
    type(simulation_t), intent(in) :: sim
    character(:), allocatable :: text

    text = ''
    if (sim%n_groups > 1) then
      text = 'bodies in contact'
    else if (sim%scene%method%scheme /= scheme_usl) then
      text = 'a SCHEME other than usl'
    else if (sim%scene%method%transfer /= transfer_flip) then
      text = 'a TRANSFER other than flip'
    else if (.not. sim%scene%method%is_bspline) then
      text = 'a SHAPE other than bspline'
    end if
  end function what_forbids

end module setup_scaling
