! SPDX-License-Identifier: MIT
!> Lists of the nodes held by clamps and walls: nodes inside their box, and columns of nodes across
!> faces that lie between nodes (boundary_clamps).
module boundary_clamp_list
  use base_kinds, only: rp
  use boundary_clamps, only: box_has, slack
  use grid_geometry, only: wrap
  use state_boundary, only: column_nodes_t, column_t
  use state_clock, only: clock_t
  use state_nodes, only: append, nodes_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: list_clamps, list_nodes_in_front

contains

  !> Collective. List the held nodes in use, without those behind a mirror.
  subroutine list_clamps(scene, clock, nodes)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(inout) :: nodes
    integer :: a, c, q, r

    if (allocated(nodes%boundary%is_held)) deallocate (nodes%boundary%is_held)
    allocate (nodes%boundary%is_held(nodes%patch%nn), source=.false.)
    nodes%boundary%is_held(nodes%boundary%mirrors%pair(1, :)) = .true.
    if (.not. allocated(nodes%boundary%fixed)) then
      allocate (nodes%boundary%fixed(3, 64), nodes%boundary%column(64))
    end if
    if (allocated(nodes%boundary%listed_node)) then
      deallocate (nodes%boundary%listed_node, nodes%boundary%listed_column)
    end if
    nodes%boundary%n_fixed = 0
    nodes%boundary%n_columns = 0
    nodes%boundary%in_front%is_cut = .false.   ! of the last lists; set by list_nodes_in_front
    do r = 1, nodes%n_ranges
      do q = nodes%range(1, r), nodes%range(2, r)
        if (nodes%boundary%is_held(q)) cycle   ! behind a mirror
        do c = 1, size(scene%clamp)
          call list_node(scene, clock, nodes, c, q)
        end do
      end do
    end do
    nodes%boundary%is_held(nodes%boundary%fixed(1, 1:nodes%boundary%n_fixed)) = .true.
    do a = 1, 3
      nodes%boundary%along(a)%is_cut = .false.
      associate (column => nodes%boundary%column(1:nodes%boundary%n_columns))
        if (nodes%halo%world%all_true(all(column%axis /= a))) cycle
      end associate
      call list_column_nodes(nodes, a)
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
  subroutine list_nodes_in_front(scene, nodes)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    real(rp), allocatable :: columns(:, :)   ! as in list_column_nodes
    logical :: used(nodes%patch%nn)
    integer :: c, lane, on(3), q, r

    if (all(scene%symmetry%friction_coefficient <= 0.0_rp)) return
    allocate (columns(8, nodes%patch%nn), source=0.0_rp)
    used = .false.
    do r = 1, nodes%n_ranges
      used(nodes%range(1, r):nodes%range(2, r)) = .true.
    end do
    do q = 1, size(used)
      if (.not. used(q)) cycle
      do c = 1, size(scene%symmetry)
        associate (wall => scene%symmetry(c), patch => nodes%patch)
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
    call share_columns(nodes, columns, nodes%boundary%in_front)
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
  subroutine list_node(scene, clock, nodes, c, q)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(inout) :: nodes
    integer, intent(in) :: c, q
    real(rp) :: x(3)
    integer :: a, side

    x = nodes%patch%position(q)
    call wrap(scene%grid, x)
    if (is_fixed(scene, clock, nodes, x) .and. box_has(scene, clock%time, nodes, c, x)) then
      call append(nodes%boundary%fixed, nodes%boundary%n_fixed, &
                  [q, c, merge(1, 0, is_owned(scene, nodes, q))])
    end if
    do a = 1, 3
      do side = -1, 1, 2
        call list_column(scene, clock, nodes, c, q, x, a, side)
      end do
    end do
  end subroutine list_node

  !> List the column across a face if `q` at `x` is the node nearest to the face.
  subroutine list_column(scene, clock, nodes, c, q, x, a, side)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(inout) :: nodes
    integer, intent(in) :: c, q, a, side
    real(rp), intent(in) :: x(3)
    type(column_t) :: column
    real(rp) :: face, other(3), parts(3), t, y(3)
    integer :: ijk(3), k, step

    associate (clamp => scene%clamp(c)%clamp, patch => nodes%patch)
      face = merge(clamp%upper(a), clamp%lower(a), side > 0)
      if (abs(face) >= 0.5_rp*huge(1.0_rp)) return
      y = image(nodes, x, a, face)
      ijk = nodes%patch%indices(q)
      t = cells_between(nodes, a, y(a), face)
      if (t <= -0.5_rp .or. t > 0.5_rp) return
      if (abs(t) <= slack .and. .not. scene%method%is_bspline) return   ! face on a row of nodes
      y(a) = face
      if (.not. box_has(scene, clock%time, nodes, c, y)) return
      column%clamp = c
      column%axis = a
      column%weight = weights_at(scene, t)
      parts = 0.5_rp
      if (patch%grading(a)%is_graded) then
        column%weight = patch%grading(a)%weights(ijk(a), t)
        parts([1, 3]) = patch%grading(a)%span(3:4, ijk(a))
      end if
      column%tail = tails(scene, parts, column%weight)
      do k = 1, 3
        step = k - 2
        if (column%weight(k) <= 0.0_rp) cycle
        other = x
        other(a) = x(a) + patch%h(a)*step
        if (patch%grading(a)%is_graded) other(a) = patch%grading(a)%middle(ijk(a) + step)
        call wrap(scene%grid, other)
        if (is_fixed(scene, clock, nodes, other)) return
        if (step*side > 0 .and. inside_any(scene, clock, nodes, other, c)) return
        if (ijk(a) + step < patch%all%lo(a) .or. ijk(a) + step > patch%all%hi(a)) cycle
        column%node(k) = q + step*patch%stride(a)
        column%is_owned(k) = is_owned(scene, nodes, column%node(k))
      end do
    end associate
    column%is_whole = all(column%node > 0 .or. column%weight <= 0.0_rp)
    associate (list => nodes%boundary%column, n => nodes%boundary%n_columns)
      if (n == size(list)) nodes%boundary%column = [list, list]
      n = n + 1
      nodes%boundary%column(n) = column
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
        if (.not. box_has(scene, clock%time, nodes, c, x)) cycle
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
      inside_any = inside_any .or. box_has(scene, clock%time, nodes, c, x)
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
