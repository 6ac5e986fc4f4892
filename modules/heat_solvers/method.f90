! SPDX-License-Identifier: MIT
!> Names of the methods of time integration and of the linear solvers.
module heat_solvers_method
  implicit none (type, external)
  private

  integer, parameter, public :: euler = 1, rkl2 = 2, backward_euler = 3, tr_bdf2 = 4
  integer, parameter, public :: by_cg = 1, by_fft = 2, by_petsc = 3
  integer, parameter, public :: max_iterations = 2000    !! limit of conjugate gradients

  character(14), parameter, public :: method_names(4) = [character(14) :: &
    'explicit', 'rkl2', 'backward-euler', 'tr-bdf2']
  character(5), parameter, public :: solver_names(3) = [character(5) :: 'cg', 'fftw', 'petsc']

end module heat_solvers_method
