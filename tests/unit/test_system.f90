! SPDX-License-Identifier: MIT
!> Where the program is: the folder is known with and without a /proc, and what lies beside it is
!> found.
program test_system
  use base_system, only: data_file, program_folder
  use check, only: begin_tests, end_tests, expect, expect_equal
  implicit none (type, external)
  character(:), allocatable :: known, path, problem
  logical :: is_there

  call begin_tests()
  known = program_folder('/proc/self/exe')
  call expect('a folder', len(known) > 1)
  call expect('absolute, with a / at its end', known(1:1) == '/' .and. known(len(known):) == '/')
  inquire (file=known//'test_system', exist=is_there)
  call expect('of this program', is_there)
  call expect_equal('the same without a /proc', program_folder('/no such/link'), known)
  call data_file('materials.nml', path, problem)
  call expect_equal('the library of materials is found', problem, '')
  call expect_equal('where the program is', path(:len(known)), known)
  call data_file('no such file', path, problem)
  call expect_equal('a file that is missing', problem, 'is not there')
  call end_tests()
end program test_system
