! SPDX-License-Identifier: MIT
!> Detection of cells above the melting temperature in heat-only runs.
module heat_alone_melting
  use base_kinds, only: rp
  use comm_world, only: world_t
  use heat_alone_state, only: heat_run_t
  use output_melting, only: melting_t, melt_sample_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: sample_cells, check_cells

contains

  !> Collective. Check the cells at a row of the history.
  subroutine check_cells(melting, world, scene, run)
    type(melting_t), intent(inout) :: melting
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(heat_run_t), intent(in) :: run

    if (all(scene%material%t_melt >= huge(1.0_rp))) return
    call melting%update(world, scene, sample_cells(scene, run), run%time)
  end subroutine check_cells

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
            mass = mesh%capacity(c)/heat%property%c_ref      ! tables may have replaced c_p
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

end module heat_alone_melting
