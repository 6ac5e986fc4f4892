! SPDX-License-Identifier: MIT
!> Set-up of moving sources of heat-only scenes, and shear stress curves of stirring ones.
module heat_setup_sources
  use base_kinds, only: pi, rp
  use heat_mesh_curve, only: curve_t, table_value
  use heat_mesh_sources, only: heat_source_t, kind_ball, kind_disc, kind_stir
  use heat_setup_tables, only: n_values, split_pairs
  use input_values, only: input_t
  use physics_flow_law, only: softening_from
  implicit none (type, external)
  private

  public :: read_heat_sources

contains

  !> Read all &SOURCE groups. Stirring sources share the heat with the tool by effusivities.
  subroutine read_heat_sources(input, m, conductivity, capacity, source)
    type(input_t), intent(in) :: input
    integer, intent(in) :: m                       !! index of the material
    real(rp), intent(in) :: conductivity            !! [W/(m K)]
    real(rp), intent(in) :: capacity                !! [J/(m3 K)]
    type(heat_source_t), allocatable, intent(out) :: source(:)
    real(rp) :: effusivity(2), share
    integer :: i

    allocate (source(input%count('SOURCE')))
    do i = 1, size(source)
      associate (s => source(i))
        s%position = input%reals('SOURCE', i, 'POSITION', 3)
        s%velocity = input%reals('SOURCE', i, 'VELOCITY', 3)
        s%radius = input%real('SOURCE', i, 'RADIUS')
        s%begin = input%real('SOURCE', i, 'BEGIN')
        if (input%real('SOURCE', i, 'END') > 0.0_rp) s%end = input%real('SOURCE', i, 'END')
        select case (input%text('SOURCE', i, 'KIND'))
        case ('disc', 'ball')
          s%kind = merge(kind_disc, kind_ball, input%text('SOURCE', i, 'KIND') == 'disc')
          s%power = input%real('SOURCE', i, 'POWER')
        case default
          s%kind = kind_stir
          effusivity = sqrt([conductivity*capacity, input%real('SOURCE', i, 'TOOL_CONDUCTIVITY') &
                             *input%real('SOURCE', i, 'TOOL_DENSITY') &
                             *input%real('SOURCE', i, 'TOOL_SPECIFIC_HEAT')])
          share = effusivity(1)/sum(effusivity)
          if (input%given('SOURCE', i, 'SHARE')) share = input%real('SOURCE', i, 'SHARE')
          s%spin = share*abs(input%real('SOURCE', i, 'SPIN_RPM'))*2.0_rp*pi/60.0_rp
          s%shear = shear_curve(input, i, m)
        end select
      end associate
    end do
  end subroutine read_heat_sources

  !> Shear stress [Pa] of a stirring source over temperature [K].
  function shear_curve(input, i, m) result(curve)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i, m
    type(curve_t) :: curve
    real(rp), parameter :: step = 0.25_rp, t_max = 4000.0_rp
    real(rp), allocatable :: t(:), v(:), sticking(:)
    real(rp) :: piece(25), sliding, last
    integer :: k, n

    n = nint(t_max/step)
    allocate (sticking(n + 1), source=0.0_rp)
    if (n_values(input, m, 'YIELD_LOGISTIC') > 0) then
      piece = input%reals('MATERIAL', m, 'YIELD_LOGISTIC', 25)
      sticking = [(logistic(piece, step*real(k, rp)), k=0, n)]
    else if (n_values(input, m, 'YIELD_TABLE') > 0) then
      call split_pairs(input, m, 'YIELD_TABLE', t, v)
      sticking = [(table_value(step*real(k, rp), t, v), k=0, n)]
    end if
    last = 0.0_rp
    if (allocated(t)) last = t(size(t))
    call soften(input%real('MATERIAL', m, 'T_MELT'), last, step, sticking)
    sticking = sticking/sqrt(3.0_rp)
    sliding = input%real('SOURCE', i, 'FRICTION')*input%real('SOURCE', i, 'PRESSURE')
    curve = curve_t(0.0_rp, step, sticking)
    select case (input%text('SOURCE', i, 'CONTACT'))
    case ('sliding')
      curve%value = sliding
    case ('limited')
      curve%value = min(sliding, sticking)
    case ('mixed')
      associate (slip => input%real('SOURCE', i, 'SLIP'))
        curve%value = slip*sliding + (1.0_rp - slip)*sticking
      end associate
    case default
    end select
  end function shear_curve

  !> Reduce the yield stress to 0 at the melting temperature, over its last 5 % or above the last
  !> given temperature.
  pure subroutine soften(t_melt, last, step, yield)
    real(rp), intent(in) :: t_melt, last, step    !! [K]
    real(rp), intent(inout) :: yield(0:)
    real(rp) :: from
    integer :: k

    from = softening_from(t_melt, last)
    do k = 0, ubound(yield, 1)
      yield(k) = yield(k)*max(0.0_rp, min(1.0_rp, (t_melt - step*k)/(t_melt - from)))
    end do
  end subroutine soften

  !> Yield stress of the first piece that reaches `t`; 0 above the last [Pa].
  pure real(rp) function logistic(piece, t)
    real(rp), intent(in) :: piece(25), t
    integer :: p

    logistic = 0.0_rp
    do p = 0, 20, 5
      if (piece(p + 3) <= 0.0_rp) return
      if (t > piece(p + 5)) cycle
      logistic = max(0.0_rp, piece(p + 1) + (piece(p + 2) - piece(p + 1)) &
                     /(1.0_rp + (t/piece(p + 3))**piece(p + 4)))
      return
    end do
  end function logistic

end module heat_setup_sources
