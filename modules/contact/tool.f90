! SPDX-License-Identifier: MIT
!> Rigid tools: motion, signed distance from their shape, and what contact sums up
!> (tool_contact_impulses). A tool without a shape is a rigid body of particles, which touches
!> nodes.
module contact_tool
  use base_kinds, only: nlane, rp
  use contact_heat_sink, only: heat_sink_t
  use contact_law, only: friction_law_t, friction_table_t, law_coulomb, of_nothing
  use contact_motion, only: drive_t, motion_t, wrapped
  use contact_watch, only: watch_t
  use tool_shapes_shape, only: no_edge, shape_t
  implicit none (type, external)
  private

  public :: tool_t, rigid_t

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
    s_to_plate = 11, &  !! friction heat given to the material [J]
    s_heat = 12, &      !! friction heat and plastic work of all, set in reports alone [J]
    ! of the face, where the layer under it may shear:
    s_area = 13, &      !! area times time [m2 s]; the following, too, are times both:
    s_face_heat = 14, &  !! temperature of the face [K m2 s]
    s_thickness = 15, &  !! of the layer that shears [m3 s]
    s_layer = 16, &     !! slip that the layer shears [m3]
    s_sliding = 17, &   !! slip that slides [m3]
    s_motion = 18, &    !! speed of the tool along its surface [m3]
    s_faster = 19, &   !! velocity of the layer's metal beyond that of its particles [m3]
    s_strength = 20, &  !! of the layer: impulse of it [N s]
    s_layer_work = 21   !! friction heat that is work of the layer [J]
  integer, parameter, public :: n_tool_sums = 21

  !> Mean rigid motion over a step.
  type :: rigid_t
    real(rp) :: centre(3) = 0.0_rp                         !! [m]
    real(rp) :: velocity(3) = 0.0_rp, omega(3) = 0.0_rp    !! [m/s], [rad/s]
  contains
    procedure :: velocity_at
  end type rigid_t

  type :: tool_t
    character(32) :: name = 'tool'
    class(shape_t), allocatable :: shape   !! unallocated: of a rigid body
    real(rp) :: start(3) = 0.0_rp          !! position at t = 0 [m]
    real(rp) :: frame(3, 3) = 0.0_rp       !! columns: local axes at t = 0, towards +x
    real(rp) :: friction = 0.0_rp          !! coefficient of Coulomb's law
    type(friction_law_t) :: friction_law
    type(friction_table_t) :: friction_table   !! of the law's coefficient, if it is of something
    real(rp) :: heat_fraction = 1.0_rp        !! share of friction heat into the material
    real(rp) :: effusivity = 0.0_rp           !! above 0, this decides about the share
                                              !! [J/(m2 K s^0.5)]
    type(heat_sink_t) :: heat              !! what takes the rest, if it has a temperature
    type(motion_t) :: motion
    type(drive_t) :: drive                 !! what presses it along its axis
    type(watch_t) :: watch                 !! what ends phases, and its limits
    integer :: n_phases = 0                !! of the input
    ! pose at the current time, and the one before
    real(rp) :: position(3) = 0.0_rp, velocity(3) = 0.0_rp, omega(3) = 0.0_rp
    real(rp) :: axes(3, 3) = 0.0_rp        !! local axes now
    real(rp) :: last_position(3) = 0.0_rp, last_axes(3, 3) = 0.0_rp
    real(rp) :: noted_position(3) = 0.0_rp, noted_axes(3, 3) = 0.0_rp   !! by `note_place`
    real(rp) :: spin = 0.0_rp              !! [rad/s]
    real(rp) :: angle = 0.0_rp             !! turned since t = 0 [rad]
    real(rp) :: sums(n_tool_sums) = 0.0_rp
    real(rp) :: hottest = 0.0_rp           !! of its face, in this step, 0: no layer shears [K]
  contains
    procedure :: has_shape
    procedure :: has_friction
    procedure :: has_layer
    procedure :: heat_share
    procedure :: stirring_radius
    procedure :: move_to
    procedure :: mean_motion
    procedure, private :: facing
    procedure :: tilt
    procedure :: carry
    procedure :: distance
    procedure :: clearance
    procedure :: clearances
    procedure :: bounds
    procedure :: note_place
    procedure :: displacement
    procedure :: surface_velocity
    procedure :: book_impulse
  end type tool_t

contains

  !> Put the tool where it is at time `t` by its schedule and its drive.
  elemental subroutine move_to(self, t)
    class(tool_t), intent(inout) :: self
    real(rp), intent(in) :: t                   !! [s]
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
    real(rp), intent(in) :: t                   !! [s]
    real(rp), intent(out) :: frame(3, 3), rate
    real(rp) :: direction

    frame = self%frame
    call self%motion%face(t, direction, rate)
    if (abs(direction) <= 0.0_rp) return
    frame(1, :) = cos(direction)*self%frame(1, :) - sin(direction)*self%frame(2, :)
    frame(2, :) = sin(direction)*self%frame(1, :) + cos(direction)*self%frame(2, :)
  end subroutine facing

  !> Angle of the axis to the vertical, above 0 if the trailing edge is the lower one [rad].
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
    real(rp), intent(in) :: t, dt               !! [s]
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

  !> Where a point `x` of the rigid tool has got to by the last move.
  pure function carry(self, x) result(y)
    class(tool_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp) :: y(3)

    y = self%position + matmul(self%axes, matmul(x - self%last_position, self%last_axes))
  end function carry

  !> False for a rigid body of particles.
  elemental logical function has_shape(self)
    class(tool_t), intent(in) :: self

    has_shape = allocated(self%shape)
  end function has_shape

  !> Whether friction can act on it.
  elemental logical function has_friction(self)
    class(tool_t), intent(in) :: self

    has_friction = self%friction > 0.0_rp .or. self%friction_table%of /= of_nothing &
                   .or. self%friction_law%kind /= law_coulomb
  end function has_friction

  !> Whether a layer of metal that can flow may shear under its face: the strength of the metal
  !> limits friction.
  elemental logical function has_layer(self)
    class(tool_t), intent(in) :: self

    has_layer = self%has_shape() .and. self%has_friction() &
                .and. .not. self%friction_law%is_unlimited()
  end function has_layer

  !> Share of the friction heat that enters a material with this effusivity, sqrt(k rho c): that of
  !> two half spaces with one temperature at the face (thesis eq. 2.11), or what is given.
  elemental real(rp) function heat_share(self, effusivity)
    class(tool_t), intent(in) :: self
    real(rp), intent(in) :: effusivity            !! [J/(m2 K s^0.5)]

    heat_share = self%heat_fraction
    if (self%effusivity > 0.0_rp) heat_share = effusivity/(effusivity + self%effusivity)
  end function heat_share

  !> Radius of what stirs, 0 if there is none [m].
  elemental real(rp) function stirring_radius(self)
    class(tool_t), intent(in) :: self

    stirring_radius = 0.0_rp
    if (self%has_shape()) stirring_radius = self%shape%radius
  end function stirring_radius

  !> Signed distance of `x` from the tool, its gradient (out of the tool), and the room along the
  !> surface to the nearest edge that stands out.
  pure subroutine distance(self, x, d, n, room)
    class(tool_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp), intent(out) :: d, n(3), room      !! [m], [-], [m]
    real(rp) :: y(3), m(3)

    d = huge(1.0_rp)
    n = 0.0_rp
    room = no_edge
    if (.not. self%has_shape()) return
    y = matmul(x - self%position, self%axes)
    call self%shape%distance(y, d, m, room)
    n = matmul(self%axes, m)
  end subroutine distance

  !> Signed distance of `x` from the tool alone [m].
  pure real(rp) function clearance(self, x)
    class(tool_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp) :: n(3), room

    call self%distance(x, clearance, n, room)
  end function clearance

  !> The same of `n` places, x(:, 1:3) [m]; of those beyond `most` any number beyond it will do.
  pure subroutine clearances(self, n, x, most, d)
    class(tool_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: x(nlane, 3), most   !! [m]
    real(rp), intent(out) :: d(n)               !! [m]
    real(rp) :: y(n, 3)
    integer :: a

    d = huge(1.0_rp)
    if (.not. self%has_shape()) return
    do a = 1, 3
      y(:, a) = (x(:n, 1) - self%position(1))*self%axes(1, a) &
                + (x(:n, 2) - self%position(2))*self%axes(2, a) &
                + (x(:n, 3) - self%position(3))*self%axes(3, a)
    end do
    call self%shape%distances(n, y, most, d)
  end subroutine clearances

  !> Remember where the tool is.
  pure subroutine note_place(self)
    class(tool_t), intent(inout) :: self

    self%noted_position = self%position
    self%noted_axes = self%axes
  end subroutine note_place

  !> How far, at most, its surface has come nearer to anything since then [m].
  pure real(rp) function displacement(self)
    class(tool_t), intent(in) :: self

    displacement = norm2(self%position - self%noted_position)
    if (self%has_shape()) displacement = displacement + self%shape%sweep(self%noted_axes, self%axes)
  end function displacement

  !> Corners of a box that the tool lies in [m].
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

  !> Its books for the impulses that it gives at a place: force, torque, work, heat.
  pure subroutine book_impulse(self, rigid, x, push, hold, mean)
    class(tool_t), intent(inout) :: self
    type(rigid_t), intent(in) :: rigid          !! its motion in this step
    real(rp), intent(in) :: x(3)                !! [m]
    real(rp), intent(in) :: push(3), hold(3)    !! across and along the surface [N s]
    real(rp), intent(in) :: mean(3)             !! velocity of the material, mean of the step [m/s]
    real(rp), dimension(3) :: arm, impulse, moment, normal, slip, surface
    real(rp) :: friction, press

    press = norm2(push)
    impulse = push + hold
    surface = rigid%velocity_at(x)
    slip = mean - surface
    arm = x - rigid%centre
    moment = [arm(2)*impulse(3) - arm(3)*impulse(2), arm(3)*impulse(1) - arm(1)*impulse(3), &
              arm(1)*impulse(2) - arm(2)*impulse(1)]
    friction = -dot_product(hold, slip)
    normal = push/max(press, tiny(press))
    associate (s => self%sums)
      s(s_force:s_force + 2) = s(s_force:s_force + 2) - impulse
      s(s_torque) = s(s_torque) - dot_product(moment, self%axes(:, 3))
      s(s_work) = s(s_work) + dot_product(impulse, surface)
      s(s_friction) = s(s_friction) + friction
      s(s_normal) = s(s_normal) - dot_product(push, slip)
      s(s_press) = s(s_press) + press
      s(s_creep) = s(s_creep) + press*norm2(mean - dot_product(mean, normal)*normal)
      s(s_slide) = s(s_slide) + press*norm2(surface - dot_product(surface, normal)*normal)
    end associate
  end subroutine book_impulse

end module contact_tool
