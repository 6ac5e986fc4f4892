! SPDX-License-Identifier: MIT
!> Sheets that have too few layers of particles to resist bending.
!>
!> Where a sheet deflects by w(x), a nodal velocity along it that is zero at all particles and has
!> the gradient -w' there relieves all shear, without energy. Particles do not move with it, but USL
!> strains them with it, so that a sheet under a lasting load sinks without end. One layer has such
!> velocities, and two layers that share two of four nodes or none; three layers keep more than half
!> of the stiffness in shear (docs/method.md, time integration).
module setup_check_sheets
  use base_kinds, only: rp
  use input_values, only: input_t
  use setup_boundary, only: wall_of
  use setup_lattice, only: lattice_of, lattice_t
  use setup_solids, only: extent_of, read_all_solids, solids_t
  use state_conditions, only: wall_t
  use state_scene, only: scene_t, scheme_usl
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: check_sheets

contains

  !> Report sheets and beams that a load would bend without end.
  subroutine check_sheets(input, scene, tool)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    type(solids_t), allocatable :: solids(:)
    real(rp) :: lower(3), upper(3)
    character(1), parameter :: axes(3) = ['x', 'y', 'z']
    integer :: a, b

    if (scene%method%scheme /= scheme_usl .and. size(tool) == 0) return
    call read_all_solids(input, solids)
    do b = 1, size(solids)
      if (scene%body(b)%is_rigid() .or. scene%body(b)%is_round) cycle
      call extent_of(solids(b)%solid, lower, upper)
      do a = 1, 3
        if (scene%grid%period(a) > 0 .or. scene%grid%grading(a)%is_graded) cycle
        if (.not. is_mechanism(scene, b, a, solids)) cycle
        if (.not. is_loaded(input, scene, tool, a, 0.5_rp*(lower + upper))) cycle
        if (is_supported(input, scene, tool, b, a, solids)) cycle
        call input%report('BODY', b, 'PARTICLES_PER_CELL', 'the body has too few layers of '// &
                          'particles along '//axes(a)//' to resist bending, and would sink '// &
                          'under a lasting load: give it three or more, with smaller cells or '// &
                          'PARTICLES_PER_CELL, or a &WALL at its face')
      end do
    end do
  end subroutine check_sheets

  !> True if axis `a` has a load on metal, or a tool beside the middle `x` of a body, and a wall or
  !> clamp that holds metal against it.
  logical function is_loaded(input, scene, tool, a, x)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    integer, intent(in) :: a
    real(rp), intent(in) :: x(3)                  !! [m]
    real(rp) :: force(3), gap, normal(3)
    logical :: is_held
    integer :: i
    type(wall_t) :: wall

    is_held = .false.
    do i = 1, input%count('WALL')
      wall = wall_of(input, scene%grid, i)
      is_held = is_held .or. wall%held(a)
    end do
    do i = 1, size(scene%clamp)
      is_held = is_held .or. scene%clamp(i)%clamp%held(a)
    end do
    is_loaded = abs(scene%method%gravity(a)) > 0.0_rp .or. input%count('TRACTION') > 0
    do i = 1, input%count('LOAD')
      force = input%reals('LOAD', i, 'FORCE', 3)
      is_loaded = is_loaded .or. abs(force(a)) > 0.0_rp
    end do
    do i = 1, size(tool)
      call tool(i)%distance(x, gap, normal)
      is_loaded = is_loaded .or. abs(normal(a)) > 0.5_rp
    end do
    is_loaded = is_loaded .and. is_held
  end function is_loaded

  !> True if nodal velocities exist that vanish at all layers of a body across axis `a` and have the
  !> same gradient at them.
  logical function is_mechanism(scene, b, a, solids)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: b, a
    type(solids_t), intent(in) :: solids(:)
    real(rp), parameter :: slack = 1.0e-6_rp      !! of positions [cells]
    type(lattice_t) :: lattice
    real(rp) :: first, last, lower(3), reach, upper(3)

    call extent_of(solids(b)%solid, lower, upper)
    lattice = lattice_of(scene, scene%body(b), solids(b)%solid)
    associate (h => scene%grid%h(a), step => lattice%spacing(a), origin => lattice%origin(a))
      first = origin + step*ceiling((lower(a) - origin)/step - slack)
      last = origin + step*floor((upper(a) - origin)/step + slack)
      reach = 1.0_rp + merge(0.5_rp, 0.5_rp*step/h, scene%method%is_bspline) - slack
      is_mechanism = last < first + 0.5_rp*step
      if (last > first + 1.5_rp*step) return
      associate (bottom => scene%grid%lower(a))
        is_mechanism = is_mechanism .or. floor((last - bottom)/h + reach) &
          - ceiling((first - bottom)/h - reach) >= 3
      end associate
    end associate
  end function is_mechanism

  !> True if a wall, a clamp over its whole area, a tool at rest or another body lies at a face of a
  !> body across axis `a`.
  logical function is_supported(input, scene, tool, b, a, solids)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    integer, intent(in) :: b, a
    type(solids_t), intent(in) :: solids(:)
    real(rp), dimension(3) :: high, low, lower, reach, upper
    type(wall_t) :: wall
    integer :: i

    is_supported = .false.
    call extent_of(solids(b)%solid, lower, upper)
    reach = 0.5_rp*scene%grid%h
    do i = 1, input%count('WALL')
      wall = wall_of(input, scene%grid, i)
      if (wall%axis == a) is_supported = is_supported .or. &
        min(abs(wall%position - lower(a)), abs(wall%position - upper(a))) <= reach(a)
    end do
    do i = 1, size(scene%clamp)
      associate (clamp => scene%clamp(i)%clamp)
        is_supported = is_supported .or. clamp%held(a) .and. &
          all(clamp%lower - lower <= reach .or. [1, 2, 3] == a) .and. &
          all(upper - clamp%upper <= reach .or. [1, 2, 3] == a)
      end associate
    end do
    do i = 1, size(tool)
      is_supported = is_supported .or. is_anvil(tool(i), a, lower, upper, reach(a))
    end do
    do i = 1, size(solids)
      if (i == b) cycle
      call extent_of(solids(i)%solid, low, high)
      is_supported = is_supported .or. all(max(lower - high, low - upper) &
                                           <= merge(reach, -1.0e-6_rp*reach, [1, 2, 3] == a))
    end do
  end function is_supported

  !> True if a tool at rest touches the four corners of a face across axis `a` of the box between
  !> `lower` and `upper`.
  logical function is_anvil(tool, a, lower, upper, reach)
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: a
    real(rp), intent(in) :: lower(3), upper(3), reach   !! [m]
    real(rp) :: corner(3), gap, normal(3)
    logical :: is_touched(2)
    integer :: i, k

    is_touched = .true.
    do k = 0, 7
      corner = merge(upper, lower, btest(k, [0, 1, 2]))
      call tool%distance(corner, gap, normal)
      i = merge(2, 1, btest(k, a - 1))
      is_touched(i) = is_touched(i) .and. abs(gap) <= reach
    end do
    is_anvil = any(is_touched)
    associate (phase => tool%motion%phase)
      do i = 1, size(phase)
        is_anvil = is_anvil .and. .not. (allocated(phase(i)%path%time) &
                                         .or. phase(i)%is_force_controlled &
                                         .or. any(abs(phase(i)%velocity) > 0.0_rp) &
                                         .or. abs(phase(i)%spin) > 0.0_rp)
      end do
    end associate
  end function is_anvil

end module setup_check_sheets
