! SPDX-License-Identifier: MIT
!> Particles in blocks of `nlane` (array of structures of arrays): `ps(lane, field, block)`.
!> All particles of a block belong to one body; unused lanes of a block are neutral (no mass).
module particles_store
  use base_kinds, only: i8, nlane, rp
  use base_system, only: allocate_aligned, free_aligned, register_prefetch, resize_aligned
  implicit none (type, external)
  private

  public :: field_t, particles_t, layout_t, make_tag, tag_id, tag_faces, tag_rest, rests, &
            set_rest, set_bit

  ! Fields of a particle; vectors take three, symmetric tensors six (xx, yy, zz, xy, yz, xz). Fields
  ! read by conduction are contiguous, and so are those read by the transfer to the grid.
  integer, parameter, public :: &
    f_pos = 1, &                                       !! position [m]
    f_mass = 4, &                                      !! mass, not scaled [kg]
    f_temp = 5, &                                      !! temperature [K]
    f_heat = 6, &                                      !! heat for the next conduction step [J]
    f_jac = 7, &                                       !! volume ratio J [-]
    f_vel = 8, &                                       !! velocity [m/s]
    f_tau = 11, &                                      !! Kirchhoff stress [Pa]
    f_bbar = 17, &                                     !! isochoric elastic strain tensor b [-]
    f_plastic = 23, &                                  !! equivalent plastic strain [-]
    f_rate = 24, &                                     !! equivalent plastic strain rate [1/s]
    f_flow = 25                                        !! flow stress [Pa]
  integer, parameter, public :: n_conduction = f_jac   !! fields read by conduction
  integer, parameter, public :: n_to_grid = f_tau + 5  !! fields read by the transfer to the grid
  integer, parameter, public :: n_fields = 25  !! fields without internal variables of a flow law

  !> Bound of volume ratios, squared elastic stretches and their inverse.
  real(rp), parameter, public :: max_volume_ratio = 1.0e6_rp

  !> A field of the particles: its place, its name in messages and in the layout of a checkpoint.
  !> Frames show the scalars and vectors that have a unit, with '_' for blanks in the name.
  type :: field_t
    integer :: first
    character(30) :: name
    character(8) :: unit = ''
    integer :: n = 1                         !! numbers, if it has a unit
  end type field_t

  type(field_t), parameter :: common(*) = [ &
    field_t(f_pos, 'position'), field_t(f_mass, 'mass'), field_t(f_temp, 'temperature', 'K'), &
    field_t(f_heat, 'waiting heat'), field_t(f_jac, 'volume ratio'), field_t(f_vel, 'velocity'), &
    field_t(f_tau, 'stress'), field_t(f_bbar, 'elastic strain'), &
    field_t(f_plastic, 'plastic strain', '1'), field_t(f_rate, 'strain rate', '1/s'), &
    field_t(f_flow, 'flow stress', 'Pa')]

  !> Positions of the fields that only some methods and scenes need; 0: absent.
  type :: layout_t
    integer :: n = n_fields     !! number of fields of a particle
    integer :: half = 0         !! half lengths of the domain [cells], 3 (cpGIMP)
    integer :: edges = 0        !! initial edges [m], 3 (graded grids)
    integer :: affine = 0       !! affine velocity gradient [1/s], row by row, 9 (APIC)
    integer :: origin = 0       !! position at t = 0 [m], 3 (prescribed fields, tractions)
    integer :: law = 1          !! internal variables of the flow law, n_law
    integer :: n_law = 0
    integer :: rest = 0             !! temperature at falling asleep [K] (sleeping)
    !> Unused impulse of Coulomb friction [N s], or mean Coulomb force [N] (contact_tool_impulses).
    integer :: coulomb_reserve = 0
    integer :: tool_force = 0       !! sustained force of tools [N], 3 (contact_tool_impulses)
    integer :: void = 0             !! empty part of the room around a particle, < 0: packed (metal)
    integer :: porosity = 0         !! of metal around a particle, away from free surfaces
    integer :: surface_offset = 0   !! distance from centre to surface, in half spacings (tools)
    !> For each tool that absorbs heat, since the last conduction step: contact area times time [m2
    !> s] and heat of the face [J].
    integer :: tool_heat = 0
    type(field_t), allocatable, private :: more(:)   !! these fields, in the order of their places
  contains
    procedure :: add => add_fields, name_of, places, shown
  end type layout_t

  !> Rest states of a particle: awake; held: gives only mass and a frozen force; asleep: inactive
  !> (sleep_criteria).
  integer, parameter, public :: awake = 0, held = 1, asleep = 2

  integer, parameter :: face_shift = 48, rest_shift = 54
  ! Bits of the tag in the first lane of a block, set by the last sort.
  !> Block may reach nodes shared with other ranks (run_order).
  integer, parameter, public :: border_bit = 56
  !> No tool reaches the block before the next sort (step_schedule).
  integer, parameter, public :: far_bit = 57
  !> Bit of a tracer particle (particles_tracers).
  integer, parameter, public :: tracer_bit = 58

  type :: particles_t
    integer :: nf = n_fields                                !! fields per particle
    integer :: nblk = 0                                     !! blocks in use
    integer :: capacity = 0                                 !! blocks allocated
    real(rp), pointer, contiguous :: ps(:, :, :) => null()  !! (nlane, nf, capacity)
    real(rp), pointer, contiguous, private :: memory(:) => null()
    integer(i8), allocatable :: tag(:, :)          !! (nlane, capacity) identity and face bits
    !> Grid velocities of the particles, while needed for output [m/s], (nlane, 3, nblk).
    real(rp), allocatable :: motion(:, :, :)
    integer, allocatable :: count(:)               !! particles in each block
    integer, allocatable :: body(:)                !! body of each block
    ! Roles, order and bounds of the blocks:
    integer :: n_awake = -1                    !! the first blocks are awake; -1: not sorted yet
    integer :: n_mapped = 0  !! the first blocks, awake and held layer, contribute mass and force
    integer :: n_border = 0                    !! awake blocks that may reach shared nodes
    !> Order of the transfer to the grid, border blocks first, (n_awake).
    integer, allocatable :: turn(:)
    integer :: n_far = 0                       !! blocks that no tool reaches before the next sort
    !> Order of the transfer to the particles, far blocks first, (n_awake).
    integer, allocatable :: order(:)
    !> Distance of the nearest particle of a block from each tool, at the last sort [m], (tools,
    !> n_awake).
    real(rp), allocatable :: clearance(:, :)
    !> Centre and radius of the bounding ball at the last sort, for body contact and heat sources
    !> [m], (4, nblk).
    real(rp), allocatable :: ball(:, :)
    !> Largest rise of the temperature of a particle by its waiting heat [K].
    real(rp) :: warming = 0.0_rp
    integer(i8) :: n_awake_particle_steps = 0  !! awake particles summed over the steps of this run
  contains
    procedure :: init, free, reserve, fit, change_fields, fetch, remove, velocity, total, extent
    procedure :: bytes
  end type particles_t

contains

  !> Append an optional field of `n` numbers, the first of them at `place`, if it is absent. Frames
  !> show it if it has a unit.
  pure subroutine add_fields(self, n, name, place, unit)
    class(layout_t), intent(inout) :: self
    integer, intent(in) :: n
    character(*), intent(in) :: name
    integer, intent(inout) :: place
    character(*), intent(in), optional :: unit

    if (place > 0) return
    place = self%n + 1
    self%n = self%n + n
    if (.not. allocated(self%more)) allocate (self%more(0))
    self%more = [self%more, field_t(place, name, n=n)]
    if (present(unit)) self%more(size(self%more))%unit = unit
  end subroutine add_fields

  !> Fields that frames show.
  pure function shown(self) result(list)
    class(layout_t), intent(in) :: self
    type(field_t), allocatable :: list(:)

    list = pack(common, common%unit /= '')
    if (allocated(self%more)) list = [list, pack(self%more, self%more%unit /= '')]
  end function shown

  !> Name of field `f`.
  pure function name_of(self, f) result(name)
    class(layout_t), intent(in) :: self
    integer, intent(in) :: f
    character(:), allocatable :: name

    name = trim(common(count(common%first <= f))%name)
    if (f > n_fields) name = trim(self%more(count(self%more%first <= f))%name)
  end function name_of

  !> Text of names and positions of the fields, which a checkpoint must match. The last field, that
  !> of sleeping, may be added or removed by a restart.
  pure function places(self) result(text)
    class(layout_t), intent(in) :: self
    character(:), allocatable :: text
    character(12) :: place
    integer :: k, n

    n = self%n - merge(1, 0, self%rest > 0)
    text = ''
    if (allocated(self%more)) then
      do k = 1, size(self%more)
        if (self%more(k)%first > n) exit
        write (place, '(i0)') self%more(k)%first
        text = text//trim(place)//' '//trim(self%more(k)%name)//', '
      end do
    end if
    write (place, '(i0)') n
    text = text//trim(place)//' numbers'
  end function places

  !> Empty store for particles of `nf` fields.
  subroutine init(self, nf)
    class(particles_t), intent(inout) :: self
    integer, intent(in) :: nf

    call self%free()
    self%nf = nf
    call self%reserve(1)
  end subroutine init

  !> Free all memory.
  subroutine free(self)
    class(particles_t), intent(inout) :: self

    if (associated(self%memory)) call free_aligned(self%memory)
    nullify (self%ps)
    if (allocated(self%tag)) deallocate (self%tag, self%count, self%body)
    self%nblk = 0
    self%capacity = 0
  end subroutine free

  !> Allocate at least `nblk` blocks. Existing blocks keep their contents, including those behind
  !> `self%nblk`, where arrivals are stored before sorting.
  subroutine reserve(self, nblk)
    class(particles_t), intent(inout) :: self
    integer, intent(in) :: nblk

    if (nblk > self%capacity) call resize(self, nblk + nblk/32 + 4)
  end subroutine reserve

  !> Release memory beyond the blocks in use, except a few: sorting needs separate blocks for other
  !> bodies and rest states.
  subroutine fit(self)
    class(particles_t), intent(inout) :: self
    integer, parameter :: few = 4

    if (self%capacity > self%nblk + few) call resize(self, self%nblk + few)
  end subroutine fit

  !> Reallocate to `n` blocks.
  subroutine resize(self, n)
    class(particles_t), intent(inout) :: self
    integer, intent(in) :: n
    integer(i8), allocatable :: tag(:, :)
    integer, allocatable :: list(:)
    integer :: old

    old = min(self%capacity, n)
    if (associated(self%memory)) then
      call resize_aligned(int(nlane, i8)*self%nf*n, self%memory)
    else
      call allocate_aligned(int(nlane, i8)*self%nf*n, self%memory)
    end if
    self%ps(1:nlane, 1:self%nf, 1:n) => self%memory
    allocate (tag(nlane, n), source=0_i8)
    if (old > 0) tag(:, 1:old) = self%tag(:, 1:old)
    call move_alloc(tag, self%tag)
    allocate (list(n), source=0)
    if (old > 0) list(1:old) = self%count(1:old)
    call move_alloc(list, self%count)
    allocate (list(n), source=0)
    if (old > 0) list(1:old) = self%body(1:old)
    call move_alloc(list, self%body)
    self%capacity = n
  end subroutine resize

  !> Remove the chosen particles of block `b`; its last particles take their slots, and freed lanes
  !> are 0.
  pure subroutine remove(self, b, chosen)
    class(particles_t), intent(inout) :: self
    integer, intent(in) :: b
    logical, intent(in) :: chosen(nlane)
    integer :: last, p

    do p = self%count(b), 1, -1
      if (.not. chosen(p)) cycle
      last = self%count(b)
      self%ps(p, :, b) = self%ps(last, :, b)
      self%tag(p, b) = self%tag(last, b)
      self%ps(last, :, b) = 0.0_rp
      self%tag(last, b) = 0_i8
      self%count(b) = last - 1
    end do
  end subroutine remove

  !> Change the number of fields: the last ones are dropped, or new ones are 0.
  subroutine change_fields(self, nf)
    class(particles_t), intent(inout) :: self
    integer, intent(in) :: nf
    real(rp), pointer, contiguous :: memory(:), ps(:, :, :)
    integer :: n

    n = min(nf, self%nf)
    call allocate_aligned(int(nlane, i8)*nf*self%capacity, memory)
    ps(1:nlane, 1:nf, 1:self%capacity) => memory
    ps(:, :n, :self%nblk) = self%ps(:, :n, :self%nblk)
    call free_aligned(self%memory)
    self%memory => memory
    self%ps => ps
    self%nf = nf
  end subroutine change_fields

  !> Register the first `n` fields of block `b`, except the fields after `from` up to `to`, for
  !> prefetching during the transfers of the block before.
  subroutine fetch(self, b, n, from, to)
    class(particles_t), intent(in) :: self
    integer, intent(in) :: b, n
    integer, intent(in), optional :: from, to
    integer :: gap(2)

    gap = 0
    if (present(from) .and. present(to)) gap = [from, to]
    if (b <= self%nblk) call register_prefetch(self%ps(:, :, b), 8*nlane*n, 8*nlane*gap(1), &
                                               8*nlane*gap(2))
  end subroutine fetch

  !> Velocities of block `b` [m/s]: grid velocities where known, otherwise the particles' own.
  pure function velocity(self, b) result(v)
    class(particles_t), intent(in) :: self
    integer, intent(in) :: b
    real(rp) :: v(nlane, 3)

    if (allocated(self%motion)) then
      v = self%motion(:, :, b)
    else
      v = self%ps(:, f_vel:f_vel + 2, b)
    end if
  end function velocity

  !> Largest coordinates of the particles in blocks `low` to `high`, and largest negative ones [m].
  pure function extent(self, low, high)
    class(particles_t), intent(in) :: self
    integer, intent(in) :: low, high
    real(rp) :: extent(6), highest, lowest
    integer :: a, b, p

    extent = -huge(1.0_rp)
    do b = low, high
      do a = 1, 3
        highest = extent(a)
        lowest = extent(3 + a)
        !$omp simd reduction(max: highest, lowest)
        do p = 1, self%count(b)
          highest = max(highest, self%ps(p, f_pos + a - 1, b))
          lowest = max(lowest, -self%ps(p, f_pos + a - 1, b))
        end do
        extent(a) = highest
        extent(3 + a) = lowest
      end do
    end do
  end function extent

  !> Number of particles on this rank.
  pure integer function total(self)
    class(particles_t), intent(in) :: self

    total = 0
    if (self%nblk > 0) total = sum(self%count(1:self%nblk))
  end function total

  !> Memory allocated for particles on this rank [bytes].
  pure integer(i8) function bytes(self)
    class(particles_t), intent(in) :: self

    bytes = int(self%capacity, i8)*(8_i8*nlane*(self%nf + 1) + 8_i8)
  end function bytes

  !> Tag from identity (below 2^48) and the six bits of the body faces that the particle lies on.
  pure integer(i8) function make_tag(id, faces)
    integer(i8), intent(in) :: id
    integer, intent(in) :: faces

    make_tag = ior(id, ishft(int(faces, i8), face_shift))
  end function make_tag

  elemental integer(i8) function tag_id(tag)
    integer(i8), intent(in) :: tag

    tag_id = ibits(tag, 0, face_shift)
  end function tag_id

  !> Bit k-1 is set if the particle lies on face k (xmin, xmax, ymin, ymax, zmin, zmax).
  elemental integer function tag_faces(tag)
    integer(i8), intent(in) :: tag

    tag_faces = int(ibits(tag, face_shift, 6))
  end function tag_faces

  !> Rest state of a tag: two bits above those of the faces.
  elemental integer function tag_rest(tag)
    integer(i8), intent(in) :: tag

    tag_rest = int(ibits(tag, rest_shift, 2))
  end function tag_rest

  !> Rest states of `n` particles, in a vectorised loop.
  pure function rests(n, tag) result(rest)
    integer, intent(in) :: n
    integer(i8), intent(in) :: tag(n)
    integer :: rest(n)

    rest = int(ibits(tag, rest_shift, 2))
  end function rests

  elemental integer(i8) function set_rest(tag, rest)
    integer(i8), intent(in) :: tag
    integer, intent(in) :: rest

    set_rest = tag
    call mvbits(int(rest, i8), 0, 2, set_rest, rest_shift)
  end function set_rest

  !> Set or clear a bit of a tag: `tracer_bit`, `border_bit` or `far_bit`.
  elemental integer(i8) function set_bit(tag, bit, is_set)
    integer(i8), intent(in) :: tag
    integer, intent(in) :: bit
    logical, intent(in) :: is_set

    set_bit = merge(ibset(tag, bit), ibclr(tag, bit), is_set)
  end function set_bit

end module particles_store
