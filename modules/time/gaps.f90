! SPDX-License-Identifier: MIT
!> Where bodies meet: list of the nodes and the gaps there. A gap is that between the particles
!> themselves: a surface is where the foremost of its particles with weight at the node ends.
module time_gaps
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use particles_store, only: f_bbar, f_jac, f_mass, f_pos
  use time_meeting, only: moves_as_one, n_sums_all, n_sums_gradient, n_trials, &
                          normal_regression, s_gradient, s_moment
  use time_nodes, only: least_mass
  use time_normals, only: average_normals, choose_normals, ignore_thin_overlaps, try_normals
  use time_state, only: roam, simulation_t
  use time_weights, only: weights_of
  implicit none (type, external)
  private

  public :: find_meeting

  real(rp), parameter :: least_weight = 1.0e-6_rp   !! of a particle that has a say in the gap
  real(rp), parameter :: clearly = 1.0e-3_rp        !! less gap of a better direction [cells]

contains

  !> Collective. List the nodes with mass of two groups, their normals and gaps.
  subroutine find_meeting(world, sim, g)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: g(8, sim%patch%nn, sim%n_groups)

    integer :: k

    call list_nodes(sim, g)
    call note_walls(sim)
    call list_near_blocks(sim)
    sim%meeting%sums = 0.0_rp
    call visit_blocks(sim, 0, 0)
    call share(world, sim, .false., size(sim%meeting%sums, 1), sim%meeting%sums)
    call try_normals(sim)
    call find_surfaces(world, sim, 1, n_trials - 1)
    sim%meeting%gap = -huge(1.0_rp)
    sim%meeting%normal = 0.0_rp
    do k = n_trials - 1, 1, -1
      call choose_normals(sim, k, merge(0.0_rp, -clearly*sim%patch%h, k > 2))
    end do
    call average_normals(sim, g, sim%meeting%trial(:, n_trials, :))
    call share(world, sim, .false., 3, sim%meeting%trial(:, n_trials, :))
    call find_surfaces(world, sim, n_trials, n_trials)
    call choose_normals(sim, n_trials, -clearly*sim%patch%h)
    call ignore_thin_overlaps(sim)
    sim%meeting%is_known = .true.
  end subroutine find_meeting

  !> Surfaces of both bodies along the trial normals `from` to `to`.
  subroutine find_surfaces(world, sim, from, to)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: from, to

    sim%meeting%surface(2*from - 1:2*to, :) = -huge(1.0_rp)
    call visit_blocks(sim, from, to)
    call share(world, sim, .true., 2*(to - from + 1), sim%meeting%surface(2*from - 1:2*to, :))
  end subroutine find_surfaces

  subroutine share(world, sim, largest, width, values)
    type(world_t), intent(in) :: world
    type(simulation_t), intent(inout) :: sim
    logical, intent(in) :: largest
    integer, intent(in) :: width
    real(rp), intent(inout) :: values(width, sim%meeting%n)

    call sim%halo%combine(world, largest, sim%patch%nn, sim%meeting%first, sim%meeting%n, &
                          sim%meeting%node, width, values)
  end subroutine share

  !> An entry for each pair of groups with mass at a node.
  subroutine list_nodes(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: g(8, sim%patch%nn, sim%n_groups)
    integer :: c, e, i, pass, r, width

    call sim%meeting%forget(sim%patch%nn)
    width = n_sums_gradient
    if (any(sim%scene%contact%normal == normal_regression)) width = n_sums_all
    associate (meeting => sim%meeting)
      do pass = 1, 2
        e = 0
        do r = 1, sim%n_runs
          do i = sim%run(1, r), sim%run(2, r)
            do c = 1, size(sim%scene%contact)
              if (any(g(8, i, sim%scene%contact(c)%group) <= least_mass)) cycle
              e = e + 1
              if (pass == 1) cycle
              meeting%node(e) = i
              meeting%pair(e) = c
              meeting%is_owned(e) = sim%run(3, r) == 1
              meeting%x(:, e) = sim%patch%position(i)
              if (meeting%first(i) == 0) meeting%first(i) = e
            end do
          end do
        end do
        if (pass == 1) call meeting%reserve(e, width)
      end do
      meeting%free = 1.0_rp
    end associate
  end subroutine list_nodes

  !> Directions in which a wall or clamp holds the nodes.
  subroutine note_walls(sim)
    type(simulation_t), intent(inout) :: sim
    integer :: i

    do i = 1, sim%n_fixed
      call note_node(sim, sim%fixed(1, i), sim%scene%constraint(sim%fixed(2, i))%component)
    end do
    do i = 1, sim%mirrors%n_planes
      associate (plane => sim%mirrors%plane(:, i))
        call note_node(sim, plane(1), sim%scene%constraint(plane(2))%component)
      end associate
    end do
  end subroutine note_walls

  !> The entries of node `q` are not free in directions that are `held`.
  pure subroutine note_node(sim, q, held)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: q
    logical, intent(in) :: held(3)
    integer :: e

    associate (meeting => sim%meeting)
      e = meeting%first(q)
      if (e == 0) return
      do while (meeting%node(e) == q)
        where (held) meeting%free(:, e) = 0.0_rp
        e = e + 1
        if (e > meeting%n) exit
      end do
    end associate
  end subroutine note_node

  !> Blocks that may have particles with weight at the listed nodes.
  subroutine list_near_blocks(sim)
    type(simulation_t), intent(inout) :: sim
    real(rp) :: low(3), high(3), reach
    integer :: b

    associate (meeting => sim%meeting)
      if (allocated(meeting%near)) deallocate (meeting%near)
      allocate (meeting%near(sim%particles%nblk))
      meeting%n_near = 0
      if (meeting%n == 0) return
      low = minval(meeting%x, 2)
      high = maxval(meeting%x, 2)
      do b = 1, sim%particles%nblk
        reach = sim%ball(4, b) + (1.0_rp + roam)*sim%scene%grid%h
        if (any(sim%ball(1:3, b) + reach < low) .or. any(sim%ball(1:3, b) - reach > high)) cycle
        meeting%n_near = meeting%n_near + 1
        meeting%near(meeting%n_near) = b
      end do
    end associate
  end subroutine list_near_blocks

  !> Surfaces of the particles along the trial normals `from` to `to`; 0: sums over the particles.
  subroutine visit_blocks(sim, from, to)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: from, to
    integer :: b, k

    do k = 1, sim%meeting%n_near
      b = sim%meeting%near(k)
      call visit_block(sim, from, to, sim%particles%body(b), sim%particles%count(b), &
                       sim%particles%nf, sim%particles%ps(:, :, b))
    end do
  end subroutine visit_blocks

  subroutine visit_block(sim, from, to, body, n, nf, ps)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: from, to, body, n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    integer :: e, first(nlane), group, i, j, k, p, q, side
    real(rp) :: w(nlane, 18), weight, slope(3), edges(3), stretch(6, 2)

    call weights_of(sim, body, nf, ps, w, first)
    group = sim%scene%body(body)%group
    do p = 1, n
      if (from > 0) call size_of(sim, body, ps(p, :), edges, stretch)
      do i = 1, 3
        do j = 1, 3
          do k = 1, 3
            q = first(p) + (i - 1)*sim%patch%stride(1) + (j - 1)*sim%patch%stride(2) + k - 1
            e = sim%meeting%first(q)
            if (e == 0) cycle
            weight = w(p, i)*w(p, 3 + j)*w(p, 6 + k)
            slope = [w(p, 9 + i)*w(p, 3 + j)*w(p, 6 + k), w(p, i)*w(p, 12 + j)*w(p, 6 + k), &
                     w(p, i)*w(p, 3 + j)*w(p, 15 + k)]
            do while (sim%meeting%node(e) == q)
              associate (contact => sim%scene%contact(sim%meeting%pair(e)))
                side = findloc(contact%group, group, 1)
                if (side > 0 .and. contact%normal /= moves_as_one) then
                  if (from == 0) then
                    call add_particle(sim, e, side, weight, slope, body, ps(p, f_mass), &
                                      ps(p, f_jac), ps(p, f_pos:f_pos + 2))
                  else if (weight > least_weight) then
                    call reach_out(sim, from, to, e, side, edges, stretch, ps(p, f_pos:f_pos + 2))
                  end if
                end if
              end associate
              e = e + 1
              if (e > sim%meeting%n) exit
            end do
          end do
        end do
      end do
    end do
  end subroutine visit_block

  !> Edges of a particle's domain and the stretch since they had that length: cpGIMP knows the
  !> edges, others the elastic stretch b, now and at the start.
  pure subroutine size_of(sim, body, ps, edges, stretch)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: body
    real(rp), intent(in) :: ps(:)
    real(rp), intent(out) :: edges(3)          !! [m]
    real(rp), intent(out) :: stretch(6, 2)     !! b now, b at the start: xx, yy, zz, xy, yz, xz

    edges = sim%scene%body(body)%spacing
    associate (half => sim%scene%layout%half)
      if (half > 0) then
        edges = edges*ps(half:half + 2)/sim%scene%domain(body)
        stretch(1:3, :) = 1.0_rp
        stretch(4:6, :) = 0.0_rp
      else
        associate (start => sim%scene%body(body)%start)
          stretch(:, 1) = ps(f_bbar:f_bbar + 5)*ps(f_jac)**(2.0_rp/3.0_rp)
          stretch(:, 2) = start%bbar*start%jac**(2.0_rp/3.0_rp)
        end associate
      end if
    end associate
  end subroutine size_of

  !> A particle's part of the sums of entry `e`.
  pure subroutine add_particle(sim, e, side, weight, slope, body, mass, jac, x)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: e, side, body
    real(rp), intent(in) :: weight, slope(3), mass, jac, x(3)
    real(rp) :: y(3), label
    integer :: o

    associate (s => sim%meeting%sums(:, e), &
               rho => sim%scene%material(sim%scene%body(body)%material)%rho)
      o = s_gradient + 3*(side - 1)
      s(o:o + 2) = s(o:o + 2) + mass/rho*jac*slope
      if (sim%scene%contact(sim%meeting%pair(e))%normal /= normal_regression) return
      y = (x - sim%meeting%x(:, e))/sim%patch%h
      label = 2*side - 3
      o = s_moment
      s(o:o + 13) = s(o:o + 13) + weight*[y*y, y(1)*y(2), y(2)*y(3), y(1)*y(3), y, 1.0_rp, &
                                          label*y, label]
    end associate
  end subroutine add_particle

  !> Move the surface of body `side` at entry `e` out to where a particle ends.
  pure subroutine reach_out(sim, from, to, e, side, edges, stretch, x)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: from, to, e, side
    real(rp), intent(in) :: edges(3), stretch(6, 2), x(3)
    real(rp) :: along, half
    integer :: k

    do k = from, to
      associate (normal => sim%meeting%trial(:, k, e), s => sim%meeting%surface(2*k - 2 + side, e))
        along = dot_product(x - sim%meeting%x(:, e), normal)*(3 - 2*side)
        half = 0.5_rp*norm2(normal*edges) &
               *sqrt(along_square(stretch(:, 1), normal)/along_square(stretch(:, 2), normal))
        s = max(s, along + half)
      end associate
    end do
  end subroutine reach_out

  !> n . b n of a symmetric tensor: xx, yy, zz, xy, yz, xz.
  pure real(rp) function along_square(b, n)
    real(rp), intent(in) :: b(6), n(3)

    along_square = sum(b(1:3)*n**2) &
                   + 2.0_rp*(b(4)*n(1)*n(2) + b(5)*n(2)*n(3) + b(6)*n(1)*n(3))
  end function along_square

end module time_gaps
