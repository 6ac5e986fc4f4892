! SPDX-License-Identifier: MIT
!> Walls and clamps in contact with tools: what the listed nodes behind walls hold is folded onto
!> those in front (as time_mirrors does with records), and held directions do not give way.
module time_touch_walls
  use base_kinds, only: rp
  use time_audit, only: e_wall
  use time_state, only: simulation_t
  use time_touching, only: n_values, v_hold, v_push
  implicit none (type, external)
  private

  public :: note_held, fold_entries, unfold_entries, book_walls

contains

  !> Directions in which a wall or clamp holds the listed nodes.
  subroutine note_held(sim)
    type(simulation_t), intent(inout) :: sim
    integer :: e, i

    associate (touching => sim%touching, rules => sim%scene%constraint, m => sim%mirrors)
      touching%meets_mirrors = any(touching%place(m%pair(1, :m%n_pairs)) > 0) &
                               .or. any(touching%place(m%plane(1, :m%n_planes)) > 0)
      do i = 1, sim%n_fixed
        e = touching%place(sim%fixed(1, i))
        if (e == 0) cycle
        where (rules(sim%fixed(2, i))%component) touching%free(:, e) = 0.0_rp
      end do
      if (.not. touching%meets_mirrors) return
      do i = 1, m%n_planes
        e = touching%place(m%plane(1, i))
        if (e == 0) cycle
        where (rules(m%plane(2, i))%component) touching%free(:, e) = 0.0_rp
      end do
    end associate
  end subroutine note_held

  !> Odd components at wall `c` of the values of an entry: -1, others 1.
  pure function parity(sim, c, width) result(sign)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: c, width
    real(rp) :: sign(width), v(3)

    sign = 1.0_rp
    if (width < n_values) return
    v = merge(-1.0_rp, 1.0_rp, sim%scene%constraint(c)%component)
    sign(v_push:v_push + 2) = v
    sign(v_hold:v_hold + 2) = v
  end function parity

  !> Fold the entries of nodes behind walls onto those in front, as `fold` does with records.
  subroutine fold_entries(sim, width, values)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: width
    real(rp), intent(inout) :: values(width, sim%touching%n_nodes)
    real(rp) :: sign(width)
    integer :: a, b, i

    if (.not. sim%touching%meets_mirrors) return
    associate (m => sim%mirrors, place => sim%touching%place)
      do i = 1, m%n_pairs
        b = place(m%pair(1, i))
        a = place(m%pair(2, i))
        if (a == 0 .or. b == 0) cycle
        sign = parity(sim, m%pair(3, i), width)
        values(:, a) = values(:, a) + sign*values(:, b)
        values(:, b) = 0.0_rp
      end do
      do i = 1, m%n_planes
        a = place(m%plane(1, i))
        if (a == 0) cycle
        values(:, a) = 0.5_rp*(1.0_rp + parity(sim, m%plane(2, i), width))*values(:, a)
      end do
    end associate
  end subroutine fold_entries

  !> Give the entries of nodes behind walls what those in front have (even values).
  subroutine unfold_entries(sim, width, values)
    type(simulation_t), intent(in) :: sim
    integer, intent(in) :: width
    real(rp), intent(inout) :: values(width, sim%touching%n_nodes)
    integer :: a, b, i

    if (.not. sim%touching%meets_mirrors) return
    associate (m => sim%mirrors, place => sim%touching%place)
      do i = m%n_pairs, 1, -1
        b = place(m%pair(1, i))
        a = place(m%pair(2, i))
        if (a > 0 .and. b > 0) values(:, b) = values(:, a)
      end do
    end associate
  end subroutine unfold_entries

  !> Impulse that held nodes and mirrors take from the tool.
  subroutine book_walls(sim, g)
    type(simulation_t), intent(inout) :: sim
    real(rp), intent(in) :: g(8, sim%patch%nn)
    real(rp) :: impulse(3), sign(n_values)
    integer :: a, c, e, i

    associate (t => sim%touching, m => sim%mirrors)
      do i = 1, sim%n_fixed
        e = t%place(sim%fixed(1, i))
        if (e == 0 .or. sim%fixed(3, i) == 0) cycle
        c = sim%fixed(2, i)
        impulse = t%values(v_push:v_push + 2, e) + t%part(e)*t%values(v_hold:v_hold + 2, e)
        do a = 1, 3
          if (.not. sim%scene%constraint(c)%component(a)) cycle
          sim%impulse(a, c) = sim%impulse(a, c) - impulse(a)
          associate (record => g(:, t%node(e)))
            sim%sums(e_wall) = sim%sums(e_wall) - impulse(a)*(record(a) - 0.5_rp*record(4 + a))
          end associate
        end do
      end do
      if (.not. t%meets_mirrors) return
      do i = 1, m%n_pairs
        e = t%place(m%pair(1, i))
        if (e == 0) cycle
        sign = parity(sim, m%pair(3, i), n_values) - 1.0_rp
        call add_own(m%pair(3, i), e, sign)
      end do
      do i = 1, m%n_planes
        e = t%place(m%plane(1, i))
        if (e == 0) cycle
        sign = 0.5_rp*(parity(sim, m%plane(2, i), n_values) - 1.0_rp)
        call add_own(m%plane(2, i), e, sign)
      end do
    end associate
  contains
    subroutine add_own(wall, e, sign)
      integer, intent(in) :: wall, e
      real(rp), intent(in) :: sign(n_values)

      associate (t => sim%touching)
        sim%impulse(:, wall) = sim%impulse(:, wall) + sign(v_push:v_push + 2) &
          *(t%own(v_push:v_push + 2, e) + t%part(e)*t%own(v_hold:v_hold + 2, e))
      end associate
    end subroutine add_own
  end subroutine book_walls

end module time_touch_walls
