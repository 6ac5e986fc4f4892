! SPDX-License-Identifier: MIT
!> Read the tools and their motion schedules.
module setup_tools
  use base_kinds, only: pi, rp
  use input_key_table, only: find, known
  use input_tables, only: check_rising
  use input_values, only: input_t
  use physics_material, only: material_t
  use setup_motions, only: read_motion
  use state_scene, only: body_t
  use tools_law, only: friction_law_t, friction_laws, friction_table_t, law_coulomb, &
                       law_schmidt_hattel, of_nothing
  use tools_shapes, only: read_shape
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: read_tools

contains

  !> Read all &TOOL groups with their &MOTION phases, followed by the rigid bodies; move them to
  !> their positions at t = 0.
  subroutine read_tools(input, body, material, tool)
    type(input_t), intent(in) :: input
    type(body_t), intent(inout) :: body(:)
    type(material_t), intent(in) :: material(:)
    type(tool_t), allocatable, intent(out) :: tool(:)
    integer :: i, n_rigid

    n_rigid = 0
    do i = 1, size(body)
      if (input%logical('BODY', i, 'RIGID')) n_rigid = n_rigid + 1
    end do
    allocate (tool(input%count('TOOL') + n_rigid))
    do i = 1, input%count('TOOL')
      tool(i)%name = input%text('TOOL', i, 'NAME')
      tool(i)%start = input%reals('TOOL', i, 'POSITION', 3)
      tool(i)%friction_coefficient = input%real('TOOL', i, 'FRICTION')
      call read_friction_law(input, i, body, material, tool(i)%friction_law)
      call read_friction_table(input, i, tool(i))
      call read_shape(input, i, tool(i)%shape, tool(i)%frame)
      call read_motion(input, tool(i)%name, tool(i)%motion)
      call read_watch(input, i, tool(i))
      call read_drive(input, i, body, material, tool(i))
      call tool(i)%move_to(0.0_rp)
    end do
    call read_rigid_bodies(input, body, tool)
    do i = 1, input%count('MOTION')
      if (find(tool%name, input%text('MOTION', i, 'TOOL')) == 0) then
        call input%report('MOTION', i, 'TOOL', 'there is no &TOOL of this name; '//known(tool%name))
      end if
    end do
  end subroutine read_tools

  !> Add a tool for each rigid body, which turns about its CENTRE.
  subroutine read_rigid_bodies(input, body, tool)
    type(input_t), intent(in) :: input
    type(body_t), intent(inout) :: body(:)
    type(tool_t), intent(inout) :: tool(:)
    character(24), parameter :: unused(4) = [character(24) :: 'VELOCITY', 'ANGULAR_VELOCITY', &
                                             'VELOCITY_GRADIENT', 'DEFORMATION']
    character(8), parameter :: forces(2) = [character(8) :: 'LOAD', 'TRACTION']
    integer :: a, b, i, k

    k = input%count('TOOL')
    do b = 1, size(body)
      if (.not. input%logical('BODY', b, 'RIGID')) cycle
      k = k + 1
      body(b)%tool = k
      tool(k)%name = body(b)%name
      tool(k)%start = input%reals('BODY', b, 'CENTRE', 3)
      do a = 1, 3
        tool(k)%frame(a, a) = 1.0_rp
      end do
      call read_motion(input, tool(k)%name, tool(k)%motion)
      if (any(tool(k)%motion%phase%is_force_controlled)) then
        call input%report('BODY', b, 'RIGID', 'only a &TOOL can have a &MOTION with FORCE')
      end if
      if (any(tool(k)%motion%phase%path%leads_tilt)) call input%report('BODY', b, 'RIGID', &
        'only a &TOOL can have a &MOTION with TILT_FOLLOWS')
      if (any(tool(k)%motion%phase%ends_early())) call input%report('BODY', b, 'RIGID', &
        'only a &TOOL can have a &MOTION with UNTIL_FORCE, UNTIL_TORQUE or UNTIL_TEMPERATURE')
      call tool(k)%move_to(0.0_rp)
      do i = 1, size(unused)
        if (input%given('BODY', b, trim(unused(i)))) call input%report('BODY', b, trim(unused(i)), &
          'a rigid body moves as &MOTION says')
      end do
      do a = 1, size(forces)
        do i = 1, input%count(trim(forces(a)))
          if (input%text(trim(forces(a)), i, 'BODY') /= body(b)%name) cycle
          call input%report(trim(forces(a)), i, 'BODY', 'a rigid body moves as &MOTION says')
        end do
      end do
      if (find(tool(:input%count('TOOL'))%name, trim(tool(k)%name)) > 0) then
        call input%report('BODY', b, 'NAME', 'a tool has this name')
      end if
    end do
  end subroutine read_rigid_bodies

  !> Read the friction law of the `i`-th tool.
  subroutine read_friction_law(input, i, body, material, law)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(body_t), intent(in) :: body(:)
    type(material_t), intent(in) :: material(:)
    type(friction_law_t), intent(out) :: law
    integer :: b

    law%kind = find(friction_laws, input%text('TOOL', i, 'FRICTION_LAW'))
    law%shear_limit = input%logical('TOOL', i, 'SHEAR_LIMIT')
    if (law%kind == law_coulomb) return
    law%coefficient = input%real('TOOL', i, coefficient_key(law))
    do b = 1, size(body)
      if (body(b)%material == 0 .or. body(b)%is_rigid()) cycle
      if (allocated(material(body(b)%material)%flow)) cycle
      call input%report('TOOL', i, 'FRICTION_LAW', "needs the strength of the metal, and '"// &
                        trim(body(b)%name)//"' is elastic: give its material a LAW")
      return
    end do
  end subroutine read_friction_law

  !> Input key of the coefficient of a friction law.
  pure function coefficient_key(law) result(key)
    type(friction_law_t), intent(in) :: law
    character(:), allocatable :: key

    key = 'SHEAR_FACTOR'
    if (law%kind == law_schmidt_hattel) key = 'STICK_FRACTION'
  end function coefficient_key

  !> Read the axial drive of the `i`-th tool. Its default damping is critical for the contact
  !> stiffness of the metal under a flat face (2 E R/(1 - nu^2), Boussinesq) plus that of the
  !> machine.
  subroutine read_drive(input, i, body, material, tool)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(body_t), intent(in) :: body(:)
    type(material_t), intent(in) :: material(:)
    type(tool_t), intent(inout) :: tool
    character(*), parameter :: only_free = 'is for a tool with a STIFFNESS or with a FORCE in '// &
                                           '&MOTION'
    real(rp), allocatable :: way(:, :)
    real(rp) :: along, face_stiffness, radius, density
    integer :: b

    tool%drive%stiffness = input%real('TOOL', i, 'STIFFNESS')
    tool%drive%is_free = tool%drive%stiffness > 0.0_rp &
      .or. any(tool%motion%phase%is_force_controlled)
    if (.not. tool%drive%is_free) then
      if (input%given('TOOL', i, 'MASS')) call input%report('TOOL', i, 'MASS', only_free)
      if (input%given('TOOL', i, 'DAMPING')) call input%report('TOOL', i, 'DAMPING', only_free)
    else if (.not. input%logical('METHOD', 1, 'MECHANICS')) then
      call input%report('TOOL', i, 'NAME', 'STIFFNESS and FORCE need METHOD MECHANICS = T')
    end if
    do b = 1, size(tool%motion%phase)
      associate (phase => tool%motion%phase(b))
        way = reshape(phase%velocity, [3, 1])
        if (allocated(phase%path%time)) way = phase%path%place
        if (.not. phase%is_force_controlled .or. all(abs(matmul(tool%frame(:, 3), way)) &
                                         <= 0.5_rp*norm2(way, 1))) cycle
        along = dot_product(tool%drive%axis, phase%velocity)
        if (along >= 0.0_rp) call input%report('TOOL', i, 'NAME', &
          'in a &MOTION with a FORCE it must not have a VELOCITY out of the metal along its '// &
          'axis, nor a path')
        phase%feed = -along
        phase%velocity = 0.0_rp
      end associate
    end do
    radius = tool%stirring_radius()
    density = 0.0_rp
    face_stiffness = 0.0_rp
    do b = 1, size(body)
      if (body(b)%material == 0 .or. body(b)%is_rigid()) cycle
      associate (m => material(body(b)%material))
        density = max(density, m%rho)
        face_stiffness = max(face_stiffness, 4.0_rp*radius*m%g*(3.0_rp*m%k + m%g) &
                             /(3.0_rp*m%k + 4.0_rp*m%g))
      end associate
    end do
    tool%drive%mass = input%real('TOOL', i, 'MASS', otherwise=density*radius**3*pi**2/4.0_rp)
    if (tool%drive%is_free .and. tool%drive%mass <= 0.0_rp) then
      call input%report('TOOL', i, 'MASS', 'must be given: this tool has no RADIUS from which '// &
                        'it would follow')
    end if
    tool%drive%damping = input%real('TOOL', i, 'DAMPING', otherwise=2.0_rp*sqrt( &
                         (face_stiffness + tool%drive%stiffness)*tool%drive%mass))
    if (tool%drive%is_free .and. tool%drive%damping <= 0.0_rp .and. tool%drive%mass > 0.0_rp &
        .and. .not. input%given('TOOL', i, 'DAMPING')) then
      call input%report('TOOL', i, 'DAMPING', 'must be given: this tool has no RADIUS from '// &
                        'which it would follow')
    end if
  end subroutine read_drive

  !> Read the table of a friction coefficient that depends on temperature, pressure or slip.
  subroutine read_friction_table(input, i, tool)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(tool_t), intent(inout) :: tool
    type(friction_table_t) :: table
    character(:), allocatable :: key

    table%of = find(['none       ', 'temperature', 'pressure   ', 'slip       '], &
                    input%text('TOOL', i, 'FRICTION_TABLE_OF')) - 1
    if (table%of == of_nothing) then
      if (tool%friction_law%kind == law_coulomb) return
      key = coefficient_key(tool%friction_law)
      if (.not. input%given('TOOL', i, key)) call input%report('TOOL', i, 'FRICTION_LAW', &
        'needs '//key//' or a table of it')
      return
    end if
    table%at = input%list('TOOL', i, 'FRICTION_AT')
    table%coefficient = input%list('TOOL', i, 'FRICTION_MU')
    if (size(table%at) == 0 .or. size(table%at) /= size(table%coefficient)) then
      call input%report('TOOL', i, 'FRICTION_AT', 'needs as many values as FRICTION_MU, at '// &
                        'least one')
    else
      call check_rising(input, 'TOOL', i, 'FRICTION_AT', table%at)
    end if
    if (tool%friction_law%kind /= law_coulomb .and. any(table%coefficient > 1.0_rp)) then
      call input%report('TOOL', i, 'FRICTION_MU', 'are '//coefficient_key(tool%friction_law)// &
                        ' of this law: up to 1')
    end if
    tool%friction_table = table
  end subroutine read_friction_table

  !> Read the load limits of the `i`-th tool.
  subroutine read_watch(input, i, tool)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(tool_t), intent(inout) :: tool

    tool%n_phases = size(tool%motion%phase)
    associate (monitor => tool%monitor)
      monitor%max_force = input%real('TOOL', i, 'MAX_FORCE', otherwise=huge(1.0_rp))
      monitor%max_torque = input%real('TOOL', i, 'MAX_TORQUE', otherwise=huge(1.0_rp))
      monitor%at_limit = find(['end      ', 'stop-feed', 'stop     '], &
                            input%text('TOOL', i, 'AT_LIMIT'))
      monitor%is_on = min(monitor%max_force, monitor%max_torque) < huge(1.0_rp)
      if (input%given('TOOL', i, 'AT_LIMIT') .and. .not. monitor%is_on) call input%report('TOOL', &
        i, 'AT_LIMIT', 'has no effect without MAX_FORCE or MAX_TORQUE')
      if (monitor%is_on .and. tool%n_phases == 0) call input%report('TOOL', i, 'NAME', &
        'has limits, but no &MOTION that they could stop')
      monitor%is_on = monitor%is_on .or. any(tool%motion%phase%ends_early())
      if (monitor%is_on .and. .not. input%logical('METHOD', 1, 'MECHANICS')) then
        call input%report('TOOL', i, 'NAME', 'limits and UNTIL_... need METHOD MECHANICS = T')
      end if
    end associate
    tool%drive%axis = tool%frame(:, 3)
    if (input%text('TOOL', i, 'KIND') == 'plane') tool%drive%axis = -tool%drive%axis
    if (any(tool%motion%phase%path%leads_tilt)) tool%drive%axis = [0.0_rp, 0.0_rp, 1.0_rp]
  end subroutine read_watch

end module setup_tools
