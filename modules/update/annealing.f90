! SPDX-License-Identifier: MIT
!> Static annealing: change of the internal variables of flow laws with time and temperature.
module update_annealing
  use base_kinds, only: nlane, rp
  use particles_store, only: f_rate, f_temp, particles_t
  use physics_flow_law, only: flow_law_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: anneal_particles

contains

  !> Apply recovery, coarsening and recrystallisation over `dt` [s] at the particles' temperatures.
  subroutine anneal_particles(scene, particles, dt)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    real(rp), intent(in) :: dt
    integer :: b

    if (.not. any(scene%material%anneals())) return
    do b = 1, particles%nblk
      associate (material => scene%material(scene%body(particles%body(b))%material))
        if (.not. allocated(material%flow)) cycle
        call anneal_one(material%flow, dt, scene%layout%law, particles%nf, particles%ps(:, :, b))
      end associate
    end do
  end subroutine anneal_particles

  subroutine anneal_one(law, dt, place, nf, ps)
    class(flow_law_t), intent(in) :: law
    real(rp), intent(in) :: dt
    integer, intent(in) :: place, nf
    real(rp), intent(inout) :: ps(nlane, nf)

    call law%anneal(dt, ps(1, f_temp), ps(1, f_rate), ps(1, place))
  end subroutine anneal_one

end module update_annealing
