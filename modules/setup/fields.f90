! SPDX-License-Identifier: MIT
!> Known fields of bodies and noise from the input.
module setup_fields
  use base_kinds, only: pi, rp
  use input_key_table, only: find
  use input_values, only: input_t
  use particles_store, only: f_pos, f_vel, particles_t
  use physics_field, only: field_t
  use physics_field_heat_mode, only: heat_mode_t
  use physics_field_ring, only: ring_t
  use physics_field_vortex, only: vortex_t
  use physics_field_waves, only: waves_t
  use physics_material, only: material_t
  use physics_noise, only: noise_t
  use setup_lattice, only: lattice_corner
  use setup_solids, only: read_body_solids, solid_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: read_fields, add_noise

contains

  !> Read the fields of the &FIELD groups; reserve particle storage for initial positions.
  subroutine read_fields(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    class(field_t), allocatable :: field
    integer :: body, i

    if (size(scene%material) == 0) return          ! reported before
    do i = 1, input%count('FIELD')
      body = find(scene%body%name, input%text('FIELD', i, 'BODY'))
      if (body == 0) cycle
      call make_field(input, i, body, scene, field)
      if (.not. allocated(field)) cycle            ! noise: see `add_noise`
      if (allocated(scene%body(body)%field)) then
        call input%report('FIELD', i, 'BODY', 'this body has another known field')
      end if
      if (field%has_motion) call check_motion(input, i, body, scene, field%has_force)
      call move_alloc(field, scene%body(body)%field)
      call scene%layout%add(3, 'initial position', scene%layout%origin, 'm')
    end do
  end subroutine read_fields

  !> Make the field of group `i`; none for noise or an unknown KIND.
  subroutine make_field(input, i, body, scene, field)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i, body
    type(scene_t), intent(in) :: scene
    class(field_t), allocatable, intent(out) :: field

    associate (material => scene%material(scene%body(body)%material))
      ! A new kind is one line here.
      select case (input%text('FIELD', i, 'KIND'))
      case ('waves')
        allocate (field, source=waves(input, i, material, .true.))
      case ('mode')
        allocate (field, source=waves(input, i, material, .false.))
      case ('vortex')
        allocate (field, source=vortex(input, i, material))
      case ('ring')
        allocate (field, source=ring(input, i, material))
      case ('heat-mode')
        allocate (field, source=heat_mode(input, i, input%real('BODY', body, 'TEMPERATURE'), &
                  material, scene%method%conducts))
      case default
      end select
    end associate
  end subroutine make_field

  !> Check the conditions under which a known motion is exact.
  subroutine check_motion(input, i, body, scene, is_forced)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i, body
    type(scene_t), intent(in) :: scene
    logical, intent(in) :: is_forced
    character(17), parameter :: own(4) = [character(17) :: 'VELOCITY', 'ANGULAR_VELOCITY', &
                                          'VELOCITY_GRADIENT', 'DEFORMATION']
    integer :: k, m

    m = scene%body(body)%material
    if (is_forced) then
      if (input%text('MATERIAL', m, 'ENERGY') /= 'coupled') then
        call input%report('FIELD', i, 'KIND', 'its body force is that of a material with '// &
                          "ENERGY = 'coupled'")
      end if
    end if
    if (input%text('MATERIAL', m, 'LAW') /= 'elastic') then
      call input%report('FIELD', i, 'KIND', 'needs an elastic material')
    end if
    if (abs(scene%material(m)%expansion) > 0.0_rp) then
      call input%report('FIELD', i, 'KIND', 'needs a material without EXPANSION')
    end if
    if (scene%method%mass_scaling > 1.0_rp) then
      call input%report('FIELD', i, 'KIND', 'is wrong with MASS_SCALING')
    end if
    do k = 1, size(own)
      if (input%given('BODY', body, trim(own(k)))) then
        call input%report('BODY', body, trim(own(k)), 'the body has its motion from a &FIELD')
      end if
    end do
  end subroutine check_motion

  !> Axes named by AXES.
  function axes_of(input, i) result(takes_part)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    logical :: takes_part(3)
    integer :: a

    takes_part = [(index(input%text('FIELD', i, 'AXES'), 'xyz'(a:a)) > 0, a=1, 3)]
  end function axes_of

  !> Angular frequency [rad/s] from FREQUENCY, or `natural` if FREQUENCY is 0.
  real(rp) function rate_of(input, i, natural)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: natural

    rate_of = 2.0_rp*pi*input%real('FIELD', i, 'FREQUENCY')
    if (rate_of <= 0.0_rp) rate_of = natural
  end function rate_of

  !> Waves with body force, or a standing elastic wave without one.
  type(waves_t) function waves(input, i, material, is_forced)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(material_t), intent(in) :: material
    logical, intent(in) :: is_forced
    integer :: a

    waves%has_motion = .true.
    waves%has_force = is_forced
    waves%amplitude = merge(input%real('FIELD', i, 'AMPLITUDE'), 0.0_rp, axes_of(input, i))
    waves%number = 2.0_rp*pi/max(input%reals('FIELD', i, 'WAVELENGTH', 3), tiny(1.0_rp))
    waves%shift = input%reals('FIELD', i, 'SHIFT', 3)
    waves%phase = input%reals('FIELD', i, 'PHASE', 3)
    waves%mu = material%g/material%rho
    waves%lambda = (material%k - 2.0_rp/3.0_rp*material%g)/material%rho
    do a = 1, 3
      waves%rate(a) = rate_of(input, i, merge(0.0_rp, waves%number(a)*material%wave_speed(), &
                                              is_forced))
    end do
    if (any(abs(waves%amplitude)*waves%number >= 1.0_rp)) then
      call input%report('FIELD', i, 'AMPLITUDE', 'must be below WAVELENGTH/(2 pi), or the body '// &
                        'is turned inside out')
    end if
    if (is_forced) call require_frequency(input, i)
  end function waves

  !> Report a missing FREQUENCY.
  subroutine require_frequency(input, i)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i

    if (input%real('FIELD', i, 'FREQUENCY') <= 0.0_rp) then
      call input%report('FIELD', i, 'FREQUENCY', 'must be > 0 for this KIND')
    end if
  end subroutine require_frequency

  !> Generalised vortex.
  type(vortex_t) function vortex(input, i, material)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(material_t), intent(in) :: material
    real(rp) :: centre(3)

    vortex%has_motion = .true.
    vortex%has_force = .true.
    centre = input%reals('FIELD', i, 'CENTRE', 3)
    vortex%centre = centre(1:2)
    vortex%radii = radii_of(input, i)
    vortex%amplitude = input%real('FIELD', i, 'AMPLITUDE')
    vortex%rate = rate_of(input, i, 0.0_rp)
    vortex%mu = material%g/material%rho
    call require_frequency(input, i)
  end function vortex

  !> Expanding ring.
  type(ring_t) function ring(input, i, material)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(material_t), intent(in) :: material
    real(rp) :: centre(3), radii(2)

    ring%has_motion = .true.
    ring%has_force = .true.
    centre = input%reals('FIELD', i, 'CENTRE', 3)
    ring%centre = centre(1:2)
    radii = radii_of(input, i)
    ring%amplitude = input%real('FIELD', i, 'AMPLITUDE')
    ring%rate = rate_of(input, i, pi*material%wave_speed()/max(sum(radii), tiny(1.0_rp)))
    ring%mu = material%g/material%rho
    if (abs(material%k - 2.0_rp/3.0_rp*material%g) > 1.0e-9_rp*material%g) then
      call input%report('FIELD', i, 'KIND', 'needs a material with POISSON_RATIO = 0')
    end if
    if (abs(radii(2) - 3.0_rp*radii(1)) <= 1.0e-6_rp*radii(2)) then
      call input%report('FIELD', i, 'RADII', 'the outer one must not be thrice the inner one')
    else
      call ring%set_radii(radii)
    end if
  end function ring

  !> Inner and outer radius [m].
  function radii_of(input, i) result(radii)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp) :: radii(2)

    radii = input%reals('FIELD', i, 'RADII', 2)
    if (radii(2) <= radii(1)) call input%report('FIELD', i, 'RADII', 'the outer one must be '// &
      'above the inner one')
  end function radii_of

  !> Decaying mode of conduction.
  type(heat_mode_t) function heat_mode(input, i, mean, material, conducts)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: mean
    type(material_t), intent(in) :: material
    logical, intent(in) :: conducts

    heat_mode%has_temperature = .true.
    heat_mode%mean = mean
    heat_mode%amplitude = input%real('FIELD', i, 'AMPLITUDE')
    heat_mode%takes_part = axes_of(input, i)
    heat_mode%number = 2.0_rp*pi/max(input%reals('FIELD', i, 'WAVELENGTH', 3), tiny(1.0_rp))
    heat_mode%shift = input%reals('FIELD', i, 'SHIFT', 3)
    if (.not. conducts) return
    heat_mode%diffusivity = material%conductivity/(material%rho*material%c_p)
    if (allocated(material%c_table) .or. allocated(material%k_table)) then
      call input%report('FIELD', i, 'KIND', 'needs a material without tables over temperature: '// &
                        'the solution is known for constant properties')
    end if
  end function heat_mode

  !> Add random or alternating velocities to particles at their initial positions.
  subroutine add_noise(input, scene, particles)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    type(noise_t) :: noise
    type(solid_t), allocatable :: solids(:)
    character(:), allocatable :: kind
    integer :: b, body, i, p

    do i = 1, input%count('FIELD')
      kind = input%text('FIELD', i, 'KIND')
      noise%alternates = kind == 'alternating'
      if (.not. noise%alternates .and. kind /= 'noise') cycle
      body = find(scene%body%name, input%text('FIELD', i, 'BODY'))
      noise%amplitude = input%real('FIELD', i, 'AMPLITUDE')
      noise%takes_part = axes_of(input, i)
      noise%seed = input%integer('FIELD', i, 'SEED')
      call read_body_solids(input, body, solids)
      noise%corner = lattice_corner(scene, scene%body(body), solids)
      noise%spacing = scene%body(body)%spacing
      do b = 1, particles%nblk
        if (particles%body(b) /= body) cycle
        associate (ps => particles%ps(:, :, b))
          do p = 1, particles%count(b)
            ps(p, f_vel:f_vel + 2) = ps(p, f_vel:f_vel + 2) + noise%velocity(ps(p, f_pos:f_pos + 2))
          end do
        end associate
      end do
    end do
  end subroutine add_noise

end module setup_fields
