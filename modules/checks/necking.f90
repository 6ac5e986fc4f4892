! SPDX-License-Identifier: MIT
!> Check for material that necks from the first plastic strain on. By the criterion of Considere
!> (1885) a bar in tension is stable while its load rises, d(sigma exp(-epsilon))/d(epsilon) > 0.
!> Otherwise the neck is as wide as the cells, and the results depend on them.
module checks_necking
  use base_kinds, only: rp
  use base_text, only: str
  use input_values, only: input_t
  use physics_point, only: point_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: check_necking

  real(rp), parameter :: strain = 0.01_rp        !! plastic strain of the comparison
  real(rp), parameter :: rate = 1.0_rp           !! plastic strain rate of the comparison [1/s]

contains

  !> Warn of such bodies in scenes without tools; under a tool the material is in compression.
  subroutine check_necking(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
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
        call input%warn('BODY', b, 'MATERIAL', 'does not harden: its flow stress '// &
                        'changes by '//str(100.0_rp*(point%sigma/yield - 1.0_rp))// &
                        ' % in the first '//str(100.0_rp*strain)//' % of plastic strain. Where '// &
                        'it is stretched it necks, in a band as wide as the cells')
      end associate
    end do
  end subroutine check_necking

end module checks_necking
