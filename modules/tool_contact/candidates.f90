! SPDX-License-Identifier: MIT
!> Particles that may touch a tool, gathered from their blocks into one: a block at a tool has only
!> a few, and weights and flow laws work on whole blocks.
module tool_contact_candidates
  use base_kinds, only: nlane, rp
  use particles_store, only: f_plastic, f_tau, layout_t, n_conduction, particles_t
  implicit none (type, external)
  private

  public :: candidates_t

  type :: candidates_t
    integer :: n = 0
    integer :: body = 0                        !! of all of them
    integer :: block(nlane) = 0, lane(nlane) = 0   !! where they are
    real(rp) :: half(nlane) = 0.0_rp           !! from their centres to their surfaces [m]
    real(rp) :: normal(3, nlane) = 0.0_rp      !! out of the tool
    integer, allocatable :: field(:)           !! those that are gathered
    real(rp), allocatable :: ps(:, :)          !! (nlane, fields of a particle)
  contains
    procedure :: init
    procedure :: add
    procedure :: fill_up
  end type candidates_t

contains

  !> No candidates of particles with `layout`; their stress is gathered if it is asked for.
  subroutine init(self, layout, with_stress)
    class(candidates_t), intent(out) :: self
    type(layout_t), intent(in) :: layout
    logical, intent(in) :: with_stress
    integer :: i

    self%field = [(i, i=1, n_conduction), f_plastic, layout%surface_offset, &
                  (layout%law + i, i=0, layout%n_law - 1)]
    if (with_stress) self%field = [self%field, (f_tau + i, i=0, 5)]
    if (layout%half > 0) self%field = [self%field, (layout%half + i, i=0, 2)]
    allocate (self%ps(nlane, layout%n), source=0.0_rp)
  end subroutine init

  !> Add the particle in lane `p` of block `b`; there must be room.
  pure subroutine add(self, particles, b, p, normal, half)
    class(candidates_t), intent(inout) :: self
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: b, p
    real(rp), intent(in) :: normal(3), half
    integer :: f, i

    self%n = self%n + 1
    self%body = particles%body(b)
    self%block(self%n) = b
    self%lane(self%n) = p
    self%normal(:, self%n) = normal
    self%half(self%n) = half
    do i = 1, size(self%field)
      f = self%field(i)
      self%ps(self%n, f) = particles%ps(p, f, b)
    end do
  end subroutine add

  !> The lanes behind the last hold what the first does.
  pure subroutine fill_up(self)
    class(candidates_t), intent(inout) :: self
    integer :: f, i

    do i = 1, size(self%field)
      f = self%field(i)
      self%ps(self%n + 1:, f) = self%ps(1, f)
    end do
  end subroutine fill_up

end module tool_contact_candidates
