! SPDX-License-Identifier: MIT
!> Metal that necks from the first plastic strain on (Considere, 1885): in tension a bar is stable
!> while its load rises, d(sigma exp(-epsilon))/d(epsilon) > 0. Without that the width of the neck
!> is that of the cells, and what follows depends on them.
module checks_necking
  use base_kinds, only: rp
  use base_text, only: str
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  use physics_point, only: point_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: check_necking

  real(rp), parameter :: strain = 0.01_rp        !! at whose end the load is compared
  real(rp), parameter :: rate = 1.0_rp           !! plastic strain rate of the comparison [1/s]

contains

  !> Warn of such bodies in a scene without tools; under a tool metal is pressed.
  subroutine check_necking(input, scene, diagnostics)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(diagnostics_t), intent(inout) :: diagnostics
    type(point_t) :: point
    real(rp) :: yield, temperature
    integer :: b

    if (input%count('TOOL') > 0) return
    do b = 1, size(scene%body)
      associate (material => scene%material(scene%body(b)%material))
        if (scene%body(b)%is_rigid() .or. .not. allocated(material%flow)) cycle
        temperature = input%real('BODY', b, 'TEMPERATURE')
        call point%init(material, temperature, rate)
        yield = point%sigma
        call point%strain_to(material, strain, rate, temperature)
        if (point%sigma*exp(-strain) >= yield) cycle
        call input%warn(diagnostics, 'BODY', b, 'MATERIAL', 'does not harden: its flow stress '// &
                        'changes by '//str(100.0_rp*(point%sigma/yield - 1.0_rp))// &
                        ' % in the first '//str(100.0_rp*strain)//' % of plastic strain. Where '// &
                        'it is stretched it necks, in a band as wide as the cells')
      end associate
    end do
  end subroutine check_necking

end module checks_necking
