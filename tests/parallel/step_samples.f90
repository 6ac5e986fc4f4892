! SPDX-License-Identifier: MIT
!> Plates of particles on a grid, with a scene made by hand, for the tests of what a step is made
!> of. Types of the scene are filled in here alone.
module step_samples
  use base_kinds, only: i8, nlane, rp
  use base_world, only: world_t
  use grid_geometry, only: make_grid
  use particles_store, only: f_bbar, f_jac, f_mass, f_pos, f_temp, f_vel, make_tag, tag_id
  use physics_flow_law, only: flow_law_t, n_work
  use run_balance, only: make_first_partition
  use run_regrid, only: regrid
  use state_clamp, only: clamp_t
  use state_conditions, only: append_clamp, symmetry_t
  use state_parts, only: simulation_t
  use tools_motion, only: phase_t
  use tools_pair, only: contact_t, pair_law_t
  use tools_shape_box, only: box_shape_t
  use tools_shape_plane, only: plane_t
  use tools_shape_shoulder, only: new_shoulder
  use tools_shape_sphere, only: sphere_t
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: add_clamp, add_contact, add_plane_of_symmetry, add_tool, fill, make_flow, noise, &
            number_of, settle, shake, start_scene
  public :: box_tool, particle_tool, plane_tool, shoulder_tool, sphere_tool

  real(rp), parameter, public :: h = 1.0e-3_rp           !! cell [m]
  real(rp), parameter, public :: rho = 8960.0_rp, c_p = 386.0_rp   !! [kg/m3], [J/(kg K)]
  real(rp), parameter, public :: room_temperature = 300.0_rp       !! of particles at first [K]
  integer, parameter, public :: most_in_body = 100000    !! particles; identities go on behind

  !> A flow stress that depends on nothing.
  type, extends(flow_law_t) :: even_law_t
    real(rp) :: strength = 0.0_rp                        !! [Pa]
  contains
    procedure :: prepare
    procedure :: stress
  end type even_law_t

contains

  !> A scene without particles: cells from 0 to `cells`, and `margin` more on both sides of axes
  !> that are not periodic; copper, elastic.
  subroutine start_scene(sim, cells, margin, n_bodies, is_periodic)
    type(simulation_t), intent(out) :: sim
    integer, intent(in) :: cells(3), margin, n_bodies
    logical, intent(in), optional :: is_periodic(3)
    logical :: periodic(3)
    integer :: b

    periodic = .false.
    if (present(is_periodic)) periodic = is_periodic
    sim%scene%grid = make_grid(h, merge(0.0_rp, -margin*h, periodic), &
                               h*(cells + merge(0, margin, periodic)), periodic)
    allocate (sim%scene%material(1), sim%scene%body(n_bodies), sim%scene%symmetry(0), &
              sim%scene%clamp(0), sim%scene%condition(0), sim%scene%contact(0), sim%tool(0))
    sim%scene%tool_of = [0]
    associate (copper => sim%scene%material(1))
      copper%rho = rho
      copper%c_p = c_p
      copper%has_heat_capacity = .true.
      copper%conductivity = 391.0_rp
      copper%t_ref = room_temperature
      call copper%set_elastic(124.0e9_rp, 0.34_rp)
      sim%clock%stiffness = copper%wave_speed()**2
      sim%clock%now%last%stiffness = sim%clock%stiffness
    end associate
    do b = 1, n_bodies
      allocate (sim%scene%body(b)%load(0))
    end do
  end subroutine start_scene

  !> The material flows at `strength` [Pa].
  subroutine make_flow(sim, strength)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: strength
    type(even_law_t) :: law

    law%strength = strength
    allocate (sim%scene%material(1)%flow, source=law)
  end subroutine make_flow

  !> A symmetry plane across `axis`; `odd` are the components that it turns round, its own if none
  !> are given.
  subroutine add_plane_of_symmetry(sim, axis, at, faces_up, odd, temperature)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: axis, at              !! place [cells]
    logical, intent(in) :: faces_up
    logical, intent(in), optional :: odd(3)
    real(rp), intent(in), optional :: temperature   !! [K]
    type(symmetry_t) :: plane
    integer :: a

    plane%place = size(sim%scene%condition) + 1
    plane%axis = axis
    plane%row = at - nint(sim%scene%grid%lower(axis)/h)
    plane%faces_up = faces_up
    plane%odd = [(a == axis, a=1, 3)]
    if (present(odd)) plane%odd = odd
    if (present(temperature)) plane%temperature = temperature
    sim%scene%symmetry = [sim%scene%symmetry, plane]
    sim%scene%condition = [character(32) :: sim%scene%condition, 'plane of symmetry']
  end subroutine add_plane_of_symmetry

  !> A clamp on a box.
  subroutine add_clamp(sim, lower, upper, held, velocity)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: lower(3), upper(3)   !! [cells]; beyond 1e6: no face
    logical, intent(in) :: held(3)
    real(rp), intent(in) :: velocity(3)          !! [m/s]
    type(clamp_t) :: clamp

    clamp%place = size(sim%scene%condition) + 1
    clamp%lower = merge(-huge(1.0_rp), h*lower, lower < -1.0e6_rp)
    clamp%upper = merge(huge(1.0_rp), h*upper, upper > 1.0e6_rp)
    clamp%held = held
    clamp%velocity = velocity
    call append_clamp(sim%scene%clamp, clamp)
    sim%scene%condition = [character(32) :: sim%scene%condition, 'clamp']
  end subroutine add_clamp

  !> Two groups of bodies that meet.
  subroutine add_contact(sim, group, normal, kind, friction)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: group(2), normal, kind
    real(rp), intent(in) :: friction

    sim%scene%contact = [sim%scene%contact, &
                         contact_t(group=group, normal=normal, law=pair_law_t(kind, friction))]
  end subroutine add_contact

  !> A tool that moves evenly from `position` [m] on; particles have surfaces that it may flatten.
  subroutine add_tool(sim, tool, position, velocity, spin)
    type(simulation_t), intent(inout) :: sim
    type(tool_t), intent(in) :: tool
    real(rp), intent(in) :: position(3), velocity(3), spin   !! [m], [m/s], [rad/s]
    type(tool_t), allocatable :: more(:)
    integer :: n

    n = size(sim%tool)
    allocate (more(n + 1))
    more(1:n) = sim%tool
    more(n + 1) = tool
    associate (new => more(n + 1))
      new%start = position
      allocate (new%motion%phase(1))
      new%motion%phase(1) = phase_t(velocity=velocity, spin=spin)
      call new%move_to(0.0_rp)
      call new%store_reference_pose()
    end associate
    call move_alloc(more, sim%tool)
    call sim%scene%layout%add(1, 'distance to the surface', sim%scene%layout%surface_offset)
    call sim%scene%layout%add(1, 'kept impulse of friction', sim%scene%layout%coulomb_reserve)
    call sim%scene%layout%add(3, 'force of tools', sim%scene%layout%tool_force)
  end subroutine add_tool

  !> A half space whose surface looks along `axis`, of length 1.
  type(tool_t) function plane_tool(axis) result(tool)
    real(rp), intent(in) :: axis(3)

    allocate (plane_t :: tool%shape)
    tool%frame = frame_of(axis)
  end function plane_tool

  !> A ball.
  type(tool_t) function sphere_tool(radius) result(tool)
    real(rp), intent(in) :: radius               !! [m]

    allocate (tool%shape, source=sphere_t(radius=radius))
    tool%frame = frame_of([0.0_rp, 0.0_rp, 1.0_rp])
  end function sphere_tool

  !> A box that spins about `axis`.
  type(tool_t) function box_tool(half, axis) result(tool)
    real(rp), intent(in) :: half(3), axis(3)     !! half edges [m]

    allocate (tool%shape, source=box_shape_t(half=half))
    tool%frame = frame_of(axis)
  end function box_tool

  !> A shoulder with a pin that spins about `axis`.
  type(tool_t) function shoulder_tool(radius, axis) result(tool)
    real(rp), intent(in) :: radius, axis(3)      !! of the shoulder [m]

    allocate (tool%shape, source=new_shoulder(radius, 2.0_rp*radius, 0.05_rp, 0.4_rp*radius, &
                                              0.3_rp*radius, 0.3_rp*radius))
    tool%frame = frame_of(axis)
  end function shoulder_tool

  !> The motion of a rigid body of particles.
  type(tool_t) function particle_tool() result(tool)
    tool%frame = frame_of([0.0_rp, 0.0_rp, 1.0_rp])
  end function particle_tool

  !> Axes of which the last is `axis`, of length 1.
  pure function frame_of(axis) result(frame)
    real(rp), intent(in) :: axis(3)
    real(rp) :: frame(3, 3), across(3)

    across = 0.0_rp
    across(minloc(abs(axis), 1)) = 1.0_rp
    across = across - dot_product(across, axis)*axis
    frame(:, 1) = across/norm2(across)
    frame(:, 3) = axis
    associate (c => axis, a => frame(:, 1))
      frame(:, 2) = [c(2)*a(3) - c(3)*a(2), c(3)*a(1) - c(1)*a(3), c(1)*a(2) - c(2)*a(1)]
    end associate
  end function frame_of

  !> Particles of `body` in the box between two corners, on a lattice of their own; each rank makes
  !> those of some planes. With `radius` only those in a disc about the middle, seen along z.
  subroutine fill(world, sim, body, lower, upper, per_cell, radius)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: body
    real(rp), intent(in) :: lower(3), upper(3)   !! [cells]
    integer, intent(in) :: per_cell              !! along each axis
    real(rp), intent(in), optional :: radius     !! [cells]
    integer :: faces, i, j, k, n(3)
    real(rp) :: x(3)

    sim%scene%body(body)%spacing = h/per_cell
    sim%scene%body(body)%widest = h/per_cell
    if (sim%particles%capacity == 0) call sim%particles%init(sim%scene%layout%n)
    n = nint((upper - lower)*per_cell)
    call sim%particles%reserve(sim%particles%nblk + product(n)/nlane + 2)
    sim%particles%nblk = sim%particles%nblk + 1
    sim%particles%body(sim%particles%nblk) = body
    do i = world%rank, n(1) - 1, world%size
      do j = 0, n(2) - 1
        do k = 0, n(3) - 1
          x = lower + ([i, j, k] + 0.5_rp)/per_cell
          if (present(radius)) then
            if (norm2(x(1:2) - 0.5_rp*(lower(1:2) + upper(1:2))) > radius) cycle
          end if
          faces = sum([1, 2, 4, 8, 16, 32], [i == 0, i == n(1) - 1, j == 0, j == n(2) - 1, &
                                             k == 0, k == n(3) - 1])
          call add_particle(sim, body, x*h, make_tag(int((body - 1)*most_in_body + 1 + k &
                                                         + n(3)*(j + n(2)*i), i8), faces))
        end do
      end do
    end do
    if (sim%particles%count(sim%particles%nblk) == 0) sim%particles%nblk = sim%particles%nblk - 1
  end subroutine fill

  !> One more particle, at rest and free of stress.
  subroutine add_particle(sim, body, x, tag)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: body
    real(rp), intent(in) :: x(3)
    integer(i8), intent(in) :: tag

    associate (last => sim%particles%nblk, layout => sim%scene%layout)
      if (sim%particles%count(last) == nlane) then
        last = last + 1
        sim%particles%body(last) = body
        sim%particles%count(last) = 0
      end if
      if (sim%particles%count(last) == 0) then   ! unused lanes are neutral
        sim%particles%ps(:, :, last) = 0.0_rp
        sim%particles%ps(:, f_bbar:f_bbar + 2, last) = 1.0_rp
        sim%particles%ps(:, f_jac, last) = 1.0_rp
      end if
      sim%particles%count(last) = sim%particles%count(last) + 1
      associate (ps => sim%particles%ps(sim%particles%count(last), :, last))
        ps(f_pos:f_pos + 2) = x
        ps(f_temp) = room_temperature
        ps(f_mass) = rho*product(sim%scene%body(body)%spacing)
        if (layout%surface_offset > 0) ps(layout%surface_offset) = 1.0_rp
        if (layout%half > 0) ps(layout%half:layout%half &
                                            + 2) = sim%scene%domain(body)
        if (layout%rest > 0) ps(layout%rest) = room_temperature
      end associate
      sim%particles%tag(sim%particles%count(last), last) = tag
    end associate
  end subroutine add_particle

  !> Collective. Give the particles to their owners and list the nodes.
  subroutine settle(world, sim)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim

    sim%world = world
    call sim%prepare_scratch()
    call make_first_partition(sim)
    call regrid(sim)
  end subroutine settle

  !> Number of a particle in its body, from 1: the same on any number of ranks.
  elemental integer function number_of(tag)
    integer(i8), intent(in) :: tag

    number_of = int(modulo(tag_id(tag) - 1_i8, int(most_in_body, i8))) + 1
  end function number_of

  !> Random velocities, each component up to `speed`, and masses up to `spread` more or less.
  subroutine shake(sim, speed, spread)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: speed, spread        !! [m/s], [-]
    integer :: a, b, p

    do b = 1, sim%particles%nblk
      do p = 1, sim%particles%count(b)
        associate (ps => sim%particles%ps(p, :, b), id => int(tag_id(sim%particles%tag(p, b))))
          do a = 0, 2
            ps(f_vel + a) = speed*(2.0_rp*noise(id, a) - 1.0_rp)
          end do
          ps(f_mass) = ps(f_mass)*(1.0_rp + spread*(2.0_rp*noise(id, 3) - 1.0_rp))
        end associate
      end do
    end do
  end subroutine shake

  !> Number between 0 and 1 that depends on two others alone.
  elemental real(rp) function noise(id, k)
    integer, intent(in) :: id, k
    integer(i8) :: a

    a = modulo(id*31_i8 + k*7877_i8, 99991_i8)
    a = modulo(a*a*7919_i8 + a*104729_i8 + k*6113_i8, 99991_i8)
    noise = (real(modulo(a*a*613_i8 + a*4729_i8, 99991_i8), rp) + 0.5_rp)/99991.0_rp
  end function noise

  subroutine prepare(self, temp, state, work)
    class(even_law_t), intent(in) :: self
    real(rp), intent(in) :: temp(nlane), state(nlane, self%n_state)
    real(rp), intent(out) :: work(nlane, n_work)

    work = 0.0_rp
  end subroutine prepare

  subroutine stress(self, work, alpha, x, log_rate, sigma, slope)
    class(even_law_t), intent(in) :: self
    real(rp), intent(in) :: work(nlane, n_work), alpha(nlane), x(nlane), log_rate(nlane)
    real(rp), intent(out) :: sigma(nlane), slope(nlane)

    sigma = self%strength
    slope = 0.0_rp
  end subroutine stress

end module step_samples
