! SPDX-License-Identifier: MIT
!> Operations of a step on one block of particles: shape functions on this rank's patch, nodal
!> records, particle update. Plain arrays, no branches.
!>
!> Affine transfer: particles carry a velocity gradient C besides their velocity, so that the
!> transfer to the grid and back conserves angular momentum (APIC: Jiang et al. 2017, JCP 338:137).
!>
!> Rigid bodies of particles: their nodes and particles follow the schedule of the tool whose shape
!> they are.
module mpm_blocks
  use base_kinds, only: nlane, rp
  use base_system, only: pack_records
  use grid_geometry, only: storage_nodes
  use particles_block, only: block_t
  use particles_store, only: f_pos, f_vel, particles_t
  use state_clock, only: clock_t
  use state_nodes, only: nodes_t
  use state_scene, only: scene_t
  use tools_tool, only: rigid_t, tool_t
  use transfer_gather, only: gather_block, lanes_t
  use transfer_scatter, only: p2g_affine_block, p2g_values_block
  use transfer_weights, only: block_corners, block_weights, graded_axis, moment_weights, &
                              own_weights, uniform_axis
  implicit none (type, external)
  private

  public :: advance_particles, affine_to_grid, body_work, corners_of, force_records, &
            gather_gradient, gather_lanes, gather_slopes, gather_velocity, kinetic_energy, &
            momentum_records, move_rigid, set_rigid_velocities, start_rigid, stretch_domains, &
            values_to_grid, weights_of

  ! Limits of the half length of a particle domain [cells]: the domain stays within the reach of the
  ! stencil and does not degenerate.
  real(rp), parameter, public :: max_half = 0.5_rp, min_half = 0.05_rp

contains

  !> Weights, slopes and first nodes for the particles of a block.
  subroutine weights_of(scene, nodes, block)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(block_t), intent(inout) :: block
    integer :: a, at(nlane)

    if (nodes%patch%is_graded()) then
      block%first = 1
      associate (patch => nodes%patch)
        do a = 1, 3
          associate (w_axis => block%w(:, 3*a - 2:3*a), slope => block%w(:, 3*a + 7:3*a + 9), &
                     x => block%ps(:, f_pos + a - 1), low => patch%all%lo(a), &
                     high => patch%all%hi(a))
            if (patch%grading(a)%is_graded) then
              call patch%grading(a)%spans_of(low + 1, high - 1, x, at)
              at = at - low
              call graded_axis(high - low + 1, patch%grading(a)%span(1, low), at, x, w_axis, slope)
            else
              call uniform_axis(patch%origin(a), 1.0_rp/patch%h(a), x, at, w_axis, slope)
            end if
          end associate
          block%first = block%first + (at - 1)*patch%stride(a)
        end do
      end associate
    else if (scene%layout%half > 0) then
      associate (half => scene%layout%half)
        call own_weights(nodes%patch%origin, 1.0_rp/nodes%patch%h, block%ps(:, half:half + 2), &
                         nodes%patch%stride, block%ps(:, f_pos:f_pos + 2), block%w, block%first)
      end associate
    else
      call block_weights(nodes%patch%origin, 1.0_rp/nodes%patch%h, scene%domain(block%body), &
                         nodes%patch%stride, block%ps(:, f_pos:f_pos + 2), block%w, block%first)
    end if
  end subroutine weights_of

  !> First nodes of the stencils without the weights, which takes much less time.
  pure subroutine corners_of(scene, nodes, block)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(block_t), intent(inout) :: block
    logical :: is_own(nlane)

    associate (patch => nodes%patch)
      if (patch%is_graded()) then
        call storage_nodes(scene%grid, patch, nlane, block%ps(:, f_pos:f_pos + 2), block%first, &
                           is_own)
        block%first = block%first - sum(patch%stride)
      else
        call block_corners(patch%origin, 1.0_rp/patch%h, patch%stride, &
                           block%ps(:, f_pos:f_pos + 2), block%first)
      end if
    end associate
  end subroutine corners_of

  !> Records of mass, momentum, internal and external force, and temperature times inertial mass.
  pure subroutine force_records(inertia, volume, acceleration, mass, v, tau, temp, rec)
    real(rp), intent(in) :: inertia              !! mass scaling factor [-]
    real(rp), intent(in) :: volume               !! initial volume over mass [m3/kg]
    real(rp), intent(in) :: acceleration(3)      !! gravity and body load [m/s2]
    real(rp), intent(in) :: mass(nlane), v(nlane, 3), tau(nlane, 6), temp(nlane)
    real(rp), intent(inout) :: rec(8, 4, nlane)
    real(rp) :: value(nlane, 8), slope(nlane, 9), m, vol
    integer :: p

    !$omp simd private(m, vol)
    do p = 1, nlane
      m = inertia*mass(p)
      vol = -volume*mass(p)
      value(p, 1) = m
      value(p, 2) = m*v(p, 1); value(p, 3) = m*v(p, 2); value(p, 4) = m*v(p, 3)
      value(p, 5) = mass(p)*acceleration(1)
      value(p, 6) = mass(p)*acceleration(2)
      value(p, 7) = mass(p)*acceleration(3)
      value(p, 8) = m*temp(p)
      slope(p, 1) = vol*tau(p, 1); slope(p, 2) = vol*tau(p, 4); slope(p, 3) = vol*tau(p, 6)
      slope(p, 4) = slope(p, 2); slope(p, 5) = vol*tau(p, 2); slope(p, 6) = vol*tau(p, 5)
      slope(p, 7) = slope(p, 3); slope(p, 8) = slope(p, 6); slope(p, 9) = vol*tau(p, 3)
    end do
    call pack_records(nlane, value, slope, rec)
  end subroutine force_records

  !> Records of mass and momentum, lanes 1:4 of their values.
  pure subroutine momentum_records(inertia, mass, v, rec)
    real(rp), intent(in) :: inertia, mass(nlane), v(nlane, 3)
    real(rp), intent(inout) :: rec(8, 4, nlane)
    integer :: p

    do p = 1, nlane
      rec(1:4, 1, p) = inertia*mass(p)*[1.0_rp, v(p, 1), v(p, 2), v(p, 3)]
    end do
  end subroutine momentum_records

  !> Add lanes 1:4 of the values of the records of a block to the nodes.
  subroutine values_to_grid(nodes, block, g)
    type(nodes_t), intent(in) :: nodes
    type(block_t), intent(in) :: block
    real(rp), intent(inout) :: g(8, nodes%patch%nn)

    call p2g_values_block(block%n, block%w, block%first, nodes%rec, nodes%patch%stride, &
                          nodes%patch%nn, g)
  end subroutine values_to_grid

  !> Gather velocity, its change and its gradient (row by row) at the particles of a block; zero in
  !> unused lanes.
  subroutine gather_velocity(nodes, block, g, v, dv, l)
    type(nodes_t), intent(in) :: nodes
    type(block_t), intent(in) :: block
    !> Velocity in lanes 1:3, its change in 5:7 [m/s].
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    real(rp), intent(out) :: v(nlane, 3), dv(nlane, 3), l(nlane, 9)
    type(lanes_t), parameter :: velocity = lanes_t(sloped=1, n_sloped=3, plain=5, n_plain=3)

    call gather_block(velocity, block%n, block%w, block%first, nodes%patch%stride, &
                      nodes%patch%nn, g, nodes%rec, v, l, dv)
    v(block%n + 1:, :) = 0.0_rp
    dv(block%n + 1:, :) = 0.0_rp
    l(block%n + 1:, :) = 0.0_rp
  end subroutine gather_velocity

  !> Gather the slopes of lanes 1:3 (row by row) at the particles of a block, with the weights `w`
  !> if present; undefined in unused lanes.
  subroutine gather_slopes(nodes, block, g, l, w)
    type(nodes_t), intent(in) :: nodes
    type(block_t), intent(in) :: block
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    real(rp), intent(out) :: l(nlane, 9)
    real(rp), intent(in), optional :: w(nlane, 18)
    real(rp) :: v(nlane, 3), none(nlane, 0)
    type(lanes_t), parameter :: slopes = lanes_t(sloped=1, n_sloped=3, plain=1, n_plain=0)

    if (present(w)) then
      call gather_block(slopes, block%n, w, block%first, nodes%patch%stride, nodes%patch%nn, g, &
                        nodes%rec, v, l, none)
    else
      call gather_block(slopes, block%n, block%w, block%first, nodes%patch%stride, &
                        nodes%patch%nn, g, nodes%rec, v, l, none)
    end if
  end subroutine gather_slopes

  !> Set the weights of a block, and gather `n_lanes` lanes of the nodal records, from `lane` on.
  subroutine gather_lanes(scene, nodes, lane, n_lanes, g, block, u)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: lane, n_lanes
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    type(block_t), intent(inout) :: block
    real(rp), intent(out) :: u(nlane, n_lanes)
    real(rp) :: none(nlane, 0), no_slopes(nlane, 0)

    call weights_of(scene, nodes, block)
    call gather_block(lanes_t(sloped=1, n_sloped=0, plain=lane, n_plain=n_lanes), block%n, &
                      block%w, block%first, nodes%patch%stride, nodes%patch%nn, g, nodes%rec, &
                      none, no_slopes, u)
  end subroutine gather_lanes

  !> Update the velocity by FLIP with a PIC fraction, and the position by the grid velocity; keep
  !> the largest squared speed.
  pure subroutine advance_particles(n, dt, pic, vg, dv, x, v, max_speed2)
    integer, intent(in) :: n
    real(rp), intent(in) :: dt, pic
    real(rp), intent(in) :: vg(nlane, 3), dv(nlane, 3)   !! grid velocity and its change [m/s]
    real(rp), intent(inout) :: x(nlane, 3), v(nlane, 3)
    real(rp), intent(inout) :: max_speed2  !! running maximum of the squared speed [m2/s2]
    real(rp) :: s(nlane)
    integer :: a, p

    do a = 1, 3
      !$omp simd
      do p = 1, nlane
        v(p, a) = (1.0_rp - pic)*(v(p, a) + dv(p, a)) + pic*vg(p, a)
        x(p, a) = x(p, a) + dt*vg(p, a)
      end do
    end do
    s = vg(:, 1)**2 + vg(:, 2)**2 + vg(:, 3)**2
    !$omp simd reduction(max: max_speed2)
    do p = 1, n
      ! NaN counts as the largest speed
      max_speed2 = max(max_speed2, merge(s(p), huge(1.0_rp), s(p) <= huge(1.0_rp)))
    end do
  end subroutine advance_particles

  !> Stretch the domains of cpGIMP along the axes: l' = l exp(dt L_aa), within limits.
  pure subroutine stretch_domains(dt, l, half)
    real(rp), intent(in) :: dt, l(nlane, 9)      !! time step [s], velocity gradient [1/s]
    real(rp), intent(inout) :: half(nlane, 3)    !! half lengths of the domains [cells]
    integer :: a, p

    do a = 1, 3
      !$omp simd
      do p = 1, nlane
        half(p, a) = max(min_half, min(max_half, half(p, a)*exp(dt*l(p, 4*a - 3))))
      end do
    end do
  end subroutine stretch_domains

  !> Kinetic energy of a block, without mass scaling [J].
  pure real(rp) function kinetic_energy(mass, v)
    real(rp), intent(in) :: mass(nlane), v(nlane, 3)
    real(rp) :: s(nlane)

    s = 0.5_rp*mass*(v(:, 1)**2 + v(:, 2)**2 + v(:, 3)**2)
    kinetic_energy = sum(s)
  end function kinetic_energy

  !> Work of a body force per mass on a block in a step [J].
  pure real(rp) function body_work(n, dt, acceleration, mass, vg, dv)
    integer, intent(in) :: n
    real(rp), intent(in) :: dt, acceleration(3), mass(nlane), vg(nlane, 3), dv(nlane, 3)
    integer :: p

    body_work = 0.0_rp
    do p = 1, n
      body_work = body_work + dt*mass(p)*dot_product(acceleration, vg(p, :) - 0.5_rp*dv(p, :))
    end do
  end function body_work

  !> Add the records of a block with the momentum m (v + C (x_i - x_p)) at node i, where C is field
  !> `affine` of the particles, row by row [1/s].
  subroutine affine_to_grid(nodes, block, affine, g)
    type(nodes_t), intent(in) :: nodes
    type(block_t), intent(in) :: block
    integer, intent(in) :: affine
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    real(rp) :: moment(nlane, 18), square(nlane, 3)
    integer :: b, p

    call moment_weights(nodes%patch%origin, nodes%patch%h, block%ps(:, f_pos:f_pos + 2), block%w, &
                        moment, square)
    associate (rec => nodes%rec, c => block%ps(:, affine:affine + 8))
      do p = 1, block%n
        do b = 1, 3
          rec(1:4, 1 + b, p) = rec(1, 1, p)*[0.0_rp, c(p, b), c(p, 3 + b), c(p, 6 + b)]
        end do
      end do
    end associate
    call p2g_affine_block(block%n, block%w, moment, block%first, nodes%rec, nodes%patch%stride, &
                          nodes%patch%nn, g)
  end subroutine affine_to_grid

  !> Gather the affine gradient C = sum w v_i (x_i - x_p)^T D^-1 with D = sum w (x_i - x_p)(x_i -
  !> x_p)^T, which is diagonal, for the next step (APIC). First moments take the place of the
  !> slopes, as both add up to zero.
  subroutine gather_gradient(scene, nodes, g, block)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    type(block_t), intent(inout) :: block
    real(rp) :: moment(nlane, 18), square(nlane, 3), s(nlane, 9)
    integer :: k, n

    if (scene%layout%affine == 0) return
    call moment_weights(nodes%patch%origin, nodes%patch%h, block%ps(:, f_pos:f_pos + 2), block%w, &
                        moment, square)
    call gather_slopes(nodes, block, g, s, moment)
    n = block%n
    associate (c => block%ps(:, scene%layout%affine:scene%layout%affine + 8))
      do k = 1, 9
        c(:n, k) = s(:n, k)/square(:n, 1 + mod(k - 1, 3))
      end do
    end associate
  end subroutine gather_gradient

  !> Set the nodes of rigid bodies to the mean velocity over the next `dt`.
  subroutine set_rigid_velocities(scene, clock, tool, nodes, dt, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(tool_t), intent(in) :: tool(:)
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: dt                 !! time step [s]
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    type(rigid_t) :: rigid
    integer :: i, k, r

    do k = 1, nodes%n_groups
      if (.not. scene%is_rigid_group(k)) cycle
      rigid = tool(scene%tool_of(k))%mean_motion(clock%time, dt)
      do r = 1, nodes%n_ranges
        do i = nodes%range(1, r), nodes%range(2, r)
          g(1:3, i, k) = rigid%velocity_at(nodes%patch%position(i))
          g(5:7, i, k) = 0.0_rp
        end do
      end do
    end do
  end subroutine set_rigid_velocities

  !> Move a block of a rigid body with its tool; keep the largest squared speed.
  subroutine move_rigid(tool, k, n, x, v, max_speed2)
    type(tool_t), intent(in) :: tool(:)
    integer, intent(in) :: k, n
    real(rp), intent(inout) :: x(nlane, 3), v(nlane, 3)
    real(rp), intent(inout) :: max_speed2         !! running maximum of the squared speed [m2/s2]
    integer :: p

    do p = 1, n
      x(p, :) = tool(k)%move_point(x(p, :))
      v(p, :) = tool(k)%surface_velocity(x(p, :))
      max_speed2 = max(max_speed2, sum(v(p, :)**2))
    end do
  end subroutine move_rigid

  !> Set the velocities of the particles of rigid bodies at t = 0.
  subroutine start_rigid(scene, tool, particles)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    type(particles_t), intent(inout) :: particles
    integer :: b, p, k

    do b = 1, particles%nblk
      k = scene%body(particles%body(b))%tool
      if (k == 0) cycle
      do p = 1, particles%count(b)
        particles%ps(p, f_vel:f_vel + 2, b) = tool(k)%surface_velocity( &
          particles%ps(p, f_pos:f_pos + 2, b))
      end do
    end do
  end subroutine start_rigid

end module mpm_blocks
