! SPDX-License-Identifier: MIT
!> Contact of material points with a rigid analytic tool.
!>
!> A point touches when its domain (half its spacing) reaches the tool's signed distance, so that
!> the gap is resolved far below the cell. The impulse that the point needs to stop approaching is
!> limited by Coulomb's law and the shear strength, and acts through the nodes in the next step
!> (as a force in the particle-to-grid transfer). Since every node's mass is at least that of the
!> points in contact there, the impulse m dv of a point can never turn its velocity round.
module contact_tool
  use base_kinds, only: nlane, rp
  use contact_motion, only: motion_t
  use contact_shapes, only: box_distance, profile_t, revolved_distance
  implicit none (type, external)
  private

  public :: tool_t, contact_block, measure_gaps, slip_rate, tool_is_near

  integer, parameter, public :: kind_revolved = 1, kind_plane = 2, kind_sphere = 3, &
                                kind_box = 4, kind_particles = 5

  ! What a tool sums up between two reports.
  integer, parameter, public :: &
    s_force = 1, &      !! impulse on the tool [N s], 3
    s_torque = 4, &     !! angular impulse on the tool about its axis against the spin [N m s]
    s_work = 5, &       !! work of the tool on the material [J]
    s_friction = 6, &   !! friction heat [J]
    s_normal = 7, &     !! energy lost in normal contact [J]
    s_press = 8, &      !! normal impulse [N s]
    s_creep = 9, &      !! normal impulse times tangential speed of the material [N m]
    s_slide = 10, &     !! normal impulse times tangential speed of the tool [N m]
    s_to_plate = 11     !! friction heat given to the material [J]
  integer, parameter, public :: n_tool_sums = 11

  type :: tool_t
    character(32) :: name = 'tool'
    integer :: kind = kind_revolved
    type(profile_t) :: profile             !! revolved
    real(rp) :: radius = 0.0_rp            !! sphere, bounding radius of the others [m]
    real(rp) :: half(3) = 0.0_rp           !! box: half edges [m]
    real(rp) :: start(3) = 0.0_rp          !! position at t = 0 [m]
    real(rp) :: frame(3, 3) = 0.0_rp       !! columns: local axes at t = 0
    real(rp) :: friction = 0.0_rp
    logical :: shear_limit = .true.
    real(rp) :: heat_share = 1.0_rp        !! share of friction heat into the material
    type(motion_t) :: motion
    ! pose at the current time, and the one before
    real(rp) :: position(3) = 0.0_rp, velocity(3) = 0.0_rp, omega(3) = 0.0_rp
    real(rp) :: axes(3, 3) = 0.0_rp        !! local axes now
    real(rp) :: last_position(3) = 0.0_rp, last_axes(3, 3) = 0.0_rp
    real(rp) :: spin = 0.0_rp
    real(rp) :: sums(n_tool_sums) = 0.0_rp
  contains
    procedure :: move_to
    procedure :: mean_motion
    procedure :: carry
    procedure :: distance
    procedure :: surface_velocity
  end type tool_t

  real(rp), parameter, public :: closing = 0.2_rp   !! share of a penetration taken back in one step
  real(rp), parameter :: memory = 0.9_rp    !! share of a sticking force kept for the next step

contains

  !> Put the tool where its schedule says at time `t`.
  pure subroutine move_to(self, t)
    class(tool_t), intent(inout) :: self
    real(rp), intent(in) :: t                   !! [s]
    real(rp) :: shift(3), angle, c, s

    self%last_position = self%position
    self%last_axes = self%axes
    call self%motion%at(t, shift, self%velocity, angle, self%spin)
    self%position = self%start + shift
    self%omega = -self%spin*self%frame(:, 3)    ! clockwise seen from above
    c = cos(angle)
    s = -sin(angle)
    self%axes(:, 1) = c*self%frame(:, 1) + s*self%frame(:, 2)
    self%axes(:, 2) = c*self%frame(:, 2) - s*self%frame(:, 1)
    self%axes(:, 3) = self%frame(:, 3)
  end subroutine move_to

  !> Means over the `dt` from `t` of the tool's position, velocity and angular velocity.
  pure subroutine mean_motion(self, t, dt, position, velocity, omega)
    class(tool_t), intent(in) :: self
    real(rp), intent(in) :: t, dt                                   !! [s]
    real(rp), intent(out) :: position(3), velocity(3), omega(3)     !! [m], [m/s], [rad/s]
    real(rp), dimension(3) :: from, to, unused
    real(rp) :: before, after, spin

    call self%motion%at(t, from, unused, before, spin)
    call self%motion%at(t + dt, to, unused, after, spin)
    position = self%start + 0.5_rp*(from + to)
    velocity = (to - from)/dt
    omega = -(after - before)/dt*self%frame(:, 3)
  end subroutine mean_motion

  !> Where a point `x` of the rigid tool has got to by the last move.
  pure function carry(self, x) result(y)
    class(tool_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp) :: y(3)

    y = self%position + matmul(self%axes, matmul(x - self%last_position, self%last_axes))
  end function carry

  !> Signed distance of `x` from the tool and its gradient (out of the tool).
  pure subroutine distance(self, x, d, n)
    class(tool_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp), intent(out) :: d, n(3)
    real(rp) :: y(3), m(3)

    y = matmul(x - self%position, self%axes)
    select case (self%kind)
    case (kind_revolved)
      call revolved_distance(self%profile, y, d, m)
    case (kind_sphere)
      d = norm2(y)
      m = y/max(d, tiny(1.0_rp))
      d = d - self%radius
    case (kind_box)
      call box_distance(self%half, y, d, m)
    case (kind_particles)      ! it touches nodes, not points
      d = huge(1.0_rp)
      m = 0.0_rp
    case default
      d = y(3)
      m = [0.0_rp, 0.0_rp, 1.0_rp]
    end select
    n = matmul(self%axes, m)
  end subroutine distance

  !> Velocity of the rigid tool at `x` [m/s].
  pure function surface_velocity(self, x) result(v)
    class(tool_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp) :: v(3), r(3)

    r = x - self%position
    v = self%velocity + [self%omega(2)*r(3) - self%omega(3)*r(2), &
                         self%omega(3)*r(1) - self%omega(1)*r(3), &
                         self%omega(1)*r(2) - self%omega(2)*r(1)]
  end function surface_velocity

  !> True if a block inside the ball (centre, radius) may touch any tool.
  pure logical function tool_is_near(tools, centre, radius)
    type(tool_t), intent(in) :: tools(:)
    real(rp), intent(in) :: centre(3), radius
    real(rp) :: d, n(3)
    integer :: k

    tool_is_near = .false.
    do k = 1, size(tools)
      call tools(k)%distance(centre, d, n)
      tool_is_near = tool_is_near .or. d <= radius
    end do
  end function tool_is_near

  !> Nearest tool of each particle of a block, the distance from it and its direction. Beyond `far`
  !> only a lower bound of the distance is wanted: a distance changes by no more than the way from
  !> the first particle.
  pure subroutine measure_gaps(tools, n, far, x, touched, d, normal)
    type(tool_t), intent(in) :: tools(:)
    integer, intent(in) :: n
    real(rp), intent(in) :: far                            !! [m]
    real(rp), intent(in) :: x(nlane, 3)                    !! [m]
    integer, intent(out) :: touched(nlane)
    real(rp), intent(out) :: d(nlane), normal(nlane, 3)    !! [m], out of the tool
    real(rp) :: trial, direction(3), first
    integer :: k, p

    touched = 1
    d = huge(1.0_rp)
    normal = 0.0_rp
    do k = 1, size(tools)
      call tools(k)%distance(x(1, :), first, direction)
      do p = 1, n
        trial = first - norm2(x(p, :) - x(1, :))
        if (trial <= far) call tools(k)%distance(x(p, :), trial, direction)
        if (trial >= d(p)) cycle
        d(p) = trial
        touched(p) = k
        normal(p, :) = direction
      end do
    end do
  end subroutine measure_gaps

  !> Shear rate of a layer of one spacing that sticks to the nearest tool, over sqrt(3): the rate of
  !> plastic strain at which the shear limit of friction is taken [1/s].
  pure subroutine slip_rate(tools, n, spacing, touched, x, v, rate)
    type(tool_t), intent(in) :: tools(:)
    integer, intent(in) :: n, touched(nlane)
    real(rp), intent(in) :: spacing                        !! [m]
    real(rp), intent(in) :: x(nlane, 3), v(nlane, 3)       !! [m], [m/s]
    real(rp), intent(out) :: rate(nlane)
    integer :: p

    rate = 1.0_rp
    do p = 1, n
      rate(p) = norm2(v(p, :) - tools(touched(p))%surface_velocity(x(p, :)))/(sqrt(3.0_rp)*spacing)
    end do
  end subroutine slip_rate

  !> Close the books of the force that acted in the step just done, and set the next one.
  subroutine contact_block(tools, n, dt, inertia, spacing, touched, d, normal, x, v, dv, mass, &
                           strength, force, heat)
    type(tool_t), intent(inout) :: tools(:)
    integer, intent(in) :: n                     !! particles in the block
    real(rp), intent(in) :: dt                   !! [s]
    real(rp), intent(in) :: inertia              !! mass scaling
    real(rp), intent(in) :: spacing(3)           !! distance of the particles along the axes [m]
    integer, intent(in) :: touched(nlane)        !! nearest tool
    real(rp), intent(in) :: d(nlane), normal(nlane, 3)   !! distance from it [m], its direction
    real(rp), intent(in) :: x(nlane, 3)          !! positions, already advanced [m]
    real(rp), intent(in) :: v(nlane, 3)          !! grid velocity at the particles [m/s]
    real(rp), intent(in) :: dv(nlane, 3)         !! its change in the step [m/s]
    real(rp), intent(in) :: mass(nlane)          !! [kg]
    real(rp), intent(in) :: strength(nlane)      !! flow stress for the shear limit [Pa]; 0: none
    real(rp), intent(inout) :: force(nlane, 3)   !! contact force [N]
    real(rp), intent(inout) :: heat(nlane)       !! heat waiting for conduction [J]
    real(rp) :: slip_limit, reach
    integer :: p

    do p = 1, n
      associate (tool => tools(touched(p)))
        if (any(abs(force(p, :)) > 0.0_rp)) then
          call settle(tool, dt, normal(p, :), x(p, :), v(p, :), dv(p, :), force(p, :), heat(p))
        end if
        reach = 0.5_rp*norm2(normal(p, :)*spacing)
        slip_limit = huge(1.0_rp)
        if (tool%shear_limit .and. strength(p) > 0.0_rp) then
          slip_limit = strength(p)*product(spacing)/(2.0_rp*reach)/sqrt(3.0_rp)
        end if
        call contact_force(dt, inertia*mass(p), d(p) - reach, normal(p, :), &
                           v(p, :) - tool%surface_velocity(x(p, :)), tool%friction, slip_limit, &
                           force(p, :))
      end associate
    end do
  end subroutine contact_block

  !> Work, heat, force and torque of `force` over the step that it acted in.
  subroutine settle(tool, dt, normal, x, v, dv, force, heat)
    type(tool_t), intent(inout) :: tool
    real(rp), intent(in) :: dt, normal(3), x(3), v(3), dv(3), force(3)
    real(rp), intent(inout) :: heat
    real(rp) :: mean(3), rigid(3), slip(3), fn, lost, friction, r(3), moment(3), press

    rigid = tool%surface_velocity(x)
    mean = v - 0.5_rp*dv                        ! the velocity that the force worked on
    slip = mean - rigid
    fn = dot_product(force, normal)
    lost = -dt*dot_product(force, slip)
    friction = lost + dt*fn*dot_product(slip, normal)
    r = x - tool%position
    moment = [r(2)*force(3) - r(3)*force(2), r(3)*force(1) - r(1)*force(3), &
              r(1)*force(2) - r(2)*force(1)]
    press = dt*abs(fn)
    mean = mean - dot_product(mean, normal)*normal
    rigid = rigid - dot_product(rigid, normal)*normal
    associate (s => tool%sums)
      s(s_force:s_force + 2) = s(s_force:s_force + 2) - dt*force
      s(s_torque) = s(s_torque) - dt*dot_product(moment, tool%axes(:, 3))
      s(s_work) = s(s_work) + dt*dot_product(force, tool%surface_velocity(x))
      s(s_friction) = s(s_friction) + friction
      s(s_normal) = s(s_normal) + lost - friction
      s(s_press) = s(s_press) + press
      s(s_creep) = s(s_creep) + press*norm2(mean)
      s(s_slide) = s(s_slide) + press*norm2(rigid)
      s(s_to_plate) = s(s_to_plate) + tool%heat_share*friction
    end associate
    heat = heat + tool%heat_share*friction
  end subroutine settle

  !> Force that closes a positive gap within the step, or takes back part of a penetration; never
  !> tensile. Tangentially as much as stops the slip, at most friction*normal or `limit` [N].
  pure subroutine contact_force(dt, m, gap, normal, slip, friction, limit, force)
    real(rp), intent(in) :: dt, m               !! [s], inertial mass [kg]
    real(rp), intent(in) :: gap, normal(3)      !! [m], out of the tool
    real(rp), intent(in) :: slip(3)             !! velocity of the material against the tool [m/s]
    real(rp), intent(in) :: friction, limit
    real(rp), intent(inout) :: force(3)         !! of the last step, of the next [N]
    real(rp) :: vn, fn, ft, tangent(3)
    vn = dot_product(slip, normal)
    fn = -m/dt*(vn + gap/dt*merge(closing, 1.0_rp, gap < 0.0_rp))
    if (fn <= 0.0_rp) then
      force = 0.0_rp
      return
    end if
    tangent = memory*(force - dot_product(force, normal)*normal) - m/dt*(slip - vn*normal)
    force = fn*normal
    ft = norm2(tangent)
    if (ft > 0.0_rp) force = force + min(1.0_rp, min(friction*fn, limit)/ft)*tangent
  end subroutine contact_force

end module contact_tool
