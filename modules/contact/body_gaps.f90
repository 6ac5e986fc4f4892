! SPDX-License-Identifier: MIT
!> Node pairs of bodies in contact and their gaps, measured between the particles.
module contact_body_gaps
  use base_kinds, only: rp
  use base_world, only: world_t
  use contact_body_kept, only: recall
  use contact_body_near, only: far_distance, list_near
  use contact_body_normals, only: average_normals, try_normals
  use contact_body_sums, only: sum_particles
  use contact_body_surfaces, only: choose_normal, first_stretches, gap_between, &
                                   measure_mean, measure_shared, choose_mean
  use particles_store, only: f_mass, particles_t
  use state_clock, only: clock_t
  use state_node_pairs, only: min_weight, n_kept, n_sums_all, n_sums_gradient, n_trials, &
                                   node_pairs_t
  use state_nodes, only: append, min_node_mass, nodes_t
  use state_scene, only: scene_t
  use tools_pair, only: moves_as_one, normal_regression
  implicit none (type, external)
  private

  public :: find_node_pairs

contains

  !> Collective. List the nodes with mass of two groups, and find their normals and gaps.
  subroutine find_node_pairs(scene, clock, particles, nodes, pairs, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(inout) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    real(rp), intent(in) :: g(8, nodes%patch%nn, nodes%n_groups)

    if (.not. allocated(pairs%lightest)) then
      call find_lightest(nodes%halo%world, scene, particles, nodes%n_groups, pairs%lightest)
      pairs%start = first_stretches(scene)
    end if
    call list_nodes(scene, clock, nodes, pairs, g)
    call mark_walls(scene, nodes, pairs)
    call take_over(scene, nodes, pairs)
    call list_near(scene, particles, nodes, pairs)
    call choose_normals(scene, nodes, pairs)
    call average_normals(scene, nodes, pairs, g)
    call sum_entries(nodes, pairs, .false., 3, pairs%mean)
    call measure_mean(scene, nodes%patch, pairs)
    call sum_entries(nodes, pairs, .true., 2*n_trials, pairs%surface)
    call choose_mean(scene, nodes%patch, pairs)
    pairs%is_known = .true.
  end subroutine find_node_pairs

  !> Collective. Take normals and surfaces from the last step; entries without them are due.
  subroutine take_over(scene, nodes, pairs)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    real(rp) :: values(n_kept - 1, pairs%n)    ! normal, surfaces, path; negative path: no values
    integer :: e

    call recall(scene, nodes%patch, pairs, values)
    call sum_entries(nodes, pairs, .true., size(values, 1), values)
    do e = 1, pairs%n
      pairs%is_due(e) = pairs%may_touch(e) .and. values(6, e) < 0.0_rp
      if (values(6, e) < 0.0_rp) values(:, e) = 0.0_rp
      pairs%normal(:, e) = values(1:3, e)
      pairs%ends(:, e) = values(4:5, e)
      pairs%way(e) = values(6, e)
      pairs%gap(e) = far_distance
      if (pairs%may_touch(e) .and. .not. pairs%is_due(e)) pairs%gap(e) = gap_between(values(4:5, e))
    end do
  end subroutine take_over

  !> Collective. Find normals and gaps of all entries that are due, each from its own particles;
  !> immediately where no other rank or image contributes.
  subroutine choose_normals(scene, nodes, pairs)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(inout) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    integer :: e

    do e = 1, pairs%n
      call sum_particles(scene, nodes%patch, e, pairs)
      if (pairs%is_shared(e)) cycle
      call try_normals(scene, nodes%patch, e, pairs)
      call choose_normal(scene, nodes%patch, e, pairs)
    end do
    call sum_entries(nodes, pairs, .false., size(pairs%sums, 1), pairs%sums)
    do e = 1, pairs%n
      if (.not. pairs%is_shared(e)) cycle
      call try_normals(scene, nodes%patch, e, pairs)
      call measure_shared(scene, e, pairs)
    end do
    call sum_entries(nodes, pairs, .true., 2*n_trials, pairs%surface)
    do e = 1, pairs%n
      if (pairs%is_shared(e)) call choose_normal(scene, nodes%patch, e, pairs)
    end do
  end subroutine choose_normals

  !> Collective. Sum values of the entries over ranks and images, or take maxima.
  subroutine sum_entries(nodes, pairs, largest, width, values)
    type(nodes_t), intent(inout) :: nodes
    type(node_pairs_t), intent(in) :: pairs
    logical, intent(in) :: largest
    integer, intent(in) :: width
    real(rp), intent(inout) :: values(width, pairs%n)

    call nodes%halo%combine(largest, nodes%patch%nn, pairs%first, pairs%n, pairs%node, &
                            width, values)
  end subroutine sum_entries

  !> List an entry for each pair of groups with mass at a node.
  subroutine list_nodes(scene, clock, nodes, pairs, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    real(rp), intent(in) :: g(8, nodes%patch%nn, nodes%n_groups)
    integer :: c, e, i, k, n, n_bodies, r, width

    call pairs%reset(nodes%patch%nn)
    width = n_sums_gradient
    if (any(scene%contact%normal == normal_regression)) width = n_sums_all
    n = 0
    if (.not. allocated(pairs%found)) allocate (pairs%found(3, 1))
    do r = 1, nodes%n_ranges
      do i = nodes%range(1, r), nodes%range(2, r)
        n_bodies = 0
        do k = 1, nodes%n_groups
          if (g(8, i, k) > min_node_mass) n_bodies = n_bodies + 1
        end do
        if (n_bodies < 2) cycle
        do c = 1, size(scene%contact)
          if (any(g(8, i, scene%contact(c)%group) <= min_node_mass)) cycle
          call append(pairs%found, n, [i, c, nodes%range(3, r)])
        end do
      end do
    end do
    call pairs%reserve(n, width)
    do e = 1, n
      associate (q => pairs%found(1, e))
        pairs%node(e) = q
        pairs%pair(e) = pairs%found(2, e)
        pairs%is_owned(e) = pairs%found(3, e) == 1
        pairs%x(:, e) = nodes%patch%position(q)
        if (pairs%first(q) == 0) pairs%first(q) = e
      end associate
    end do
    call mark_shared(nodes, pairs)
    call mark_touching(scene, clock, nodes, pairs, g)
    pairs%free = 1.0_rp
  end subroutine list_nodes

  !> Mark entries of bodies with a &CONTACT where particles of both may have enough weight to count
  !> for the gap: since none is lighter than the lightest of its group, its weight is at most the
  !> nodal mass over that.
  pure subroutine mark_touching(scene, clock, nodes, pairs, g)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    real(rp), intent(in) :: g(8, nodes%patch%nn, nodes%n_groups)
    real(rp), parameter :: rounding = 1.0_rp - 1.0e-6_rp
    real(rp) :: least(nodes%n_groups)
    integer :: e

    least = rounding*min_weight*clock%mass_scaling*pairs%lightest
    do e = 1, pairs%n
      associate (contact => scene%contact(pairs%pair(e)))
        pairs%may_touch(e) = contact%normal /= moves_as_one &
                          .and. all(g(8, pairs%node(e), contact%group) > least(contact%group))
      end associate
    end do
  end subroutine mark_touching

  !> Collective. Find the mass of the lightest particle of each group [kg].
  subroutine find_lightest(world, scene, particles, n_groups, lightest)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: n_groups
    real(rp), allocatable, intent(out) :: lightest(:)
    real(rp) :: heaviest_inverse(n_groups)
    integer :: b

    heaviest_inverse = 0.0_rp
    do b = 1, particles%nblk
      associate (n => particles%count(b), k => scene%body(particles%body(b))%group)
        heaviest_inverse(k) = max(heaviest_inverse(k), &
                                  maxval(1.0_rp/particles%ps(:n, f_mass, b)))
      end associate
    end do
    call world%max(heaviest_inverse)
    lightest = merge(1.0_rp/max(heaviest_inverse, tiny(1.0_rp)), 0.0_rp, heaviest_inverse > 0.0_rp)
  end subroutine find_lightest

  !> Mark entries at nodes that several ranks store, or one through several images.
  pure subroutine mark_shared(nodes, pairs)
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    logical :: is_shared(nodes%patch%nn)

    pairs%is_shared = .false.
    if (size(nodes%halo%shared) == 0 .and. size(nodes%halo%image) == 0) return
    is_shared = .false.
    is_shared(nodes%halo%shared) = .true.
    is_shared(nodes%halo%image(1, :)) = .true.
    is_shared(nodes%halo%image(2, :)) = .true.
    pairs%is_shared = is_shared(pairs%node)
  end subroutine mark_shared

  !> Mark directions in which a wall or clamp holds the nodes.
  subroutine mark_walls(scene, nodes, pairs)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(node_pairs_t), intent(inout) :: pairs
    integer :: i

    do i = 1, nodes%boundary%n_fixed
      call mark_node(pairs, nodes%boundary%fixed(1, i), scene%clamp(nodes%boundary%fixed(2, &
          i))%clamp%held)
    end do
    do i = 1, nodes%boundary%mirrors%n_planes
      associate (plane => nodes%boundary%mirrors%plane(:, i))
        call mark_node(pairs, plane(1), scene%symmetry(plane(2))%odd)
      end associate
    end do
  end subroutine mark_walls

  !> Mark the `held` directions of the entries of node `q` as not free.
  pure subroutine mark_node(pairs, q, held)
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: q
    logical, intent(in) :: held(3)
    integer :: e

    e = pairs%first(q)
    if (e == 0) return
    do while (pairs%node(e) == q)
      where (held) pairs%free(:, e) = 0.0_rp
      e = e + 1
      if (e > pairs%n) exit
    end do
  end subroutine mark_node

end module contact_body_gaps
