! SPDX-License-Identifier: MIT
!> Detection of metal above its melting temperature: one warning, and maxima for the summary.
module output_melting
  use base_kinds, only: rp
  use base_log, only: say
  use base_text, only: str
  use comm_world, only: world_t
  use particles_store, only: f_mass, f_pos, f_temp
  use simulation_parts, only: simulation_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: melting_t, melt_sample_t

  type :: melting_t
    real(rp) :: share = 0.0_rp     !! largest mass fraction above its melting temperature so far
    real(rp) :: over = 0.0_rp      !! largest excess over the melting temperature so far [K]
    real(rp) :: ratio = 0.0_rp     !! largest temperature/melting temperature at the last row
    logical, private :: is_reported = .false.
  contains
    procedure :: check_particles
    procedure :: json
    procedure :: update
  end type melting_t

  !> Molten mass and hottest particle or cell of one rank.
  type :: melt_sample_t
    real(rp) :: melted = 0.0_rp, mass = 0.0_rp        !! [kg]
    real(rp) :: over = -huge(1.0_rp), temp = 0.0_rp   !! largest excess over the melting
                                                      !! temperature, and temperature there [K]
    real(rp) :: x(3) = 0.0_rp                         !! position of the largest excess [m]
    integer :: body = 0
  end type melt_sample_t

contains

  !> Collective. Check the particles of deformable bodies at a row of the history.
  subroutine check_particles(self, sim)
    class(melting_t), intent(inout) :: self
    type(simulation_t), intent(in) :: sim
    type(melt_sample_t) :: sample
    real(rp) :: t_melt
    integer :: b, n, p

    if (all(sim%scene%material%t_melt >= huge(1.0_rp))) return
    do b = 1, sim%particles%nblk
      n = sim%particles%count(b)
      if (n == 0) cycle
      if (sim%scene%body(sim%particles%body(b))%is_rigid()) cycle
      t_melt = sim%scene%material(sim%scene%body(sim%particles%body(b))%material)%t_melt
      associate (ps => sim%particles%ps(1:n, :, b))
        sample%mass = sample%mass + sum(ps(:, f_mass))
        p = maxloc(ps(:, f_temp), dim=1)
        if (ps(p, f_temp) - t_melt > sample%over) then
          sample%over = ps(p, f_temp) - t_melt
          sample%temp = ps(p, f_temp)
          sample%x = ps(p, f_pos:f_pos + 2)
          sample%body = sim%particles%body(b)
        end if
        if (ps(p, f_temp) > t_melt) sample%melted = sample%melted &
            + sum(ps(:, f_mass), mask=ps(:, f_temp) > t_melt)
      end associate
    end do
    call self%update(sim%world, sim%scene, sample, sim%clock%time)
  end subroutine check_particles

  !> Collective. Update the maxima; the first time any metal is above its melting temperature warn
  !> with the hottest position.
  subroutine update(self, world, scene, sample, time)
    class(melting_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(melt_sample_t), intent(in) :: sample
    real(rp), intent(in) :: time                     !! [s]
    real(rp) :: sums(2), maxima(2)
    character(:), allocatable :: local_message, message

    sums = [sample%melted, sample%mass]
    maxima = [sample%over, sample%temp/max(sample%temp - sample%over, tiny(1.0_rp))]
    call world%sum(sums)
    call world%max(maxima)
    self%ratio = maxima(2)
    if (maxima(1) <= 0.0_rp) return
    self%share = max(self%share, sums(1)/max(sums(2), tiny(1.0_rp)))
    self%over = max(self%over, maxima(1))
    if (self%is_reported) return
    self%is_reported = .true.
    local_message = ''
    if (sample%over >= maxima(1)) local_message = 'warning: at t = '//str(time)//' s '// &
      str(100.0_rp*sums(1)/sums(2))//' % of the mass ('//str(sums(1))// &
      ' kg) is above its melting temperature; the hottest, in '// &
      trim(scene%body(sample%body)%name)//' at ('//str(sample%x(1))//', '//str(sample%x(2))// &
      ', '//str(sample%x(3))//') m, has '//str(sample%temp)//' K, T_MELT is '//str(sample%temp &
      - sample%over)//' K'
    call world%share_message(local_message, message)
    if (world%is_root()) call say(message)
  end subroutine update

  !> Two members of NAME_summary.json, each with its comma.
  function json(self) result(text)
    class(melting_t), intent(in) :: self
    character(:), allocatable :: text

    text = '  "melted_share_max": '//str(self%share)//','//new_line('a')// &
           '  "hottest_over_melting_K": '//str(self%over)//','
  end function json

end module output_melting
