! SPDX-License-Identifier: MIT
!> Keys of &BODY and &SHAPE.
module groups_body
  use keys_table, only: key_table_t
  implicit none (type, external)
  private

  public :: add_body

contains

  !> Add the rows of &BODY and &SHAPE to the table.
  subroutine add_body(t)
    type(key_table_t), intent(inout) :: t

    call t%group('BODY', 'repeat required', 'A deformable body; &SHAPE groups give its geometry.')
    call t%key('NAME', 'text', 1, '', 'required', 'name', 'name of the body')
    call t%key('MATERIAL', 'text', 1, '', 'required', '&MATERIAL', 'NAME of its &MATERIAL')
    call t%key('PARTICLES_PER_CELL', 'integer', -3, '', '2', '[1,8]', &
      'particles per cell and direction: one number, or one for each axis')
    call t%key('LATTICE', 'choice', 1, '', 'body', 'body grid round', &
      'anchor of the lattice of particles: lower corner or centre of the first shape, or lower '// &
      'corner of the grid; round: rings or shells that follow the first shape, a cylinder or '// &
      'sphere')
    call t%key('TEMPERATURE', 'real', 1, 'K', '298', '(0,inf)', 'initial temperature')
    call t%key('VELOCITY', 'real', 3, 'm/s', '0 0 0', '', 'initial velocity')
    call t%key('ANGULAR_VELOCITY', 'real', 3, 'rad/s', '0 0 0', '', &
      'initial rotation, added to VELOCITY')
    call t%key('VELOCITY_GRADIENT', 'real', 9, '1/s', '0 0 0 0 0 0 0 0 0', '', &
      'initial dv/dx row by row, added to VELOCITY: xx xy xz yx yy yz zx zy zz')
    call t%key('CENTRE', 'real', 3, 'm', '0 0 0', '', &
      'the point that moves with VELOCITY when there is rotation or a gradient; RIGID: on its axis')
    call t%key('DEFORMATION', 'real', 9, '', '1 0 0 0 1 0 0 0 1', '', &
      'initial elastic deformation gradient row by row; the shapes are the deformed ones')
    call t%key('RIGID', 'logical', 1, '', '.false.', '', &
      'the particles move as a rigid body, by &MOTION groups whose TOOL is this NAME')

    call t%group('SHAPE', 'repeat required', &
      'A piece of a body, added or cut away; the pieces of a body act in the order of the file.')
    call t%key('BODY', 'text', 1, '', 'required', '&BODY', 'NAME of the &BODY')
    call t%key('KIND', 'choice', 1, '', 'box', 'box cylinder sphere trapezoid', 'geometry')
    call t%key('OPERATION', 'choice', 1, '', 'add', 'add subtract', 'add material or cut it away')
    call t%key('LOWER', 'real', 3, 'm', 'required if KIND = box or trapezoid', '', 'lower corner')
    call t%key('UPPER', 'real', 3, 'm', 'required if KIND = box or trapezoid', '', 'upper corner')
    call t%key('CENTRE', 'real', 3, 'm', 'required if KIND = cylinder or sphere', '', &
      'centre of the sphere, middle of the cylinder')
    call t%key('RADIUS', 'real', 1, 'm', 'required if KIND = cylinder or sphere', '(0,inf)', &
      'radius')
    call t%key('LENGTH', 'real', 1, 'm', 'required if KIND = cylinder', '(0,inf)', &
      'length of the cylinder')
    call t%key('AXIS', 'choice', 1, '', 'z if KIND = cylinder', 'x y z', &
      'direction of the cylinder')
    call t%key('ALONG', 'choice', 1, '', 'x if KIND = trapezoid', 'x y z', &
      'trapezoid: direction in which the width changes')
    call t%key('ACROSS', 'choice', 1, '', 'y if KIND = trapezoid', 'x y z', &
      'trapezoid: direction of the width, centred between LOWER and UPPER')
    call t%key('WIDTH_LOWER', 'real', 1, 'm', 'required if KIND = trapezoid', '[0,inf)', &
      'width at the LOWER end of ALONG')
    call t%key('WIDTH_UPPER', 'real', 1, 'm', 'required if KIND = trapezoid', '[0,inf)', &
      'width at the UPPER end of ALONG')
  end subroutine add_body

end module groups_body
