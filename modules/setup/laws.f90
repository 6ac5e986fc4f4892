! SPDX-License-Identifier: MIT
!> Storage and warnings of the flow laws of the materials.
module setup_laws
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  use physics_material, only: material_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: lay_out_laws

contains

  !> Reserve particle storage for internal variables of the flow laws; list the warnings of the
  !> laws.
  subroutine lay_out_laws(input, scene, diagnostics)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: m

    allocate (scene%warning(0))
    associate (layout => scene%layout)
      do m = 1, size(scene%material)
        if (.not. allocated(scene%material(m)%flow)) cycle
        call list_warnings(scene%material(m), scene%warning)
        layout%n_law = max(layout%n_law, scene%material(m)%flow%n_state)
        if (scene%material(m)%flow%anneals .and. .not. scene%method%conducts) then
          call input%report(diagnostics, 'MATERIAL', m, '', &
                            scene%material(m)%flow%annealing_keys()// &
                            ' go with the conduction steps: there is no &HEAT')
        end if
      end do
      if (layout%n_law == 0) return
      layout%law = 0
      call layout%add(layout%n_law, layout%law)
    end associate
  end subroutine lay_out_laws

  !> Add the warnings of a material's flow law to those of the scene, without duplicates.
  subroutine list_warnings(material, all)
    type(material_t), intent(inout) :: material
    character(48), allocatable, intent(inout) :: all(:)
    character(48), allocatable :: own(:)
    integer :: k

    call material%flow%list_warnings(own)
    do k = 1, size(own)
      if (.not. any(all == own(k))) all = [all, own(k)]
      material%warning(k) = findloc(all, own(k), dim=1)
    end do
  end subroutine list_warnings

end module setup_laws
