! SPDX-License-Identifier: MIT
!> Clamps, and walls that are not mirrors. Nodes inside their box are held. Where a face of the box
!> lies between nodes, the velocity at the face is held instead of the next node: v(face) = sum w v
!> of the two or three nodes across it, by the impulse w lambda on each of them (a projection in the
!> mass norm, which cannot add energy to a body at rest). A node with much less mass than one at the
!> end of a body would take all of lambda without holding the rest of the body: its weight decreases
!> with its mass.
!>
!> Coulomb friction on walls that are mirrors. Reflection leaves the force that presses on the wall
!> at the nodes on it (boundary_symmetry). The tangential velocity at the wall, sum w v of the node
!> on it and the one in front, is brought towards rest by an impulse w lambda on both, at most the
!> coefficient times the pressing impulse. Such a projection cannot add energy. The shear strength
!> of the metal needs no limit of its own: the stress of the particles beside the wall has it.
!>
!> A moving tool inside the box of a clamp and the clamp prescribe different velocities of the same
!> metal, which would be crushed between held nodes and the tool. The clamp therefore does not hold
!> nodes within a cell of the surface of such a tool, if it holds the velocity component nearest to
!> the normal of the tool there.
module boundary_clamps
  use base_kinds, only: rp
  use grid_geometry, only: length_along, wrap
  use state_boundary, only: column_nodes_t, column_t
  use state_clock, only: clock_t
  use state_nodes, only: min_node_inertia, min_node_mass, nodes_t
  use state_scene, only: scene_t
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: box_has, hold_walls, release_held, release_near_tools

  real(rp), parameter, public :: slack = 1.0e-6_rp   !! tolerance of positions [cells]

  !> Smallest mass of a node, over that at the end of a body, that leaves its weight unchanged.
  real(rp), parameter :: min_tail = 0.5_rp

contains

  !> Collective. Apply friction on walls, then set the held nodes of walls and clamps to their
  !> velocity, times `fraction`; add what walls and clamps exert.
  subroutine hold_walls(scene, clock, nodes, fraction, g, impulses, wall_work)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(inout) :: nodes
    real(rp), intent(in) :: fraction                 !! 1, or 0 for clamps at rest
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    real(rp), intent(inout) :: impulses(:, :)        !! of each condition [N s]
    real(rp), intent(inout) :: wall_work             !! [J]
    integer, parameter :: velocities(6) = [1, 2, 3, 5, 6, 7]
    integer :: axis, k

    do k = 1, nodes%n_groups
      if (scene%is_rigid_group(k)) cycle
      call apply_wall_friction(scene, clock, nodes, g(:, :, k), impulses, wall_work)
      call copy_columns(nodes, nodes%boundary%in_front, velocities, g(:, :, k))
      do axis = 1, 3
        call hold_columns(scene, clock, nodes, axis, fraction, g(:, :, k), impulses, wall_work)
        call copy_columns(nodes, nodes%boundary%along(axis), velocities, g(:, :, k))
      end do
      call hold_nodes(scene, clock, nodes, fraction, g(:, :, k), impulses, wall_work)
    end do
  end subroutine hold_walls

  !> Stop the metal on walls with friction, and record the impulse and the work of friction. Held
  !> nodes and mirrored velocities are set afterwards.
  subroutine apply_wall_friction(scene, clock, nodes, g, impulses, wall_work)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(inout) :: g(8, nodes%patch%nn)   !! velocity records
    real(rp), intent(inout) :: impulses(:, :), wall_work   !! [N s] of each condition, [J]
    real(rp) :: pressing(nodes%boundary%mirrors%n_planes)   !! impulse into the wall [N s]
    real(rp) :: least
    integer :: axis, i, lane

    if (all(scene%symmetry%friction_coefficient <= 0.0_rp)) return
    least = min_node_inertia(scene, clock)
    associate (plane => nodes%boundary%mirrors%plane)
      do i = 1, size(pressing)
        associate (wall => scene%symmetry(plane(2, i)), q => plane(1, i))
          if (wall%friction_coefficient <= 0.0_rp) cycle
          lane = wall%axis
          pressing(i) = merge(-1.0_rp, 1.0_rp, wall%faces_up)*max(g(8, q), least)*g(4 + lane, q)
          g([lane, 4 + lane], q) = 0.0_rp
        end associate
      end do
      do axis = 1, 3                            ! the same order on all ranks
        do i = 1, size(pressing)
          associate (wall => scene%symmetry(plane(2, i)))
            if (wall%axis == axis .and. wall%friction_coefficient > 0.0_rp) then
              call stop_node(scene, nodes, plane(2, i), plane(1, i), &
                             wall%friction_coefficient*pressing(i), least, g, impulses, &
                             wall_work)
            end if
          end associate
        end do
      end do
    end associate
  end subroutine apply_wall_friction

  !> Friction on wall `c` at its node `on`, by an impulse of at most `limit`.
  subroutine stop_node(scene, nodes, c, on, limit, least, g, impulses, wall_work)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: c, on
    real(rp), intent(in) :: limit  !! largest impulse [N s]
    real(rp), intent(in) :: least  !! smallest nodal inertia [kg]
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    real(rp), intent(inout) :: impulses(:, :), wall_work   !! [N s] of each condition, [J]
    real(rp) :: change(3), impulse(3), inertia(2), spans(3), v(3), w(2), work
    integer :: ijk(3), k, node(2), step

    associate (wall => scene%symmetry(c), patch => nodes%patch)
      if (limit <= 0.0_rp .or. g(8, on) <= min_node_mass) return
      ijk = patch%indices(on)
      step = merge(1, -1, wall%faces_up)
      if (ijk(wall%axis) + step < patch%all%lo(wall%axis)) return   ! no particle is near
      if (ijk(wall%axis) + step > patch%all%hi(wall%axis)) return
      node = [on, on + step*patch%stride(wall%axis)]
      w = [1.0_rp, 0.0_rp]
      if (scene%method%is_bspline) w = [0.75_rp, 0.25_rp]
      associate (grading => patch%grading(wall%axis))
        if (grading%is_graded) then
          spans = grading%weights(ijk(wall%axis), 0.0_rp)
          w = [spans(2), spans(1) + spans(3)]
        end if
      end associate
      where (g(8, node) <= min_node_mass) w = 0.0_rp
      inertia = max(g(8, node), least, min_node_mass)
      v = w(1)*g(1:3, node(1)) + w(2)*g(1:3, node(2))
      v(wall%axis) = 0.0_rp
      impulse = -v/sum(w**2/inertia)
      if (norm2(impulse) > limit) impulse = impulse*(limit/norm2(impulse))
      work = 0.0_rp
      do k = 1, 2
        change = w(k)*impulse/inertia(k)
        work = work + w(k)*dot_product(impulse, g(1:3, node(k)) + 0.5_rp*change)
        g(1:3, node(k)) = g(1:3, node(k)) + change
        g(5:7, node(k)) = g(5:7, node(k)) + change
      end do
      if (.not. patch%own%has(ijk)) return
      impulses(:, wall%place) = impulses(:, wall%place) + impulse
      wall_work = wall_work + work
    end associate
  end subroutine stop_node

  !> Hold the nodes inside the boxes.
  subroutine hold_nodes(scene, clock, nodes, fraction, g, impulses, wall_work)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: fraction
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    real(rp), intent(inout) :: impulses(:, :), wall_work   !! [N s] of each condition, [J]
    real(rp) :: value, before, impulse, least, v(3)
    integer :: a, i, q

    least = min_node_inertia(scene, clock)
    do i = 1, nodes%boundary%n_fixed
      q = nodes%boundary%fixed(1, i)
      associate (clamp => scene%clamp(nodes%boundary%fixed(2, i))%clamp)
        v = clamp%velocity
        if (.not. clamp%is_uniform) v = clamp%velocity_at(nodes%patch%position(q), clock%time)
        do a = 1, 3
          if (.not. clamp%held(a)) cycle
          value = fraction*v(a)
          before = g(a, q) - g(4 + a, q)
          if (nodes%boundary%fixed(3, i) == 1 .and. g(8, q) > min_node_mass) then
            impulse = max(g(8, q), least)*(value - g(a, q))
            impulses(a, clamp%place) = impulses(a, clamp%place) + impulse
            wall_work = wall_work + impulse*0.5_rp*(before + value)
          end if
          g(a, q) = value
          g(4 + a, q) = value - before
        end do
      end associate
    end do
  end subroutine hold_nodes

  !> Hold the velocities at the faces of the columns along one axis.
  subroutine hold_columns(scene, clock, nodes, axis, fraction, g, impulses, wall_work)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: axis
    real(rp), intent(in) :: fraction
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    real(rp), intent(inout) :: impulses(:, :), wall_work   !! [N s] of each condition, [J]
    real(rp) :: impulse, jump(3), least, v(3)
    integer :: a, i, k, q

    least = min_node_inertia(scene, clock)
    do i = 1, nodes%boundary%n_columns
      associate (column => nodes%boundary%column(i), &
                 clamp => scene%clamp(nodes%boundary%column(i)%clamp)%clamp)
        if (column%axis /= axis .or. .not. column%is_whole) cycle
        v = clamp%velocity
        if (.not. clamp%is_uniform) then
          v = clamp%velocity_at(nodes%patch%position(column%node(2)), clock%time)
        end if
        do a = 1, 3
          if (.not. clamp%held(a)) cycle
          jump = jumps(column, fraction*v(a), a, least, nodes%patch%nn, g, g)
          do k = 1, 3
            if (column%node(k) == 0) cycle
            q = column%node(k)
            g(a, q) = g(a, q) + jump(k)
            g(4 + a, q) = g(4 + a, q) + jump(k)
            if (.not. column%is_owned(k)) cycle
            impulse = max(g(8, q), least)*jump(k)
            impulses(a, clamp%place) = impulses(a, clamp%place) + impulse
            wall_work = wall_work + impulse*(g(a, q) - 0.5_rp*g(4 + a, q))
          end do
        end do
      end associate
    end do
  end subroutine hold_columns

  !> Changes of lane `a` at the nodes of a column that set its value at the face to `value`.
  pure function jumps(column, value, a, least, nn, mass, g) result(jump)
    type(column_t), intent(in) :: column
    real(rp), intent(in) :: value, least     !! prescribed value, smallest nodal inertia [kg]
    integer, intent(in) :: a, nn
    real(rp), intent(in) :: mass(8, nn)      !! velocity records
    real(rp), intent(in) :: g(8, nn)
    real(rp) :: jump(3), heaviest, inverse(3), total, v, w(3)
    integer :: k

    jump = 0.0_rp
    w = 0.0_rp
    inverse = 0.0_rp
    v = 0.0_rp
    heaviest = maxval(mass(8, pack(column%node, column%node > 0)))
    do k = 1, 3
      if (column%node(k) == 0) cycle
      if (mass(8, column%node(k)) <= min_node_mass) cycle
      associate (m => mass(8, column%node(k)))
        w(k) = column%weight(k)*min(1.0_rp, m/(min_tail*heaviest*column%tail(k)))
        inverse(k) = 1.0_rp/max(m, least)
        v = v + w(k)*g(a, column%node(k))
      end associate
    end do
    total = sum(w)
    if (total > 0.0_rp) jump = w*inverse*(value*total - v)/sum(w*w*inverse)
  end function jumps

  !> Collective. Where ranks cut columns, copy the lanes `lanes` of their nodes from the ranks that
  !> use these columns whole.
  subroutine copy_columns(nodes, along, lanes, g)
    type(nodes_t), intent(inout) :: nodes
    type(column_nodes_t), intent(in) :: along
    integer, intent(in) :: lanes(:)
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    real(rp), allocatable :: values(:, :)
    integer, allocatable :: place(:)
    integer :: e, n

    if (.not. along%is_cut) return
    n = size(along%node)
    allocate (values(size(lanes), n))
    allocate (place(nodes%patch%nn), source=0)
    place(along%node) = [(e, e=1, n)]
    do e = 1, n
      values(:, e) = merge(g(lanes, along%node(e)), -huge(1.0_rp), along%is_known(e))
    end do
    call nodes%halo%combine(.true., nodes%patch%nn, place, n, along%node, &
                                size(lanes), values)
    do e = 1, n
      if (any(values(:, e) <= -huge(1.0_rp))) cycle
      g(lanes, along%node(e)) = values(:, e)
    end do
  end subroutine copy_columns

  !> Collective. Set the held components of the velocities in lanes 5:7 of `increment` to zero; `g`
  !> holds the masses.
  subroutine release_held(scene, nodes, g, increment)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    real(rp), intent(in) :: g(8, nodes%patch%nn, nodes%n_groups)
    real(rp), intent(inout) :: increment(8, nodes%patch%nn, nodes%n_groups)
    real(rp) :: jump(3)
    integer :: a, axis, i, j, k, q

    do k = 1, nodes%n_groups
      do axis = 1, 3
        do i = 1, nodes%boundary%n_columns
          associate (column => nodes%boundary%column(i), &
                     clamp => scene%clamp(nodes%boundary%column(i)%clamp)%clamp)
            if (column%axis /= axis .or. .not. column%is_whole) cycle
            do a = 1, 3
              if (.not. clamp%held(a)) cycle
              jump = jumps(column, 0.0_rp, 4 + a, 0.0_rp, nodes%patch%nn, g(:, :, k), &
                           increment(:, :, k))
              do j = 1, 3
                q = column%node(j)
                if (q > 0) increment(4 + a, q, k) = increment(4 + a, q, k) + jump(j)
              end do
            end do
          end associate
        end do
        call copy_columns(nodes, nodes%boundary%along(axis), [5, 6, 7], increment(:, :, k))
      end do
      do i = 1, nodes%boundary%n_fixed
        associate (v => increment(5:7, nodes%boundary%fixed(1, i), k))
          where (scene%clamp(nodes%boundary%fixed(2, i))%clamp%held) v = 0.0_rp
        end associate
      end do
    end do
  end subroutine release_held

  !> Remove the nodes and columns near tools, at the tool positions at the beginning of a step, from
  !> the lists of held ones.
  subroutine release_near_tools(scene, time, nodes, tools)
    type(scene_t), intent(in) :: scene
    real(rp), intent(in) :: time                     !! [s]
    type(nodes_t), intent(inout) :: nodes
    type(tool_t), intent(in) :: tools(:)
    logical :: meets(size(tools), size(scene%clamp))
    integer, allocatable :: kept(:)
    integer :: c, i, k

    do c = 1, size(scene%clamp)
      do k = 1, size(tools)
        meets(k, c) = enters_box(scene, tools, k, c)
      end do
    end do
    if (.not. any(meets) .and. .not. allocated(nodes%boundary%listed_node)) return
    associate (now => nodes%boundary)
      if (.not. allocated(now%listed_node)) then
        now%listed_node = now%fixed(:, :now%n_fixed)
        now%listed_column = now%column(:now%n_columns)
      end if
      associate (node => now%listed_node, column => now%listed_column)
        kept = pack([(i, i=1, size(node, 2))], [(holds(node(1, i), node(2, i)), &
                                                 i=1, size(node, 2))])
        now%is_held(node(1, :)) = .false.
        now%is_held(node(1, kept)) = .true.
        now%n_fixed = size(kept)
        now%fixed(:, :size(kept)) = node(:, kept)
        kept = pack([(i, i=1, size(column))], [(holds(column(i)%node(2), column(i)%clamp), &
                                                i=1, size(column))])
        now%n_columns = size(kept)
        now%column(:size(kept)) = column(kept)
      end associate
      if (.not. any(meets)) deallocate (now%listed_node, now%listed_column)
    end associate
  contains
    !> True if clamp `c` still holds node `q`, given the tools inside its box.
    logical function holds(q, c)
      integer, intent(in) :: q, c
      real(rp) :: d, n(3), x(3)
      integer :: k

      holds = .true.
      if (.not. any(meets(:, c))) return
      x = nodes%patch%position(q)
      call wrap(scene%grid, x)
      do k = 1, size(tools)
        if (.not. meets(k, c)) cycle
        call tools(k)%distance(x, d, n)
        if (d >= length_along(nodes%patch%edges_at(x), n)) cycle
        if (.not. scene%clamp(c)%clamp%held(maxloc(abs(n), dim=1))) cycle
        if (d <= 0.0_rp .or. box_has(scene, time, nodes, c, x - d*n)) holds = .false.
      end do
    end function holds
  end subroutine release_near_tools

  !> True if tool `k` moves relative to clamp `c` and its bounding box overlaps that of the clamp.
  pure logical function enters_box(scene, tools, k, c)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tools(:)
    integer, intent(in) :: k, c
    real(rp) :: lower(3), upper(3)

    enters_box = .false.
    associate (tool => tools(k), clamp => scene%clamp(c)%clamp)
      if (clamp%is_wall .or. .not. tool%has_shape()) return
      if (.not. (tool%drive%is_free .or. .not. clamp%is_uniform .or. any(abs(tool%omega) > 0.0_rp) &
                 .or. any(abs(tool%velocity - clamp%velocity) > 0.0_rp))) return
      call tool%bounds(lower, upper)
      enters_box = all(lower <= clamp%upper .and. upper >= clamp%lower)
    end associate
  end function enters_box

  !> True if `x` or one of its nearest images is inside the box of clamp `c`, which is not released.
  pure logical function box_has(scene, time, nodes, c, x)
    type(scene_t), intent(in) :: scene
    real(rp), intent(in) :: time             !! [s]
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: c
    real(rp), intent(in) :: x(3)             !! position of the point [m]
    real(rp) :: y(3)
    logical :: inside(3)
    integer :: turn

    box_has = .false.
    if (time >= scene%clamp(c)%clamp%until) return
    inside = .false.
    associate (patch => nodes%patch, clamp => scene%clamp(c)%clamp)
      do turn = -1, 1
        y = x + patch%h*real(turn*patch%period, rp)
        inside = inside .or. (y >= clamp%lower - slack*patch%h &
                              .and. y <= clamp%upper + slack*patch%h)
      end do
    end associate
    box_has = all(inside)
  end function box_has

end module boundary_clamps
