! SPDX-License-Identifier: MIT
!> How far bodies reach at node pairs, and the gap between them: a surface is where the foremost of
!> its particles with weight at the node ends. Particles are looked at in bundles, first those that
!> were foremost along another direction, until no bundle can reach farther, or until it is clear
!> that a direction leaves too little gap to be chosen.
module body_contact_surfaces
  use base_kinds, only: rp
  use body_contact_near, only: far, first_stretch, sizes_along
  use body_contact_node_pairs, only: axis_rows, bundle_lanes, least_weight, n_bundle, n_trials, &
                                     near_t, node_pairs_t, u_weights
  use grid_geometry, only: patch_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: choose_normal, first_stretches, measure_mean, measure_shared, take_mean

  real(rp), parameter :: clearly = 1.0e-3_rp        !! less gap of a better direction [shortest
                                                    !! edges of the cell]
  real(rp), parameter :: nothing = -1.0e200_rp      !! surface of a body without a particle near [m]
  real(rp), parameter :: any_gap = -1.0e100_rp      !! least gap if all are to be measured [m]

contains

  !> Both surfaces along all trial normals of entry `e`, of which other ranks or images know
  !> particles.
  subroutine measure_shared(scene, patch, start, e, pairs)
    type(scene_t), intent(in) :: scene
    type(patch_t), intent(in) :: patch
    real(rp), intent(in) :: start(6, size(scene%body))
    integer, intent(in) :: e
    type(node_pairs_t), intent(inout) :: pairs
    integer :: k
    real(rp) :: gap

    pairs%foremost(:, e) = 0
    pairs%surface(:, :, e) = nothing           ! all of it is sent
    if (.not. pairs%is_met(e)) return
    do k = 1, n_trials - 1
      call measure(scene, patch, start, pairs, e, pairs%trial(:, k, e), any_gap, &
                   pairs%surface(:, k, e), gap)
    end do
  end subroutine measure_shared

  !> Take the normal with the largest gap at entry `e`; one that is better founded (they come first)
  !> also if its gap is little less.
  subroutine choose_normal(scene, patch, start, e, pairs)
    type(scene_t), intent(in) :: scene
    type(patch_t), intent(in) :: patch
    real(rp), intent(in) :: start(6, size(scene%body))
    integer, intent(in) :: e
    type(node_pairs_t), intent(inout) :: pairs
    real(rp) :: gap(n_trials - 1), little
    integer :: chosen, k

    pairs%gap(e) = far
    pairs%normal(:, e) = 0.0_rp
    pairs%ends(:, e) = 0.0_rp
    if (.not. pairs%is_met(e)) return
    little = clearly*minval(patch%edges_at(pairs%x(:, e)))
    if (pairs%is_shared(e)) then
      do k = 1, size(gap)
        gap(k) = gap_between(pairs%surface(:, k, e))
      end do
    else
      pairs%foremost(:, e) = 0
      call measure_trials(scene, patch, start, pairs, e, little, gap)
    end if
    chosen = best_of(little, pairs%trial(:, :, e), gap)
    if (chosen == 0) return
    pairs%gap(e) = gap(chosen)
    pairs%normal(:, e) = pairs%trial(:, chosen, e)
    pairs%ends(:, e) = pairs%surface(:, chosen, e)
  end subroutine choose_normal

  !> Gaps along the trial normals of entry `e`: that of the first, and of those that could be taken
  !> in its place; others may have the first's.
  subroutine measure_trials(scene, patch, start, pairs, e, little, gap)
    type(scene_t), intent(in) :: scene
    type(patch_t), intent(in) :: patch
    real(rp), intent(in) :: start(6, size(scene%body))
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: e
    real(rp), intent(in) :: little             !! [m]
    real(rp), intent(out) :: gap(n_trials - 1)
    logical :: is_less(n_trials - 1)
    real(rp) :: least
    integer :: k

    least = any_gap
    is_less = .false.
    gap = any_gap
    do k = 1, size(gap)
      if (all(abs(pairs%trial(:, k, e)) <= 0.0_rp)) cycle
      call measure(scene, patch, start, pairs, e, pairs%trial(:, k, e), least, &
                   pairs%surface(:, k, e), gap(k))
      if (k == 1) least = gap(1) + little
      is_less(k) = gap(k) <= least .and. k > 1
    end do
    if (least > any_gap .and. all(gap(2:) <= least)) then
      gap(2:) = any_gap                        ! the first one is taken
    else
      do k = 2, size(gap)
        if (is_less(k)) call measure(scene, patch, start, pairs, e, &
                                     pairs%trial(:, k, e), any_gap, pairs%surface(:, k, e), gap(k))
      end do
    end if
  end subroutine measure_trials

  !> The trial normal to take; 0 if there is none. The first two may have `little` less gap.
  pure integer function best_of(little, trial, gap) result(chosen)
    real(rp), intent(in) :: little, trial(3, n_trials - 1), gap(n_trials - 1)
    integer :: k

    chosen = 0
    do k = size(gap), 1, -1
      if (all(abs(trial(:, k)) <= 0.0_rp)) cycle
      if (chosen > 0) then
        if (gap(k) < gap(chosen) - merge(0.0_rp, little, k > 2)) cycle
      end if
      chosen = k
    end do
  end function best_of

  !> Both surfaces along the mean normals: where these could be taken, and at all shared entries.
  subroutine measure_mean(scene, patch, start, pairs)
    type(scene_t), intent(in) :: scene
    type(patch_t), intent(in) :: patch
    real(rp), intent(in) :: start(6, size(scene%body))
    type(node_pairs_t), intent(inout) :: pairs
    real(rp) :: gap, least, little
    integer :: e

    do e = 1, pairs%n
      if (all(abs(pairs%mean(:, e)) <= 0.0_rp)) cycle
      if (.not. pairs%is_met(e)) cycle
      little = clearly*minval(patch%edges_at(pairs%x(:, e)))
      least = any_gap
      if (pairs%gap(e) > -far .and. .not. pairs%is_shared(e)) least = pairs%gap(e) - little
      call measure(scene, patch, start, pairs, e, pairs%mean(:, e), least, &
                   pairs%surface(:, n_trials, e), gap)
    end do
  end subroutine measure_mean

  !> Take the mean normal where its gap is little less or more.
  pure subroutine take_mean(scene, patch, pairs)
    type(scene_t), intent(in) :: scene
    type(patch_t), intent(in) :: patch
    type(node_pairs_t), intent(inout) :: pairs
    real(rp) :: gap, little
    integer :: e

    do e = 1, pairs%n
      if (all(abs(pairs%mean(:, e)) <= 0.0_rp)) cycle
      if (.not. pairs%is_met(e)) cycle
      little = clearly*minval(patch%edges_at(pairs%x(:, e)))
      gap = gap_between(pairs%surface(:, n_trials, e))
      if (gap < pairs%gap(e) - little .and. pairs%gap(e) > -far) cycle
      pairs%gap(e) = gap
      pairs%normal(:, e) = pairs%mean(:, e)
      pairs%ends(:, e) = pairs%surface(:, n_trials, e)
    end do
  end subroutine take_mean

  !> Gap between two surfaces; far if one of the bodies has no particle near.
  pure real(rp) function gap_between(surface) result(gap)
    real(rp), intent(in) :: surface(2)

    gap = far
    if (all(surface > -far)) gap = -sum(surface)
  end function gap_between

  pure function first_stretches(scene) result(start)
    type(scene_t), intent(in) :: scene
    real(rp) :: start(6, size(scene%body))
    integer :: b

    do b = 1, size(scene%body)
      start(:, b) = first_stretch(scene, b)
    end do
  end function first_stretches

  !> How far both bodies of entry `e` reach along `n`, out of the first, and the gap. If that is
  !> less than `least`, surfaces may be less and the gap more than they are, but not above `least`.
  !> Particles that were foremost before are looked at first.
  subroutine measure(scene, patch, start, pairs, e, n, least, surface, gap)
    type(scene_t), intent(in) :: scene
    type(patch_t), intent(in) :: patch
    real(rp), intent(in) :: start(6, size(scene%body))
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: e
    real(rp), intent(in) :: n(3), least
    real(rp), intent(out) :: surface(2)
    real(rp), intent(out) :: gap
    real(rp) :: bound(27, 2), factor(size(scene%body)), nn(6)
    integer :: pass, side

    nn = [n(1)*n(1), n(2)*n(2), n(3)*n(3), n(1)*n(2), n(2)*n(3), n(1)*n(3)]
    factor = sizes_along(scene, start, nn)
    surface = nothing
    passes: do pass = 1, 3
      do side = 1, 2
        associate (first => pairs%item(side, e) + 1, last => pairs%item(side + 1, e), &
                   near => pairs%near, foremost => pairs%foremost(side, e))
          if (first > last) cycle
          if (pass == 1) then
            if (foremost == 0) cycle
            call look_at(near, foremost, (3 - 2*side)*n, nn, factor, pairs%x(:, e), surface(side))
            if (side == 1) cycle
          else if (pass == 2) then
            bound(:, side) = bounds(patch, pairs%node(e), (3 - 2*side)*n, &
                                    longest_of(scene, pairs%pair(e), side, near%longest))
            call look_at_largest(near, first, last, (3 - 2*side)*n, nn, factor, pairs%x(:, e), &
                                 bound(:, side), foremost, surface(side))
          else
            call look_at_all(near, first, last, (3 - 2*side)*n, nn, factor, pairs%x(:, e), &
                             bound(:, side), -least - surface(3 - side), foremost, surface(side))
          end if
        end associate
        if (sum(surface) > -least) exit passes
      end do
      if (sum(surface) > -least) exit passes
    end do passes
    gap = gap_between(surface)
  end subroutine measure

  !> Bound of half the length of particles of one of the bodies of a contact [m].
  pure real(rp) function longest_of(scene, contact, side, longest)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: contact, side
    real(rp), intent(in) :: longest(:)
    integer :: b

    longest_of = 0.0_rp
    do b = 1, size(longest)
      if (scene%body(b)%group /= scene%contact(contact)%group(side)) cycle
      longest_of = max(longest_of, longest(b))
    end do
  end function longest_of

  !> How far particles with node `q` at each of the 27 places can reach from it along n [m]: they
  !> are in the cell around the middle one of these.
  pure function bounds(patch, q, n, longest) result(bound)
    type(patch_t), intent(in) :: patch
    integer, intent(in) :: q
    real(rp), intent(in) :: n(3), longest
    real(rp) :: bound(27)
    real(rp), dimension(3, 3) :: along, high, low   ! of the cell below, here, above, by axis
    integer :: a, l

    do a = 1, 3
      call cells_around(patch, q, a, low(:, a), high(:, a))
      along(:, a) = max(n(a)*low(:, a), n(a)*high(:, a))
    end do
    do l = 1, 27                               ! at the first place the middle one is above
      bound(l) = along(3 - axis_rows(1, l), 1) + along(6 - axis_rows(2, l), 2) &
                 + along(9 - axis_rows(3, l), 3) + longest
    end do
  end function bounds

  !> Ends, from node `q`, of the cells around the node below, itself and that above on axis `a` [m].
  pure subroutine cells_around(patch, q, a, low, high)
    type(patch_t), intent(in) :: patch
    integer, intent(in) :: q, a
    real(rp), intent(out) :: low(3), high(3)
    real(rp), parameter :: steps(3) = [-1.0_rp, 0.0_rp, 1.0_rp]
    integer :: ijk(3)

    if (a /= patch%grading%axis) then
      low = (steps - 0.5_rp)*patch%h(a)
      high = (steps + 0.5_rp)*patch%h(a)
      return
    end if
    ijk = patch%indices(q)
    associate (i => ijk(a), edge => patch%grading%edge)
      low = edge(i - 1:i + 1) - patch%grading%middle(i)
      high = edge(i:i + 2) - patch%grading%middle(i)
    end associate
  end subroutine cells_around

  !> The item with the largest bound, if that may move the surface out.
  subroutine look_at_largest(near, first, last, n, nn, factor, x, bound, foremost, surface)
    type(near_t), intent(in) :: near
    integer, intent(in) :: first, last
    real(rp), intent(in) :: n(3), nn(6), factor(:), x(3), bound(27)   !! [m]
    integer, intent(inout) :: foremost
    real(rp), intent(inout) :: surface
    real(rp) :: before
    integer :: o

    o = largest(last - first + 1, near%item(:, first:last), bound) + first - 1
    if (o == foremost .or. bound(near%item(2, o)) <= surface) return
    before = surface
    call look_at(near, o, n, nn, factor, x, surface)
    if (surface > before) foremost = o
  end subroutine look_at_largest

  !> The item with the largest bound.
  pure integer function largest(m, item, bound)
    integer, intent(in) :: m, item(2, m)
    real(rp), intent(in) :: bound(27)
    integer :: o

    largest = 1
    do o = 2, m
      if (bound(item(2, o)) > bound(item(2, largest))) largest = o
    end do
  end function largest

  !> All items from `first` to `last` that can move the surface out, until it is beyond `enough`.
  subroutine look_at_all(near, first, last, n, nn, factor, x, bound, enough, foremost, surface)
    type(near_t), intent(in) :: near
    integer, intent(in) :: first, last
    real(rp), intent(in) :: n(3), nn(6), factor(:), x(3), bound(27), enough   !! [m]
    integer, intent(inout) :: foremost
    real(rp), intent(inout) :: surface
    real(rp) :: before
    integer :: o

    do o = first, last
      if (bound(near%item(2, o)) <= surface) cycle
      before = surface
      call look_at(near, o, n, nn, factor, x, surface)
      if (surface > before) foremost = o
      if (surface > enough) return
    end do
  end subroutine look_at_all

  !> Move a surface out to the foremost particle of an item with weight.
  subroutine look_at(near, o, n, nn, factor, x, surface)
    type(near_t), intent(in) :: near
    integer, intent(in) :: o
    real(rp), intent(in) :: n(3), nn(6), factor(:)
    real(rp), intent(in) :: x(3)               !! of the node [m]
    real(rp), intent(inout) :: surface         !! from the node along n [m]
    integer :: u

    u = near%item(1, o)
    call reach_out(near%bundle(:, :, u), near%item(2, o), x, n, nn, factor(near%body(u)), surface)
  end subroutine look_at

  !> Move a surface out to where particles with weight end.
  pure subroutine reach_out(u, place, x, n, nn, factor, surface)
    integer, intent(in) :: place               !! of the node among the 27
    real(rp), intent(in) :: u(bundle_lanes, n_bundle)
    real(rp), intent(in) :: x(3), n(3)
    real(rp), intent(in) :: nn(6)              !! products of n: xx, yy, zz, xy, yz, xz
    real(rp), intent(in) :: factor             !! in their half lengths
    real(rp), intent(inout) :: surface
    real(rp) :: end(bundle_lanes), half2
    integer :: i, j, k, l

    i = axis_rows(1, place) + u_weights
    j = axis_rows(2, place) + u_weights
    k = axis_rows(3, place) + u_weights
    !$omp simd private(half2)
    do l = 1, bundle_lanes
      half2 = u(l, 4)*nn(1) + u(l, 5)*nn(2) + u(l, 6)*nn(3) &
              + u(l, 7)*nn(4) + u(l, 8)*nn(5) + u(l, 9)*nn(6)
      end(l) = (u(l, 1) - x(1))*n(1) + (u(l, 2) - x(2))*n(2) + (u(l, 3) - x(3))*n(3) &
               + sqrt(half2*factor)
      if (u(l, i)*u(l, j)*u(l, k) <= least_weight) end(l) = nothing
    end do
    surface = max(surface, max(max(max(end(1), end(5)), max(end(3), end(7))), &
                               max(max(end(2), end(6)), max(end(4), end(8)))))
  end subroutine reach_out

end module body_contact_surfaces
