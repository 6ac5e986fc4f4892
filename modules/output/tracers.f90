! SPDX-License-Identifier: MIT
!> Rows of NAME_tracers.csv: one for each tracer and output time.
module output_tracers
  use base_kinds, only: i8, rp
  use io_histories, only: compact
  use io_lines, only: lines_t
  use particles_tracers, only: n_seen
  use simulation_parts, only: simulation_t
  implicit none (type, external)
  private

  public :: tracer_rows

  character(24), parameter, public :: tracer_headings(10) = [character(24) :: 'time[s]', 'group', &
    'tracer', 'id', 'body', 'x[m]', 'y[m]', 'z[m]', 'temperature[K]', 'plastic_strain[1]']

contains

  !> Collective. Text of the rows of the groups that are due, and their number; a tracer whose
  !> particle has left the grid has no row. `id` is that of the particle in the frames.
  subroutine tracer_rows(sim, is_due, text, n)
    type(simulation_t), intent(in) :: sim
    logical, intent(in) :: is_due(:)              !! groups to write
    character(:), allocatable, intent(out) :: text
    integer, intent(out) :: n
    integer, parameter :: longest = 240           !! longest row [characters]
    real(rp), allocatable :: seen(:, :)
    type(lines_t) :: lines
    character(20) :: now
    integer :: i, k

    allocate (seen(n_seen, sim%tracers%n))
    call sim%tracers%collect(sim%world, sim%particles, seen)
    allocate (character(longest*sim%tracers%n) :: lines%text)
    write (now, '(es19.12)') sim%clock%time
    n = 0
    do i = 1, sim%tracers%n
      if (.not. is_due(sim%tracers%group(i)) .or. seen(n_seen, i) < 0.5_rp) cycle
      call lines%add(compact(now))
      call lines%add(','//trim(sim%tracers%name(sim%tracers%group(i)))//',')
      call lines%add(int(i, i8))
      call lines%add(',')
      call lines%add(sim%tracers%id(i))
      call lines%add(','//trim(sim%scene%body(nint(seen(6, i)))%name))
      do k = 1, 5
        call lines%add(',')
        call lines%add(seen(k, i))
      end do
      call lines%add(new_line('a'))
      n = n + 1
    end do
    text = lines%text(:lines%used)
  end subroutine tracer_rows

end module output_tracers
