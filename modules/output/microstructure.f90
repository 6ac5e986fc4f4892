! SPDX-License-Identifier: MIT
!> Outputs of flow laws in frames and histories, and warnings of where the laws do not hold.
module output_microstructure
  use base_kinds, only: nlane, rp, sp
  use base_text, only: str
  use comm_world, only: world_t
  use io_row, only: row_t
  use particles_store, only: f_mass, f_plastic, particles_t
  use physics_flow_law, only: n_outputs, n_validity_warnings, warning_text
  use state_books, only: books_t
  use state_clock, only: clock_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: add_micro_columns, micro_means_t, microstructure_means, n_micro_outputs, &
            pack_outputs, warning_message

  real(rp), parameter :: stirred = 1.0_rp    !! plastic strain from which material counts as stirred

  !> Means of stirred material, by mass.
  type :: micro_means_t
    real(rp) :: mass = 0.0_rp                  !! that is stirred [kg]
    real(rp) :: mean(n_outputs) = 0.0_rp       !! of the outputs of physics_flow_law
    real(rp) :: least_grain = 0.0_rp           !! of all material [m]
  end type micro_means_t

contains

  !> How many of the laws' outputs the scene has: none, those of deformation, or all.
  pure integer function n_micro_outputs(scene)
    type(scene_t), intent(in) :: scene

    n_micro_outputs = 0
    if (scene%layout%n_law == 0) return
    n_micro_outputs = merge(n_outputs, n_outputs - 1, any(scene%material%anneals()))
  end function n_micro_outputs

  !> Outputs of all particles of this rank, in the order of the blocks; 0 without internal
  !> variables.
  subroutine pack_outputs(scene, particles, values)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    real(sp), allocatable, intent(out) :: values(:, :)
    real(rp) :: block(nlane, n_outputs)
    integer :: b, k, m, n

    k = n_micro_outputs(scene)
    allocate (values(particles%total(), k))
    if (k == 0) return
    n = 0
    do b = 1, particles%nblk
      m = particles%count(b)
      call describe_block(scene, particles, b, particles%nf, particles%ps(:, :, b), block)
      values(n + 1:n + m, :) = real(block(1:m, 1:k), sp)
      n = n + m
    end do
  end subroutine pack_outputs

  subroutine describe_block(scene, particles, b, nf, ps, values)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: b, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(out) :: values(nlane, n_outputs)

    values = 0.0_rp
    associate (material => scene%material(scene%body(particles%body(b))%material))
      if (allocated(material%flow)) call material%flow%describe(ps(1, scene%layout%law), values)
    end associate
  end subroutine describe_block

  !> Columns of the history for flow laws with outputs.
  subroutine add_micro_columns(scene, means, row)
    type(scene_t), intent(in) :: scene
    type(micro_means_t), intent(in) :: means
    type(row_t), intent(inout) :: row

    if (n_micro_outputs(scene) == 0) return
    call row%add('stirred_mass', 'kg', means%mass)
    call row%add('grain_size', 'm', means%mean(1))
    call row%add('dislocation_density', '1/m2', means%mean(2))
    call row%add('wall_fraction', '1', means%mean(5))
    call row%add('recrystallised', '1', means%mean(6))
    call row%add('grain_size_min', 'm', means%least_grain)
  end subroutine add_micro_columns

  !> Collective. The means now; 0 while nothing is stirred.
  subroutine microstructure_means(world, scene, particles, means)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(micro_means_t), intent(out) :: means
    real(rp) :: values(nlane, n_outputs), sums(n_outputs + 1), least(1), stirred_mass(nlane)
    integer :: b, k, n

    if (n_micro_outputs(scene) == 0) return
    sums = 0.0_rp
    least = -huge(1.0_rp)
    do b = 1, particles%nblk
      n = particles%count(b)
      call describe_block(scene, particles, b, particles%nf, particles%ps(:, :, b), values)
      associate (ps => particles%ps(:, :, b))
        stirred_mass = merge(ps(:, f_mass), 0.0_rp, ps(:, f_plastic) > stirred .and. values(:, 1) &
                             > 0.0_rp)
        sums = sums + [sum(stirred_mass(:n)), &
                       (sum(stirred_mass(:n)*values(:n, k)), k=1, n_outputs)]
        least = max(least, -minval(values(:n, 1), mask=values(:n, 1) > 0.0_rp))
      end associate
    end do
    call world%sum(sums)
    call world%max(least)
    means%mass = sums(1)
    if (sums(1) > 0.0_rp) means%mean = sums(2:)/sums(1)
    means%least_grain = -least(1)
  end subroutine microstructure_means

  !> Collective. What kind `k` of warning there has been on any rank, how often and where first; ''.
  subroutine warning_message(world, clock, books, k, message)
    type(world_t), intent(in) :: world
    type(clock_t), intent(in) :: clock
    type(books_t), intent(in) :: books
    integer, intent(in) :: k
    character(:), allocatable, intent(inout) :: message
    character(:), allocatable :: mine
    real(rp) :: counts(n_validity_warnings)

    counts = books%validity_warnings
    call world%sum(counts)
    mine = ''
    associate (place => books%warning_place(:, k))
      if (books%validity_warnings(k) > 0.0_rp) mine = 'warning: until t = '//str(clock%time)// &
          ' s '// &
        str(counts(k))//' particle-steps '//trim(warning_text(k))//'; one of the first at ('// &
        str(place(3))//', '//str(place(4))//', '//str(place(5))//') m, t = '//str(place(1))// &
        ' s, '//str(place(2))//' K'
    end associate
    call world%share_message(mine, message)
  end subroutine warning_message

end module output_microstructure
