! SPDX-License-Identifier: MIT
!> Keys of &WALL, &LOAD, &TRACTION and &CONTACT; those of clamps are in conditions_list.
module groups_boundary
  use conditions_list, only: add_clamp_keys
  use keys_table, only: key_table_t
  implicit none (type, external)
  private

  public :: add_boundary

contains

  !> Add the rows of these groups to the table.
  subroutine add_boundary(t)
    type(key_table_t), intent(inout) :: t

    call t%group('WALL', 'repeat', 'A flat rigid wall.')
    call t%key('SIDE', 'choice', 1, '', 'required', 'xmin xmax ymin ymax zmin zmax', &
      'side of the grid on which it stands')
    call t%key('KIND', 'choice', 1, '', 'sliding', 'fixed sliding', &
      'holds everything, or only the normal')
    call t%key('POSITION', 'real', 1, 'm', '', '', &
      'coordinate of the wall; not given: at the side of the grid')
    call t%key('TEMPERATURE', 'real', 1, 'K', '', '(0,inf)', &
      'temperature of the wall; not given: it lets no heat through')

    call add_clamp_keys(t)

    call t%group('LOAD', 'repeat', &
      'A force on a body, shared by its particles in proportion to mass.')
    call t%key('BODY', 'text', 1, '', 'required', '&BODY', 'NAME of the &BODY')
    call t%key('FORCE', 'real', 3, 'N', 'required', '', 'total force')
    call t%key('RAMP', 'real', 1, 's', '0', '[0,inf)', &
      'time in which the force rises linearly from 0')

    call t%group('TRACTION', 'repeat', 'A force per area on the surface of a body.')
    call t%key('BODY', 'text', 1, '', 'required', '&BODY', 'NAME of the &BODY')
    call t%key('FACE', 'choice', 1, '', 'all', 'xmin xmax ymin ymax zmin zmax all', &
      'faces of the body by the direction they look to')
    call t%key('LOWER', 'real', 3, 'm', '', '', &
      'only faces whose particles start above this corner; not given: no limit')
    call t%key('UPPER', 'real', 3, 'm', '', '', &
      'only faces whose particles start below this corner; not given: no limit')
    call t%key('PRESSURE', 'real', 1, 'Pa', '0', '', 'normal to the face, positive inwards')
    call t%key('VECTOR', 'real', 3, 'Pa', '0 0 0', '', 'force per initial area')
    call t%key('RAMP', 'real', 1, 's', '0', '[0,inf)', &
      'time in which the traction rises linearly from 0')

    call t%group('CONTACT', 'repeat', &
      'Contact of two bodies; bodies without it that meet stick together.')
    call t%key('BODY', 'text', 1, '', 'required', '&BODY', 'NAME of one &BODY')
    call t%key('OTHER', 'text', 1, '', 'required', '&BODY', 'NAME of the other &BODY')
    call t%key('LAW', 'choice', 1, '', 'coulomb', 'coulomb stick frictionless', &
      'what happens along the surface')
    call t%key('FRICTION', 'real', 1, '', '0.2 if LAW = coulomb', '[0,inf)', &
      'Coulomb coefficient of friction')
    call t%key('NORMAL', 'choice', 1, '', 'regression', 'gradient regression', &
      'direction of the surface: from gradients of volume, or from a plane between the '// &
      'particles; that of either body instead where it separates them better')
    call t%key('CONDUCTANCE', 'real', 1, 'W/(m2 K)', '', '[0,inf)', &
      'heat through the area of contact for each kelvin between the bodies; not given: they '// &
      'conduct perfectly')
    call t%key('CONDUCTANCE_TABLE', 'real', -64, '', '', '[0,inf)', &
      'instead of CONDUCTANCE, pairs of pressure [Pa] and conductance [W/(m2 K)]; linear '// &
      'between, constant outside')

    call t%may_change('LOAD', 'FORCE')
    call t%may_change('TRACTION', 'PRESSURE VECTOR')
  end subroutine add_boundary

end module groups_boundary
