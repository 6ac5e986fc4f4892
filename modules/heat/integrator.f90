! SPDX-License-Identifier: MIT
!> Time integration of a temperature field: explicit Euler, the super-time-stepping scheme RKL2
!> (Meyer, Balsara & Aslam 2014, J. Comput. Phys. 257, 594) or implicit schemes
!> (heat_implicit). Steps are controlled by an error estimate. The heat of sources and films
!> is integrated with the same scheme as the field, so that the balance is exact.
module heat_integrator
  use base_kinds, only: i8, rp
  use heat_implicit, only: implicit_t, order_of
  use heat_linear, only: backward_euler, euler, rkl2, tr_bdf2
  use heat_rates, only: heat_t, n_heats
  implicit none (type, external)
  private

  public :: integrator_t, n_kept

  !> Fields of a restart besides the state: rate, mean rate, preconditioner.
  integer, parameter :: n_kept = 3

  real(rp), parameter :: safety = 0.8_rp, max_growth = 2.0_rp, min_growth = 0.2_rp
  integer, parameter :: max_refused = 50           !! largest number of refused trials of one step
  real(rp), parameter :: stability_fraction = 0.95_rp  !! used fraction of the stability limit

  !> State of the time integration.
  type :: integrator_t
    integer :: method = rkl2
    real(rp) :: tolerance = 2.0_rp                 !! largest error of a step in any cell [K]
    real(rp) :: fixed = 0.0_rp                     !! fixed step [s]; 0: by the error estimate
    real(rp) :: next = 0.0_rp                      !! next trial step [s]
    real(rp) :: last = 0.0_rp                      !! last accepted step [s]
    integer(i8) :: steps = 0, refused = 0          !! accepted and refused steps so far
    logical :: is_stuck = .false.                  !! a step failed; the state is that before it
    real(rp) :: heats(n_heats) = 0.0_rp            !! heat of sources and films since t = 0 [J]
    type(implicit_t) :: implicit
    logical, private :: has_rate = .false.         !! `m0` and `p0` are of the current state
    logical, allocatable, private :: was_on(:)
    real(rp), private :: p0(n_heats) = 0.0_rp
    real(rp), allocatable, private, dimension(:) :: y0, y1, m0, m1
  contains
    procedure :: start, advance, pack_restart_data, unpack_restart_data
  end type integrator_t

contains

  !> Allocate the fields and choose the first step.
  subroutine start(self, heat)
    class(integrator_t), intent(inout) :: self
    type(heat_t), intent(inout) :: heat
    integer :: lo, hi

    lo = lbound(heat%theta, 1)
    hi = ubound(heat%theta, 1)
    allocate (self%y0(lo:hi), self%y1(lo:hi), self%m0(lo:hi), self%m1(lo:hi), source=0.0_rp)
    allocate (self%was_on(size(heat%source)), source=.false.)
    if (self%next <= 0.0_rp) self%next = 10.0_rp/max(heat%max_decay_rate, 1.0e-3_rp)
    if (self%fixed > 0.0_rp) self%next = self%fixed       ! a restart may have changed it
    if (is_implicit(self)) call self%implicit%start(heat, self%method)
  end subroutine start

  !> True for implicit methods.
  pure logical function is_implicit(self)
    class(integrator_t), intent(in) :: self

    is_implicit = self%method == backward_euler .or. self%method == tr_bdf2
  end function is_implicit

  !> Collective. Data for a restart besides the state: fields of the own cells, and numbers.
  subroutine pack_restart_data(self, heat, fields, numbers)
    class(integrator_t), intent(in) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(out) :: fields(:, :)                  !! (cells, n_kept)
    real(rp), allocatable, intent(out) :: numbers(:)       !! the same on all ranks
    real(rp) :: of_solver(2), power(n_heats*heat%world%size)

    power = 0.0_rp
    power(n_heats*heat%world%rank + 1:n_heats*(heat%world%rank + 1)) = self%p0
    call heat%world%sum(power)
    fields(:, 1) = self%m0(1:heat%size())
    call self%implicit%pack_restart_data(fields(:, 2:), of_solver)
    numbers = [of_solver, real(size(self%was_on), rp), merge(1.0_rp, 0.0_rp, self%was_on), &
               merge(1.0_rp, 0.0_rp, self%has_rate), power]
  end subroutine pack_restart_data

  !> Restore the data of `pack_restart_data` after `start`; with other sources the rates are
  !> computed again.
  subroutine unpack_restart_data(self, heat, fields, numbers)
    class(integrator_t), intent(inout) :: self
    type(heat_t), intent(in) :: heat
    real(rp), intent(in) :: fields(:, :), numbers(:)
    integer :: n

    if (is_implicit(self)) call self%implicit%unpack_restart_data(fields(:, 2:), numbers(:2))
    n = size(self%was_on)
    if (nint(numbers(3)) /= n) return
    self%was_on = numbers(4:3 + n) > 0.0_rp
    self%has_rate = numbers(4 + n) > 0.0_rp
    self%m0(1:heat%size()) = fields(:, 1)
    associate (power => reshape(numbers(5 + n:), [n_heats, (size(numbers) - 4 - n)/n_heats]))
      if (size(power, 2) == heat%world%size) then
        self%p0 = power(:, heat%world%rank + 1)
      else                               ! the number of ranks has changed
        self%p0 = merge(sum(power, dim=2), 0.0_rp, heat%world%is_root())
      end if
    end associate
  end subroutine unpack_restart_data

  !> Collective. Make one step, which ends at `t_limit` or before, and update `t`. If a step cannot
  !> be solved or does not meet the tolerance, the state is restored and `is_stuck` set on all
  !> ranks.
  subroutine advance(self, heat, t, t_limit)
    class(integrator_t), intent(inout) :: self
    type(heat_t), intent(inout) :: heat
    real(rp), intent(inout) :: t                   !! time [s]
    real(rp), intent(in) :: t_limit                !! latest end of the step [s]
    real(rp) :: dt, error(1), gain(n_heats), p1(n_heats), t_end, dt_wanted
    integer(i8) :: before

    before = self%refused
    do
      dt_wanted = self%next
      if (self%method == euler .and. heat%max_decay_rate > 0.0_rp) then
        dt_wanted = min(dt_wanted, stability_fraction/heat%max_decay_rate)
      end if
      dt = equal_part(dt_wanted, t_limit - t)
      t_end = t + dt
      if (abs(t_end - t_limit) <= 1.0e-12_rp*abs(t_limit)) t_end = t_limit
      call prepare_step(self, heat, t, t_end)
      self%y0 = heat%theta
      select case (self%method)
      case (euler)
        heat%theta = heat%theta + dt*self%m0
        gain = dt*self%p0
      case (rkl2)
        call rkl2_step(self, heat, dt, gain)
      case default
        call self%implicit%step(heat, dt, self%y0, self%m0, self%p0, gain)
      end select
      call heat%rate(heat%theta, 1.0_rp, self%m1, p1)
      error = 0.0_rp
      if (self%fixed > 0.0_rp .or. self%method == euler) then
        self%is_stuck = self%implicit%has_failed
        exit
      end if
      call estimate(self, heat, dt, error(1))
      call heat%world%max(error)
      self%next = dt*max(min_growth, min(max_growth, &
        safety*(self%tolerance/max(error(1), tiny(1.0_rp))) &
        **(1.0_rp/(1.0_rp + order_of(self%method)))))
      if (.not. error(1) > self%tolerance) exit   ! NaN is reported by the loop
      heat%theta = self%y0
      self%refused = self%refused + 1
      self%is_stuck = self%refused - before == max_refused
      if (self%is_stuck) exit
    end do
    if (self%is_stuck) then
      heat%theta = self%y0
      self%last = dt
      return
    end if
    ! a step shortened by an output does not shorten the next ones
    if (error(1) <= 0.25_rp*self%tolerance .and. dt < dt_wanted) self%next = max(self%next, &
                                                                                 dt_wanted)
    if (is_implicit(self)) call self%implicit%save_mean_rate(heat, dt, self%y0)
    call heat%world%sum(gain)
    self%heats = self%heats + gain
    call swap(self%m0, self%m1)
    self%p0 = p1
    self%has_rate = .true.
    self%steps = self%steps + 1
    self%last = dt
    t = t_end
  end subroutine advance

  !> Largest step up to `dt_wanted` such that equal steps fill the remaining time [s].
  pure real(rp) function equal_part(dt_wanted, left)
    real(rp), intent(in) :: dt_wanted, left

    equal_part = left
    if (dt_wanted < left) equal_part = left/real(ceiling(min(left/dt_wanted, 1.0e9_rp)), rp)
  end function equal_part

  !> Set the sources for the step, and the rates at its start if they are not known.
  subroutine prepare_step(self, heat, t, t_end)
    class(integrator_t), intent(inout) :: self
    type(heat_t), intent(inout) :: heat
    real(rp), intent(in) :: t, t_end

    call heat%set_sources(t, t_end)
    if (any(heat%is_on .neqv. self%was_on)) self%has_rate = .false.
    self%was_on = heat%is_on
    if (.not. self%has_rate) call heat%rate(heat%theta, 0.0_rp, self%m0, self%p0)
    self%has_rate = .true.
  end subroutine prepare_step

  !> RKL2 step with as many stages as stability requires.
  subroutine rkl2_step(self, heat, dt, gain)
    class(integrator_t), intent(inout) :: self
    type(heat_t), intent(inout) :: heat
    real(rp), intent(in) :: dt
    real(rp), intent(out) :: gain(n_heats)
    real(rp) :: a(5), b(-1:1), g(n_heats), g1(n_heats), gamma, mu, nu, p(n_heats), w1, factor
    integer :: j, s

    s = max(3, ceiling(0.5_rp*(sqrt(9.0_rp + 8.0_rp*dt*heat%max_decay_rate/stability_fraction) &
                               - 1.0_rp)))
    w1 = 4.0_rp/real(s*s + s - 2, rp)
    ! heat%theta holds stage j-1, y1 holds stage j-2 and then j; both are swapped
    self%y1 = self%y0
    g = 0.0_rp
    heat%theta = self%y0 + dt*w1/3.0_rp*self%m0
    g1 = dt*w1/3.0_rp*self%p0
    do j = 2, s
      b = [b_of(j - 2), b_of(j - 1), b_of(j)]
      mu = real(2*j - 1, rp)/real(j, rp)*b(1)/b(0)
      nu = -real(j - 1, rp)/real(j, rp)*b(1)/b(-1)
      factor = mu*w1*dt
      gamma = -(1.0_rp - b(0))*factor
      a = [mu, nu, 1.0_rp - mu - nu, factor, gamma]
      call heat%fill(heat%theta)
      call heat%stage(a, heat%theta, self%y1, self%y0, self%m0, part_of_step(j - 1, s), p)
      p = mu*g1 + nu*g + factor*p + gamma*self%p0
      g = g1
      g1 = p
      call swap(heat%theta, self%y1)
    end do
    gain = g1
  end subroutine rkl2_step

  !> Coefficient b_j of RKL2.
  pure real(rp) function b_of(j)
    integer, intent(in) :: j

    b_of = 1.0_rp/3.0_rp
    if (j > 2) b_of = real(j*j + j - 2, rp)/real(2*j*(j + 1), rp)
  end function b_of

  !> Time of stage `j` of `s` as a fraction of the step.
  pure real(rp) function part_of_step(j, s)
    integer, intent(in) :: j, s

    part_of_step = real(j*j + j - 2, rp)/real(s*s + s - 2, rp)
    if (j == 1) part_of_step = 4.0_rp/(3.0_rp*real(s*s + s - 2, rp))
  end function part_of_step

  !> Swap two arrays.
  subroutine swap(a, b)
    real(rp), allocatable, intent(inout) :: a(:), b(:)
    real(rp), allocatable :: c(:)

    call move_alloc(a, c)
    call move_alloc(b, a)
    call move_alloc(c, b)
  end subroutine swap

  !> Largest error of this rank's cells [K]: for RKL2 that of Sommeijer, Shampine & Verwer (1998,
  !> J. Comput. Appl. Math. 88, 315), 0.8 (y0 - y1) + 0.4 dt (f0 + f1).
  subroutine estimate(self, heat, dt, error)
    class(integrator_t), intent(inout) :: self
    type(heat_t), intent(inout) :: heat
    real(rp), intent(in) :: dt
    real(rp), intent(out) :: error
    integer :: c

    error = 0.0_rp
    if (is_implicit(self)) then
      call self%implicit%estimate(heat, dt, self%m0, self%m1, error)
      return
    end if
    !$omp simd reduction(max: error)
    do c = 1, heat%size()
      error = max(error, abs(0.8_rp*(self%y0(c) - heat%theta(c)) &
                             + 0.4_rp*dt*(self%m0(c) + self%m1(c))))
    end do
  end subroutine estimate

end module heat_integrator
