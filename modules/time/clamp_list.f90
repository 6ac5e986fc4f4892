! SPDX-License-Identifier: MIT
!> Which nodes clamps and walls hold: those inside their box, and the columns of nodes across its
!> faces that lie between nodes (time_clamps).
module time_clamp_list
  use base_kinds, only: rp
  use comm_world, only: world_t
  use grid_geometry, only: wrap
  use time_nodes, only: append
  use time_scene, only: constraint_t
  use time_state, only: column_t, simulation_t
  implicit none (type, external)
  private

  public :: list_clamps

  real(rp), parameter :: slack = 1.0e-6_rp       !! [cells]

contains

  !> Collective. List the nodes in use that are held, but not those behind a mirror.
  subroutine list_clamps(world, sim)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    logical :: is_whole
    integer :: c, q, r

    if (allocated(sim%is_held)) deallocate (sim%is_held)
    allocate (sim%is_held(sim%patch%nn), source=.false.)
    sim%is_held(sim%mirrors%pair(1, :)) = .true.
    if (.not. allocated(sim%fixed)) allocate (sim%fixed(3, 64), sim%column(64))
    sim%n_fixed = 0
    sim%n_columns = 0
    do r = 1, sim%n_runs
      do q = sim%run(1, r), sim%run(2, r)
        if (sim%is_held(q)) cycle                 ! behind a mirror
        do c = 1, size(sim%scene%constraint)
          if (sim%scene%constraint(c)%axis > 0) cycle
          call list_node(sim, c, q)
        end do
      end do
    end do
    sim%is_held(sim%fixed(1, 1:sim%n_fixed)) = .true.
    is_whole = .true.
    do r = 1, sim%n_columns
      associate (column => sim%column(r))
        is_whole = is_whole .and. all(column%node > 0 .or. column%weight <= 0.0_rp)
      end associate
    end do
    sim%columns_are_cut = .not. world%all_true(is_whole)
  end subroutine list_clamps

  !> What rule `c` does with node `q`.
  subroutine list_node(sim, c, q)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: c, q
    real(rp) :: x(3)
    integer :: a, side

    x = sim%patch%position(q)
    call wrap(sim%scene%grid, x)
    if (is_fixed(sim, x) .and. holds(sim, sim%scene%constraint(c), x)) then
      call append(sim%fixed, sim%n_fixed, [q, c, merge(1, 0, is_owned(sim, q))])
    end if
    do a = 1, 3
      do side = -1, 1, 2
        call list_column(sim, c, q, x, a, side)
      end do
    end do
  end subroutine list_node

  !> The column across a face if `q` at `x` is the node nearest to it.
  subroutine list_column(sim, c, q, x, a, side)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: c, q, a, side
    real(rp), intent(in) :: x(3)
    type(column_t) :: column
    real(rp) :: face, other(3), t, y(3)
    integer :: ijk(3), k, step

    associate (rule => sim%scene%constraint(c), patch => sim%patch)
      face = merge(rule%upper(a), rule%lower(a), side > 0)
      if (abs(face) >= 0.5_rp*huge(1.0_rp)) return
      y = image(sim, x, a, face)
      t = (face - y(a))/patch%h
      if (t <= -0.5_rp .or. t > 0.5_rp) return
      if (abs(t) <= slack .and. .not. sim%scene%method%is_bspline) return   ! on a row of nodes
      y(a) = face
      if (.not. holds(sim, rule, y)) return
      column%rule = c
      column%weight = weights_at(sim, t)
      column%tail = tails(sim, column%weight)
      ijk = indices(sim, q)
      do k = 1, 3
        step = k - 2
        if (column%weight(k) <= 0.0_rp) cycle
        other = x
        other(a) = x(a) + patch%h*step
        call wrap(sim%scene%grid, other)
        if (is_fixed(sim, other)) return
        if (step*side > 0 .and. inside_any(sim, other, c)) return
        if (ijk(a) + step < patch%all%lo(a) .or. ijk(a) + step > patch%all%hi(a)) cycle
        column%node(k) = q + step*patch%stride(a)
        column%is_owned(k) = is_owned(sim, column%node(k))
      end do
    end associate
    call append_column(sim%column, sim%n_columns, column)
  end subroutine list_column

  !> Weights at a point `t` cells above a node of that node (2) and its neighbours.
  pure function weights_at(sim, t) result(w)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: t
    real(rp) :: w(3)

    if (sim%scene%method%is_bspline) then
      w = [0.5_rp*(0.5_rp - t)**2, 0.75_rp - t**2, 0.5_rp*(0.5_rp + t)**2]
    else
      w = [max(0.0_rp, -t), 1.0_rp - abs(t), max(0.0_rp, t)]
    end if
  end function weights_at

  !> Integral of a node's shape function beyond the point where it has fallen to `w` [cells]: w**2/2 of
  !> a linear one, sqrt(2) w**1.5/3 of the outer part of a B-spline.
  pure function tails(sim, w) result(tail)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: w(3)
    real(rp) :: tail(3)

    if (sim%scene%method%is_bspline) then
      tail = sqrt(2.0_rp)/3.0_rp*w**1.5_rp
    else
      tail = 0.5_rp*w**2
    end if
  end function tails

  !> A node is held itself if it is in a box, but not if it is only part of columns across one face.
  pure logical function is_fixed(sim, x)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: x(3)             !! [m]
    integer :: c, n_boxes, n_faces

    n_boxes = 0
    n_faces = 0
    do c = 1, size(sim%scene%constraint)
      associate (rule => sim%scene%constraint(c))
        if (rule%axis > 0) cycle
        if (.not. holds(sim, rule, x)) cycle
        n_boxes = n_boxes + 1
        n_faces = n_faces + count(near_face(sim, rule%upper, x)) + count(near_face(sim, rule%lower, x))
      end associate
    end do
    is_fixed = n_boxes > 0 .and. .not. (n_boxes == 1 .and. n_faces == 1)
  end function is_fixed

  !> For each axis, whether a node in the box is part of the columns across the face there.
  pure function near_face(sim, face, x) result(is_near)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: face(3), x(3)    !! [m]
    logical :: is_near(3)
    real(rp) :: depth, y(3)
    integer :: a

    do a = 1, 3
      is_near(a) = .false.
      if (abs(face(a)) >= 0.5_rp*huge(1.0_rp)) cycle
      y = image(sim, x, a, face(a))
      depth = abs(face(a) - y(a))/sim%patch%h
      if (sim%scene%method%is_bspline) then
        is_near(a) = depth < 1.5_rp - slack
      else
        is_near(a) = depth > slack .and. depth < 1.0_rp - slack
      end if
    end do
  end function near_face

  !> The image of `x` along axis `a` that is nearest to `face`.
  pure function image(sim, x, a, face) result(y)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: x(3), face
    integer, intent(in) :: a
    real(rp) :: y(3), period

    y = x
    period = sim%patch%h*real(sim%patch%period(a), rp)
    if (period > 0.0_rp) y(a) = x(a) + period*anint((face - x(a))/period)
  end function image

  pure logical function inside_any(sim, x, but)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: x(3)
    integer, intent(in) :: but
    integer :: c

    inside_any = .false.
    do c = 1, size(sim%scene%constraint)
      if (c == but .or. sim%scene%constraint(c)%axis > 0) cycle
      inside_any = inside_any .or. holds(sim, sim%scene%constraint(c), x)
    end do
  end function inside_any

  !> Whether a rule is for the place `x` or one of its next images.
  pure logical function holds(sim, rule, x)
    type(simulation_t), intent(in) :: sim
    type(constraint_t), intent(in) :: rule
    real(rp), intent(in) :: x(3)             !! [m]
    real(rp) :: y(3)
    logical :: inside(3)
    integer :: turn

    inside = .false.
    do turn = -1, 1
      y = x + sim%patch%h*real(turn*sim%patch%period, rp)
      inside = inside .or. (y >= rule%lower - slack*sim%patch%h &
                            .and. y <= rule%upper + slack*sim%patch%h)
    end do
    holds = all(inside)
  end function holds

  pure function indices(sim, q) result(ijk)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: q
    integer :: ijk(3), rest

    rest = q - 1
    ijk(1) = rest/sim%patch%stride(1)
    rest = rest - ijk(1)*sim%patch%stride(1)
    ijk(2) = rest/sim%patch%stride(2)
    ijk(3) = rest - ijk(2)*sim%patch%stride(2)
    ijk = ijk + sim%patch%all%lo
  end function indices

  !> Whether the books of a node are this rank's; nodes outside belong to the nearest inside.
  pure logical function is_owned(sim, q)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: q
    integer :: ijk(3)

    ijk = indices(sim, q)
    where (sim%scene%grid%period == 0) ijk = max(0, min(sim%scene%grid%n - 1, ijk))
    is_owned = sim%patch%own%has(ijk)
  end function is_owned

  pure subroutine append_column(list, n, entry)
    type(column_t), allocatable, intent(inout) :: list(:)
    integer, intent(inout) :: n
    type(column_t), intent(in) :: entry
    type(column_t), allocatable :: longer(:)

    if (n == size(list)) then
      allocate (longer(2*n))
      longer(1:n) = list
      call move_alloc(longer, list)
    end if
    n = n + 1
    list(n) = entry
  end subroutine append_column

end module time_clamp_list
