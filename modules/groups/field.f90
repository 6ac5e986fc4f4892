! SPDX-License-Identifier: MIT
!> Keys of &FIELD.
module groups_field
  use keys_table, only: key_table_t
  implicit none (type, external)
  private

  public :: add_fields

contains

  !> Add the rows of &FIELD to the table.
  subroutine add_fields(t)
    type(key_table_t), intent(inout) :: t

    call t%group('FIELD', 'repeat', &
      'A known motion or temperature of a body: its start, body force, and errors in '// &
      'NAME_errors.csv; or noise in its velocities. Shapes and masses are those of the '// &
      'undeformed body, X a place in it.')
    call t%key('BODY', 'text', 1, '', 'required', '&BODY', 'NAME of the &BODY')
    call t%key('KIND', 'choice', 1, '', 'required', &
      'waves vortex ring mode noise alternating heat-mode', &
      'waves: u_i = A sin(2 pi X_i/L_i + P_i) sin(w t + Q_i) with body force; mode: without; '// &
      'vortex, ring: plane, with force; noise, alternating: initial velocities; heat-mode: '// &
      'TEMPERATURE + A times sines of X_i, decaying')
    call t%key('AMPLITUDE', 'real', 1, '', 'required', '', &
      'A: displacement [m], angle [rad] (vortex), velocity [m/s] (noise, alternating) or '// &
      'temperature [K]')
    call t%key('WAVELENGTH', 'real', 3, 'm', '1 1 1 if KIND = waves or mode or heat-mode', &
      '(0,inf)', 'L of each axis')
    call t%key('AXES', 'text', 1, '', &
      'x if KIND = waves or mode or heat-mode or noise or alternating', 'xyz', &
      'axes that take part; components of the velocity with noise')
    call t%key('SHIFT', 'real', 3, 'rad', '0 0 0 if KIND = waves or mode or heat-mode', '', &
      'P of each axis')
    call t%key('FREQUENCY', 'real', 1, '1/s', '0 if KIND = waves or mode or vortex or ring', &
      '[0,inf)', &
      'w/(2 pi); mode, ring: 0: from the material, w = 2 pi c/L_i or pi c/(sum of RADII), c '// &
      'the speed of pressure waves')
    call t%key('PHASE', 'real', 3, 'rad', '0 0 0 if KIND = waves or mode', '', 'Q of each axis')
    call t%key('CENTRE', 'real', 3, 'm', '0 0 0 if KIND = vortex or ring', '', &
      'a point of the axis of vortex and ring')
    call t%key('RADII', 'real', 2, 'm', '1 2 if KIND = vortex or ring', '(0,inf)', &
      'inner and outer radius of vortex and ring')
    call t%key('SEED', 'integer', 1, '', '1 if KIND = noise', '', 'of the noise')
  end subroutine add_fields

end module groups_field
