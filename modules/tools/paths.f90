! SPDX-License-Identifier: MIT
!> Construction of paths of tools from points.
module tools_paths
  use base_kinds, only: rp
  use tools_motion, only: path_t, wrapped
  implicit none (type, external)
  private

  public :: new_path

contains

  !> Path through `place` (3, points) at increasing times.
  pure type(path_t) function new_path(time, place, line, leads_tilt) result(new)
    real(rp), intent(in) :: time(:), place(:, :)    !! time [s], positions [m]
    integer, intent(in) :: line(:)
    logical, intent(in) :: leads_tilt
    real(rp) :: way(2)
    integer :: k, n

    n = size(time)
    new%leads_tilt = leads_tilt
    allocate (new%time, source=time - time(1))
    allocate (new%place, source=place - spread(place(:, 1), 2, n))
    allocate (new%line, source=line)
    allocate (new%heading(n), source=0.0_rp)
    do k = 1, n
      if (k > 1) new%heading(k) = new%heading(k - 1)
      if (k == n) exit
      way = place(:2, k + 1) - place(:2, k)
      if (all(abs(way) <= 0.0_rp)) cycle            ! no heading: the tool rests, or moves along z
      associate (heading => atan2(way(2), way(1)))
        if (all(abs(new%place(:2, :k)) <= 0.0_rp)) new%heading(:k) = heading
        new%heading(k) = new%heading(k) + wrapped(heading - new%heading(k))
      end associate
    end do
  end function new_path

end module tools_paths
