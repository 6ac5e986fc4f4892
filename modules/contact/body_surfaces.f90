! SPDX-License-Identifier: MIT
!> Extent of bodies at node pairs, and the gap between them: a surface is the end of the outermost
!> particle with weight at the node. Particles are examined in bundles, first those that were
!> outermost along another direction, until no bundle can extend farther, or until a direction is
!> known to leave too small a gap to be chosen.
module contact_body_surfaces
  use base_kinds, only: rp
  use contact_body_near, only: far_distance, first_stretch, sizes_along
  use grid_geometry, only: patch_t
  use state_node_pairs, only: axis_rows, bundle_lanes, min_weight, n_box, n_bundle, n_trials, &
                                   near_t, node_pairs_t, u_weights
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: choose_normal, first_stretches, gap_between, measure_mean, measure_shared, choose_mean

  !> Gain of the gap above which a less well founded direction is preferred [shortest cell edges].
  real(rp), parameter :: min_gap_gain = 1.0e-3_rp
  !> Surface of a body without particles near the node [m].
  real(rp), parameter :: no_surface = -1.0e200_rp
  !> Lower bound of the gap with which all surfaces are measured [m].
  real(rp), parameter :: no_min_gap = -1.0e100_rp

contains

  !> Measure both surfaces along all trial normals of entry `e`, to which other ranks or images
  !> contribute.
  subroutine measure_shared(scene, e, pairs)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: e
    type(node_pairs_t), intent(inout) :: pairs
    integer :: k
    real(rp) :: gap

    pairs%outermost(:, e) = 0
    pairs%surface(:, :, e) = no_surface           ! values of all entries are sent
    if (.not. pairs%is_due(e)) return
    do k = 1, n_trials - 1
      call measure(scene, pairs, e, pairs%trial(:, k, e), no_min_gap, &
                   pairs%surface(:, k, e), gap)
    end do
  end subroutine measure_shared

  !> Choose the normal with the largest gap at entry `e`; a better founded one (earlier in the list)
  !> is chosen also if its gap is slightly smaller.
  subroutine choose_normal(scene, patch, e, pairs)
    type(scene_t), intent(in) :: scene
    type(patch_t), intent(in) :: patch
    integer, intent(in) :: e
    type(node_pairs_t), intent(inout) :: pairs
    real(rp) :: gap(n_trials - 1), gap_tolerance
    integer :: chosen, k

    if (.not. pairs%is_due(e)) return
    gap_tolerance = min_gap_gain*minval(patch%edges_at(pairs%x(:, e)))
    if (pairs%is_shared(e)) then
      do k = 1, size(gap)
        gap(k) = gap_between(pairs%surface(:, k, e))
      end do
    else
      pairs%outermost(:, e) = 0
      call measure_trials(scene, pairs, e, gap_tolerance, gap)
    end if
    chosen = best_of(gap_tolerance, pairs%trial(:, :, e), gap)
    if (chosen == 0) return
    pairs%gap(e) = gap(chosen)
    pairs%normal(:, e) = pairs%trial(:, chosen, e)
    pairs%ends(:, e) = pairs%surface(:, chosen, e)
  end subroutine choose_normal

  !> Measure the gaps along the trial normals of entry `e`: the first one exactly, and all that
  !> could be chosen in its place; the others may be set to the gap of the first.
  subroutine measure_trials(scene, pairs, e, gap_tolerance, gap)
    type(scene_t), intent(in) :: scene
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: e
    real(rp), intent(in) :: gap_tolerance             !! [m]
    real(rp), intent(out) :: gap(n_trials - 1)
    logical :: is_less(n_trials - 1)
    real(rp) :: least
    integer :: k

    least = no_min_gap
    is_less = .false.
    gap = no_min_gap
    do k = 1, size(gap)
      if (all(abs(pairs%trial(:, k, e)) <= 0.0_rp)) cycle
      call measure(scene, pairs, e, pairs%trial(:, k, e), least, pairs%surface(:, k, e), &
                   gap(k))
      if (k == 1) least = gap(1) + gap_tolerance
      is_less(k) = gap(k) <= least .and. k > 1
    end do
    if (least > no_min_gap .and. all(gap(2:) <= least)) then
      gap(2:) = no_min_gap                        ! the first one is chosen
    else
      do k = 2, size(gap)
        if (is_less(k)) call measure(scene, pairs, e, pairs%trial(:, k, e), no_min_gap, &
                                     pairs%surface(:, k, e), gap(k))
      end do
    end if
  end subroutine measure_trials

  !> Index of the trial normal to choose; 0 if there is none. The first two may have a gap smaller
  !> by `gap_tolerance`.
  pure integer function best_of(gap_tolerance, trial, gap) result(chosen)
    real(rp), intent(in) :: gap_tolerance, trial(3, n_trials - 1), gap(n_trials - 1)
    integer :: k

    chosen = 0
    do k = size(gap), 1, -1
      if (all(abs(trial(:, k)) <= 0.0_rp)) cycle
      if (chosen > 0) then
        if (gap(k) < gap(chosen) - merge(0.0_rp, gap_tolerance, k > 2)) cycle
      end if
      chosen = k
    end do
  end function best_of

  !> Measure both surfaces along the mean normals where these could be chosen, and at all shared
  !> entries.
  subroutine measure_mean(scene, patch, pairs)
    type(scene_t), intent(in) :: scene
    type(patch_t), intent(in) :: patch
    type(node_pairs_t), intent(inout) :: pairs
    real(rp) :: gap, least, gap_tolerance
    integer :: e

    do e = 1, pairs%n
      if (all(abs(pairs%mean(:, e)) <= 0.0_rp)) cycle
      if (.not. pairs%is_due(e)) cycle
      gap_tolerance = min_gap_gain*minval(patch%edges_at(pairs%x(:, e)))
      least = no_min_gap
      if (pairs%gap(e) > -far_distance .and. .not. pairs%is_shared(e)) least = pairs%gap(e) &
        - gap_tolerance
      call measure(scene, pairs, e, pairs%mean(:, e), least, &
                   pairs%surface(:, n_trials, e), gap)
    end do
  end subroutine measure_mean

  !> Choose the mean normal where its gap is larger or only slightly smaller.
  pure subroutine choose_mean(scene, patch, pairs)
    type(scene_t), intent(in) :: scene
    type(patch_t), intent(in) :: patch
    type(node_pairs_t), intent(inout) :: pairs
    real(rp) :: gap, gap_tolerance
    integer :: e

    do e = 1, pairs%n
      if (all(abs(pairs%mean(:, e)) <= 0.0_rp)) cycle
      if (.not. pairs%is_due(e)) cycle
      gap_tolerance = min_gap_gain*minval(patch%edges_at(pairs%x(:, e)))
      gap = gap_between(pairs%surface(:, n_trials, e))
      if (gap < pairs%gap(e) - gap_tolerance .and. pairs%gap(e) > -far_distance) cycle
      pairs%gap(e) = gap
      pairs%normal(:, e) = pairs%mean(:, e)
      pairs%ends(:, e) = pairs%surface(:, n_trials, e)
    end do
  end subroutine choose_mean

  !> Gap between two surfaces; `far_distance` if one of the bodies has no particle near.
  pure real(rp) function gap_between(surface) result(gap)
    real(rp), intent(in) :: surface(2)

    gap = far_distance
    if (all(surface > -far_distance)) gap = -sum(surface)
  end function gap_between

  !> Initial stretches of the particles of all bodies.
  pure function first_stretches(scene) result(start)
    type(scene_t), intent(in) :: scene
    real(rp) :: start(6, size(scene%body))
    integer :: b

    do b = 1, size(scene%body)
      start(:, b) = first_stretch(scene, b)
    end do
  end function first_stretches

  !> Measure how far both bodies of entry `e` extend along `n`, the direction out of the first body,
  !> and the gap. If the gap is below `least`, surfaces may be underestimated and the gap
  !> overestimated, but not above `least`. Particles that were outermost before are examined first.
  subroutine measure(scene, pairs, e, n, least, surface, gap)
    type(scene_t), intent(in) :: scene
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: e
    real(rp), intent(in) :: n(3), least
    real(rp), intent(out) :: surface(2)
    real(rp), intent(out) :: gap
    real(rp) :: bound(pairs%item(3, e) - pairs%item(1, e)), factor(size(scene%body)), nn(6)
    integer :: o, pass, side

    nn = [n(1)*n(1), n(2)*n(2), n(3)*n(3), n(1)*n(2), n(2)*n(3), n(1)*n(3)]
    factor = sizes_along(scene, pairs%start, nn)
    surface = no_surface
    passes: do pass = 1, 3
      do side = 1, 2
        o = pairs%item(side, e) - pairs%item(1, e)
        associate (first => pairs%item(side, e) + 1, last => pairs%item(side + 1, e), &
                   near => pairs%near, outermost => pairs%outermost(side, e))
          if (first > last) cycle
          if (pass == 1) then
            if (outermost == 0) cycle
            call extend_surface(near, outermost, (3 - 2*side)*n, nn, factor, pairs%x(:, e), &
                                surface(side))
            if (side == 1) cycle
          else if (pass == 2) then
            bound(o + 1:o + last - first + 1) = bounds(last - first + 1, near%item(:, first:last), &
                                                       near%n_bundles, near%box, (3 - 2*side)*n, &
                                                       pairs%x(:, e))
            call extend_by_largest(near, first, last, (3 - 2*side)*n, nn, factor, pairs%x(:, e), &
                                   bound(o + 1:), outermost, surface(side))
          else
            call extend_by_all(near, first, last, (3 - 2*side)*n, nn, factor, pairs%x(:, e), &
                               bound(o + 1:), -least - surface(3 - side), outermost, surface(side))
          end if
        end associate
        if (sum(surface) > -least) exit passes
      end do
      if (sum(surface) > -least) exit passes
    end do passes
    gap = gap_between(surface)
  end subroutine measure

  !> Upper bounds of the extent along n from the node at `x` of the particles of items [m].
  pure function bounds(m, item, n_bundles, box, n, x) result(bound)
    integer, intent(in) :: m, item(2, m), n_bundles
    real(rp), intent(in) :: box(n_box, n_bundles), n(3), x(3)
    real(rp) :: bound(m)
    integer :: o

    do o = 1, m
      associate (b => box(:, item(1, o)))
        bound(o) = sum(max((b(1:3) - x)*n, (b(4:6) - x)*n)) + b(7)
      end associate
    end do
  end function bounds

  !> Extend a surface by the item with the largest bound, if that can move it outwards.
  subroutine extend_by_largest(near, first, last, n, nn, factor, x, bound, outermost, surface)
    type(near_t), intent(in) :: near
    integer, intent(in) :: first, last
    real(rp), intent(in) :: n(3), nn(6), factor(:)
    real(rp), intent(in) :: x(3)                      !! position of the node [m]
    real(rp), intent(in) :: bound(last - first + 1)   !! bounds [m]
    integer, intent(inout) :: outermost
    real(rp), intent(inout) :: surface
    real(rp) :: before
    integer :: o

    o = maxloc(bound, 1)
    if (first + o - 1 == outermost .or. bound(o) <= surface) return
    o = first + o - 1
    before = surface
    call extend_surface(near, o, n, nn, factor, x, surface)
    if (surface > before) outermost = o
  end subroutine extend_by_largest

  !> Extend a surface by all items from `first` to `last` that can move it outwards, until it is
  !> beyond `enough`.
  subroutine extend_by_all(near, first, last, n, nn, factor, x, bound, enough, outermost, surface)
    type(near_t), intent(in) :: near
    integer, intent(in) :: first, last
    real(rp), intent(in) :: n(3), nn(6), factor(:), x(3), bound(last - first + 1), enough   !! [m]
    integer, intent(inout) :: outermost
    real(rp), intent(inout) :: surface
    real(rp) :: before
    integer :: o

    do o = first, last
      if (bound(o - first + 1) <= surface) cycle
      before = surface
      call extend_surface(near, o, n, nn, factor, x, surface)
      if (surface > before) outermost = o
      if (surface > enough) return
    end do
  end subroutine extend_by_all

  !> Extend a surface to the outermost particle of an item with weight.
  subroutine extend_surface(near, o, n, nn, factor, x, surface)
    type(near_t), intent(in) :: near
    integer, intent(in) :: o
    real(rp), intent(in) :: n(3), nn(6), factor(:)
    real(rp), intent(in) :: x(3)               !! node position [m]
    real(rp), intent(inout) :: surface         !! surface position from the node along n [m]
    integer :: u

    u = near%item(1, o)
    call extend_by_bundle(near%bundle(:, :, u), near%item(2, o), x, n, nn, factor(near%body(u)), &
                          surface)
  end subroutine extend_surface

  !> Extend a surface to the ends of particles with weight.
  pure subroutine extend_by_bundle(u, place, x, n, nn, factor, surface)
    integer, intent(in) :: place               !! place of the node among the 27
    real(rp), intent(in) :: u(bundle_lanes, n_bundle)
    real(rp), intent(in) :: x(3), n(3)
    real(rp), intent(in) :: nn(6)              !! products of n: xx, yy, zz, xy, yz, xz
    real(rp), intent(in) :: factor             !! factor of their half lengths
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
      if (u(l, i)*u(l, j)*u(l, k) <= min_weight) end(l) = no_surface
    end do
    surface = max(surface, max(max(max(end(1), end(5)), max(end(3), end(7))), &
                               max(max(end(2), end(6)), max(end(4), end(8)))))
  end subroutine extend_by_bundle

end module contact_body_surfaces
