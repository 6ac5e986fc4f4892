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
  use boundary_held, only: boundary_t
  use contact_tool_lists, only: m_last_impulse, n_both, n_masses, n_values, tool_contact_t, &
    v_stick, v_normal
  use mapping_nodes, only: nodes_t
  use state_run, only: budget_t, e_wall
  use state_scene, only: scene_t
  use tools_tool, only: rigid_t
  implicit none (type, external)
  private

  public :: find_separate_sides, mark_held, reflect_masses, reflect_values, restore_masses, &
            restore_fractions, record_wall_impulse

  real(rp), parameter :: slack = 1.0e-9_rp   !! tolerance of a motion along a plane

contains

  !> Find the planes on whose sides friction is limited separately, for a tool with this motion.
  pure subroutine find_separate_sides(scene, rigid, contact)
    type(scene_t), intent(in) :: scene
    type(rigid_t), intent(in) :: rigid
    type(tool_contact_t), intent(inout) :: contact
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
  !> the sign.
  subroutine mark_held(scene, boundary, contact)
    type(scene_t), intent(in) :: scene
    type(boundary_t), intent(in) :: boundary
    type(tool_contact_t), intent(inout) :: contact
    integer :: e, i, k

    associate (contact => contact, m => boundary%mirrors)
      contact%reaches_mirrors = any(contact%entry_of(m%pair(1, :m%n_pairs)) > 0) &
                               .or. any(contact%entry_of(m%plane(1, :m%n_planes)) > 0)
      do i = 1, boundary%n_fixed
        e = contact%entry_of(boundary%fixed(1, i))
        if (e == 0) cycle
        where (scene%clamp(boundary%fixed(2, i))%clamp%held) contact%free_direction(:, e) = 0.0_rp
      end do
      if (.not. contact%reaches_mirrors) return
      do i = 1, m%n_planes
        e = contact%entry_of(m%plane(1, i))
        if (e == 0) cycle
        where (scene%symmetry(m%plane(2, i))%odd) contact%free_direction(:, e) = 0.0_rp
        if (.not. contact%has_separate_sides(m%plane(2, i))) then
          where (scene%symmetry(m%plane(2, i))%odd) contact%is_folded(:, e) = .true.
        end if
      end do
      do i = 1, m%n_pairs
        if (contact%has_separate_sides(m%pair(3, i))) cycle
        do k = 1, 2
          e = contact%entry_of(m%pair(k, i))
          if (e == 0) cycle
          where (scene%symmetry(m%pair(3, i))%odd) contact%is_folded(:, e) = .true.
        end do
      end do
    end associate
  end subroutine mark_held

  !> Signs of the values of an entry at plane `c`: -1 for odd components, 1 for others.
  pure function wall_signs(scene, c, width) result(sign)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: c, width
    real(rp) :: sign(width), v(3)

    sign = 1.0_rp
    v = merge(-1.0_rp, 1.0_rp, scene%symmetry(c)%odd)
    if (width == n_masses) sign(m_last_impulse:m_last_impulse + 2) = v
    if (width < n_values) return
    sign(v_normal:v_normal + 2) = v
    sign(v_stick:v_stick + 2) = v
  end function wall_signs

  !> Reflect the masses of nodes behind walls to those in front, as `reflect` does with records.
  subroutine reflect_masses(scene, boundary, contact)
    type(scene_t), intent(in) :: scene
    type(boundary_t), intent(in) :: boundary
    type(tool_contact_t), intent(inout) :: contact
    integer :: a, b, i

    if (.not. contact%reaches_mirrors) return
    associate (m => boundary%mirrors, place => contact%entry_of, masses => contact%mass)
      do i = 1, m%n_pairs
        b = place(m%pair(1, i))
        a = place(m%pair(2, i))
        if (a == 0 .or. b == 0) cycle
        masses(:, a) = masses(:, a) + wall_signs(scene, m%pair(3, i), n_masses)*masses(:, b)
        masses(:, b) = 0.0_rp
      end do
      do i = 1, m%n_planes
        a = place(m%plane(1, i))
        if (a == 0) cycle
        masses(:, a) = 0.5_rp*(1.0_rp + wall_signs(scene, m%plane(2, i), n_masses))*masses(:, a)
      end do
    end associate
  end subroutine reflect_masses

  !> Set the masses of nodes behind walls to those in front.
  subroutine restore_masses(scene, boundary, contact)
    type(scene_t), intent(in) :: scene
    type(boundary_t), intent(in) :: boundary
    type(tool_contact_t), intent(inout) :: contact
    integer :: a, b, i

    if (.not. contact%reaches_mirrors) return
    associate (m => boundary%mirrors, place => contact%entry_of)
      do i = m%n_pairs, 1, -1
        b = place(m%pair(1, i))
        a = place(m%pair(2, i))
        if (a == 0 .or. b == 0) cycle
        contact%mass(:, b) = wall_signs(scene, m%pair(3, i), n_masses)*contact%mass(:, a)
      end do
    end associate
  end subroutine restore_masses

  !> Reflect the values of nodes behind walls to those in front, or add them to the second part
  !> where the sides are limited separately.
  subroutine reflect_values(scene, boundary, contact)
    type(scene_t), intent(in) :: scene
    type(boundary_t), intent(in) :: boundary
    type(tool_contact_t), intent(inout) :: contact
    real(rp) :: sign(n_values)
    integer :: a, b, i

    if (.not. contact%reaches_mirrors) return
    associate (m => boundary%mirrors, place => contact%entry_of, values => contact%values)
      do i = 1, m%n_pairs
        b = place(m%pair(1, i))
        a = place(m%pair(2, i))
        if (a == 0 .or. b == 0) cycle
        sign = wall_signs(scene, m%pair(3, i), n_values)
        if (contact%has_separate_sides(m%pair(3, i))) then
          values(n_values + 1:n_both, a) = values(n_values + 1:n_both, a) &
            + sign*(values(:n_values, b) + values(n_values + 1:n_both, b))
        else
          values(:n_values, a) = values(:n_values, a) + sign*values(:n_values, b)
          values(:n_values, b) = 0.0_rp
          if (contact%width > n_values) then
            values(n_values + 1:, a) = values(n_values + 1:, a) + sign*values(n_values + 1:, b)
            values(n_values + 1:, b) = 0.0_rp
          end if
        end if
      end do
      do i = 1, m%n_planes
        a = place(m%plane(1, i))
        if (a == 0 .or. contact%has_separate_sides(m%plane(2, i))) cycle
        sign = 0.5_rp*(1.0_rp + wall_signs(scene, m%plane(2, i), n_values))
        values(:n_values, a) = sign*values(:n_values, a)
        if (contact%width > n_values) values(n_values + 1:, a) = sign*values(n_values + 1:, a)
      end do
    end associate
  end subroutine reflect_values

  !> Set the friction fractions of nodes behind walls, and the values of those behind mirrors, from
  !> the nodes in front.
  subroutine restore_fractions(scene, boundary, contact)
    type(scene_t), intent(in) :: scene
    type(boundary_t), intent(in) :: boundary
    type(tool_contact_t), intent(inout) :: contact
    integer :: a, b, i

    if (.not. contact%reaches_mirrors) return
    associate (m => boundary%mirrors, place => contact%entry_of)
      do i = m%n_pairs, 1, -1
        b = place(m%pair(1, i))
        a = place(m%pair(2, i))
        if (a == 0 .or. b == 0) cycle
        contact%friction_fraction_behind(b) = contact%friction_fraction_behind(a)
        if (contact%has_separate_sides(m%pair(3, i))) then
          contact%friction_fraction(b) = contact%friction_fraction_behind(a)
        else
          contact%friction_fraction(b) = contact%friction_fraction(a)
          contact%values(:n_values, b) = wall_signs(scene, m%pair(3, i), n_values) &
                                         *contact%values(:n_values, a)
        end if
      end do
    end associate
  end subroutine restore_fractions

  !> Record the impulse that held nodes and mirrors take from the tool.
  subroutine record_wall_impulse(scene, nodes, boundary, contact, budget, g)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(boundary_t), intent(in) :: boundary
    type(tool_contact_t), intent(in) :: contact
    type(budget_t), intent(inout) :: budget
    real(rp), intent(in) :: g(8, nodes%patch%nn)
    real(rp) :: impulse(3), sign(n_values)
    integer :: a, c, e, i, place

    associate (t => contact, m => boundary%mirrors)
      do i = 1, boundary%n_fixed
        e = t%entry_of(boundary%fixed(1, i))
        if (e == 0 .or. boundary%fixed(3, i) == 0) cycle
        c = boundary%fixed(2, i)
        place = scene%clamp(c)%clamp%place
        impulse = t%values(v_normal:v_normal + 2, e) + t%friction_fraction(e) &
          *t%values(v_stick:v_stick + 2, e)
        do a = 1, 3
          if (.not. scene%clamp(c)%clamp%held(a)) cycle
          budget%impulse(a, place) = budget%impulse(a, place) - impulse(a)
          associate (record => g(:, t%node(e)))
            budget%sums(e_wall) = budget%sums(e_wall) - impulse(a)*(record(a) - 0.5_rp &
                                                                    *record(4 + a))
          end associate
        end do
      end do
      if (.not. t%reaches_mirrors) return
      do i = 1, m%n_pairs
        e = t%entry_of(m%pair(1, i))
        if (e == 0) cycle
        sign = wall_signs(scene, m%pair(3, i), n_values) - 1.0_rp
        call add_local(m%pair(3, i), e, sign)
      end do
      do i = 1, m%n_planes
        e = t%entry_of(m%plane(1, i))
        if (e == 0) cycle
        sign = 0.5_rp*(wall_signs(scene, m%plane(2, i), n_values) - 1.0_rp)
        call add_local(m%plane(2, i), e, sign)
      end do
    end associate
  contains
    !> Add the impulse of this rank's particles at an entry, times `sign`.
    subroutine add_local(plane, e, sign)
      integer, intent(in) :: plane, e
      real(rp), intent(in) :: sign(n_values)

      associate (t => contact, impulse => budget%impulse(:, scene%symmetry(plane)%place))
        impulse = impulse + sign(v_normal:v_normal + 2) &
          *(t%local_values(v_normal:v_normal + 2, e) + t%friction_fraction(e) &
            *t%local_values(v_stick:v_stick + 2, e))
      end associate
    end subroutine add_local
  end subroutine record_wall_impulse

end module contact_tool_walls
