! SPDX-License-Identifier: MIT
!> Lists of the nodes held by clamps and walls: nodes inside their box, and columns of nodes across
!> faces that lie between nodes (boundary_clamps).
module boundary_clamp_list
  use base_kinds, only: rp
  use boundary_clamps, only: box_has, slack
  use grid_geometry, only: wrap
  use simulation_boundary, only: column_nodes_t, column_t
  use simulation_nodes, only: append, nodes_t
  use simulation_parts, only: simulation_t
  use simulation_run, only: clock_t
  use simulation_scene, only: scene_t
  implicit none (type, external)
  private

  public :: list_clamps, list_nodes_in_front

contains

  !> Collective. List the held nodes in use, without those behind a mirror.
  subroutine list_clamps(sim)
    type(simulation_t), intent(inout) :: sim
    integer :: a, c, q, r

    if (allocated(sim%nodes%boundary%is_held)) deallocate (sim%nodes%boundary%is_held)
    allocate (sim%nodes%boundary%is_held(sim%nodes%patch%nn), source=.false.)
    sim%nodes%boundary%is_held(sim%nodes%boundary%mirrors%pair(1, :)) = .true.
    if (.not. allocated(sim%nodes%boundary%fixed)) allocate (sim%nodes%boundary%fixed(3, 64), &
                                                       sim%nodes%boundary%column(64))
    if (allocated(sim%nodes%boundary%listed_node)) deallocate (sim%nodes%boundary%listed_node, &
                                                         sim%nodes%boundary%listed_column)
    sim%nodes%boundary%n_fixed = 0
    sim%nodes%boundary%n_columns = 0
    sim%nodes%boundary%in_front%is_cut = .false.   ! of the last lists; set by list_nodes_in_front
    do r = 1, sim%nodes%n_ranges
      do q = sim%nodes%range(1, r), sim%nodes%range(2, r)
        if (sim%nodes%boundary%is_held(q)) cycle   ! behind a mirror
        do c = 1, size(sim%scene%clamp)
          call list_node(sim, c, q)
        end do
      end do
    end do
    sim%nodes%boundary%is_held(sim%nodes%boundary%fixed(1, 1:sim%nodes%boundary%n_fixed)) = .true.
    do a = 1, 3
      sim%nodes%boundary%along(a)%is_cut = .false.
      associate (column => sim%nodes%boundary%column(1:sim%nodes%boundary%n_columns))
        if (sim%world%all_true(all(column%axis /= a))) cycle
      end associate
      call list_column_nodes(sim%nodes, a)
    end do
  end subroutine list_clamps

  !> Collective. List the nodes of the columns along `axis`, including columns that only other ranks
  !> list. Columns along one axis share no nodes, so that a rank that stores a whole column
  !> computes the result at its nodes; columns along different axes share nodes at the edges of
  !> clamps.
  subroutine list_column_nodes(nodes, axis)
    type(nodes_t), intent(inout) :: nodes
    integer, intent(in) :: axis
    real(rp), allocatable :: columns(:, :)   ! lane 1: this rank stores the whole column of the
                                             ! node; lane 2: only a part of it
    integer :: i, k, lane

    allocate (columns(8, nodes%patch%nn), source=0.0_rp)
    do i = 1, nodes%boundary%n_columns
      associate (column => nodes%boundary%column(i))
        if (column%axis /= axis) cycle
        lane = merge(1, 2, column%is_whole)
        do k = 1, 3
          if (column%node(k) > 0) columns(lane, column%node(k)) = 1.0_rp
        end do
      end associate
    end do
    call share_columns(nodes, columns, nodes%boundary%along(axis))
  end subroutine list_column_nodes

  !> Collective. List the nodes used in steps in front of those on walls with friction, which
  !> changes the velocities of both: a rank may use the former and not the latter.
  subroutine list_nodes_in_front(sim)
    type(simulation_t), intent(inout) :: sim
    real(rp), allocatable :: columns(:, :)   ! as in list_column_nodes
    logical :: used(sim%nodes%patch%nn)
    integer :: c, lane, on(3), q, r

    if (all(sim%scene%symmetry%friction_coefficient <= 0.0_rp)) return
    allocate (columns(8, sim%nodes%patch%nn), source=0.0_rp)
    used = .false.
    do r = 1, sim%nodes%n_ranges
      used(sim%nodes%range(1, r):sim%nodes%range(2, r)) = .true.
    end do
    do q = 1, size(used)
      if (.not. used(q)) cycle
      do c = 1, size(sim%scene%symmetry)
        associate (wall => sim%scene%symmetry(c), patch => sim%nodes%patch)
          if (wall%friction_coefficient <= 0.0_rp) cycle
          on = patch%indices(q)
          if (on(wall%axis) /= wall%row + merge(1, -1, wall%faces_up)) cycle
          on(wall%axis) = wall%row
          lane = 2
          if (patch%all%has(on)) lane = merge(1, 2, used(patch%node(on)))
          columns(lane, q) = 1.0_rp
        end associate
      end do
    end do
    call share_columns(sim%nodes, columns, sim%nodes%boundary%in_front)
  end subroutine list_nodes_in_front

  !> Collective. List the nodes of `columns` (list_column_nodes) of all ranks.
  subroutine share_columns(nodes, columns, list)
    type(nodes_t), intent(inout) :: nodes
    real(rp), intent(inout) :: columns(8, nodes%patch%nn)
    type(column_nodes_t), intent(inout) :: list
    logical :: is_known(nodes%patch%nn)
    integer :: i

    is_known = columns(1, :) > 0.0_rp .and. columns(2, :) <= 0.0_rp
    call nodes%halo%sum(8, nodes%patch%nn, columns)
    list%node = pack([(i, i=1, nodes%patch%nn)], maxval(columns(1:2, :), 1) > 0.0_rp)
    list%is_known = is_known(list%node)
    list%is_cut = .not. nodes%halo%world%all_true(all(list%is_known))
  end subroutine share_columns

  !> List node `q` if clamp `c` holds it, and the columns through it.
  subroutine list_node(sim, c, q)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: c, q
    real(rp) :: x(3)
    integer :: a, side

    x = sim%nodes%patch%position(q)
    call wrap(sim%scene%grid, x)
    if (is_fixed(sim%scene, sim%clock, sim%nodes, x) .and. &
        box_has(sim%scene, sim%clock, sim%nodes, c, x)) then
      call append(sim%nodes%boundary%fixed, sim%nodes%boundary%n_fixed, &
                  [q, c, merge(1, 0, is_owned(sim%scene, sim%nodes, q))])
    end if
    do a = 1, 3
      do side = -1, 1, 2
        call list_column(sim, c, q, x, a, side)
      end do
    end do
  end subroutine list_node

  !> List the column across a face if `q` at `x` is the node nearest to the face.
  subroutine list_column(sim, c, q, x, a, side)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: c, q, a, side
    real(rp), intent(in) :: x(3)
    type(column_t) :: column
    real(rp) :: face, other(3), parts(3), t, y(3)
    integer :: ijk(3), k, step

    associate (clamp => sim%scene%clamp(c)%clamp, patch => sim%nodes%patch)
      face = merge(clamp%upper(a), clamp%lower(a), side > 0)
      if (abs(face) >= 0.5_rp*huge(1.0_rp)) return
      y = image(sim%nodes, x, a, face)
      ijk = sim%nodes%patch%indices(q)
      t = cells_between(sim%nodes, a, y(a), face)
      if (t <= -0.5_rp .or. t > 0.5_rp) return
      if (abs(t) <= slack .and. .not. sim%scene%method%is_bspline) return   ! face on a row of nodes
      y(a) = face
      if (.not. box_has(sim%scene, sim%clock, sim%nodes, c, y)) return
      column%clamp = c
      column%axis = a
      column%weight = weights_at(sim%scene, t)
      parts = 0.5_rp
      if (patch%grading(a)%is_graded) then
        column%weight = patch%grading(a)%weights(ijk(a), t)
        parts([1, 3]) = patch%grading(a)%span(3:4, ijk(a))
      end if
      column%tail = tails(sim%scene, parts, column%weight)
      do k = 1, 3
        step = k - 2
        if (column%weight(k) <= 0.0_rp) cycle
        other = x
        other(a) = x(a) + patch%h(a)*step
        if (patch%grading(a)%is_graded) other(a) = patch%grading(a)%middle(ijk(a) + step)
        call wrap(sim%scene%grid, other)
        if (is_fixed(sim%scene, sim%clock, sim%nodes, other)) return
        if (step*side > 0 .and. inside_any(sim%scene, sim%clock, sim%nodes, other, c)) return
        if (ijk(a) + step < patch%all%lo(a) .or. ijk(a) + step > patch%all%hi(a)) cycle
        column%node(k) = q + step*patch%stride(a)
        column%is_owned(k) = is_owned(sim%scene, sim%nodes, column%node(k))
      end do
    end associate
    column%is_whole = all(column%node > 0 .or. column%weight <= 0.0_rp)
    associate (list => sim%nodes%boundary%column, n => sim%nodes%boundary%n_columns)
      if (n == size(list)) sim%nodes%boundary%column = [list, list]
      n = n + 1
      sim%nodes%boundary%column(n) = column
    end associate
  end subroutine list_column

  !> Weights of a node (2) and its neighbours (1, 3) at a point `t` cells above the node.
  pure function weights_at(scene, t) result(w)
    type(scene_t), intent(in) :: scene
    real(rp), intent(in) :: t
    real(rp) :: w(3)

    if (scene%method%is_bspline) then
      w = [0.5_rp*(0.5_rp - t)**2, 0.75_rp - t**2, 0.5_rp*(0.5_rp + t)**2]
    else
      w = [max(0.0_rp, -t), 1.0_rp - abs(t), max(0.0_rp, t)]
    end if
  end function weights_at

  !> Integral of a node's shape function beyond the point where it has decreased to `w` [cells]:
  !> w**2/2 for a linear function, w**1.5/(3 sqrt(f)) for the outer part f d**2 of a B-spline.
  pure function tails(scene, parts, w) result(tail)
    type(scene_t), intent(in) :: scene
    real(rp), intent(in) :: parts(3)   !! factor f of the parts of a B-spline, 1/2 in equal cells
    real(rp), intent(in) :: w(3)       !! weights
    real(rp) :: tail(3)

    if (scene%method%is_bspline) then
      tail = sqrt(1.0_rp/parts)/3.0_rp*w**1.5_rp
    else
      tail = 0.5_rp*w**2
    end if
  end function tails

  !> True if a node lies in the box of a clamp and not only in columns across one face.
  pure logical function is_fixed(scene, clock, nodes, x)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: x(3)             !! position of the node [m]
    integer :: c, n_boxes, n_faces

    n_boxes = 0
    n_faces = 0
    do c = 1, size(scene%clamp)
      associate (clamp => scene%clamp(c)%clamp)
        if (.not. box_has(scene, clock, nodes, c, x)) cycle
        n_boxes = n_boxes + 1
        n_faces = n_faces + count(near_face(scene, nodes, clamp%upper, x)) &
          + count(near_face(scene, nodes, clamp%lower, x))
      end associate
    end do
    is_fixed = n_boxes > 0 .and. .not. (n_boxes == 1 .and. n_faces == 1)
  end function is_fixed

  !> For each axis, true if a node in the box is part of the columns across the face there.
  pure function near_face(scene, nodes, face, x) result(is_near)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: face(3), x(3)    !! corner of the box, position of the node [m]
    logical :: is_near(3)
    real(rp) :: depth, y(3)
    integer :: a

    do a = 1, 3
      is_near(a) = .false.
      if (abs(face(a)) >= 0.5_rp*huge(1.0_rp)) cycle
      y = image(nodes, x, a, face(a))
      depth = abs(cells_between(nodes, a, y(a), face(a)))
      if (scene%method%is_bspline) then
        is_near(a) = depth < 1.5_rp - slack
      else
        is_near(a) = depth > slack .and. depth < 1.0_rp - slack
      end if
    end do
  end function near_face

  !> Cells from the node at position `node` up to a face.
  pure real(rp) function cells_between(nodes, a, node, face) result(cells)
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: a
    real(rp), intent(in) :: node, face      !! positions of the node and the face [m]

    associate (grading => nodes%patch%grading(a))
      if (grading%is_graded) then
        cells = grading%place(face) - anint(grading%place(node))
      else
        cells = (face - node)/nodes%patch%h(a)
      end if
    end associate
  end function cells_between

  !> Image of `x` along axis `a` that is nearest to `face` [m].
  pure function image(nodes, x, a, face) result(y)
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: x(3), face
    integer, intent(in) :: a
    real(rp) :: y(3), period

    y = x
    period = nodes%patch%h(a)*real(nodes%patch%period(a), rp)
    if (period > 0.0_rp) y(a) = x(a) + period*anint((face - x(a))/period)
  end function image

  !> True if `x` is inside the box of any clamp except clamp `but`.
  pure logical function inside_any(scene, clock, nodes, x, but)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: x(3)
    integer, intent(in) :: but
    integer :: c

    inside_any = .false.
    do c = 1, size(scene%clamp)
      if (c == but) cycle
      inside_any = inside_any .or. box_has(scene, clock, nodes, c, x)
    end do
  end function inside_any

  !> True if this rank records a node; nodes outside the grid belong to the owner of the nearest
  !> inside.
  pure logical function is_owned(scene, nodes, q)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: q
    integer :: ijk(3)

    ijk = nodes%patch%indices(q)
    where (scene%grid%period == 0) ijk = max(0, min(scene%grid%n - 1, ijk))
    is_owned = nodes%patch%own%has(ijk)
  end function is_owned

end module boundary_clamp_list
