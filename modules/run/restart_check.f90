! SPDX-License-Identifier: MIT
!> Checks that a run of this scene can have written the boxes of the ranks and the particles in a
!> checkpoint.
module run_restart_check
  use base_kinds, only: i8, nlane, rp
  use base_text, only: str
  use grid_geometry, only: box_t, grid_t, halo, nearest_node
  use io_plausible, only: is_between, least, most, speed_of_light
  use output_diagnostics, only: field_name
  use particles_store, only: asleep, f_bbar, f_flow, f_jac, f_mass, f_plastic, f_pos, f_rate, &
                             f_temp, f_vel, tag_id, tag_rest, tracer_bit
  use simulation_parts, only: simulation_t
  implicit none (type, external)
  private

  public :: check_boxes, check_particles

  real(rp), parameter :: strained = 1.0e6_rp   !! bound of volume ratios and their inverse

contains

  !> Whether the boxes of the ranks divide the grid.
  pure logical function check_boxes(grid, boxes) result(is_good)
    type(grid_t), intent(in) :: grid
    type(box_t), intent(in) :: boxes(:)
    type(box_t) :: both
    integer(i8) :: nodes
    integer :: i, k

    is_good = .true.
    nodes = 0
    do k = 1, size(boxes)
      if (boxes(k)%is_empty()) cycle
      is_good = is_good .and. all(boxes(k)%lo >= 0 .and. boxes(k)%hi < grid%n)
      if (.not. is_good) return
      nodes = nodes + product(int(boxes(k)%hi - boxes(k)%lo + 1, i8))
      do i = 1, k - 1
        both = boxes(i)%meet(boxes(k))
        is_good = is_good .and. both%is_empty()
      end do
    end do
    is_good = is_good .and. nodes == product(int(grid%n, i8))
  end function check_boxes

  !> Error message for the particles of this rank; '' if they are valid. Their nearest nodes must be
  !> in `box` or next to it, and unused lanes must be neutral (particles_sort).
  function check_particles(sim, box) result(text)
    type(simulation_t), intent(in) :: sim
    type(box_t), intent(in) :: box
    character(:), allocatable :: text
    real(rp) :: low(sim%particles%nf), high(sim%particles%nf)
    integer(i8), parameter :: tags = ishft(1_i8, tracer_bit + 1)
    type(box_t) :: reach
    integer :: b, f, p
    logical :: fits(nlane)

    call ranges(sim, low, high)
    reach = box%grown(1)
    text = ''
    do b = 1, sim%particles%nblk
      associate (ps => sim%particles%ps(:, :, b), tag => sim%particles%tag(:, b), &
                 n => sim%particles%count(b), body => sim%particles%body(b))
        if (n < 0 .or. n > nlane) then
          text = '/particles/count: a block of '//str(n)//' particles'
        else if (body < 1 .or. body > size(sim%scene%body)) then
          text = '/particles/body: body '//str(body)//' of '//str(size(sim%scene%body))
        else if (any(tag(:n) < 0 .or. tag(:n) >= tags) .or. any(tag_rest(tag(:n)) > asleep)) then
          text = '/particles/tag: a tag that no particle can have'
        end if
        if (text /= '') return
        do f = 1, size(low)
          fits = is_between(ps(:, f), low(f), high(f))
          if (f == f_mass) fits(n + 1:) = is_between(ps(n + 1:, f), 0.0_rp, 0.0_rp)
          if (all(fits)) cycle
          p = findloc(fits, .false., 1)
          text = '/particles/state: particle '//str(tag_id(tag(p)))//' has a '// &
                 field_name(sim%scene%layout, f)//' of '//str(ps(p, f))//', not from '// &
                 str(low(f))//' to '//str(high(f))
          if (p > n) text = '/particles/state: there is a particle behind the '//str(n)// &
                            ' of its block'
          return
        end do
        do p = 1, n
          if (reach%has(nearest_node(sim%scene%grid, ps(p, f_pos:f_pos + 2)))) cycle
          text = '/particles/state: particle '//str(tag_id(tag(p)))//' is outside the box of '// &
                 'nodes of its rank'
          return
        end do
      end associate
    end do
  end function check_particles

  !> Ranges of the fields of particles. Particles that leave the grid are removed before they are
  !> outside the patch of a rank.
  pure subroutine ranges(sim, low, high)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(out) :: low(:), high(:)

    low = -most
    high = most
    associate (grid => sim%scene%grid)
      low(f_pos:f_pos + 2) = grid%lower - halo*grid%h
      high(f_pos:f_pos + 2) = grid%upper() + halo*grid%h
    end associate
    low([f_mass, f_temp]) = least
    low([f_plastic, f_rate, f_flow]) = 0.0_rp
    low(f_jac) = 1.0_rp/strained
    high(f_jac) = strained
    low(f_vel:f_vel + 2) = -speed_of_light
    high(f_vel:f_vel + 2) = speed_of_light
    low(f_bbar:f_bbar + 5) = -strained
    low(f_bbar:f_bbar + 2) = 1.0_rp/strained
    high(f_bbar:f_bbar + 5) = strained
  end subroutine ranges

end module run_restart_check
