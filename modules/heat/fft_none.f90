! SPDX-License-Identifier: MIT
!> Substitute for `fft.f90` in a build without FFTW; the set-up rejects scenes that would need it.
module heat_fft
  use base_errors, only: fatal
  use base_kinds, only: rp
  use heat_rates, only: heat_t
  implicit none (type, external)
  private

  public :: fft_t, has_fft

  logical, parameter :: has_fft = .false.

  type :: fft_t
    logical :: is_exact = .false.
  contains
    procedure :: start, apply, solve
  end type fft_t

contains

  subroutine start(self, heat)
    class(fft_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat

    call fatal('this program was built without FFTW')
  end subroutine start

  subroutine apply(self, heat, a, r, z)
    class(fft_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: a, r(:)
    real(rp), intent(out) :: z(:)

    z = r
  end subroutine apply

  subroutine solve(self, heat, a, d, r, z)
    class(fft_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: a, d(:), r(:)
    real(rp), intent(out) :: z(:)

    z = r
  end subroutine solve

end module heat_fft
