! SPDX-License-Identifier: MIT
!> Filling of bodies with particles on a lattice; each rank fills planes of every body. Initial
!> elastic state of bodies from &BODY DEFORMATION.
module setup_filling
  use base_kinds, only: i8, nlane, rp
  use base_text, only: str
  use base_world, only: world_t
  use grid_geometry, only: grid_t
  use input_values, only: input_t
  use particles_store, only: f_bbar, f_jac, f_mass, f_pos, f_tau, f_temp, f_vel, make_tag, &
                             max_volume_ratio, particles_t
  use physics_stress, only: compute_elastic_stress
  use setup_lattice, only: lattice_of, lattice_t
  use setup_solids, only: is_inside, read_body_solids, solid_t
  use state_probes, only: probes_t
  use state_scene, only: body_t, load_t, scene_t, start_t
  implicit none (type, external)
  private

  public :: check_stretch, count_particles, fill_bodies, load_bodies, stretch_bodies, &
            update_probe_temperatures

contains

  !> Report an invalid deformation gradient of body `i`.
  subroutine check_stretch(input, i)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp) :: f(3, 3), jac, measures(4)

    f = deformation(input, i)
    jac = determinant(f)
    measures = [jac, sum(f**2, 2)*max(jac, 1.0_rp/max_volume_ratio)**(-2.0_rp/3.0_rp)]
    if (.not. jac > 0.0_rp) then
      call input%report('BODY', i, 'DEFORMATION', 'must have a determinant above 0')
    else if (.not. all(measures >= 1.0_rp/max_volume_ratio .and. measures <= max_volume_ratio)) then
      call input%report('BODY', i, 'DEFORMATION', 'is implausible: its determinant, and '// &
                        'the squares of stretches at this volume, must be from '// &
                        str(1.0_rp/max_volume_ratio)//' to '//str(max_volume_ratio))
    end if
  end subroutine check_stretch

  !> Set the initial elastic state and stress of bodies with a deformation.
  subroutine stretch_bodies(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    real(rp) :: f(3, 3), c(3, 3), b(nlane, 6), j(nlane), tau(nlane, 6), temp(nlane)
    integer :: i

    do i = 1, size(scene%body)
      if (.not. input%given('BODY', i, 'DEFORMATION')) cycle
      associate (start => scene%body(i)%start)
        f = deformation(input, i)
        start%jac = determinant(f)
        c = matmul(f, transpose(f))*start%jac**(-2.0_rp/3.0_rp)
        start%bbar = [c(1, 1), c(2, 2), c(3, 3), c(1, 2), c(2, 3), c(1, 3)]
        b = spread(start%bbar, 1, nlane)
        j = start%jac
        temp = input%real('BODY', i, 'TEMPERATURE')
        call compute_elastic_stress(scene%material(scene%body(i)%material), 1, temp, b, j, tau, &
                                    start%wave2)
        start%tau = tau(1, :)
      end associate
    end do
  end subroutine stretch_bodies

  !> Deformation gradient of body `i`.
  function deformation(input, i) result(f)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp) :: f(3, 3)

    f = transpose(reshape(input%reals('BODY', i, 'DEFORMATION', 9), [3, 3]))
  end function deformation

  !> Determinant of a tensor.
  pure real(rp) function determinant(f)
    real(rp), intent(in) :: f(3, 3)

    determinant = f(1, 1)*(f(2, 2)*f(3, 3) - f(2, 3)*f(3, 2)) &
                  - f(1, 2)*(f(2, 1)*f(3, 3) - f(2, 3)*f(3, 1)) &
                  + f(1, 3)*(f(2, 1)*f(3, 2) - f(2, 2)*f(3, 1))
  end function determinant

  !> Make the particles of this rank, on lattice planes assigned to the ranks in turn.
  subroutine fill_bodies(world, input, scene, particles)
    type(world_t), intent(in) :: world
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(inout) :: particles
    type(solid_t), allocatable :: solids(:)
    type(lattice_t) :: lattice
    integer(i8) :: offset
    integer :: body, i, first, last

    call particles%init(scene%layout%n)
    offset = 0
    do body = 1, size(scene%body)
      call read_body_solids(input, body, solids)
      lattice = lattice_of(scene, scene%body(body), solids)
      first = int(int(lattice%n(1), i8)*world%rank/world%size)
      last = int(int(lattice%n(1), i8)*(world%rank + 1)/world%size) - 1
      do i = first, last
        call fill_plane(input, scene, body, solids, lattice, i, offset, particles)
      end do
      offset = offset + product(int(lattice%n, i8))
    end do
    call particles%fit()
  end subroutine fill_bodies

  !> Make the particles of plane `i` of a lattice.
  subroutine fill_plane(input, scene, body, solids, lattice, i, offset, particles)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: body, i
    type(solid_t), intent(in) :: solids(:)
    type(lattice_t), intent(in) :: lattice
    integer(i8), intent(in) :: offset
    type(particles_t), intent(inout) :: particles
    real(rp) :: x(3), velocity(3), gradient(3, 3), centre(3), w(3), temperature, mass
    integer(i8) :: id
    integer :: faces, j, k

    velocity = input%reals('BODY', body, 'VELOCITY', 3)
    w = input%reals('BODY', body, 'ANGULAR_VELOCITY', 3)
    gradient = transpose(reshape(input%reals('BODY', body, 'VELOCITY_GRADIENT', 9), [3, 3])) &
               + reshape([0.0_rp, w(3), -w(2), -w(3), 0.0_rp, w(1), w(2), -w(1), 0.0_rp], [3, 3])
    centre = input%reals('BODY', body, 'CENTRE', 3)
    temperature = input%real('BODY', body, 'TEMPERATURE')
    mass = particle_mass(scene, scene%body(body))
    do j = 0, lattice%on_ring(i) - 1
      do k = 0, lattice%n(3) - 1
        x = lattice%point(i, j, k)
        if (.not. is_inside(solids, x)) cycle
        faces = 0
        if (lattice%is_straight()) faces = open_faces(scene%grid, solids, lattice, [i, j, k])
        id = offset + 1 + k + lattice%n(3)*(j + int(lattice%n(2), i8)*i)
        call add_particle(particles, body, scene%body(body)%start, x, &
                          velocity + matmul(gradient, x - centre), temperature, &
                          mass*lattice%share(i, j, k), make_tag(id, faces))
        call add_extras(scene, body, gradient, lattice%edges(i, j, k), particles)
      end do
    end do
  end subroutine fill_plane

  !> Mass of one particle of a body [kg].
  pure real(rp) function particle_mass(scene, body)
    type(scene_t), intent(in) :: scene
    type(body_t), intent(in) :: body

    particle_mass = scene%material(body%material)%rho*product(body%spacing)/body%start%jac
  end function particle_mass

  !> Bits of the directions (-x, +x, -y, +y, -z, +z) in which the next lattice point is outside the
  !> body, with periodic images.
  pure integer function open_faces(grid, solids, lattice, ijk)
    type(grid_t), intent(in) :: grid
    type(solid_t), intent(in) :: solids(:)
    type(lattice_t), intent(in) :: lattice
    integer, intent(in) :: ijk(3)
    real(rp) :: x(3), y(3), length
    integer :: axis, next(3), side

    open_faces = 0
    x = lattice%point(ijk(1), ijk(2), ijk(3))
    do axis = 1, 3
      do side = 0, 1
        y = x
        y(axis) = x(axis) + lattice%spacing(axis)*(2*side - 1)
        if (lattice%grading(axis)%is_graded) then
          next = ijk
          next(axis) = ijk(axis) + 2*side - 1
          y = lattice%point(next(1), next(2), next(3))
        end if
        length = grid%h(axis)*grid%period(axis)
        if (length > 0.0_rp) y(axis) = grid%lower(axis) + modulo(y(axis) - grid%lower(axis), length)
        if (.not. is_inside(solids, y)) open_faces = ibset(open_faces, 2*(axis - 1) + side)
      end do
    end do
  end function open_faces

  !> Append a particle; a new block begins when the body changes or the last is full.
  subroutine add_particle(particles, body, start, x, v, temperature, mass, tag)
    type(particles_t), intent(inout) :: particles
    integer, intent(in) :: body
    type(start_t), intent(in) :: start
    real(rp), intent(in) :: x(3), v(3), temperature, mass
    integer(i8), intent(in) :: tag
    integer :: b, p
    logical :: fits

    b = particles%nblk
    fits = .false.
    if (b > 0) fits = particles%body(b) == body .and. particles%count(b) < nlane
    if (.not. fits) then
      call particles%reserve(b + 1)
      b = b + 1
      particles%nblk = b
      particles%count(b) = 0
      particles%body(b) = body
      particles%ps(:, :, b) = 0.0_rp
    end if
    p = particles%count(b) + 1
    particles%count(b) = p
    particles%ps(p, f_pos:f_pos + 2, b) = x
    particles%ps(p, f_vel:f_vel + 2, b) = v
    particles%ps(p, f_bbar:f_bbar + 5, b) = start%bbar
    particles%ps(p, f_jac, b) = start%jac
    particles%ps(p, f_tau:f_tau + 5, b) = start%tau
    particles%ps(p, f_temp, b) = temperature
    particles%ps(p, f_mass, b) = mass
    particles%tag(p, b) = tag
  end subroutine add_particle

  !> Set the fields that only some methods need, for the particle added last.
  subroutine add_extras(scene, body, gradient, edges, particles)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: body
    real(rp), intent(in) :: gradient(3, 3)   !! gradient of the velocity [1/s]
    real(rp), intent(in) :: edges(3)         !! edges of the particle [m]
    type(particles_t), intent(inout) :: particles
    real(rp), allocatable :: state(:)

    associate (ps => particles%ps(particles%count(particles%nblk), :, particles%nblk), &
               half => scene%layout%half, affine => scene%layout%affine, &
               cover => scene%layout%surface_offset, origin => scene%layout%origin, &
               law => scene%layout%law, &
               material => scene%material(scene%body(body)%material))
      if (half > 0) ps(half:half + 2) = scene%domain(body)
      if (scene%layout%edges > 0) ps(scene%layout%edges:scene%layout%edges + 2) = edges
      if (affine > 0) ps(affine:affine + 8) = reshape(transpose(gradient), [9])
      if (cover > 0) ps(cover) = 1.0_rp
      if (origin > 0) ps(origin:origin + 2) = ps(f_pos:f_pos + 2)
      if (allocated(material%flow)) then
        allocate (state(material%flow%n_state))
        call material%flow%start(state)
        ps(law:law + size(state) - 1) = state
      end if
    end associate
  end subroutine add_extras

  !> Collective. Count the particles of each body, of all ranks, without making them.
  subroutine count_particles(world, input, scene, counts, shares)
    type(world_t), intent(in) :: world
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    integer(i8), intent(out) :: counts(:)
    real(rp), intent(out) :: shares(:)       !! volume of each body over that of a particle
    type(solid_t), allocatable :: solids(:)
    type(lattice_t) :: lattice
    integer :: body, i, j, k

    counts = 0
    shares = 0.0_rp
    do body = 1, size(scene%body)
      call read_body_solids(input, body, solids)
      lattice = lattice_of(scene, scene%body(body), solids)
      do i = world%rank, lattice%n(1) - 1, world%size
        do j = 0, lattice%on_ring(i) - 1
          do k = 0, lattice%n(3) - 1
            if (is_inside(solids, lattice%point(i, j, k))) then
              counts(body) = counts(body) + 1
              shares(body) = shares(body) + lattice%share(i, j, k)
            end if
          end do
        end do
      end do
    end do
    call world%sum(counts)
    call world%sum(shares)
  end subroutine count_particles

  !> Distribute the forces of &LOAD groups over the masses of their bodies.
  subroutine load_bodies(input, shares, scene)
    type(input_t), intent(in) :: input
    !> Volume of each body over that of a particle, from `count_particles`.
    real(rp), intent(in) :: shares(:)
    type(scene_t), intent(inout) :: scene
    real(rp) :: mass
    type(load_t) :: load
    integer :: b, i

    do b = 1, size(scene%body)
      associate (body => scene%body(b))
        mass = shares(b)*particle_mass(scene, body)
        allocate (body%load(0))
        do i = 1, input%count('LOAD')
          if (body%name /= input%text('LOAD', i, 'BODY')) cycle
          load%acceleration = input%reals('LOAD', i, 'FORCE', 3)/mass
          load%ramp = input%real('LOAD', i, 'RAMP')
          body%load = [body%load, load]
        end do
      end associate
    end do
  end subroutine load_bodies

  !> Set the initial temperature of probes to that of their bodies.
  subroutine update_probe_temperatures(input, scene, probes)
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(probes_t), intent(inout) :: probes
    type(solid_t), allocatable :: solids(:)
    integer :: b, i

    do b = input%count('BODY'), 1, -1
      call read_body_solids(input, b, solids)
      do i = 1, probes%n
        if (.not. is_inside(solids, probes%x(:, i))) cycle
        probes%temperature(i) = input%real('BODY', b, 'TEMPERATURE')
        probes%group(i) = scene%body(b)%group
      end do
    end do
  end subroutine update_probe_temperatures

end module setup_filling
