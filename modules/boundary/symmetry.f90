! SPDX-License-Identifier: MIT
!> Walls as mirrors. Contributions of particles to the nodes behind a wall are reflected to the
!> nodes in front with the signs of an image body behind the wall, and after the update the nodes
!> behind are set to the mirrored values. Nodes on the wall keep their own half and lose the odd
!> components. Reflection is linear: each rank reflects its own contributions before the sum over
!> ranks, since it stores the mirror of every node that its particles reach, but not every node
!> whose mirror they reach.
module boundary_symmetry
  use base_kinds, only: rp
  use state_budget, only: budget_t, e_wall_heat
  use state_conditions, only: symmetry_t
  use state_nodes, only: nodes_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: list_mirrors, split_mirrors, narrow_mirrors, reflect, restore, restore_velocities, &
            add_lost, record_impulse, record_wall_heat

  ! Parts of a reflection (run_order): nodes shared between ranks, all others.
  integer, parameter, public :: shared_part = 1, interior_part = 2

  ! Kinds of nodal records, which determine the lanes that change sign at a wall:
  integer, parameter, public :: &
    r_momentum = 1, &      !! mass, momentum (3), force (3), mass times temperature
    r_velocity = 2, &      !! velocity (3), temperature, velocity change (3), mass
    r_filter = 3, &        !! momentum (3) or, in lanes 5:7, a velocity increment
    r_heat = 4, &          !! capacity, capacity times temperature, stored heat
    r_temperature = 5, &   !! capacity, -, -, temperature in lanes 4, 5
    r_flux = 6, &          !! heat in lane 5, capacity times a difference of temperature in lane 8
    ! Temperature increment in lanes 4 and 5, temperature in 6 and 8, their difference in 7.
    r_warming = 7

contains

  !> List the nodes in use on and behind the walls, and their mirror nodes; pairs in the order x, y,
  !> z.
  subroutine list_mirrors(scene, nodes)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    logical, allocatable :: used(:)
    integer, allocatable :: pair(:, :), plane(:, :)
    integer :: axis, c, max_pairs, n(3), r

    associate (m => nodes%boundary%mirrors, planes => scene%symmetry)
      m%n_pairs = 0
      m%n_planes = 0
      max_pairs = 0
      if (nodes%patch%nn > 0) then
        n = nodes%patch%all%hi - nodes%patch%all%lo + 1
        do c = 1, size(planes)
          max_pairs = max_pairs + nodes%patch%nn/n(planes(c)%axis)
        end do
      end if
      allocate (pair(3, max_pairs), plane(2, max_pairs))
      if (max_pairs > 0) then
        allocate (used(nodes%patch%nn), source=.false.)
        do r = 1, nodes%n_ranges
          used(nodes%range(1, r):nodes%range(2, r)) = .true.
        end do
        do axis = 1, 3
          do c = 1, size(planes)
            if (planes(c)%axis == axis) call add_plane(scene, nodes, c, used, pair, plane)
          end do
        end do
      end if
      m%pair = pair(:, 1:m%n_pairs)
      m%plane = plane(:, 1:m%n_planes)
      if (allocated(m%mass_behind)) deallocate (m%mass_behind)
      allocate (m%mass_behind(m%n_pairs, nodes%n_groups), source=0.0_rp)
    end associate
  end subroutine list_mirrors

  !> Move pairs and planes with `marked` nodes to the front of the lists, to be reflected first;
  !> mirror nodes of marked ones, directly or around a corner, are marked as well, and with friction
  !> the node on the wall between them.
  subroutine split_mirrors(scene, nodes, marked)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    logical, intent(inout) :: marked(:)
    integer :: i, of_pair(3), turn

    associate (m => nodes%boundary%mirrors)
      do turn = 1, 3                           ! a corner joins at most three axes
        do i = 1, m%n_pairs
          of_pair = [m%pair(1:2, i), m%pair(1, i)]
          if (scene%symmetry(m%pair(3, i))%friction_coefficient > 0.0_rp) then
            of_pair(3) = sum(of_pair(1:2))/2
          end if
          if (any(marked(of_pair))) marked(of_pair) = .true.
        end do
      end do
      m%n_shared_pairs = count(marked(m%pair(2, :)))
      call put_first(marked(m%pair(2, :)), m%pair)
      m%n_shared_planes = count(marked(m%plane(1, :)))
      call put_first(marked(m%plane(1, :)), m%plane)
    end associate
  end subroutine split_mirrors

  !> Store the mirrors of all particles and continue with those of the nodes in use.
  subroutine narrow_mirrors(nodes)
    type(nodes_t), intent(inout) :: nodes
    logical :: used(nodes%patch%nn)
    logical, allocatable :: keep(:)
    integer :: i, r

    used = .false.
    do r = 1, nodes%n_ranges
      used(nodes%range(1, r):nodes%range(2, r)) = .true.
    end do
    nodes%boundary%resting_mirrors = nodes%boundary%mirrors
    associate (m => nodes%boundary%mirrors, all => nodes%boundary%resting_mirrors)
      keep = used(all%pair(1, :)) .or. used(all%pair(2, :))
      m%n_shared_pairs = count(keep(:all%n_shared_pairs))
      m%n_pairs = count(keep)
      m%pair = all%pair(:, pack([(i, i=1, all%n_pairs)], keep))
      keep = used(all%plane(1, :))
      m%n_shared_planes = count(keep(:all%n_shared_planes))
      m%n_planes = count(keep)
      m%plane = all%plane(:, pack([(i, i=1, all%n_planes)], keep))
      deallocate (m%mass_behind)
      allocate (m%mass_behind(m%n_pairs, nodes%n_groups), source=0.0_rp)
    end associate
  end subroutine narrow_mirrors

  !> Move the columns of `list` with `is_first` to the front, preserving the order otherwise.
  pure subroutine put_first(is_first, list)
    logical, intent(in) :: is_first(:)
    integer, intent(inout) :: list(:, :)
    integer :: i, order(size(is_first))

    order = [pack([(i, i=1, size(is_first))], is_first), &
             pack([(i, i=1, size(is_first))], .not. is_first)]
    list = list(:, order)
  end subroutine put_first

  !> Append the nodes in use on plane `c`, and the pairs across it.
  subroutine add_plane(scene, nodes, c, used, pair, plane)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
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
            nodes%boundary%mirrors%n_planes = nodes%boundary%mirrors%n_planes + 1
            plane(:, nodes%boundary%mirrors%n_planes) = [patch%node(on), c]
          end if
          if (.not. (is_used(behind) .and. is_used(front))) cycle
          nodes%boundary%mirrors%n_pairs = nodes%boundary%mirrors%n_pairs + 1
          pair(:, nodes%boundary%mirrors%n_pairs) = [patch%node(behind), patch%node(front), c]
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

  !> Signs of the lanes of a record at a plane, and the shift of each (times mass or capacity in a
  !> reflection): twice the temperature of the plane.
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

  !> Signs and shifts of a record at all planes.
  subroutine reflections(scene, kind, sign, shift)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: kind
    real(rp), intent(out), dimension(8, size(scene%symmetry)) :: sign, shift
    integer :: c

    do c = 1, size(scene%symmetry)
      call reflection(scene%symmetry(c), kind, sign(:, c), shift(:, c))
    end do
  end subroutine reflections

  !> Reflect the records behind the walls to the nodes in front; records behind are zero then.
  !> `lost` accumulates the change of the sum over the nodes; `mass_behind` returns lane 1 of the
  !> nodes behind. At a wall with friction the nodes on it receive the force that presses on it.
  subroutine reflect(scene, nodes, kind, g, lost, mass_behind, part)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: kind
    real(rp), intent(inout) :: g(8, nodes%patch%nn), lost(8, size(scene%symmetry))
    real(rp), intent(inout), optional :: mass_behind(nodes%boundary%mirrors%n_pairs)
    !> `shared_part` or `interior_part` of the nodes; absent: all.
    integer, intent(in), optional :: part
    real(rp), dimension(8, size(scene%symmetry)) :: sign, shift
    real(rp) :: odd(8)
    integer :: a, b, c, i, pairs(2), planes(2)

    associate (m => nodes%boundary%mirrors)
      if (m%n_pairs + m%n_planes == 0) return
      call reflections(scene, kind, sign, shift)
      pairs = [1, m%n_pairs]
      planes = [1, m%n_planes]
      if (present(part)) then
        if (part == shared_part) pairs(2) = m%n_shared_pairs
        if (part == shared_part) planes(2) = m%n_shared_planes
        if (part == interior_part) pairs(1) = m%n_shared_pairs + 1
        if (part == interior_part) planes(1) = m%n_shared_planes + 1
      end if
      do i = pairs(1), pairs(2)
        b = m%pair(1, i)
        a = m%pair(2, i)
        c = m%pair(3, i)
        if (present(mass_behind)) mass_behind(i) = g(1, b)
        lost(:, c) = lost(:, c) + (sign(:, c) - 1.0_rp)*g(:, b)
        if (kind == r_momentum .and. scene%symmetry(c)%friction_coefficient > 0.0_rp) then
          associate (lane => 4 + scene%symmetry(c)%axis, on => (a + b)/2)
            g(lane, on) = g(lane, on) + 2.0_rp*g(lane, b)
            lost(lane, c) = lost(lane, c) + 2.0_rp*g(lane, b)   ! counted at the node on the wall
          end associate
        end if
        g(:, a) = g(:, a) + sign(:, c)*g(:, b) + shift(:, c)*g(1, b)
        g(:, b) = 0.0_rp
      end do
      do i = planes(1), planes(2)
        a = m%plane(1, i)
        c = m%plane(2, i)
        odd = 0.5_rp*(1.0_rp - sign(:, c))
        lost(:, c) = lost(:, c) - odd*g(:, a)
        if (kind == r_momentum .and. scene%symmetry(c)%friction_coefficient > 0.0_rp) then
          odd(4 + scene%symmetry(c)%axis) = 0.0_rp
        end if
        g(:, a) = (1.0_rp - odd)*g(:, a) + 0.5_rp*shift(:, c)*g(1, a)
      end do
    end associate
  end subroutine reflect

  !> Set the nodes behind the walls to the mirrored values of those in front.
  subroutine restore(scene, nodes, kind, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: kind
    real(rp), intent(inout) :: g(8, nodes%patch%nn)
    real(rp), dimension(8, size(scene%symmetry)) :: sign, shift
    integer :: c, i

    associate (m => nodes%boundary%mirrors)
      if (m%n_pairs == 0) return
      call reflections(scene, kind, sign, shift)
      do i = m%n_pairs, 1, -1
        c = m%pair(3, i)
        g(:, m%pair(1, i)) = sign(:, c)*g(:, m%pair(2, i)) + shift(:, c)
      end do
    end associate
  end subroutine restore

  !> Set the nodes behind the walls to the mirrored velocities, for all groups of bodies.
  subroutine restore_velocities(scene, nodes, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(inout) :: g(8, nodes%patch%nn, nodes%n_groups)
    integer :: k

    do k = 1, nodes%n_groups
      call restore(scene, nodes, r_velocity, g(:, :, k))
    end do
  end subroutine restore_velocities

  !> Add the change of forces by reflections, acting for `dt` [s], to the impulses of the walls.
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

  !> Record the impulse of the walls on this rank's particles in a step: the change of their
  !> momentum by the nodal velocity changes less that by their own forces. For s = -1 a pair adds -2
  !> (m_b dv_a + dt f_b) with this rank's mass and force of the node behind, a node on the wall -dt
  !> f. The momentum of resting particles does not change: they contribute force only.
  subroutine record_impulse(scene, nodes, budget, dt, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(budget_t), intent(inout) :: budget
    real(rp), intent(in) :: dt             !! time step [s]
    real(rp), intent(in) :: g(:, :, :)     !! (8, nn, n_groups) velocity records
    real(rp) :: mass
    integer :: a, c, i, k

    associate (m => nodes%boundary%mirrors)
      if (m%n_pairs + m%n_planes == 0) return
      call add_lost(scene, dt, m%lost, budget%impulse)
      do k = 1, size(g, 3)
        do i = 1, m%n_pairs
          a = m%pair(2, i)
          c = m%pair(3, i)
          mass = m%mass_behind(i, k)
          if (allocated(m%resting_mass_behind)) mass = mass - m%resting_mass_behind(i)
          associate (impulse => budget%impulse(:, scene%symmetry(c)%place))
            impulse = impulse - merge(2.0_rp, 0.0_rp, scene%symmetry(c)%odd)*mass*g(5:7, a, k)
          end associate
        end do
      end do
    end associate
  end subroutine record_impulse

  !> Record the heat that the walls give to this rank's particles when these take lane 5 of `g`;
  !> `lost` is the change of heat by reflections. As for momentum: -2 (C_b dT_a + q_b), -q.
  subroutine record_wall_heat(scene, nodes, budget, lost, group, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(budget_t), intent(inout) :: budget
    real(rp), intent(in) :: lost(size(scene%symmetry))   !! change of heat by reflections [J]
    integer, intent(in) :: group
    real(rp), intent(in) :: g(:, :)   !! (8, nn) temperature increments in lane 5 [K]
    real(rp) :: heat
    integer :: i

    associate (m => nodes%boundary%mirrors)
      if (m%n_pairs + m%n_planes == 0) return
      heat = sum(lost)
      do i = 1, m%n_pairs
        if (scene%symmetry(m%pair(3, i))%temperature <= 0.0_rp) cycle
        heat = heat - 2.0_rp*m%mass_behind(i, group)*g(5, m%pair(2, i))
      end do
      budget%sums(e_wall_heat) = budget%sums(e_wall_heat) + heat
    end associate
  end subroutine record_wall_heat

end module boundary_symmetry
