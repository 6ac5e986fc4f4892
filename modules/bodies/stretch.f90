! SPDX-License-Identifier: MIT
!> Initial elastic state of bodies from &BODY DEFORMATION.
module bodies_stretch
  use base_kinds, only: nlane, rp
  use input_values, only: input_t
  use physics_stress, only: elastic_stress
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: check_stretch, stretch_bodies

contains

  !> Report an invalid deformation gradient of body `i`.
  subroutine check_stretch(input, i)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp) :: jac

    jac = determinant(deformation(input, i))
    if (.not. (jac > 0.0_rp .and. jac <= huge(1.0_rp))) then
      call input%report('BODY', i, 'DEFORMATION', 'must have a determinant above 0')
    end if
  end subroutine check_stretch

  !> Set the initial elastic state and stress of bodies with a deformation.
  subroutine stretch_bodies(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    real(rp) :: f(3, 3), c(3, 3), b(nlane, 6), j(nlane), tau(nlane, 6), temp(nlane)
    integer :: i

    do i = 1, size(scene%body)
      if (.not. input%given('BODY', i, 'DEFORMATION')) cycle
      associate (start => scene%body(i)%start)
        f = deformation(input, i)
        start%jac = determinant(f)
        c = matmul(f, transpose(f))*start%jac**(-2.0_rp/3.0_rp)
        start%bbar = [c(1, 1), c(2, 2), c(3, 3), c(1, 2), c(2, 3), c(1, 3)]
        b = spread(start%bbar, 1, nlane)
        j = start%jac
        temp = input%real('BODY', i, 'TEMPERATURE')
        call elastic_stress(scene%material(scene%body(i)%material), 1, temp, b, j, tau, start%wave2)
        start%tau = tau(1, :)
      end associate
    end do
  end subroutine stretch_bodies

  !> Deformation gradient of body `i`.
  function deformation(input, i) result(f)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp) :: f(3, 3)

    f = transpose(reshape(input%reals('BODY', i, 'DEFORMATION', 9), [3, 3]))
  end function deformation

  !> Determinant of a tensor.
  pure real(rp) function determinant(f)
    real(rp), intent(in) :: f(3, 3)

    determinant = f(1, 1)*(f(2, 2)*f(3, 3) - f(2, 3)*f(3, 2)) &
                  - f(1, 2)*(f(2, 1)*f(3, 3) - f(2, 3)*f(3, 1)) &
                  + f(1, 3)*(f(2, 1)*f(3, 2) - f(2, 2)*f(3, 1))
  end function determinant

end module bodies_stretch
