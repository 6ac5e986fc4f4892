! SPDX-License-Identifier: MIT
!> Tracers, material points that are followed. Each is the particle nearest to a given position at t
!> = 0; it is marked by a bit of its tag, which is kept through sorts, migration and checkpoints.
module particles_tracers
  use base_kinds, only: i8, rp
  use base_sort, only: order_of
  use base_world, only: world_t
  use grid_geometry, only: grid_t, wrap
  use particles_store, only: f_plastic, f_pos, f_temp, particles_t, set_bit, tag_id, tracer_bit
  implicit none (type, external)
  private

  public :: tracers_t

  !> Numbers of a tracer in a row: position, temperature, plastic strain, body, presence.
  integer, parameter, public :: n_seen = 7

  !> Requested positions, in groups, and the particles that represent them.
  type :: tracers_t
    integer :: n = 0                           !! number of positions of all groups
    character(32), allocatable :: name(:)      !! names of the groups
    real(rp), allocatable :: interval(:)       !! time between rows of each group [s]
    integer, allocatable :: group(:)           !! group of each position
    real(rp), allocatable :: place(:, :)       !! (3, n) requested positions [m]
    !> Particle of each position; 0 if another position of the group has it.
    integer(i8), allocatable :: id(:)
    real(rp), allocatable :: next(:)           !! time of the next rows of each group [s]
    real(rp), allocatable :: row_time(:)       !! time of the last rows of each group [s]
    integer(i8) :: rows = 0                    !! rows written so far
    integer, allocatable, private :: order(:)  !! positions in the order of their particles
  contains
    procedure :: add_group, choose, set_ids, collect
    procedure, private :: first_of
  end type tracers_t

contains

  !> Append a group with its positions.
  subroutine add_group(self, name, interval, place)
    class(tracers_t), intent(inout) :: self
    character(*), intent(in) :: name
    real(rp), intent(in) :: interval                 !! [s]
    real(rp), intent(in), contiguous :: place(:, :)  !! (3, n) positions [m]
    integer :: n

    if (.not. allocated(self%name)) then
      allocate (self%name(0), self%interval(0), self%group(0), self%place(3, 0), self%id(0), &
                self%next(0), self%row_time(0))
    end if
    n = self%n + size(place, 2)
    self%name = [character(32) :: self%name, name]
    self%interval = [self%interval, interval]
    self%next = [self%next, 0.0_rp]
    self%row_time = [self%row_time, -1.0_rp]
    self%group = [self%group, spread(size(self%name), 1, size(place, 2))]
    self%place = reshape([self%place, place], [3, n])
    self%id = [self%id, spread(0_i8, 1, size(place, 2))]
    self%n = n
  end subroutine add_group

  !> Collective, at t = 0. Choose the nearest particle to each position, of several the one with the
  !> lowest number, so that the result does not depend on the ranks. Two positions of a group never
  !> share one.
  subroutine choose(self, world, grid, particles)
    class(tracers_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(grid_t), intent(in) :: grid
    type(particles_t), intent(inout) :: particles
    real(rp) :: least(self%n), nearest(self%n), number(self%n), place(3, self%n)
    integer(i8) :: id(self%n)
    integer :: b, i, p

    if (self%n == 0) return
    place = self%place(:, :self%n)
    do i = 1, self%n
      call wrap(grid, place(:, i))
    end do
    call find_nearest(self%n, place, particles, nearest, number)
    least = -nearest
    call world%max(least)
    where (nearest > -least) number = huge(1.0_rp)
    number = -number
    call world%max(number)
    id = nint(-number, i8)
    call self%set_ids(id)
    do i = 2, self%n
      p = self%order(i)
      b = self%order(i - 1)
      if (id(p) == id(b) .and. self%group(p) == self%group(b)) self%id(p) = 0_i8
    end do
    call self%set_ids(self%id)
    do b = 1, particles%nblk
      do p = 1, particles%count(b)
        associate (tag => particles%tag(p, b))
          if (self%first_of(tag_id(tag)) > 0) tag = set_bit(tag, tracer_bit, .true.)
        end associate
      end do
    end do
  end subroutine choose

  !> Squared distance and number of this rank's nearest particle to each position; blocks farther
  !> away than the nearest so far are skipped.
  pure subroutine find_nearest(n, place, particles, nearest, number)
    integer, intent(in) :: n
    real(rp), intent(in) :: place(3, n)            !! positions [m]
    type(particles_t), intent(in) :: particles
    real(rp), intent(out) :: nearest(n), number(n)   !! squared distance [m2], particle number [-]
    real(rp) :: box(6), d2
    integer :: b, i, p

    nearest = huge(1.0_rp)
    number = huge(1.0_rp)
    do b = 1, particles%nblk
      box = particles%extent(b, b)
      do i = 1, n
        if (sum(max(0.0_rp, place(:, i) - box(:3), -box(4:) - place(:, i))**2) > nearest(i)) cycle
        do p = 1, particles%count(b)
          d2 = sum((particles%ps(p, f_pos:f_pos + 2, b) - place(:, i))**2)
          if (d2 > nearest(i)) cycle
          associate (id => real(tag_id(particles%tag(p, b)), rp))
            if (d2 < nearest(i)) number(i) = id
            number(i) = min(number(i), id)
          end associate
          nearest(i) = d2
        end do
      end do
    end do
  end subroutine find_nearest

  !> Set the particles of the tracer positions, and sort the positions by particle.
  subroutine set_ids(self, id)
    class(tracers_t), intent(inout) :: self
    integer(i8), intent(in) :: id(self%n)

    self%id = id
    self%order = order_of(reshape(real(id, rp), [1, self%n]))
  end subroutine set_ids

  !> Index in `order` at which the positions of particle `id` begin; 0 if it is not a tracer.
  pure integer function first_of(self, id) result(low)
    class(tracers_t), intent(in) :: self
    integer(i8), intent(in) :: id
    integer :: high, middle

    low = 1
    high = self%n + 1
    do while (low < high)
      middle = (low + high)/2
      if (self%id(self%order(middle)) < id) then
        low = middle + 1
      else
        high = middle
      end if
    end do
    if (low > self%n) then
      low = 0
    else if (self%id(self%order(low)) /= id) then
      low = 0
    end if
  end function first_of

  !> Collective. Current values of each tracer: position [m], temperature [K], plastic strain, body,
  !> and 1; all 0 for positions without a particle, or whose particle has left the grid.
  subroutine collect(self, world, particles, seen)
    class(tracers_t), intent(in) :: self
    type(world_t), intent(in) :: world
    type(particles_t), intent(in) :: particles
    real(rp), intent(out) :: seen(n_seen, self%n)
    real(rp), allocatable :: flat(:)
    integer :: b, i, p
    integer(i8) :: id

    seen = 0.0_rp
    do b = 1, particles%nblk
      do p = 1, particles%count(b)
        if (.not. btest(particles%tag(p, b), tracer_bit)) cycle
        id = tag_id(particles%tag(p, b))
        i = self%first_of(id)
        do while (i > 0 .and. i <= self%n)
          if (self%id(self%order(i)) /= id) exit
          associate (ps => particles%ps(p, :, b))
            seen(:, self%order(i)) = [ps(f_pos:f_pos + 2), ps(f_temp), ps(f_plastic), &
                                      real(particles%body(b), rp), 1.0_rp]
          end associate
          i = i + 1
        end do
      end do
    end do
    allocate (flat(size(seen)))
    flat(:) = reshape(seen, [size(flat)])
    call world%sum(flat)
    seen = reshape(flat, shape(seen))
  end subroutine collect

end module particles_tracers
