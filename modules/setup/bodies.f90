! SPDX-License-Identifier: MIT
!> Read the bodies and the heat-transfer films on their faces; check the shapes.
module setup_bodies
  use base_kinds, only: rp
  use base_text, only: str
  use input_key_table, only: find
  use input_tables, only: check_rising
  use input_values, only: input_t
  use setup_filling, only: check_stretch
  use setup_solids, only: bounds, read_body_solids, read_solid, solid_cylinder, solid_sphere, &
                          solid_t
  use state_scene, only: film_t, of_nothing, of_pressure, scene_t
  implicit none (type, external)
  private

  public :: check_shapes, face_names, is_face, read_bodies, read_surfaces

  character(4), parameter :: face_names(6) = ['xmin', 'xmax', 'ymin', 'ymax', 'zmin', 'zmax']

contains

  !> Read all &BODY groups.
  subroutine read_bodies(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    integer :: i, per_cell(3)

    allocate (scene%body(input%count('BODY')))
    do i = 1, size(scene%body)
      associate (b => scene%body(i))
        b%name = input%text('BODY', i, 'NAME')
        per_cell = input%integers('BODY', i, 'PARTICLES_PER_CELL', 3)
        where (per_cell == 0) per_cell = max(1, per_cell(1))
        b%spacing = scene%grid%h/per_cell
        b%widest = scene%grid%longest_edges()/per_cell
        b%own_lattice = input%text('BODY', i, 'LATTICE') /= 'grid'
        b%is_round = input%text('BODY', i, 'LATTICE') == 'round'
        if (b%is_round) then
          call check_round(input, i, b%spacing)
          b%widest = b%spacing
        end if
        b%material = find(scene%material%name, input%text('BODY', i, 'MATERIAL'))
        b%material = max(1, b%material)            ! an unknown name was reported before
        call check_stretch(input, i)
      end associate
    end do
  end subroutine read_bodies

  !> Check a body with LATTICE = round, whose particles lie in rings or shells: its first shape must
  !> be a cylinder or a sphere, and it has no plane faces for surface conditions. Equalize the
  !> spacing across the axis (cylinder) or in all directions (sphere).
  subroutine check_round(input, body, spacing)
    type(input_t), intent(in) :: input
    integer, intent(in) :: body
    real(rp), intent(inout) :: spacing(3)      !! particle spacing [m]
    type(solid_t), allocatable :: solids(:)
    logical :: is_across(3)
    character(8), parameter :: groups(3) = ['LOAD    ', 'SURFACE ', 'TRACTION']
    integer :: g, i

    call read_body_solids(input, body, solids)
    if (size(solids) > 0) then
      if (all(solids(1)%kind /= [solid_cylinder, solid_sphere])) then
        call input%report('BODY', body, 'LATTICE', 'round: the first &SHAPE of the body must '// &
                          'be a cylinder or a sphere')
      end if
      is_across = solids(1)%kind == solid_sphere .or. [1, 2, 3] /= solids(1)%axis
      where (is_across) spacing = minval(spacing, is_across)
    end if
    do g = 1, size(groups)
      do i = 1, input%count(trim(groups(g)))
        if (input%text(trim(groups(g)), i, 'BODY') == input%text('BODY', body, 'NAME')) then
          call input%report(trim(groups(g)), i, 'BODY', 'a body with LATTICE = round cannot '// &
                            'have a &'//trim(groups(g)))
        end if
      end do
    end do
  end subroutine check_round

  !> Read the films of the &SURFACE groups on the faces of the bodies.
  subroutine read_surfaces(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    character(:), allocatable :: wanted
    type(film_t) :: film
    integer :: body, face, i

    do i = 1, input%count('SURFACE')
      if (.not. scene%method%conducts) call input%report('SURFACE', i, '', 'has no effect '// &
        'without a &HEAT group')
      body = find(scene%body%name, input%text('SURFACE', i, 'BODY'))
      if (body == 0) cycle
      wanted = input%text('SURFACE', i, 'FACE')
      film = film_of(input, i, scene, body)
      do face = 1, 6
        if (.not. is_face(wanted, face)) cycle
        scene%body(body)%film(face) = film
      end do
    end do
  end subroutine read_surfaces

  !> True if the value of FACE names face 1 to 6 (xmin, xmax, ...).
  pure logical function is_face(wanted, face)
    character(*), intent(in) :: wanted
    integer, intent(in) :: face

    is_face = wanted == 'all' .or. wanted == face_names(face) .or. &
              (wanted == 'sides' .and. face <= 4)
  end function is_face

  !> Heat-transfer film of the `i`-th &SURFACE. A film with BACKING = 'body' has the
  !> resistance of a millionth of a particle spacing, as the metal goes on behind it.
  type(film_t) function film_of(input, i, scene, body) result(film)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: body

    film%ambient = input%real('SURFACE', i, 'AMBIENT', otherwise=input%real('HEAT', 1, 'AMBIENT'))
    film%emissivity = input%real('SURFACE', i, 'EMISSIVITY')
    film%has_backing = input%text('SURFACE', i, 'BACKING') /= 'none'
    film%of = find(['none    ', 'pressure'], input%text('SURFACE', i, 'TABLE_OF')) - 1
    if (film%of == of_nothing) then
      if (input%text('SURFACE', i, 'BACKING') == 'body') then
        associate (metal => scene%material(scene%body(body)%material))
          film%coefficient = 1.0e6_rp/minval(scene%body(body)%spacing) &
                             *metal%conductivity_at(input%real('BODY', body, 'TEMPERATURE'))
        end associate
      else if (.not. input%given('SURFACE', i, 'COEFFICIENT')) then
        call input%report('SURFACE', i, 'COEFFICIENT', 'is missing')
      end if
      film%coefficient = input%real('SURFACE', i, 'COEFFICIENT', otherwise=film%coefficient)
      film%factor = input%real('SURFACE', i, 'PRESSURE_FACTOR')
      film%exponent = input%real('SURFACE', i, 'PRESSURE_EXPONENT')
      if (film%factor > 0.0_rp) film%of = of_pressure
    else
      film%at = input%list('SURFACE', i, 'TABLE_AT')
      film%there = input%list('SURFACE', i, 'TABLE_COEFFICIENT')
      if (size(film%at) == 0 .or. size(film%at) /= size(film%there)) then
        call input%report('SURFACE', i, 'TABLE_AT', 'needs as many values as '// &
                          'TABLE_COEFFICIENT, at least one')
      else
        call check_rising(input, 'SURFACE', i, 'TABLE_AT', film%at)
      end if
    end if
    if (film%of == of_pressure .and. .not. scene%method%has_mechanics) then
      call input%report('SURFACE', i, '', 'a coefficient by pressure needs mechanics: with '// &
                        'MECHANICS = F no pressure is known')
    end if
  end function film_of

  !> Check that shapes lie inside the grid, and that bodies have a shape.
  subroutine check_shapes(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(solid_t) :: solid
    real(rp) :: lower(3), upper(3), top(3), slack
    logical :: has_shape(size(scene%body))
    integer :: body, i

    has_shape = .false.
    top = scene%grid%upper()
    slack = 1.0e-9_rp*minval(scene%grid%h)
    do i = 1, input%count('SHAPE')
      call read_solid(input, i, solid)
      body = find(scene%body%name, input%text('SHAPE', i, 'BODY'))
      if (body == 0 .or. .not. solid%adds) cycle
      has_shape(body) = .true.
      call bounds(solid, lower, upper)
      if (scene%grid%n(1) == 0) cycle
      if (any(lower < scene%grid%lower - slack) .or. any(upper > top + slack)) then
        call input%report('SHAPE', i, '', 'reaches outside the grid: '//excess_of(lower, upper, &
                          scene%grid%lower, top, slack))
      end if
    end do
    do body = 1, size(scene%body)
      if (.not. has_shape(body)) call input%report('BODY', body, 'NAME', 'no &SHAPE adds '// &
        'material to this body')
    end do
  end subroutine check_shapes

  !> Text on where a box exceeds another on each axis, as 'y to 0.05 m (grid to 0.046 m)'.
  function excess_of(lower, upper, bottom, top, slack) result(text)
    real(rp), intent(in) :: lower(3), upper(3)   !! corners of the inner box [m]
    real(rp), intent(in) :: bottom(3), top(3)    !! corners of the outer box [m]
    real(rp), intent(in) :: slack                !! tolerance [m]
    character(:), allocatable :: text
    character(1), parameter :: axes(3) = ['x', 'y', 'z']
    integer :: k

    text = ''
    do k = 1, 3
      if (lower(k) < bottom(k) - slack) then
        text = text//', '//axes(k)//' from '//str(lower(k))//' m (grid from '//str(bottom(k))//' m)'
      end if
      if (upper(k) > top(k) + slack) then
        text = text//', '//axes(k)//' to '//str(upper(k))//' m (grid to '//str(top(k))//' m)'
      end if
    end do
    text = text(3:)
  end function excess_of

end module setup_bodies
