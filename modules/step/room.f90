! SPDX-License-Identifier: MIT
!> The room of the metal. J follows the divergence of the grid velocity, and positions the velocity
!> itself: below the size of a cell the two part, and where metal shears past a tool for long it
!> packs in some places and opens in others. The fill of a node is the volume of the particles with
!> its weights, and that of the tools, over the volume of the node. Stirred metal moves down the
!> gradient of the fill, as by diffusion. Positions alone change: momentum and energy are kept.
!>
!> A free surface must neither spread nor attract: near open nodes, less than half full, the fill
!> counts only where metal is packed more than disorder of particles explains.
!>
!> A hole closes on the grid when it is as small as a cell: its sides share nodes and approach no
!> more. The empty part of the room around a particle bounds its pressure (mpm_constitutive).
module step_room
  use base_kinds, only: i8, nlane, rp
  use boundary_symmetry, only: r_momentum, reflect
  use mpm_blocks, only: gather_lanes, values_to_grid, weights_of
  use particles_block, only: block_t, view_block
  use particles_store, only: f_jac, f_mass, f_plastic, f_pos, particles_t
  use state_conditions, only: wall_t
  use state_nodes, only: clear_nodes, nodes_t
  use state_parts, only: simulation_t
  use state_scene, only: scene_t
  use tools_tool, only: tool_t
  use transfer_gather, only: gather_block, lanes_t
  implicit none (type, external)
  private

  public :: keep_room

  ! Lanes of a nodal record: excess of the fill over 1, 1 at an open node, fill by metal alone.
  integer, parameter :: l_excess = 1, l_open = 2, l_metal = 3

  integer(i8), parameter :: interval = 20        !! steps between two corrections
  real(rp), parameter :: diffusivity = 0.2_rp    !! per correction [cells2]; 0.5 is unstable
  !> Fill below which a node is open, as every node beyond a plane surface is.
  real(rp), parameter :: open_fill = 0.5_rp
  real(rp), parameter :: disorder = 0.1_rp       !! excess of the fill by disorder of particles
  real(rp), parameter :: stirred = 3.0_rp       !! plastic strain above which metal moves
  real(rp), parameter :: sheared = 1.0_rp       !! plastic strain above which pores are compacted
  real(rp), parameter :: most = 0.04_rp          !! largest displacement of a correction [cells]
  !> Fill around a particle of a fragment, by metal alone. With two particles along an axis of a
  !> cell a fragment of one cell has at most 0.148 and a row of particles 0.09, a corner of three
  !> layers or more at least 0.19, at any place between the nodes (B-splines).
  real(rp), parameter :: alone = 1.0_rp/6.0_rp
  real(rp), parameter :: reach = 1.5_rp          !! half support of a shape function [cells]

contains

  !> Collective, between two steps. Find fragments, and move stirred metal towards equal fill. Only
  !> metal that flows breaks, so that of other bodies the first step is enough.
  subroutine keep_room(sim)
    type(simulation_t), intent(inout) :: sim
    type(block_t) :: block
    integer :: b, i

    if (.not. sim%scene%method%has_mechanics) return
    if (.not. sim%scene%method%shows_motion) then          ! no metal, or not FLIP
      if (sim%clock%step == 1_i8) call fill_rooms(sim, sim%nodes%g)
      return
    end if
    if (sim%clock%step == 1_i8) call fill_rooms(sim, sim%nodes%g2)
    if (modulo(sim%clock%step, interval) /= 0_i8) return
    associate (g => sim%nodes%g2, mark => sim%nodes%g)
      call fill_rooms(sim, g)
      call clear_nodes(sim%nodes, mark)
      if (sim%world%all_true(.not. has_stirred(sim%scene, sim%particles))) return
      do i = 1, sim%particles%n_mapped
        call view_block(sim%particles, turn_of(sim%particles, i), block)
        call mark_surface(sim%scene, sim%nodes, g(:, :, 1), block, mark(:, :, 1))
      end do
      call free_surface(sim%scene, sim%nodes, g(:, :, 1), mark(:, :, 1))
      do i = 1, sim%particles%n_awake
        b = turn_of(sim%particles, i)
        call view_block(sim%particles, b, block)
        call find_porosity(sim%scene, sim%nodes, g(:, :, 1), block)
        if (.not. is_stirred(sim%scene, sim%particles, b)) cycle
        call move_block(sim%scene, sim%tool, sim%nodes, g(:, :, 1), block)
      end do
    end associate
    sim%clock%displacement = sim%clock%displacement + most*sim%scene%grid%longest()
  end subroutine keep_room

  !> Collective. Compute the fill `g` of the nodes, the voids at the particles, and whether there
  !> are fragments: modes of volume that their particles do not feel need a shorter step
  !> (mpm_stability).
  subroutine fill_rooms(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn, sim%nodes%n_groups)
    type(block_t) :: block
    logical :: is_fragmented
    integer :: i

    call clear_nodes(sim%nodes, g)
    do i = 1, sim%particles%n_mapped   ! including sleepers that share nodes with awake particles
      call view_block(sim%particles, turn_of(sim%particles, i), block)
      call add_volumes(sim%scene, sim%nodes, block, g(:, :, 1))
    end do
    call find_excess(sim, g(:, :, 1))
    is_fragmented = .false.
    do i = 1, sim%particles%n_awake
      call view_block(sim%particles, sim%particles%turn(i), block)
      call find_voids(sim%clock%step > 1_i8, sim%scene, sim%nodes, g(:, :, 1), block, is_fragmented)
    end do
    sim%clock%fragments = merge(0, 1, sim%world%all_true(.not. is_fragmented))
  end subroutine fill_rooms

  !> Block `i` of those that contribute mass, awake ones in their order.
  pure integer function turn_of(particles, i) result(b)
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: i

    b = i
    if (i <= particles%n_awake) b = particles%turn(i)
  end function turn_of

  !> True if this rank has stirred metal that is awake.
  pure logical function has_stirred(scene, particles)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    integer :: i

    has_stirred = .false.
    do i = 1, particles%n_awake
      has_stirred = is_stirred(scene, particles, particles%turn(i))
      if (has_stirred) return
    end do
  end function has_stirred

  !> True if block `b` has stirred metal.
  pure logical function is_stirred(scene, particles, b)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: b

    associate (body => scene%body(particles%body(b)))
      is_stirred = .not. body%is_rigid() .and. allocated(scene%material(body%material)%flow)
    end associate
    if (is_stirred) is_stirred = any(particles%ps(:particles%count(b), f_plastic, b) > stirred)
  end function is_stirred

  !> Add the volumes of a block to lane 1 of the nodes.
  subroutine add_volumes(scene, nodes, block, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(block_t), intent(inout) :: block
    real(rp), intent(inout) :: g(8, nodes%patch%nn)

    call weights_of(scene, nodes, block)
    nodes%rec(1:4, 1, :) = 0.0_rp
    nodes%rec(1, 1, :) = block%ps(:, f_mass)*block%ps(:, f_jac) &
                         /scene%material(scene%body(block%body)%material)%rho
    call values_to_grid(nodes, block, g)
  end subroutine add_volumes

  !> Collective. From the volumes of the particles: the excess of the fill over 1, the open nodes,
  !> and the fill by metal alone, without its images behind walls: a crumb on a wall has the modes
  !> of a free one.
  subroutine find_excess(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(inout) :: g(8, sim%nodes%patch%nn)
    real(rp) :: excess, h(3), lost(8, size(sim%scene%symmetry)), x(3)
    real(rp), allocatable :: metal(:, :)
    integer :: i, k, r

    allocate (metal(1, sim%nodes%patch%nn), source=g(1:1, :))
    call sim%nodes%halo%sum(1, sim%nodes%patch%nn, metal)
    lost = 0.0_rp
    call reflect(sim%scene, sim%nodes, r_momentum, g, lost)
    call sim%nodes%halo%sum(8, sim%nodes%patch%nn, g)
    associate (planes => sim%nodes%boundary%mirrors%plane)
      do i = 1, size(planes, 2)
        g(1, planes(1, i)) = 2.0_rp*g(1, planes(1, i))   ! the other half of the node is its image
      end do
    end associate
    do r = 1, sim%nodes%n_ranges
      do i = sim%nodes%range(1, r), sim%nodes%range(2, r)
        call sim%nodes%patch%share_of(i, x, h)
        metal(1, i) = metal(1, i)/product(h)
        excess = g(1, i)/product(h) - 1.0_rp
        do k = 1, size(sim%tool)
          excess = excess + covered_part(sim%tool(k), h, x)
        end do
        g(l_excess, i) = excess
        g(l_open, i) = merge(1.0_rp, 0.0_rp, excess < open_fill - 1.0_rp)
      end do
    end do
    call mirror(sim%nodes, g)
    g(l_metal, :) = metal(1, :)
  end subroutine find_excess

  !> Set the nodes behind walls to the values of their mirror nodes.
  pure subroutine mirror(nodes, g)
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    integer :: i

    associate (pair => nodes%boundary%mirrors%pair)
      do i = nodes%boundary%mirrors%n_pairs, 1, -1
        g(:, pair(1, i)) = g(:, pair(2, i))
      end do
    end associate
  end subroutine mirror

  !> Set `is_fragmented` if a particle of the block is of a fragment. With `stores_voids`, store the
  !> empty part of the room around the particles, beyond what disorder explains; negative where the
  !> metal is packed.
  subroutine find_voids(stores_voids, scene, nodes, g, block, is_fragmented)
    logical, intent(in) :: stores_voids
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    type(block_t), intent(inout) :: block
    logical, intent(inout) :: is_fragmented
    real(rp) :: u(nlane, l_metal)

    call gather_lanes(scene, nodes, l_excess, l_metal, g, block, u)
    if (.not. scene%body(block%body)%is_rigid()) then
      is_fragmented = is_fragmented .or. any(u(:block%n, l_metal) < alone)
    end if
    if (scene%layout%void == 0 .or. .not. stores_voids) return
    associate (n => block%n)
      block%ps(:n, scene%layout%void) = sign(min(1.0_rp, max(0.0_rp, abs(u(:n, 1)) - disorder)), &
                                             -u(:n, 1))
    end associate
  end subroutine find_voids

  !> Store the part of the room around the particles of a block that neither metal nor tools fill,
  !> away from free surfaces.
  subroutine find_porosity(scene, nodes, g, block)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    type(block_t), intent(inout) :: block
    real(rp) :: u(nlane, 1)

    call gather_lanes(scene, nodes, l_excess, 1, g, block, u)
    associate (n => block%n)
      block%ps(:n, scene%layout%porosity) = merge(min(1.0_rp, max(0.0_rp, -u(:n, 1))), 0.0_rp, &
                                                  block%ps(:n, f_plastic) > sheared)
    end associate
  end subroutine find_porosity

  !> Mark the nodes of the particles that reach an open node.
  subroutine mark_surface(scene, nodes, g, block, mark)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    type(block_t), intent(inout) :: block
    real(rp), intent(inout) :: mark(8, nodes%patch%nn)
    real(rp) :: u(nlane, 1)

    call gather_lanes(scene, nodes, l_open, 1, g, block, u)
    if (.not. any(u(:block%n, 1) > 0.0_rp)) return
    nodes%rec(1:4, 1, :) = 0.0_rp
    nodes%rec(1, 1, :block%n) = merge(1.0_rp, 0.0_rp, u(:block%n, 1) > 0.0_rp)
    call values_to_grid(nodes, block, mark)
  end subroutine mark_surface

  !> Collective. Marked nodes attract nothing, and repel only what disorder does not explain.
  subroutine free_surface(scene, nodes, g, mark)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    real(rp), intent(inout) :: g(8, nodes%patch%nn), mark(8, nodes%patch%nn)
    real(rp) :: lost(8, size(scene%symmetry))
    integer :: i, r

    lost = 0.0_rp
    call reflect(scene, nodes, r_momentum, mark, lost)
    call nodes%halo%sum(8, nodes%patch%nn, mark)
    do r = 1, nodes%n_ranges
      do i = nodes%range(1, r), nodes%range(2, r)
        if (mark(1, i) > 0.0_rp) g(l_excess, i) = max(0.0_rp, g(l_excess, i) - disorder)
      end do
    end do
    call mirror(nodes, g)
  end subroutine free_surface

  !> Part of the room of a node that a tool covers, with the weights of the node: the mean over
  !> eight points that carry half of the variance of the shape function, h2/4 along each axis, each
  !> with the rest.
  real(rp) function covered_part(tool, h, x) result(part)
    type(tool_t), intent(in) :: tool
    real(rp), intent(in) :: h(3), x(3)                 !! edges and centre of the room [m]
    real(rp), parameter :: sigma = sqrt(0.125_rp)
    real(rp) :: d, n(3)
    integer :: i, j, k

    part = 0.0_rp
    d = tool%clearance(x)
    if (d > reach*maxval(h)) return
    part = 1.0_rp
    if (d < -reach*maxval(h)) return
    part = 0.0_rp
    do i = -1, 1, 2
      do j = -1, 1, 2
        do k = -1, 1, 2
          call tool%distance(x + sigma*h*real([i, j, k], rp), d, n)
          part = part + 0.0625_rp*erfc(d/(sqrt(2.0_rp)*sigma*norm2(n*h)))
        end do
      end do
    end do
  end function covered_part

  !> Move the stirred particles of a block.
  subroutine move_block(scene, tools, nodes, g, block)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tools(:)
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    type(block_t), intent(inout) :: block
    real(rp) :: h(3), none(nlane, 0), slope(nlane, 3), spacing(3), step(3), v(nlane, 1), x(3)
    integer :: k, p

    call weights_of(scene, nodes, block)
    call gather_block(lanes_t(sloped=l_excess, n_sloped=1, plain=1, n_plain=0), block%n, block%w, &
                      block%first, nodes%patch%stride, nodes%patch%nn, g, nodes%rec, v, slope, none)
    do p = 1, block%n
      if (block%ps(p, f_plastic) <= stirred) cycle
      x = block%ps(p, f_pos:f_pos + 2)
      h = nodes%patch%edges_at(x)
      step = -h*max(-most, min(most, diffusivity*h*slope(p, :)))
      spacing = scene%spacing_of(block%body, block%ps(p, :))
      do k = 1, size(tools)
        call stop_at(tools(k), x, 0.5_rp*block%ps(p, scene%layout%surface_offset)*maxval(spacing), &
                     step)
      end do
      do k = 1, size(scene%wall)
        call stop_at_wall(scene%wall(k), x, spacing, step)
      end do
      block%ps(p, f_pos:f_pos + 2) = x + step
    end do
  end subroutine move_block

  !> Shorten a displacement so that the surface of a particle does not enter a wall.
  pure subroutine stop_at_wall(wall, x, spacing, step)
    type(wall_t), intent(in) :: wall
    real(rp), intent(in) :: x(3), spacing(3)   !! position and spacing of the particle [m]
    real(rp), intent(inout) :: step(3)         !! displacement [m]
    real(rp) :: room, sense

    associate (a => wall%axis)
      sense = merge(1.0_rp, -1.0_rp, wall%faces_up)
      room = sense*(x(a) - wall%position) - 0.5_rp*spacing(a)
      step(a) = sense*max(sense*step(a), -max(0.0_rp, room))
    end associate
  end subroutine stop_at_wall

  !> Shorten a displacement so that the surface of a particle does not enter a tool.
  pure subroutine stop_at(tool, x, half, step)
    type(tool_t), intent(in) :: tool
    real(rp), intent(in) :: x(3), half       !! position, distance of the surface [m]
    real(rp), intent(inout) :: step(3)       !! displacement [m]
    real(rp) :: d, into, n(3)

    call tool%distance(x, d, n, cutoff=half + norm2(step))
    into = -dot_product(step, n) - max(0.0_rp, d - half)
    if (into > 0.0_rp .and. d < half + norm2(step)) step = step + into*n
  end subroutine stop_at

end module step_room
