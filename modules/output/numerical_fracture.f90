! SPDX-License-Identifier: MIT
!> Detection of numerical fracture: neighbouring particles that are stretched so far apart that they
!> may share no grid node. Their distance is estimated as the initial spacing times the elastic
!> stretch; plastic stretch is not known.
module output_numerical_fracture
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use particles_store, only: f_bbar, f_jac, f_mass, f_pos, particles_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: separation_ratio

contains

  !> Collective. Largest ratio of the distance of neighbours to that at which they surely share a
  !> node.
  real(rp) function separation_ratio(world, scene, particles)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    real(rp) :: largest(1)
    integer :: b

    largest = 0.0_rp
    do b = 1, particles%nblk
      if (scene%body(particles%body(b))%is_rigid()) cycle
      largest(1) = max(largest(1), separation_in_block(scene, particles%body(b), &
                                                       particles%count(b), particles%nf, &
                                                         particles%ps(:, :, b)))
    end do
    call world%max(largest)
    separation_ratio = largest(1)
  end function separation_ratio

  !> Largest ratio in a block, along the grid axes: particles surely share a node up to a distance
  !> of one cell plus one particle domain.
  pure real(rp) function separation_in_block(scene, body, n, nf, ps)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: body, n, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp) :: half(3), distance(3), edges(3), start(3)
    integer :: p

    separation_in_block = 0.0_rp
    half = scene%domain(body)
    associate (s => scene%body(body)%start)
      start = sqrt(s%bbar(1:3))*s%jac**(1.0_rp/3.0_rp)
    end associate
    do p = 1, n
      if (scene%layout%half > 0) half = ps(p, scene%layout%half:scene%layout%half + 2)
      edges = scene%grid%edges_at(ps(p, f_pos:f_pos + 2))
      distance = scene%spacing_of(body, ps(p, f_mass))*sqrt(ps(p, f_bbar:f_bbar + 2)) &
                 *ps(p, f_jac)**(1.0_rp/3.0_rp)/start
      separation_in_block = max(separation_in_block, &
                                maxval(distance/(edges*(1.0_rp + 2.0_rp*half))))
    end do
  end function separation_in_block

end module output_numerical_fracture
