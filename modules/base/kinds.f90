! SPDX-License-Identifier: MIT
!> Numeric kinds and common constants.
module base_kinds
  use, intrinsic :: iso_fortran_env, only: int64, real32, real64
  implicit none (type, external)
  private

  integer, parameter, public :: rp = real64   !! working precision of every field
  integer, parameter, public :: sp = real32   !! precision of output frames
  integer, parameter, public :: i8 = int64    !! particle identities and global counts
  integer, parameter, public :: nlane = 64    !! particles per block (lanes of a batch)

  real(rp), parameter, public :: pi = 3.141592653589793238462643383279502884_rp

end module base_kinds
