! SPDX-License-Identifier: MIT
!> How far bodies reach at node pairs, and the gap between them: a surface is where the foremost of
!> its particles with weight at the node ends. Particles are looked at from the front, those with the
!> same nodes together, until none can reach farther, or until it is clear that a direction leaves
!> too little gap to be chosen.
module body_contact_surfaces
  use base_kinds, only: nlane, rp
  use body_contact_near, only: far, first_stretch
  use body_contact_node_pairs, only: bundle_lanes, n_bundle, n_trials, near_t, node_pairs_t, &
                                     u_edges, u_place, u_stretch, u_weights
  use contact_pair, only: moves_as_one
  use grid_geometry, only: patch_t
  use particles_store, only: f_bbar, f_jac, f_pos, particles_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: choose_normals, measure_mean, measure_shared, take_mean

  real(rp), parameter :: clearly = 1.0e-3_rp        !! less gap of a better direction [cells]
  real(rp), parameter :: least_weight = 1.0e-6_rp   !! of a particle that counts for the gap
  real(rp), parameter :: nothing = -1.0e200_rp      !! surface of a body without a particle near [m]
  real(rp), parameter :: any_gap = -1.0e100_rp      !! least gap if all are to be measured [m]

contains

  !> Both surfaces along all directions at entries that other ranks or images know particles of.
  subroutine measure_shared(scene, particles, patch, pairs)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(patch_t), intent(in) :: patch
    type(node_pairs_t), intent(inout) :: pairs
    integer :: e, k
    real(rp) :: gap, start(6, size(scene%body))

    start = first_stretches(scene)
    do e = 1, pairs%n
      if (.not. pairs%is_shared(e)) cycle
      if (scene%contact(pairs%pair(e))%normal == moves_as_one) cycle
      do k = 1, n_trials - 1
        call measure(scene, particles, patch, start, pairs, e, pairs%trial(:, k, e), any_gap, &
                     pairs%surface(:, k, e), gap)
      end do
    end do
  end subroutine measure_shared

  !> Take the normal with the largest gap; one that is better founded (they come first) also if its
  !> gap is little less.
  subroutine choose_normals(scene, particles, patch, pairs)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(patch_t), intent(in) :: patch
    type(node_pairs_t), intent(inout) :: pairs
    real(rp) :: gap(n_trials - 1), little, start(6, size(scene%body))
    integer :: chosen, e, k

    pairs%gap = -huge(1.0_rp)
    pairs%normal = 0.0_rp
    pairs%ends = 0.0_rp
    little = clearly*minval(patch%h)
    start = first_stretches(scene)
    do e = 1, pairs%n
      if (scene%contact(pairs%pair(e))%normal == moves_as_one) cycle
      if (pairs%is_shared(e)) then
        do k = 1, size(gap)
          gap(k) = gap_between(pairs%surface(:, k, e))
        end do
      else
        call measure_trials(scene, particles, patch, start, pairs, e, little, gap)
      end if
      chosen = best_of(little, pairs%trial(:, :, e), gap)
      if (chosen == 0) cycle
      pairs%gap(e) = gap(chosen)
      pairs%normal(:, e) = pairs%trial(:, chosen, e)
      pairs%ends(:, e) = pairs%surface(:, chosen, e)
    end do
  end subroutine choose_normals

  !> Gaps along the trial normals of entry `e`: that of the first, and of those that could be taken
  !> in its place; others may have the first's.
  subroutine measure_trials(scene, particles, patch, start, pairs, e, little, gap)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
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
      call measure(scene, particles, patch, start, pairs, e, pairs%trial(:, k, e), least, &
                   pairs%surface(:, k, e), gap(k))
      if (k == 1) least = gap(1) + little
      is_less(k) = gap(k) <= least .and. k > 1
    end do
    if (least > any_gap .and. all(gap(2:) <= least)) then
      gap(2:) = any_gap                        ! the first one is taken
    else
      do k = 2, size(gap)
        if (is_less(k)) call measure(scene, particles, patch, start, pairs, e, &
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
  subroutine measure_mean(scene, particles, patch, pairs)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(patch_t), intent(in) :: patch
    type(node_pairs_t), intent(inout) :: pairs
    real(rp) :: gap, least, little, start(6, size(scene%body))
    integer :: e

    little = clearly*minval(patch%h)
    start = first_stretches(scene)
    do e = 1, pairs%n
      if (all(abs(pairs%mean(:, e)) <= 0.0_rp)) cycle
      if (scene%contact(pairs%pair(e))%normal == moves_as_one) cycle
      least = any_gap
      if (pairs%gap(e) > -far .and. .not. pairs%is_shared(e)) least = pairs%gap(e) - little
      call measure(scene, particles, patch, start, pairs, e, pairs%mean(:, e), least, &
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

    little = clearly*minval(patch%h)
    do e = 1, pairs%n
      if (all(abs(pairs%mean(:, e)) <= 0.0_rp)) cycle
      if (scene%contact(pairs%pair(e))%normal == moves_as_one) cycle
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

  !> How far both bodies of entry `e` reach along `n`, out of the first, and the gap. If that is less
  !> than `least`, surfaces may be less and the gap more than they are, but not more than `least`.
  subroutine measure(scene, particles, patch, start, pairs, e, n, least, surface, gap)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(patch_t), intent(in) :: patch
    real(rp), intent(in) :: start(6, size(scene%body))
    type(node_pairs_t), intent(inout) :: pairs
    integer, intent(in) :: e
    real(rp), intent(in) :: n(3), least
    real(rp), intent(inout) :: surface(2)
    real(rp), intent(out) :: gap
    integer :: b, pass, side

    surface = nothing
    associate (groups => scene%contact(pairs%pair(e))%group)
      do pass = merge(2, 1, least <= any_gap), 2
        do side = 1, 2
          do b = 1, size(scene%body)
            if (scene%body(b)%group /= groups(side)) cycle
            call look_along(scene, particles, patch, b, start(:, b), pairs%near, pairs%node(e), &
                            pairs%x(:, e), (3 - 2*side)*n, pass == 1, -least - surface(3 - side), &
                            surface(side))
          end do
          if (sum(surface) > -least) exit
        end do
        if (sum(surface) > -least) exit
      end do
    end associate
    gap = gap_between(surface)
  end subroutine measure

  !> Move a surface out to the foremost particle of body `b` with weight at node `q`, along `n`. Ends
  !> early when it is beyond `enough`, or after the foremost row of cells with particles.
  subroutine look_along(scene, particles, patch, b, start, near, q, x, n, only_first, enough, &
                        surface)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(patch_t), intent(in) :: patch
    integer, intent(in) :: b, q
    real(rp), intent(in) :: start(6)           !! first stretch of the body's particles
    type(near_t), intent(inout) :: near
    real(rp), intent(in) :: x(3), n(3)         !! of the node [m]
    logical, intent(in) :: only_first
    real(rp), intent(in) :: enough             !! [m]
    real(rp), intent(inout) :: surface         !! from the node along n [m]
    real(rp) :: along(3), best(bundle_lanes), bound(3), factor, nn(6)
    integer :: axis(3), corner, i, j, k, p(3), slot, step(3)
    logical :: found

    call order_axes(patch, n, axis, step, along)
    nn = [n(1)*n(1), n(2)*n(2), n(3)*n(3), n(1)*n(2), n(2)*n(3), n(1)*n(3)]
    factor = 1.0_rp/max(sum(start(1:3)*nn(1:3)) + 2.0_rp*sum(start(4:6)*nn(4:6)), tiny(1.0_rp))
    best = surface
    do i = 1, -1, -1
      bound(1) = (i + 0.5_rp)*along(1) + near%longest(b)
      if (bound(1) + 1.5_rp*(along(2) + along(3)) <= surface) return
      do j = 1, -1, -1
        bound(2) = bound(1) + (j + 0.5_rp)*along(2)
        if (bound(2) + 1.5_rp*along(3) <= surface) exit
        found = .false.
        do k = 1, -1, -1
          bound(3) = bound(2) + (k + 0.5_rp)*along(3)
          if (bound(3) <= surface) exit
          corner = q - sum(patch%stride) + i*step(1) + j*step(2) + k*step(3)
          if (corner < 1) cycle
          slot = near%slot(corner)
          if (slot == 0) cycle
          if (near%last(b, slot) == 0) cycle
          if (near%bundle_of(b, slot) == 0) call bundle_up(scene, particles, b, slot, near)
          p(axis) = [i, j, k]*sign(1, step)
          p = 2 - p
          associate (first => near%bundle_of(b, slot), m => near%bundles_in(b, slot))
            call reach_out(m, near%bundle(:, :, first:first + m - 1), p, x, n, nn, factor, best)
          end associate
          found = .true.
        end do
        if (.not. found) cycle
        surface = maxval(best)
        if (only_first .or. surface > enough) return
      end do
    end do
  end subroutine look_along

  !> The axes, that along which a direction crosses most cells first, the step in nodes along each
  !> that goes forwards, and how far it is [m].
  pure subroutine order_axes(patch, n, axis, step, along)
    type(patch_t), intent(in) :: patch
    real(rp), intent(in) :: n(3)
    integer, intent(out) :: axis(3), step(3)
    real(rp), intent(out) :: along(3)

    along = abs(n)*patch%h
    axis = [1, 2, 3]
    if (along(2) > along(1)) axis = [2, 1, 3]
    if (along(3) > maxval(along(1:2))) axis = [3, 1, 2]
    along = along(axis)
    step = patch%stride(axis)
    where (n(axis) < 0.0_rp) step = -step
  end subroutine order_axes

  !> Put the particles of body `b` at a corner into bundles.
  subroutine bundle_up(scene, particles, b, slot, near)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: b, slot
    type(near_t), intent(inout) :: near
    integer :: block, l, lane, p

    near%bundle_of(b, slot) = near%n_bundles + 1
    p = near%last(b, slot)
    l = bundle_lanes
    do while (p > 0)
      if (l == bundle_lanes) then
        call near%add_bundle()
        l = 0
      end if
      l = l + 1
      block = (p - 1)/nlane + 1
      lane = p - (block - 1)*nlane
      associate (u => near%bundle(:, :, near%n_bundles), ps => particles%ps(:, :, near%block(block)))
        u(l, u_place:u_place + 2) = ps(lane, f_pos:f_pos + 2)
        u(l, u_weights:u_weights + 8) = near%w(lane, :, block)
        u(l, u_edges:u_edges + 2) = 0.25_rp*scene%body(b)%spacing**2
        if (scene%layout%half > 0) then
          u(l, u_edges:u_edges + 2) = u(l, u_edges:u_edges + 2) &
              *(ps(lane, scene%layout%half:scene%layout%half + 2)/scene%domain(b))**2
          u(l, u_stretch:u_stretch + 2) = 1.0_rp
        else
          u(l, u_stretch:u_stretch + 5) = ps(lane, f_bbar:f_bbar + 5) &
              *ps(lane, f_jac)**(2.0_rp/3.0_rp)
          u(l, u_stretch + 3:u_stretch + 5) = 2.0_rp*u(l, u_stretch + 3:u_stretch + 5)
        end if
      end associate
      p = near%before(p)
    end do
    near%bundles_in(b, slot) = near%n_bundles - near%bundle_of(b, slot) + 1
  end subroutine bundle_up

  !> Move surfaces out to where particles with weight end: half their edge along n, stretched by
  !> sqrt(n.b n/n.first n).
  pure subroutine reach_out(m, u, p, x, n, nn, factor, best)
    integer, intent(in) :: m, p(3)             !! place of the node among the 27
    real(rp), intent(in) :: u(bundle_lanes, n_bundle, m)
    real(rp), intent(in) :: x(3), n(3)
    real(rp), intent(in) :: nn(6)              !! products of n: xx, yy, zz, xy, yz, xz
    real(rp), intent(in) :: factor             !! 1/n.first n
    real(rp), intent(inout) :: best(bundle_lanes)
    real(rp) :: out, half2, stretch
    integer :: i, j, k, l, o

    i = u_weights - 1 + p(1)
    j = u_weights + 2 + p(2)
    k = u_weights + 5 + p(3)
    do o = 1, m
      !$omp simd private(out, half2, stretch)
      do l = 1, bundle_lanes
        half2 = u(l, 4, o)*nn(1) + u(l, 5, o)*nn(2) + u(l, 6, o)*nn(3)
        stretch = u(l, 7, o)*nn(1) + u(l, 8, o)*nn(2) + u(l, 9, o)*nn(3) &
                  + u(l, 10, o)*nn(4) + u(l, 11, o)*nn(5) + u(l, 12, o)*nn(6)
        out = (u(l, 1, o) - x(1))*n(1) + (u(l, 2, o) - x(2))*n(2) + (u(l, 3, o) - x(3))*n(3) &
              + sqrt(half2*stretch*factor)
        out = merge(out, nothing, u(l, i, o)*u(l, j, o)*u(l, k, o) > least_weight)
        best(l) = merge(out, best(l), out > best(l))
      end do
    end do
  end subroutine reach_out

end module body_contact_surfaces
