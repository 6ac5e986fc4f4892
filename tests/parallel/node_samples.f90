! SPDX-License-Identifier: MIT
!> Records of the nodes of a step, for tests that look at them: made by hand, gathered from all
!> ranks, summed.
module node_samples
  use base_kinds, only: rp
  use base_world, only: world_t
  use state_nodes, only: min_node_inertia, min_node_mass, nodes_t, update_nodes
  use state_parts, only: simulation_t
  use step_advance, only: take_step
  use step_samples, only: noise, number_of
  use step_to_grid, only: particles_to_grid
  implicit none (type, external)
  private

  public :: all_of, balance_of, balance_t, gather_nodes, gather_particles, map_particles, &
            set_velocity, shake_nodes, step_once

  !> Sums over all nodes, each once.
  type :: balance_t
    real(rp) :: mass = 0.0_rp, momentum(3) = 0.0_rp      !! [kg], [N s]
    real(rp) :: moment(3) = 0.0_rp                       !! about a point [N m s]
    real(rp) :: energy = 0.0_rp                          !! kinetic [J]
  end type balance_t

contains

  !> Collective. Sums over the ranks.
  function all_of(world, values) result(sums)
    type(world_t), intent(in) :: world
    real(rp), intent(in) :: values(:)
    real(rp) :: sums(size(values))

    sums = values
    call world%sum(sums)
  end function all_of

  !> Collective. Velocity records of the nodes, from the particles and `dt` of their forces [s].
  subroutine map_particles(world, sim, dt, g)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)

    call particles_to_grid(sim, g)
    call update_nodes(sim%scene, sim%clock, sim%nodes, dt, g)
  end subroutine map_particles

  !> Collective. A step of `dt` [s], or of less if that is too long.
  subroutine step_once(world, sim, dt)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: dt
    real(rp) :: taken

    taken = dt
    call take_step(sim, taken)
    sim%clock%dt = taken
    sim%clock%time = sim%clock%time + taken
    sim%clock%step = sim%clock%step + 1
    sim%clock%displacement = sim%clock%displacement + taken*sim%clock%max_speed
  end subroutine step_once

  !> The velocity v + L x at the nodes in use, and no change of it.
  subroutine set_velocity(nodes, v, l, g)
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: v(3), l(3, 3)        !! [m/s], [1/s]
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    integer :: i, r

    do r = 1, nodes%n_ranges
      do i = nodes%range(1, r), nodes%range(2, r)
        g(1:3, i) = v + matmul(l, nodes%patch%position(i))
        g(5:7, i) = 0.0_rp
      end do
    end do
  end subroutine set_velocity

  !> Random velocities of the nodes in use, each component up to `speed`, with changes up to
  !> `change` [m/s]; `group` makes those of several fields differ.
  subroutine shake_nodes(nodes, speed, change, group, g)
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: speed, change
    integer, intent(in) :: group
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    integer :: a, i, ijk(3), r, id

    do r = 1, nodes%n_ranges
      do i = nodes%range(1, r), nodes%range(2, r)
        ijk = nint(nodes%patch%position(i)/nodes%patch%h)
        where (nodes%patch%period > 0) ijk = modulo(ijk, nodes%patch%period)
        id = 50000 + ijk(1) + 61*ijk(2) + 3721*ijk(3)
        do a = 1, 3
          g(a, i) = speed*(2.0_rp*noise(id, a + 10*group) - 1.0_rp)
          g(4 + a, i) = change*(2.0_rp*noise(id, a + 10*group + 3) - 1.0_rp)
        end do
      end do
    end do
  end subroutine shake_nodes

  !> Collective. Records of all nodes of the grid, from their owners, on every rank; x first.
  subroutine gather_nodes(world, sim, g, whole)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: g(8, sim%nodes%patch%nn)
    real(rp), allocatable, intent(out) :: whole(:, :, :, :)   !! (8, 0:nx-1, 0:ny-1, 0:nz-1)
    real(rp), allocatable :: flat(:)
    integer :: i, ijk(3), r

    associate (n => sim%scene%grid%n, nodes => sim%nodes)
      allocate (whole(8, 0:n(1) - 1, 0:n(2) - 1, 0:n(3) - 1), source=0.0_rp)
      do r = 1, nodes%n_ranges
        if (nodes%range(3, r) == 0) cycle
        do i = nodes%range(1, r), nodes%range(2, r)
          ijk = nint((nodes%patch%position(i) - sim%scene%grid%lower)/nodes%patch%h)
          whole(:, ijk(1), ijk(2), ijk(3)) = g(:, i)
        end do
      end do
      flat = reshape(whole, [size(whole)])
      call world%sum(flat)
      whole = reshape(flat, shape(whole))
    end associate
  end subroutine gather_nodes

  !> Collective. Sums over all nodes of what their velocity records hold; moments about `x` [m]. A
  !> node moves with the inertia that it has against forces.
  type(balance_t) function balance_of(world, sim, x, g) result(sums)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: x(3), g(8, sim%nodes%patch%nn)
    real(rp) :: arm(3), flat(8), least, p(3)
    integer :: i, r

    least = min_node_inertia(sim%scene, sim%clock)
    flat = 0.0_rp
    associate (nodes => sim%nodes)
      do r = 1, nodes%n_ranges
        if (nodes%range(3, r) == 0) cycle
        do i = nodes%range(1, r), nodes%range(2, r)
          p = max(least, g(8, i))*g(1:3, i)
          if (g(8, i) <= min_node_mass) p = 0.0_rp
          arm = nodes%patch%position(i) - x
          flat = flat + [g(8, i), p, cross(arm, p), 0.5_rp*dot_product(p, g(1:3, i))]
        end do
      end do
    end associate
    call world%sum(flat)
    sums%mass = flat(1)
    sums%momentum = flat(2:4)
    sums%moment = flat(5:7)
    sums%energy = flat(8)
  end function balance_of

  pure function cross(a, b) result(c)
    real(rp), intent(in) :: a(3), b(3)
    real(rp) :: c(3)

    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

  !> Collective. The fields from `field` on of the first `n` particles of `body`, on every rank, in
  !> the order of their numbers.
  subroutine gather_particles(world, sim, body, field, n, values)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: body, field, n
    real(rp), intent(out) :: values(:, :)        !! (fields, n)
    real(rp) :: flat(size(values, 1)*n)
    integer :: b, i, p, width

    width = size(values, 1)
    flat = 0.0_rp
    do b = 1, sim%particles%nblk
      if (sim%particles%body(b) /= body) cycle
      do p = 1, sim%particles%count(b)
        i = number_of(sim%particles%tag(p, b))
        flat(width*(i - 1) + 1:width*i) = sim%particles%ps(p, field:field + width - 1, b)
      end do
    end do
    call world%sum(flat)
    values = reshape(flat, [width, n])
  end subroutine gather_particles

end module node_samples
