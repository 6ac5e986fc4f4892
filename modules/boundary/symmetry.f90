! SPDX-License-Identifier: MIT
!> Walls as mirrors. What particles give to the nodes behind a wall is reflected to the nodes in
!> front with the signs of an image body behind the wall, and after the update the nodes behind get
!> the mirrored values. Nodes on the wall keep their own half and lose what is odd. Reflection is
!> linear: each rank reflects its own contributions, before they are summed over ranks, since it
!> stores the mirror of every node that its particles reach but not every node whose mirror they
!> reach.
module boundary_symmetry
  use base_kinds, only: rp
  use boundary_held, only: boundary_t
  use conditions_symmetry, only: symmetry_t
  use mapping_nodes, only: nodes_t
  use state_books, only: books_t, e_wall_heat
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: list_mirrors, split_mirrors, narrow_mirrors, reflect, restore, restore_velocities, &
            add_lost, book_impulse, book_heat

  ! Parts of a reflection (exchange_order).
  integer, parameter, public :: early = 1, late = 2

  ! What the lanes of a record hold, which decides what is odd at a wall.
  integer, parameter, public :: &
    r_momentum = 1, &      !! mass, momentum (3), force (3), mass times temperature
    r_velocity = 2, &      !! velocity (3), temperature, velocity change (3), mass
    r_filter = 3, &        !! momentum (3) or, in lanes 5:7, a velocity increment
    r_heat = 4, &          !! capacity, capacity times temperature, waiting heat
    r_temperature = 5, &   !! capacity, -, -, temperature in lanes 4, 5
    r_flux = 6, &          !! heat in lane 5, capacity times a difference of temperature in lane 8
    r_warming = 7          !! increment of temperature in lanes 4, 5, temperature in lanes 6, 8, a
                           !! difference in lane 7

contains

  !> List the nodes in use on and behind the walls, with their mirrors; pairs in the order x, y, z.
  subroutine list_mirrors(scene, nodes, boundary)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(boundary_t), intent(inout) :: boundary
    logical, allocatable :: used(:)
    integer, allocatable :: pair(:, :), plane(:, :)
    integer :: axis, c, most, n(3), r

    associate (m => boundary%mirrors, planes => scene%symmetry)
      m%n_pairs = 0
      m%n_planes = 0
      most = 0
      if (nodes%patch%nn > 0) then
        n = nodes%patch%all%hi - nodes%patch%all%lo + 1
        do c = 1, size(planes)
          most = most + nodes%patch%nn/n(planes(c)%axis)
        end do
      end if
      allocate (pair(3, most), plane(2, most))
      if (most > 0) then
        allocate (used(nodes%patch%nn), source=.false.)
        do r = 1, nodes%n_ranges
          used(nodes%range(1, r):nodes%range(2, r)) = .true.
        end do
        do axis = 1, 3
          do c = 1, size(planes)
            if (planes(c)%axis == axis) call add_plane(scene, nodes, boundary, c, used, pair, plane)
          end do
        end do
      end if
      m%pair = pair(:, 1:m%n_pairs)
      m%plane = plane(:, 1:m%n_planes)
      if (allocated(m%own)) deallocate (m%own)
      allocate (m%own(m%n_pairs, nodes%n_groups), source=0.0_rp)
    end associate
  end subroutine list_mirrors

  !> Put first the pairs and planes of `marked` nodes, which are reflected first; nodes that walls
  !> join with marked ones, directly or around a corner, are marked as well.
  subroutine split_mirrors(boundary, marked)
    type(boundary_t), intent(inout) :: boundary
    logical, intent(inout) :: marked(:)
    integer :: i, turn

    associate (m => boundary%mirrors)
      do turn = 1, 3                           ! a corner joins at most three axes
        do i = 1, m%n_pairs
          if (any(marked(m%pair(1:2, i)))) marked(m%pair(1:2, i)) = .true.
        end do
      end do
      m%early_pairs = count(marked(m%pair(2, :)))
      call put_first(marked(m%pair(2, :)), m%pair)
      m%early_planes = count(marked(m%plane(1, :)))
      call put_first(marked(m%plane(1, :)), m%plane)
    end associate
  end subroutine split_mirrors

  !> Put all mirrors aside and go on with those of nodes in use.
  subroutine narrow_mirrors(nodes, boundary)
    type(nodes_t), intent(in) :: nodes
    type(boundary_t), intent(inout) :: boundary
    logical :: used(nodes%patch%nn)
    logical, allocatable :: keep(:)
    integer :: i, r

    used = .false.
    do r = 1, nodes%n_ranges
      used(nodes%range(1, r):nodes%range(2, r)) = .true.
    end do
    boundary%resting_mirrors = boundary%mirrors
    associate (m => boundary%mirrors, all => boundary%resting_mirrors)
      keep = used(all%pair(1, :)) .or. used(all%pair(2, :))
      m%early_pairs = count(keep(:all%early_pairs))
      m%n_pairs = count(keep)
      m%pair = all%pair(:, pack([(i, i=1, all%n_pairs)], keep))
      keep = used(all%plane(1, :))
      m%early_planes = count(keep(:all%early_planes))
      m%n_planes = count(keep)
      m%plane = all%plane(:, pack([(i, i=1, all%n_planes)], keep))
      deallocate (m%own)
      allocate (m%own(m%n_pairs, nodes%n_groups), source=0.0_rp)
    end associate
  end subroutine narrow_mirrors

  !> Columns of `list` with `is_first` before the others, else in the old order.
  pure subroutine put_first(is_first, list)
    logical, intent(in) :: is_first(:)
    integer, intent(inout) :: list(:, :)
    integer :: i, order(size(is_first))

    order = [pack([(i, i=1, size(is_first))], is_first), &
             pack([(i, i=1, size(is_first))], .not. is_first)]
    list = list(:, order)
  end subroutine put_first

  subroutine add_plane(scene, nodes, boundary, c, used, pair, plane)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(boundary_t), intent(inout) :: boundary
    integer, intent(in) :: c
    logical, intent(in) :: used(:)
    integer, intent(inout) :: pair(:, :), plane(:, :)
    integer :: a, across(2), behind(3), front(3), i, j, on(3), reach

    associate (patch => nodes%patch, symmetry => scene%symmetry(c))
      a = symmetry%axis
      across = pack([1, 2, 3], [1, 2, 3] /= a)
      reach = merge(1, -1, symmetry%faces_up)
      do i = patch%all%lo(across(1)), patch%all%hi(across(1))
        do j = patch%all%lo(across(2)), patch%all%hi(across(2))
          on(across) = [i, j]
          on(a) = symmetry%row
          behind = on
          front = on
          behind(a) = on(a) - reach
          front(a) = on(a) + reach
          if (is_used(on)) then
            boundary%mirrors%n_planes = boundary%mirrors%n_planes + 1
            plane(:, boundary%mirrors%n_planes) = [patch%node(on), c]
          end if
          if (.not. (is_used(behind) .and. is_used(front))) cycle
          boundary%mirrors%n_pairs = boundary%mirrors%n_pairs + 1
          pair(:, boundary%mirrors%n_pairs) = [patch%node(behind), patch%node(front), c]
        end do
      end do
    end associate
  contains
    logical function is_used(ijk)
      integer, intent(in) :: ijk(3)

      is_used = nodes%patch%all%has(ijk)
      if (is_used) is_used = used(nodes%patch%node(ijk))
    end function is_used
  end subroutine add_plane

  !> How a record is mirrored at a plane: signs of its lanes, and what is added to each (times mass
  !> or capacity in a reflection): twice the temperature of the plane.
  pure subroutine reflection(plane, kind, sign, shift)
    type(symmetry_t), intent(in) :: plane
    integer, intent(in) :: kind
    real(rp), intent(out) :: sign(8), shift(8)
    real(rp) :: thermal, v(3)

    v = merge(-1.0_rp, 1.0_rp, plane%odd)
    thermal = merge(-1.0_rp, 1.0_rp, plane%temperature > 0.0_rp)
    sign = 1.0_rp
    shift = 0.0_rp
    select case (kind)
    case (r_momentum)
      sign(2:8) = [v, v, thermal]
      shift(8) = 2.0_rp*plane%temperature
    case (r_velocity)
      sign(1:7) = [v, thermal, v]
      shift(4) = 2.0_rp*plane%temperature
    case (r_filter)
      sign(1:7) = [v, 1.0_rp, v]
    case (r_heat)
      sign(2:3) = thermal
      shift(2) = 2.0_rp*plane%temperature
    case (r_temperature)
      sign(4:5) = thermal
      shift(4:5) = 2.0_rp*plane%temperature
    case (r_flux)
      sign([5, 8]) = thermal
    case (r_warming)
      sign(4:8) = thermal
      shift([6, 8]) = 2.0_rp*plane%temperature
    case default
      error stop 'reflection of a record of no kind'
    end select
  end subroutine reflection

  subroutine reflections(scene, kind, sign, shift)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: kind
    real(rp), intent(out), dimension(8, size(scene%symmetry)) :: sign, shift
    integer :: c

    do c = 1, size(scene%symmetry)
      call reflection(scene%symmetry(c), kind, sign(:, c), shift(:, c))
    end do
  end subroutine reflections

  !> Fold the records behind the walls onto those in front; records behind are zero then. To `lost`
  !> is added what that changes of the sum over the nodes; `own` takes lane 1 of the nodes behind.
  subroutine reflect(scene, nodes, boundary, kind, g, lost, own, part)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(boundary_t), intent(in) :: boundary
    integer, intent(in) :: kind
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    real(rp), intent(inout) :: lost(8, size(scene%symmetry))
    real(rp), intent(inout), optional :: own(boundary%mirrors%n_pairs)
    integer, intent(in), optional :: part                 !! not given: all
    real(rp), dimension(8, size(scene%symmetry)) :: sign, shift
    real(rp) :: odd(8)
    integer :: a, b, c, i, pairs(2), planes(2)

    associate (m => boundary%mirrors)
      if (m%n_pairs + m%n_planes == 0) return
      call reflections(scene, kind, sign, shift)
      pairs = [1, m%n_pairs]
      planes = [1, m%n_planes]
      if (present(part)) then
        if (part == early) pairs(2) = m%early_pairs
        if (part == early) planes(2) = m%early_planes
        if (part == late) pairs(1) = m%early_pairs + 1
        if (part == late) planes(1) = m%early_planes + 1
      end if
      do i = pairs(1), pairs(2)
        b = m%pair(1, i)
        a = m%pair(2, i)
        c = m%pair(3, i)
        if (present(own)) own(i) = g(1, b)
        lost(:, c) = lost(:, c) + (sign(:, c) - 1.0_rp)*g(:, b)
        g(:, a) = g(:, a) + sign(:, c)*g(:, b) + shift(:, c)*g(1, b)
        g(:, b) = 0.0_rp
      end do
      do i = planes(1), planes(2)
        a = m%plane(1, i)
        c = m%plane(2, i)
        odd = 0.5_rp*(1.0_rp - sign(:, c))
        lost(:, c) = lost(:, c) - odd*g(:, a)
        g(:, a) = (1.0_rp - odd)*g(:, a) + 0.5_rp*shift(:, c)*g(1, a)
      end do
    end associate
  end subroutine reflect

  !> Give the nodes behind the walls the mirrored values of those in front.
  subroutine restore(scene, nodes, boundary, kind, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(boundary_t), intent(in) :: boundary
    integer, intent(in) :: kind
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    real(rp), dimension(8, size(scene%symmetry)) :: sign, shift
    integer :: c, i

    associate (m => boundary%mirrors)
      if (m%n_pairs == 0) return
      call reflections(scene, kind, sign, shift)
      do i = m%n_pairs, 1, -1
        c = m%pair(3, i)
        g(:, m%pair(1, i)) = sign(:, c)*g(:, m%pair(2, i)) + shift(:, c)
      end do
    end associate
  end subroutine restore

  !> The same for the velocities of all groups of bodies.
  subroutine restore_velocities(scene, nodes, boundary, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(boundary_t), intent(in) :: boundary
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    integer :: k

    do k = 1, nodes%n_groups
      call restore(scene, nodes, boundary, r_velocity, g(:, :, k))
    end do
  end subroutine restore_velocities

  !> Add to the impulses of the conditions what reflections have changed of forces that act for `dt`
  !> [s].
  pure subroutine add_lost(scene, dt, lost, impulse)
    type(scene_t), intent(in) :: scene
    real(rp), intent(in) :: dt, lost(8, size(scene%symmetry))
    real(rp), intent(inout) :: impulse(3, size(scene%condition))
    integer :: c

    do c = 1, size(scene%symmetry)
      associate (p => scene%symmetry(c)%place)
        impulse(:, p) = impulse(:, p) + dt*lost(5:7, c)
      end associate
    end do
  end subroutine add_lost

  !> Impulse of the walls on this rank's particles in a step: the change of their momentum by the
  !> nodes' dv less that by their own forces. For s = -1 a pair adds -2 (m_b dv_a + dt f_b) with the
  !> own mass and force of the node behind, a node on the wall -dt f. The momentum of what is at
  !> rest there does not change: it has force alone.
  subroutine book_impulse(scene, nodes, boundary, books, dt, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(boundary_t), intent(in) :: boundary
    type(books_t), intent(inout) :: books
    real(rp), intent(in) :: dt                                !! [s]
    real(rp), intent(in) :: g(8, nodes%patch%nn, nodes%n_groups)  !! velocity records
    real(rp) :: mass
    integer :: a, c, i, k

    associate (m => boundary%mirrors)
      if (m%n_pairs + m%n_planes == 0) return
      call add_lost(scene, dt, m%lost, books%impulse)
      do k = 1, nodes%n_groups
        do i = 1, m%n_pairs
          a = m%pair(2, i)
          c = m%pair(3, i)
          mass = m%own(i, k)
          if (allocated(boundary%mirrors%at_rest)) mass = mass - boundary%mirrors%at_rest(i)
          associate (impulse => books%impulse(:, scene%symmetry(c)%place))
            impulse = impulse - merge(2.0_rp, 0.0_rp, scene%symmetry(c)%odd)*mass*g(5:7, a, k)
          end associate
        end do
      end do
    end associate
  end subroutine book_impulse

  !> Heat that the walls give to this rank's particles, when these take lane 5 of `g`; `lost` is the
  !> heat that reflections have changed. As for momentum: -2 (C_b dT_a + q_b), -q.
  subroutine book_heat(scene, nodes, boundary, books, lost, group, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(boundary_t), intent(in) :: boundary
    type(books_t), intent(inout) :: books
    real(rp), intent(in) :: lost(size(scene%symmetry))   !! [J]
    integer, intent(in) :: group
    real(rp), intent(in) :: g(8, nodes%patch%nn)                       !! [K]
    real(rp) :: heat
    integer :: i

    associate (m => boundary%mirrors)
      if (m%n_pairs + m%n_planes == 0) return
      heat = sum(lost)
      do i = 1, m%n_pairs
        if (scene%symmetry(m%pair(3, i))%temperature <= 0.0_rp) cycle
        heat = heat - 2.0_rp*m%own(i, group)*g(5, m%pair(2, i))
      end do
      books%sums(e_wall_heat) = books%sums(e_wall_heat) + heat
    end associate
  end subroutine book_heat

end module boundary_symmetry
