! SPDX-License-Identifier: MIT
!> Rigid analytic tools: signed distance, motion, and what contact sums up (tool_contact_impulses).
module contact_tool
  use base_kinds, only: nlane, rp
  use contact_friction_table, only: friction_table_t
  use contact_motion, only: motion_t
  use contact_shapes, only: box_distance, profile_t, revolved_distance, revolved_distances
  implicit none (type, external)
  private

  public :: tool_t, rigid_t

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
    s_to_plate = 11, &  !! friction heat given to the material [J]
    s_heat = 12         !! friction heat and plastic work of all tools and bodies, set in reports
                        !! alone [J]
  integer, parameter, public :: n_tool_sums = 12

  !> Mean rigid motion over a step.
  type :: rigid_t
    real(rp) :: centre(3) = 0.0_rp                         !! [m]
    real(rp) :: velocity(3) = 0.0_rp, omega(3) = 0.0_rp    !! [m/s], [rad/s]
  contains
    procedure :: velocity_at
  end type rigid_t

  type :: tool_t
    character(32) :: name = 'tool'
    integer :: kind = kind_revolved
    type(profile_t) :: profile             !! revolved
    real(rp) :: radius = 0.0_rp            !! sphere, bounding radius of the others [m]
    real(rp) :: half(3) = 0.0_rp           !! box: half edges [m]
    real(rp) :: start(3) = 0.0_rp          !! position at t = 0 [m]
    real(rp) :: frame(3, 3) = 0.0_rp       !! columns: local axes at t = 0
    real(rp) :: friction = 0.0_rp
    type(friction_table_t) :: friction_table   !! instead, if it is of something
    logical :: shear_limit = .true.
    real(rp) :: heat_fraction = 1.0_rp        !! share of friction heat into the material
    type(motion_t) :: motion
    ! pose at the current time, and the one before
    real(rp) :: position(3) = 0.0_rp, velocity(3) = 0.0_rp, omega(3) = 0.0_rp
    real(rp) :: axes(3, 3) = 0.0_rp        !! local axes now
    real(rp) :: last_position(3) = 0.0_rp, last_axes(3, 3) = 0.0_rp
    real(rp) :: noted_position(3) = 0.0_rp, noted_axes(3, 3) = 0.0_rp   !! by `note_place`
    real(rp) :: spin = 0.0_rp              !! [rad/s]
    real(rp) :: angle = 0.0_rp             !! turned since t = 0 [rad]
    real(rp) :: sums(n_tool_sums) = 0.0_rp
  contains
    procedure :: move_to
    procedure :: mean_motion
    procedure :: tilt
    procedure :: carry
    procedure :: distance
    procedure :: clearance
    procedure :: clearances
    procedure :: bounds
    procedure :: note_place
    procedure :: displacement
    procedure :: surface_velocity
  end type tool_t

contains

  !> Put the tool where its schedule says at time `t`.
  pure subroutine move_to(self, t)
    class(tool_t), intent(inout) :: self
    real(rp), intent(in) :: t                   !! [s]
    real(rp) :: shift(3), c, s

    self%last_position = self%position
    self%last_axes = self%axes
    call self%motion%at(t, shift, self%velocity, self%angle, self%spin)
    self%position = self%start + shift
    self%omega = -self%spin*self%frame(:, 3)    ! clockwise seen from above
    c = cos(self%angle)
    s = -sin(self%angle)
    self%axes(:, 1) = c*self%frame(:, 1) + s*self%frame(:, 2)
    self%axes(:, 2) = c*self%frame(:, 2) - s*self%frame(:, 1)
    self%axes(:, 3) = self%frame(:, 3)
  end subroutine move_to

  !> Angle of the axis to the vertical, above 0 if the trailing edge (-x) is the lower one [rad].
  pure real(rp) function tilt(self)
    class(tool_t), intent(in) :: self

    associate (axis => self%axes(:, 3))
      tilt = atan2(norm2(axis(1:2)), axis(3))
      if (axis(1) > 0.0_rp) tilt = -tilt
    end associate
  end function tilt

  !> Mean motion over the `dt` from `t`.
  pure type(rigid_t) function mean_motion(self, t, dt)
    class(tool_t), intent(in) :: self
    real(rp), intent(in) :: t, dt               !! [s]
    real(rp), dimension(3) :: from, to, unused
    real(rp) :: before, after, spin

    call self%motion%at(t, from, unused, before, spin)
    call self%motion%at(t + dt, to, unused, after, spin)
    mean_motion%centre = self%start + 0.5_rp*(from + to)
    mean_motion%velocity = (to - from)/dt
    mean_motion%omega = -(after - before)/dt*self%frame(:, 3)
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

  !> Signed distance of `x` from the tool, its gradient (out of the tool), and the room along the
  !> surface to the nearest edge that stands out.
  pure subroutine distance(self, x, d, n, room)
    class(tool_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp), intent(out) :: d, n(3), room      !! [m], [-], [m]
    real(rp) :: y(3), m(3)

    y = matmul(x - self%position, self%axes)
    room = huge(1.0_rp)
    select case (self%kind)
    case (kind_revolved)
      call revolved_distance(self%profile, y, d, m, room)
    case (kind_sphere)
      d = norm2(y)
      m = y/max(d, tiny(1.0_rp))
      d = d - self%radius
    case (kind_box)
      call box_distance(self%half, y, d, m, room)
    case (kind_particles)      ! it touches nodes, not points
      d = huge(1.0_rp)
      m = 0.0_rp
    case default
      d = y(3)
      m = [0.0_rp, 0.0_rp, 1.0_rp]
    end select
    n = matmul(self%axes, m)
  end subroutine distance

  !> Signed distance of `x` from the tool alone [m].
  pure real(rp) function clearance(self, x)
    class(tool_t), intent(in) :: self
    real(rp), intent(in) :: x(3)
    real(rp) :: n(3), room

    call self%distance(x, clearance, n, room)
  end function clearance

  !> The same of `n` places, x(:, 1:3) [m].
  pure subroutine clearances(self, n, x, d)
    class(tool_t), intent(in) :: self
    integer, intent(in) :: n
    real(rp), intent(in) :: x(nlane, 3)
    real(rp), intent(out) :: d(n)               !! [m]
    real(rp) :: y(n, 3), r(n)
    integer :: a, p

    if (self%kind == kind_box) then
      do p = 1, n
        d(p) = self%clearance(x(p, :))
      end do
      return
    end if
    do a = 1, 3
      y(:, a) = (x(:n, 1) - self%position(1))*self%axes(1, a) &
                + (x(:n, 2) - self%position(2))*self%axes(2, a) &
                + (x(:n, 3) - self%position(3))*self%axes(3, a)
    end do
    select case (self%kind)
    case (kind_revolved)
      r = sqrt(y(:, 1)**2 + y(:, 2)**2)
      call revolved_distances(self%profile, n, r, y(:, 3), d)
    case (kind_sphere)
      d = sqrt(y(:, 1)**2 + y(:, 2)**2 + y(:, 3)**2) - self%radius
    case (kind_particles)
      d = huge(1.0_rp)
    case default
      d = y(:, 3)
    end select
  end subroutine clearances

  !> Remember where the tool is.
  pure subroutine note_place(self)
    class(tool_t), intent(inout) :: self

    self%noted_position = self%position
    self%noted_axes = self%axes
  end subroutine note_place

  !> How far, at most, its surface has come nearer to anything since then [m]; spin about its own
  !> axis brings only a box nearer.
  pure real(rp) function displacement(self)
    class(tool_t), intent(in) :: self

    displacement = norm2(self%position - self%noted_position)
    if (self%kind == kind_box) displacement = displacement &
        + norm2(self%axes - self%noted_axes)*norm2(self%half)
  end function displacement

  !> Corners of a box that the tool lies in [m].
  pure subroutine bounds(self, lower, upper)
    class(tool_t), intent(in) :: self
    real(rp), intent(out) :: lower(3), upper(3)
    real(rp) :: half(3), middle(3)

    middle = self%position
    select case (self%kind)
    case (kind_revolved)
      associate (r => self%profile%r(1:self%profile%n), z => self%profile%z(1:self%profile%n), &
                 axis => self%axes(:, 3))
        middle = middle + 0.5_rp*(maxval(z) + minval(z))*axis
        half = 0.5_rp*(maxval(z) - minval(z))*abs(axis) &
               + maxval(r)*sqrt(max(0.0_rp, 1.0_rp - axis**2))
      end associate
    case (kind_sphere)
      half = self%radius
    case (kind_box)
      half = matmul(abs(self%axes), self%half)
    case default
      half = huge(1.0_rp)
    end select
    lower = middle - half
    upper = middle + half
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

end module contact_tool
