! SPDX-License-Identifier: MIT
!> Date, wall-clock and processor time, and the times of the phases of a step.
module base_timers
  use base_kinds, only: i8, rp
  implicit none (type, external)
  private

  public :: wall_time, cpu_seconds, now, phase_timer_t

  integer, parameter, public :: n_phases = 7

  ! Phases of a step whose times are measured.
  integer, parameter, public :: ph_to_grid = 1, ph_exchange = 2, ph_nodes = 3, &
                                ph_to_particles = 4, ph_conduction = 5, ph_sorting = 6, &
                                ph_output = 7
  character(17), parameter, public :: phase_name(n_phases) = [character(17) :: &
    'to_grid', 'exchange', 'nodes', 'to_particles', 'conduction', 'sorting', 'output']

  !> Wall-clock times of the phases; `lap(k)` adds the time since the last call to phase k [s].
  type :: phase_timer_t
    real(rp) :: seconds(n_phases) = 0.0_rp, last = 0.0_rp
  contains
    procedure :: start, lap
  end type phase_timer_t

contains

  !> Seconds of wall-clock time since an arbitrary origin.
  real(rp) function wall_time()
    integer(i8) :: ticks, rate

    call system_clock(ticks, rate)
    wall_time = real(ticks, rp)/real(rate, rp)
  end function wall_time

  !> Date and time, to the second.
  function now() result(text)
    character(19) :: text
    integer :: v(8)

    call date_and_time(values=v)
    write (text, '(i4.4,2("-",i2.2)," ",i2.2,2(":",i2.2))') v(1:3), v(5:7)
  end function now

  !> Seconds of processor time used by this process.
  real(rp) function cpu_seconds()
    call cpu_time(cpu_seconds)
  end function cpu_seconds

  !> Start timing.
  subroutine start(self)
    class(phase_timer_t), intent(inout) :: self

    self%last = wall_time()
  end subroutine start

  !> Add the time since the last call to phase `k`.
  subroutine lap(self, k)
    class(phase_timer_t), intent(inout) :: self
    integer, intent(in) :: k
    real(rp) :: now

    now = wall_time()
    self%seconds(k) = self%seconds(k) + now - self%last
    self%last = now
  end subroutine lap

end module base_timers
