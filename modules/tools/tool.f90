! SPDX-License-Identifier: MIT
!> Rigid tools: motion, signed distance from their shape, and accumulated contact sums
!> (contact_tool_impulses). A tool without a shape is a rigid body of particles, with contact at
!> nodes.
module tools_tool
  use base_kinds, only: nlane, rp
  use tools_heat_sink, only: heat_sink_t
  use tools_law, only: friction_law_t, friction_table_t, law_coulomb, of_nothing
  use tools_monitor, only: monitor_t
  use tools_motion, only: drive_t, motion_t, wrapped
  use tools_shape, only: no_edge, shape_t
  use tools_sums, only: n_tool_sums, s_force, s_friction, s_metal_slip, s_normal_impulse, &
                        s_normal_loss, s_tool_slip, s_torque, s_work
  implicit none (type, external)
  private

  public :: tool_t, rigid_t

  !> Mean rigid motion over a step.
  type :: rigid_t
    real(rp) :: centre(3) = 0.0_rp                         !! [m]
    real(rp) :: velocity(3) = 0.0_rp, omega(3) = 0.0_rp  !! velocity [m/s], angular velocity [rad/s]
  contains
    procedure :: velocity_at
  end type rigid_t

  type :: tool_t
    character(32) :: name = 'tool'
    class(shape_t), allocatable :: shape   !! unallocated: rigid body of particles
    real(rp) :: start(3) = 0.0_rp          !! position at t = 0 [m]
    real(rp) :: frame(3, 3) = 0.0_rp       !! local axes at t = 0, in columns, for travel along +x
    real(rp) :: friction_coefficient = 0.0_rp  !! coefficient of Coulomb's law
    type(friction_law_t) :: friction_law
    type(friction_table_t) :: friction_table  !! table of the coefficient of the law
    !> Given fraction of the friction heat that enters the material.
    real(rp) :: fixed_heat_share = 1.0_rp
    !> Effusivity [J/(m2 K s^0.5)]; above 0 it determines the fraction of the friction heat that
    !> enters the material.
    real(rp) :: effusivity = 0.0_rp
    type(heat_sink_t) :: heat                 !! sink of the remaining friction heat
    type(motion_t) :: motion
    type(drive_t) :: drive      !! machine that presses the tool along its axis
    type(monitor_t) :: monitor  !! load monitor: phase ends and limits
    integer :: n_phases = 0     !! phases in the input
    ! Pose at the current time and at the time before: position [m], velocity [m/s], angular
    ! velocity [rad/s], axes.
    real(rp) :: position(3) = 0.0_rp, velocity(3) = 0.0_rp, omega(3) = 0.0_rp
    real(rp) :: axes(3, 3) = 0.0_rp        !! current local axes
    real(rp) :: last_position(3) = 0.0_rp, last_axes(3, 3) = 0.0_rp
    !> Position [m] and axes at the last sort.
    real(rp) :: reference_position(3) = 0.0_rp, reference_axes(3, 3) = 0.0_rp
    real(rp) :: spin = 0.0_rp                                 !! [rad/s]
    real(rp) :: angle = 0.0_rp                                !! angle turned since t = 0 [rad]
    real(rp) :: sums(n_tool_sums) = 0.0_rp
    !> Largest temperature of the face in this step [K]; 0: no layer shears.
    real(rp) :: max_face_temperature = 0.0_rp
  contains
    procedure :: has_shape, has_friction, has_layer, heat_share, stirring_radius, move_to
    procedure :: mean_motion
    procedure, private :: facing
    procedure :: tilt, move_point, distance, clearance, clearances, bounds, store_reference_pose
    procedure :: displacement, surface_velocity, record_impulse
  end type tool_t

contains

  !> Move the tool to its pose at time `t` by schedule and drive.
  elemental subroutine move_to(self, t)
    class(tool_t), intent(inout) :: self
    real(rp), intent(in) :: t                   !! time [s]
    real(rp) :: frame(3, 3), rate, shift(3), c, s

    self%last_position = self%position
    self%last_axes = self%axes
    call self%motion%at(t, shift, self%velocity, self%angle, self%spin)
    if (self%drive%is_free) then
      shift = shift + self%drive%offset(t)*self%drive%axis
      self%velocity = self%velocity + self%drive%rate*self%drive%axis
    end if
    self%position = self%start + shift
    call self%facing(t, frame, rate)
    self%omega = [0.0_rp, 0.0_rp, rate] - self%spin*frame(:, 3)    ! clockwise seen from above
    c = cos(self%angle)
    s = -sin(self%angle)
    self%axes(:, 1) = c*frame(:, 1) + s*frame(:, 2)
    self%axes(:, 2) = c*frame(:, 2) - s*frame(:, 1)
    self%axes(:, 3) = frame(:, 3)
  end subroutine move_to

  !> Axes at time `t` without the spin, and their rate of rotation about z [rad/s].
  pure subroutine facing(self, t, frame, rate)
    class(tool_t), intent(in) :: self
    real(rp), intent(in) :: t                   !! time [s]
    real(rp), intent(out) :: frame(3, 3), rate
    real(rp) :: direction

    frame = self%frame
    call self%motion%face(t, direction, rate)
    if (abs(direction) <= 0.0_rp) return
    frame(1, :) = cos(direction)*self%frame(1, :) - sin(direction)*self%frame(2, :)
    frame(2, :) = sin(direction)*self%frame(1, :) + cos(direction)*self%frame(2, :)
  end subroutine facing

  !> Angle of the axis to the vertical, positive if the trailing edge is the lower one [rad].
  pure real(rp) function tilt(self)
    class(tool_t), intent(in) :: self

    associate (axis => self%frame(:, 3))
      tilt = atan2(norm2(axis(1:2)), axis(3))
      if (axis(1) > 0.0_rp) tilt = -tilt
    end associate
  end function tilt

  !> Mean motion over the `dt` from `t`.
  pure type(rigid_t) function mean_motion(self, t, dt)
    class(tool_t), intent(in) :: self
    real(rp), intent(in) :: t, dt               !! time, time step [s]
    real(rp), dimension(3) :: from, to, unused
    real(rp) :: before, after, direction(2), frame(3, 3), spin

    call self%facing(t + 0.5_rp*dt, frame, spin)
    call self%motion%face(t, direction(1), spin)
    call self%motion%face(t + dt, direction(2), spin)
    call self%motion%at(t, from, unused, before, spin)
    call self%motion%at(t + dt, to, unused, after, spin)
    mean_motion%centre = self%start + 0.5_rp*(from + to)
    mean_motion%velocity = (to - from)/dt
    if (self%drive%is_free) then
      mean_motion%centre = mean_motion%centre + self%drive%offset(t + 0.5_rp*dt)*self%drive%axis
      mean_motion%velocity = mean_motion%velocity + self%drive%rate*self%drive%axis
    end if
    mean_motion%omega = [0.0_rp, 0.0_rp, wrapped(direction(2) - direction(1))/dt] &
                        - (after - before)/dt*frame(:, 3)
  end function mean_motion

  !> Velocity of the rigid motion at `x` [m/s].
  pure function velocity_at(self, x) result(v)
    class(rigid_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp) :: v(3), r(3)

    r = x - self%centre
    v = self%velocity + [self%omega(2)*r(3) - self%omega(3)*r(2), &
                         self%omega(3)*r(1) - self%omega(1)*r(3), &
                         self%omega(1)*r(2) - self%omega(2)*r(1)]
  end function velocity_at

  !> New position of a point `x` of the rigid tool after the last move [m].
  pure function move_point(self, x) result(y)
    class(tool_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp) :: y(3)

    y = self%position + matmul(self%axes, matmul(x - self%last_position, self%last_axes))
  end function move_point

  !> False for a rigid body of particles.
  elemental logical function has_shape(self)
    class(tool_t), intent(in) :: self

    has_shape = allocated(self%shape)
  end function has_shape

  !> True if friction can act on the tool.
  elemental logical function has_friction(self)
    class(tool_t), intent(in) :: self

    has_friction = self%friction_coefficient > 0.0_rp .or. self%friction_table%of /= of_nothing &
                   .or. self%friction_law%kind /= law_coulomb
  end function has_friction

  !> True if a metal layer may shear under the face: the strength of the metal limits friction.
  elemental logical function has_layer(self)
    class(tool_t), intent(in) :: self

    has_layer = self%has_shape() .and. self%has_friction() &
                .and. .not. self%friction_law%has_no_shear_limit()
  end function has_layer

  !> Fraction of the friction heat that enters a material of this effusivity, sqrt(k rho c): the
  !> fraction of two half spaces with equal face temperature (thesis eq. 2.11), or the given one.
  elemental real(rp) function heat_share(self, effusivity)
    class(tool_t), intent(in) :: self
    real(rp), intent(in) :: effusivity            !! [J/(m2 K s^0.5)]

    heat_share = self%fixed_heat_share
    if (self%effusivity > 0.0_rp) heat_share = effusivity/(effusivity + self%effusivity)
  end function heat_share

  !> Radius of the stirring part [m]; 0: none.
  elemental real(rp) function stirring_radius(self)
    class(tool_t), intent(in) :: self

    stirring_radius = 0.0_rp
    if (self%has_shape()) stirring_radius = self%shape%radius
  end function stirring_radius

  !> Signed distance `d` of `x` from the tool, its gradient `n` (out of the tool), and the distance
  !> along the surface to the nearest convex edge. Beyond a cutoff any value above it may be
  !> returned; beyond that of the edge only the sign of the distance to the edge is certain.
  pure subroutine distance(self, x, d, n, edge_distance, cutoff, edge_cutoff)
    class(tool_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp), intent(out) :: d               !! signed distance [m]
    real(rp), intent(out) :: n(3)            !! unit normal [-]
    real(rp), intent(out), optional :: edge_distance         !! distance to the edge [m]
    real(rp), intent(in), optional :: cutoff, edge_cutoff    !! default: none [m]
    real(rp) :: edge, edge_reach, m(3), reach, y(3)

    d = huge(1.0_rp)
    n = 0.0_rp
    if (present(edge_distance)) edge_distance = no_edge
    if (.not. self%has_shape()) return
    y = matmul(x - self%position, self%axes)
    reach = huge(1.0_rp)
    if (present(cutoff)) reach = cutoff
    edge_reach = merge(no_edge, 0.0_rp, present(edge_distance))
    if (present(edge_cutoff)) edge_reach = edge_cutoff
    call self%shape%near_distance(y, reach, edge_reach, d, m, edge)
    if (present(edge_distance)) edge_distance = edge
    n = matmul(self%axes, m)
  end subroutine distance

  !> Signed distance of `x` from the tool [m].
  pure real(rp) function clearance(self, x)
    class(tool_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp) :: n(3)

    call self%distance(x, clearance, n)
  end function clearance

  !> Signed distances of `n` positions x(:, 1:3) [m], or with `is_bound` lower bounds, which take
  !> less time; beyond `most` any value above it may be returned.
  pure subroutine clearances(self, n, x, most, d, is_bound)
    class(tool_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: x(nlane, 3), most   !! position, cutoff distance [m]
    real(rp), intent(out) :: d(n)               !! signed distances [m]
    logical, intent(in), optional :: is_bound
    real(rp) :: y(n, 3)
    integer :: a

    d = huge(1.0_rp)
    if (.not. self%has_shape()) return
    do a = 1, 3
      y(:, a) = (x(:n, 1) - self%position(1))*self%axes(1, a) &
                + (x(:n, 2) - self%position(2))*self%axes(2, a) &
                + (x(:n, 3) - self%position(3))*self%axes(3, a)
    end do
    if (present(is_bound)) then
      call self%shape%lower_bounds(n, y, most, d)
    else
      call self%shape%distances(n, y, most, d)
    end if
  end subroutine clearances

  !> Store the pose, from which `displacement` is measured.
  pure subroutine store_reference_pose(self)
    class(tool_t), intent(inout) :: self

    self%reference_position = self%position
    self%reference_axes = self%axes
  end subroutine store_reference_pose

  !> Upper bound of the approach of the tool surface to any point since the stored pose [m].
  pure real(rp) function displacement(self)
    class(tool_t), intent(in) :: self

    displacement = norm2(self%position - self%reference_position)
    if (self%has_shape()) displacement = displacement &
      + self%shape%sweep(self%reference_axes, self%axes)
  end function displacement

  !> Corners of a bounding box of the tool [m].
  pure subroutine bounds(self, lower, upper)
    class(tool_t), intent(in) :: self
    real(rp), intent(out) :: lower(3), upper(3)
    real(rp) :: half(3), middle(3)

    middle = 0.0_rp
    half = huge(1.0_rp)
    if (self%has_shape()) call self%shape%bounds(self%axes, middle, half)
    lower = self%position + middle - half
    upper = self%position + middle + half
  end subroutine bounds

  !> Velocity of the rigid tool at `x` [m/s].
  pure function surface_velocity(self, x) result(v)
    class(tool_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp) :: v(3)
    type(rigid_t) :: now

    now = rigid_t(self%position, self%velocity, self%omega)
    v = now%velocity_at(x)
  end function surface_velocity

  !> Add impulses at a node to the sums of the tool: force, torque, work, heat. They may be those
  !> of a part of the particles at the node: the sums add up if `normal` is that of all of them.
  pure subroutine record_impulse(self, rigid, x, normal, push, hold, mean)
    class(tool_t), intent(inout) :: self
    type(rigid_t), intent(in) :: rigid        !! motion of the tool in this step
    real(rp), intent(in) :: x(3)              !! position [m]
    real(rp), intent(in) :: normal(3)         !! unit vector
    real(rp), intent(in) :: push(3), hold(3)  !! impulses normal and tangential to the surface [N s]
    real(rp), intent(in) :: mean(3)           !! mean velocity of the material in the step [m/s]
    real(rp), dimension(3) :: arm, impulse, moment, slip, surface
    real(rp) :: friction, press

    press = dot_product(push, normal)
    impulse = push + hold
    surface = rigid%velocity_at(x)
    slip = mean - surface
    arm = x - rigid%centre
    moment = [arm(2)*impulse(3) - arm(3)*impulse(2), arm(3)*impulse(1) - arm(1)*impulse(3), &
              arm(1)*impulse(2) - arm(2)*impulse(1)]
    friction = -dot_product(hold, slip)
    associate (s => self%sums)
      s(s_force:s_force + 2) = s(s_force:s_force + 2) - impulse
      s(s_torque) = s(s_torque) - dot_product(moment, self%axes(:, 3))
      s(s_work) = s(s_work) + dot_product(impulse, surface)
      s(s_friction) = s(s_friction) + friction
      s(s_normal_loss) = s(s_normal_loss) - dot_product(push, slip)
      s(s_normal_impulse) = s(s_normal_impulse) + press
      s(s_metal_slip) = s(s_metal_slip) + press*norm2(mean - dot_product(mean, normal)*normal)
      s(s_tool_slip) = s(s_tool_slip) + press*norm2(surface - dot_product(surface, normal)*normal)
    end associate
  end subroutine record_impulse

end module tools_tool
