! SPDX-License-Identifier: MIT
!> Direction of the surface at the nodes where bodies meet.
!>
!> Directions are tried at a node: out of the first body, out of the second (turned round), their
!> mean, and one from both by the sum of volume gradients or by the plane that tells their particles
!> apart (linear regression with labels -1 and 1; Nairn, Hammerquist & Smith 2020, CMAME
!> 362:112859, use the logistic one). That with the largest gap separates the bodies best. At edges,
!> where a node sees few particles, none of them may be right: the mean of what was chosen at the
!> nodes around is tried last.
module time_normals
  use base_kinds, only: rp
  use time_meeting, only: normal_regression, s_moment
  use time_state, only: simulation_t
  implicit none (type, external)
  private

  public :: try_normals, choose_normals, average_normals, ignore_thin_overlaps

  real(rp), parameter :: ridge = 1.0e-3_rp          !! of the regression [cells^2]
  real(rp), parameter :: thin = 0.05_rp             !! volume gradient of a full surface: about 0.5
  real(rp), parameter :: far = 1.0e30_rp            !! beyond any surface [m]

contains

  !> Directions to choose from, the best founded first: that of both bodies, or a rigid body's own.
  subroutine try_normals(sim)
    type(simulation_t), intent(inout) :: sim
    integer :: e

    do e = 1, sim%meeting%n
      associate (s => sim%meeting%sums(:, e), t => sim%meeting%trial(:, :, e), &
                 contact => sim%scene%contact(sim%meeting%pair(e)))
        t(:, 1) = s(1:3) - s(4:6)
        if (contact%normal == normal_regression) t(:, 1) = plane_between(s(s_moment:s_moment + 13))
        t(:, 3) = unit(sim%meeting%free(:, e)*s(1:3))
        t(:, 4) = unit(-sim%meeting%free(:, e)*s(4:6))
        t(:, 1) = unit(sim%meeting%free(:, e)*t(:, 1))
        t(:, 2) = unit(t(:, 3) + t(:, 4))
        if (sim%scene%tool_of(contact%group(1)) > 0) t = t(:, [3, 1, 2, 4, 5])
        if (sim%scene%tool_of(contact%group(2)) > 0) t = t(:, [4, 1, 2, 3, 5])
      end associate
    end do
  end subroutine try_normals

  pure function unit(a)
    real(rp), intent(in) :: a(3)
    real(rp) :: unit(3), length

    length = norm2(a)
    unit = 0.0_rp
    if (length > 0.0_rp) unit = a/length
  end function unit

  !> Slope of the linear function that fits the labels of the particles best.
  pure function plane_between(s) result(slope)
    real(rp), intent(in) :: s(14)
    real(rp) :: slope(3), a(3, 3), b(3), mean(3)
    integer :: i

    mean = s(7:9)/s(10)
    a = reshape([s(1), s(4), s(6), s(4), s(2), s(5), s(6), s(5), s(3)], [3, 3])/s(10)
    do i = 1, 3
      a(:, i) = a(:, i) - mean*mean(i)
      a(i, i) = a(i, i) + ridge
    end do
    b = (s(11:13) - mean*s(14))/s(10)
    slope = [dot_product(b, cross(a(:, 2), a(:, 3))), dot_product(b, cross(a(:, 3), a(:, 1))), &
             dot_product(b, cross(a(:, 1), a(:, 2)))]     ! times det(a) > 0
  end function plane_between

  pure function cross(a, b) result(c)
    real(rp), intent(in) :: a(3), b(3)
    real(rp) :: c(3)

    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

  !> Take the trial normal `k` where its gap is larger by `more` [m] than the largest so far.
  subroutine choose_normals(sim, k, more)
    type(simulation_t), intent(inout) :: sim
    integer, intent(in) :: k
    real(rp), intent(in) :: more
    real(rp) :: gap
    integer :: e

    associate (meeting => sim%meeting)
      do e = 1, meeting%n
        if (all(abs(meeting%trial(:, k, e)) <= 0.0_rp)) cycle
        if (any(meeting%surface(2*k - 1:2*k, e) < -far)) then
          gap = far                              ! one of the bodies has no particle near
        else
          gap = -sum(meeting%surface(2*k - 1:2*k, e))
        end if
        if (gap < meeting%gap(e) + more .and. meeting%gap(e) > -far) cycle
        meeting%gap(e) = gap
        meeting%normal(:, e) = meeting%trial(:, k, e)
      end do
    end associate
  end subroutine choose_normals

  !> Mean of the normals chosen at each owned node and those around it, by the mass that meets there
  !> and how well they separate the bodies.
  subroutine average_normals(sim, g, mean)
    type(simulation_t), intent(in) :: sim
    real(rp), intent(in) :: g(8, sim%patch%nn, sim%n_groups)
    real(rp), intent(out) :: mean(3, sim%meeting%n)
    integer :: e, i, j, k, o

    mean = 0.0_rp
    associate (meeting => sim%meeting)
      do e = 1, meeting%n
        if (.not. meeting%is_owned(e)) cycle
        do i = -1, 1
          do j = -1, 1
            do k = -1, 1
              o = meeting%place(meeting%node(e) + i*sim%patch%stride(1) + j*sim%patch%stride(2) &
                                + k, meeting%pair(e))
              if (o == 0) cycle
              if (meeting%gap(o) < -far) cycle
              mean(:, e) = mean(:, e) + trust(meeting%gap(o)/sim%patch%h)*meeting%normal(:, o) &
                /sum(1.0_rp/g(8, meeting%node(o), sim%scene%contact(meeting%pair(o))%group))
            end do
          end do
        end do
        mean(:, e) = unit(meeting%free(:, e)*mean(:, e))
      end do
    end associate
  end subroutine average_normals

  !> No overlap is believed where a node sees too little of a body to tell its surface.
  subroutine ignore_thin_overlaps(sim)
    type(simulation_t), intent(inout) :: sim
    integer :: e

    associate (s => sim%meeting%sums)
      do e = 1, sim%meeting%n
        if (min(norm2(s(1:3, e)), norm2(s(4:6, e))) > thin*sim%patch%h**2) cycle
        sim%meeting%gap(e) = max(0.0_rp, sim%meeting%gap(e))
      end do
    end associate
  end subroutine ignore_thin_overlaps

  !> Weight of a normal that leaves a gap [cells]: little if the bodies overlap.
  pure real(rp) function trust(gap)
    real(rp), intent(in) :: gap
    real(rp), parameter :: overlap = 0.02_rp

    trust = 1.0_rp/(1.0_rp + (max(-1.0_rp, min(0.0_rp, gap))/overlap)**2)**2
  end function trust

end module time_normals
