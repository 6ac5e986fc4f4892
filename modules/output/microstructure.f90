! SPDX-License-Identifier: MIT
!> Outputs of flow laws (microstructure) in frames and histories, and warnings of their validity.
!> An output that several laws have is listed once; it is 0 for particles whose law lacks it.
module output_microstructure
  use base_kinds, only: nlane, rp, sp
  use base_text, only: str
  use base_world, only: world_t
  use io_histories, only: row_t
  use particles_store, only: f_mass, f_plastic, particles_t
  use physics_flow_law, only: law_output_t
  use state_budget, only: budget_t
  use state_clock, only: clock_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: add_micro_columns, frame_outputs, micro_means_t, find_microstructure_means, &
            zero_means, pack_outputs, make_warning_message

  real(rp), parameter :: stirred_strain = 1.0_rp  !! least plastic strain of stirred material

  !> For each output of the scene: mass-weighted mean over stirred material, minimum over all
  !> material.
  type :: micro_means_t
    real(rp) :: mass = 0.0_rp                  !! stirred mass of materials with outputs [kg]
    real(rp), allocatable :: mean(:)
    real(rp), allocatable :: minimum(:)        !! least positive value
  end type micro_means_t

  !> Outputs of a scene, and for each material the indices of its law's outputs among them.
  type :: outputs_t
    type(law_output_t), allocatable :: all(:)
    integer, allocatable :: n(:)               !! number of outputs of a material's law
    integer, allocatable :: place(:, :)        !! index in `all` of (output of the law, material)
  end type outputs_t

contains

  !> List the outputs of all flow laws without duplicates.
  subroutine list_outputs(scene, outputs)
    type(scene_t), intent(in) :: scene
    type(outputs_t), intent(out) :: outputs
    integer, parameter :: most = 32
    type(law_output_t) :: all(most)
    integer :: k, m, n, place

    n = 0
    allocate (outputs%n(size(scene%material)), outputs%place(most, size(scene%material)), source=0)
    do m = 1, size(scene%material)
      if (.not. allocated(scene%material(m)%flow)) cycle
      associate (own => scene%material(m)%flow%outputs())
        outputs%n(m) = size(own)
        do k = 1, size(own)
          place = findloc(all(:n)%name, own(k)%name, dim=1)
          if (place == 0) then
            n = n + 1
            place = n
            all(n) = own(k)
          end if
          all(place)%in_frames = all(place)%in_frames .or. own(k)%in_frames
          outputs%place(k, m) = place
        end do
      end associate
    end do
    outputs%all = all(:n)
  end subroutine list_outputs

  !> Outputs that are written to frames.
  function frame_outputs(scene) result(list)
    type(scene_t), intent(in) :: scene
    type(law_output_t), allocatable :: list(:)
    type(outputs_t) :: outputs

    call list_outputs(scene, outputs)
    list = pack(outputs%all, outputs%all%in_frames)
  end function frame_outputs

  !> Frame outputs of all particles of this rank, in the order of the blocks.
  subroutine pack_outputs(scene, particles, values)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    real(sp), allocatable, intent(out) :: values(:, :)
    type(outputs_t) :: outputs
    real(rp), allocatable :: block(:, :)
    integer, allocatable :: shown(:)
    integer :: b, k, m, n

    call list_outputs(scene, outputs)
    shown = pack([(k, k=1, size(outputs%all))], outputs%all%in_frames)
    allocate (values(particles%total(), size(shown)))
    if (size(shown) == 0) return
    allocate (block(nlane, size(outputs%all)))
    n = 0
    do b = 1, particles%nblk
      m = particles%count(b)
      call describe_block(scene, outputs, particles%body(b), particles%nf, particles%ps(:, :, b), &
                          block)
      values(n + 1:n + m, :) = real(block(1:m, shown), sp)
      n = n + m
    end do
  end subroutine pack_outputs

  !> Outputs of a block of particles of one body.
  subroutine describe_block(scene, outputs, body, nf, ps, values)
    type(scene_t), intent(in) :: scene
    type(outputs_t), intent(in) :: outputs
    integer, intent(in) :: body, nf
    real(rp), intent(in) :: ps(nlane, nf)
    real(rp), intent(out) :: values(nlane, size(outputs%all))
    real(rp) :: own(nlane, outputs%n(scene%body(body)%material))

    values = 0.0_rp
    if (size(own, 2) == 0) return
    associate (m => scene%body(body)%material)
      call scene%material(m)%flow%describe(ps(1, scene%layout%law), size(own, 2), own)
      values(:, outputs%place(:size(own, 2), m)) = own
    end associate
  end subroutine describe_block

  !> Add the columns of the history for flow laws with outputs.
  subroutine add_micro_columns(scene, means, row)
    type(scene_t), intent(in) :: scene
    type(micro_means_t), intent(in) :: means
    type(row_t), intent(inout) :: row
    type(outputs_t) :: outputs
    integer :: k

    call list_outputs(scene, outputs)
    if (size(outputs%all) == 0) return
    call row%add('stirred_mass', 'kg', means%mass)
    do k = 1, size(outputs%all)
      if (outputs%all(k)%has_mean) call row%add(outputs%all(k)%name, outputs%all(k)%unit, &
                                                means%mean(k))
    end do
    do k = 1, size(outputs%all)
      if (outputs%all(k)%has_minimum) call row%add(trim(outputs%all(k)%name)//'_min', &
                                                 outputs%all(k)%unit, means%minimum(k))
    end do
  end subroutine add_micro_columns

  !> Means of zero, with the array sizes of a scene.
  type(micro_means_t) function zero_means(scene) result(means)
    type(scene_t), intent(in) :: scene
    type(outputs_t) :: outputs

    call list_outputs(scene, outputs)
    allocate (means%mean(size(outputs%all)), means%minimum(size(outputs%all)), source=0.0_rp)
  end function zero_means

  !> Collective. Current means and minima; 0 while nothing is stirred.
  subroutine find_microstructure_means(world, scene, particles, means)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(micro_means_t), intent(out) :: means
    type(outputs_t) :: outputs
    real(rp), allocatable :: minimum(:), mass(:), sums(:), values(:, :)
    real(rp) :: stirred_mass(nlane)
    integer :: b, k, n, n_all

    call list_outputs(scene, outputs)
    n_all = size(outputs%all)
    means = zero_means(scene)
    if (n_all == 0) return
    allocate (mass(n_all), sums(2*n_all + 1), source=0.0_rp)
    allocate (minimum(n_all), source=-huge(1.0_rp))
    allocate (values(nlane, n_all))
    do b = 1, particles%nblk
      n = particles%count(b)
      associate (m => scene%body(particles%body(b))%material, ps => particles%ps(:, :, b))
        if (outputs%n(m) == 0) cycle
        call describe_block(scene, outputs, particles%body(b), particles%nf, ps, values)
        stirred_mass = merge(ps(:, f_mass), 0.0_rp, ps(:, f_plastic) > stirred_strain)
        mass = 0.0_rp
        mass(outputs%place(:outputs%n(m), m)) = sum(stirred_mass(:n))
        sums = sums + [sum(stirred_mass(:n)), mass, &
                       (sum(stirred_mass(:n)*values(:n, k)), k=1, n_all)]
        minimum = max(minimum, -minval(values(:n, :), dim=1, mask=values(:n, :) > 0.0_rp))
      end associate
    end do
    call world%sum(sums)
    call world%max(minimum)
    means%mass = sums(1)
    mass = sums(2:n_all + 1)
    where (mass > 0.0_rp) means%mean = sums(n_all + 2:)/mass
    means%minimum = -minimum
  end subroutine find_microstructure_means

  !> Collective. Message on warning `k` of the flow laws: its number of occurrences on all ranks,
  !> and the position of one; '' if there was none.
  subroutine make_warning_message(world, scene, clock, budget, k, message)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(budget_t), intent(in) :: budget
    integer, intent(in) :: k
    character(:), allocatable, intent(inout) :: message
    character(:), allocatable :: local_message
    real(rp) :: counts(size(budget%warnings))

    counts = budget%warnings
    call world%sum(counts)
    local_message = ''
    associate (place => budget%warning_place(:, k))
      if (budget%warnings(k) > 0.0_rp) then
        local_message = 'warning: until t = '//str(clock%time)//' s '//str(counts(k))// &
          ' particle-steps '//trim(scene%warning(k))//'; one of the first at ('//str(place(3))// &
          ', '//str(place(4))//', '//str(place(5))//') m, t = '//str(place(1))//' s, '// &
          str(place(2))//' K'
      end if
    end associate
    call world%share_message(local_message, message)
  end subroutine make_warning_message

end module output_microstructure
