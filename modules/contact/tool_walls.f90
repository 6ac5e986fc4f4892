! SPDX-License-Identifier: MIT
!> Walls and clamps in contact with tools: values of the listed nodes behind walls are reflected to
!> those in front (as boundary_symmetry does with records), and held directions do not move.
!>
!> A tool that moves along a mirror, or turns about an axis normal to it, is its own image, and
!> metal and image share the friction at a node: it is limited jointly, and a half model equals the
!> full one. With any other motion the image would rub in the opposite direction at the same nodes,
!> and a no-slip wall (KIND = 'fixed') has no image at all: the stick impulses cancel there, which
!> limits nothing. Friction at the nodes on such a plane, behind it and in front is therefore
!> limited by the strength of the particles on each side separately. The values behind are a second
!> part of the values of the node in front, which a rank may store without the one behind.
module contact_tool_walls
  use base_kinds, only: rp
  use state_budget, only: budget_t, e_wall
  use state_nodes, only: nodes_t
  use state_scene, only: scene_t
  use state_tool_lists, only: impulse_of, m_last_impulse, n_both, n_masses, n_values, &
                                   tool_contact_t, v_normal, v_stick
  use tools_tool, only: rigid_t
  implicit none (type, external)
  private

  public :: find_separate_sides, mark_held, reflect_masses, reflect_values, restore_masses, &
            restore_fractions, record_wall_impulse

  real(rp), parameter :: slack = 1.0e-9_rp   !! tolerance of a velocity component along a plane

contains

  !> Find the planes on whose sides friction is limited separately, for a tool with the given
  !> motion.
  pure subroutine find_separate_sides(scene, contact, rigid)
    type(scene_t), intent(in) :: scene
    type(tool_contact_t), intent(inout) :: contact
    type(rigid_t), intent(in) :: rigid
    real(rp) :: across(3), along(3)
    integer :: c

    if (.not. allocated(contact%has_separate_sides)) then
      allocate (contact%has_separate_sides(size(scene%symmetry)))
    end if
    do c = 1, size(scene%symmetry)
      associate (plane => scene%symmetry(c))
        along = merge(1.0_rp, 0.0_rp, [1, 2, 3] == plane%axis)
        across = 1.0_rp - along
        contact%has_separate_sides(c) = all(plane%odd) &
          .or. norm2(along*rigid%velocity) > slack*norm2(rigid%velocity) &
          .or. norm2(across*rigid%omega) > slack*norm2(rigid%omega)
      end associate
    end do
    contact%width = merge(n_both, n_values, any(contact%has_separate_sides))
  end subroutine find_separate_sides

  !> Mark directions in which a wall or clamp holds the listed nodes, or in which reflection changes
  !> the sign, and list the entries at planes of symmetry.
  subroutine mark_held(scene, nodes, contact)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(inout) :: contact
    integer :: c, e, i, k

    do i = 1, nodes%boundary%n_fixed
      e = contact%entry_of(nodes%boundary%fixed(1, i))
      if (e == 0) cycle
      where (scene%clamp(nodes%boundary%fixed(2, i))%clamp%held) contact%free_direction(:, &
          e) = 0.0_rp
    end do
    associate (m => nodes%boundary%mirrors, at => contact%entry_of)
      contact%pair = m%pair(:, pack([(i, i=1, m%n_pairs)], at(m%pair(1, :m%n_pairs)) > 0 &
                                        .or. at(m%pair(2, :m%n_pairs)) > 0))
      contact%plane = m%plane(:, pack([(i, i=1, m%n_planes)], at(m%plane(1, :m%n_planes)) > 0))
      do i = 1, size(contact%pair, 2)
        contact%pair(1:2, i) = at(contact%pair(1:2, i))
      end do
      contact%plane(1, :) = at(contact%plane(1, :))
    end associate
    do i = 1, size(contact%plane, 2)
      e = contact%plane(1, i)
      c = contact%plane(2, i)
      where (scene%symmetry(c)%odd) contact%free_direction(:, e) = 0.0_rp
      if (contact%has_separate_sides(c)) cycle
      where (scene%symmetry(c)%odd) contact%is_folded(:, e) = .true.
    end do
    do i = 1, size(contact%pair, 2)
      c = contact%pair(3, i)
      do k = 1, 2
        e = contact%pair(k, i)
        if (e == 0 .or. contact%has_separate_sides(c)) cycle
        where (scene%symmetry(c)%odd) contact%is_folded(:, e) = .true.
      end do
    end do
  end subroutine mark_held

  !> Signs of the values of an entry at plane `c`: -1 for odd components, 1 for others.
  pure function wall_signs(scene, c, width) result(sign)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: c, width
    real(rp) :: sign(width), v(3)
    integer :: i

    sign = 1.0_rp
    v = merge(-1.0_rp, 1.0_rp, scene%symmetry(c)%odd)
    if (width == n_masses) sign(m_last_impulse:m_last_impulse + 2) = v
    do i = 0, width - n_values, n_values         ! of one side or of both
      sign(i + v_normal:i + v_normal + 2) = v
      sign(i + v_stick:i + v_stick + 2) = v
    end do
  end function wall_signs

  !> Reflect the masses of nodes behind walls to those in front, as `reflect` does with records.
  subroutine reflect_masses(scene, contact)
    type(scene_t), intent(in) :: scene
    type(tool_contact_t), intent(inout) :: contact
    integer :: i

    do i = 1, size(contact%pair, 2)
      if (any(contact%pair(1:2, i) == 0)) cycle
      associate (behind => contact%mass(:, contact%pair(1, i)), &
                 front => contact%mass(:, contact%pair(2, i)))
        front = front + wall_signs(scene, contact%pair(3, i), n_masses)*behind
        behind = 0.0_rp
      end associate
    end do
    do i = 1, size(contact%plane, 2)
      associate (on => contact%mass(:, contact%plane(1, i)))
        on = 0.5_rp*(1.0_rp + wall_signs(scene, contact%plane(2, i), n_masses))*on
      end associate
    end do
  end subroutine reflect_masses

  !> Set the masses of nodes behind walls to those in front.
  subroutine restore_masses(scene, contact)
    type(scene_t), intent(in) :: scene
    type(tool_contact_t), intent(inout) :: contact
    integer :: i

    do i = size(contact%pair, 2), 1, -1
      if (any(contact%pair(1:2, i) == 0)) cycle
      contact%mass(:, contact%pair(1, i)) = wall_signs(scene, contact%pair(3, i), &
        n_masses)*contact%mass(:, contact%pair(2, i))
    end do
  end subroutine restore_masses

  !> Reflect the values of nodes behind walls to those in front, or add them to the second part
  !> where the sides are limited separately.
  subroutine reflect_values(scene, contact)
    type(scene_t), intent(in) :: scene
    type(tool_contact_t), intent(inout) :: contact
    real(rp) :: sign(contact%width)
    integer :: i

    do i = 1, size(contact%pair, 2)
      if (any(contact%pair(1:2, i) == 0)) cycle
      sign = wall_signs(scene, contact%pair(3, i), contact%width)
      associate (behind => contact%values(:, contact%pair(1, i)), &
                 front => contact%values(:, contact%pair(2, i)))
        if (contact%has_separate_sides(contact%pair(3, i))) then
          front(n_values + 1:) = front(n_values + 1:) &
            + sign(:n_values)*(behind(:n_values) + behind(n_values + 1:))
        else
          front = front + sign*behind
          behind = 0.0_rp
        end if
      end associate
    end do
    do i = 1, size(contact%plane, 2)
      if (contact%has_separate_sides(contact%plane(2, i))) cycle
      associate (on => contact%values(:, contact%plane(1, i)))
        on = 0.5_rp*(1.0_rp + wall_signs(scene, contact%plane(2, i), contact%width))*on
      end associate
    end do
  end subroutine reflect_values

  !> Set the friction fractions of nodes behind walls, and the values of those behind mirrors, from
  !> the nodes in front.
  subroutine restore_fractions(scene, contact)
    type(scene_t), intent(in) :: scene
    type(tool_contact_t), intent(inout) :: contact
    integer :: i

    do i = size(contact%pair, 2), 1, -1
      if (any(contact%pair(1:2, i) == 0)) cycle
      associate (b => contact%pair(1, i), a => contact%pair(2, i), c => contact%pair(3, i))
        contact%friction_fraction_behind(b) = contact%friction_fraction_behind(a)
        if (contact%has_separate_sides(c)) then
          contact%friction_fraction(b) = contact%friction_fraction_behind(a)
        else
          contact%friction_fraction(b) = contact%friction_fraction(a)
          associate (signs => wall_signs(scene, c, n_values))
            contact%values(:n_values, b) = signs*contact%values(:n_values, a)
          end associate
        end if
      end associate
    end do
  end subroutine restore_fractions

  !> Record the impulse that held nodes and mirrors take from the tool.
  subroutine record_wall_impulse(scene, nodes, contact, budget, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(tool_contact_t), intent(in) :: contact
    type(budget_t), intent(inout) :: budget
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    real(rp) :: impulse(3), mean
    integer :: a, c, e, i, place

    associate (t => contact)
      do i = 1, nodes%boundary%n_fixed
        e = t%entry_of(nodes%boundary%fixed(1, i))
        if (e == 0 .or. nodes%boundary%fixed(3, i) == 0) cycle
        c = nodes%boundary%fixed(2, i)
        place = scene%clamp(c)%clamp%place
        impulse = impulse_of(t%values(:, e), t%friction_fraction(e))
        do a = 1, 3
          if (.not. scene%clamp(c)%clamp%held(a)) cycle
          budget%impulse(a, place) = budget%impulse(a, place) - impulse(a)
          mean = g(a, t%node(e)) - 0.5_rp*g(4 + a, t%node(e))   ! velocity in the step [m/s]
          budget%sums(e_wall) = budget%sums(e_wall) - impulse(a)*mean
        end do
      end do
      do i = 1, size(t%pair, 2)
        if (t%pair(1, i) > 0) call add_local(t%pair(3, i), t%pair(1, i), 1.0_rp)
      end do
      do i = 1, size(t%plane, 2)
        call add_local(t%plane(2, i), t%plane(1, i), 0.5_rp)
      end do
    end associate
  contains
    !> Add the change of the impulse of this rank's particles at an entry, times `share`.
    subroutine add_local(plane, e, share)
      integer, intent(in) :: plane, e
      real(rp), intent(in) :: share

      associate (t => contact, impulse => budget%impulse(:, scene%symmetry(plane)%place))
        impulse = impulse - merge(2.0_rp*share, 0.0_rp, scene%symmetry(plane)%odd) &
                  *impulse_of(t%local_values(:, e), t%friction_fraction(e))
      end associate
    end subroutine add_local
  end subroutine record_wall_impulse

end module contact_tool_walls
