! SPDX-License-Identifier: MIT
!> Watches for metal above its melting temperature: warns once, and keeps the worst for the
!> summary.
module output_melting
  use base_kinds, only: rp
  use base_log, only: say
  use base_text, only: str
  use comm_world, only: world_t
  use particles_store, only: f_mass, f_pos, f_temp, particles_t
  use state_clock, only: clock_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: melting_t, seen_t

  type :: melting_t
    real(rp) :: share = 0.0_rp     !! largest part of the mass above its melting temperature so far
    real(rp) :: over = 0.0_rp      !! most that any of it was above [K]
    real(rp) :: ratio = 0.0_rp     !! largest temperature over that of melting at the last row
    logical, private :: is_reported = .false.
  contains
    procedure :: watch_particles
    procedure :: json
    procedure :: judge
  end type melting_t

  !> What one rank sees.
  type :: seen_t
    real(rp) :: melted = 0.0_rp, mass = 0.0_rp        !! [kg]
    real(rp) :: over = -huge(1.0_rp), temp = 0.0_rp   !! of the one farthest above its melting point
                                                      !! [K]
    real(rp) :: x(3) = 0.0_rp                         !! its place [m]
    integer :: body = 0
  end type seen_t

contains

  !> Collective, at a row of the history: the particles of bodies that deform.
  subroutine watch_particles(self, world, scene, clock, particles)
    class(melting_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(particles_t), intent(in) :: particles
    type(seen_t) :: seen
    real(rp) :: t_melt
    integer :: b, n, p

    if (all(scene%material%t_melt >= huge(1.0_rp))) return
    do b = 1, particles%nblk
      n = particles%count(b)
      if (n == 0) cycle
      if (scene%body(particles%body(b))%is_rigid()) cycle
      t_melt = scene%material(scene%body(particles%body(b))%material)%t_melt
      associate (ps => particles%ps(1:n, :, b))
        seen%mass = seen%mass + sum(ps(:, f_mass))
        p = maxloc(ps(:, f_temp), dim=1)
        if (ps(p, f_temp) - t_melt > seen%over) then
          seen%over = ps(p, f_temp) - t_melt
          seen%temp = ps(p, f_temp)
          seen%x = ps(p, f_pos:f_pos + 2)
          seen%body = particles%body(b)
        end if
        if (ps(p, f_temp) > t_melt) seen%melted = seen%melted &
            + sum(ps(:, f_mass), mask=ps(:, f_temp) > t_melt)
      end associate
    end do
    call self%judge(world, scene, seen, clock%time)
  end subroutine watch_particles

  !> Collective. The worst so far; the first time any metal is above melting the rank that has the
  !> hottest is named.
  subroutine judge(self, world, scene, seen, time)
    class(melting_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(seen_t), intent(in) :: seen
    real(rp), intent(in) :: time                     !! [s]
    real(rp) :: sums(2), most(2)
    character(:), allocatable :: mine, message

    sums = [seen%melted, seen%mass]
    most = [seen%over, seen%temp/max(seen%temp - seen%over, tiny(1.0_rp))]
    call world%sum(sums)
    call world%max(most)
    self%ratio = most(2)
    if (most(1) <= 0.0_rp) return
    self%share = max(self%share, sums(1)/max(sums(2), tiny(1.0_rp)))
    self%over = max(self%over, most(1))
    if (self%is_reported) return
    self%is_reported = .true.
    mine = ''
    if (seen%over >= most(1)) mine = 'warning: at t = '//str(time)//' s '// &
      str(100.0_rp*sums(1)/sums(2))//' % of the mass ('//str(sums(1))// &
      ' kg) is above its melting temperature; the hottest, in '// &
      trim(scene%body(seen%body)%name)//' at ('//str(seen%x(1))//', '//str(seen%x(2))//', '// &
      str(seen%x(3))//') m, has '//str(seen%temp)//' K, T_MELT is '//str(seen%temp - seen%over)// &
      ' K'
    call world%share_message(mine, message)
    if (world%is_root()) call say(message)
  end subroutine judge

  !> Two members of NAME_summary.json, each with its comma.
  function json(self) result(text)
    class(melting_t), intent(in) :: self
    character(:), allocatable :: text

    text = '  "melted_share_max": '//str(self%share)//','//new_line('a')// &
           '  "hottest_over_melting_K": '//str(self%over)//','
  end function json

end module output_melting
