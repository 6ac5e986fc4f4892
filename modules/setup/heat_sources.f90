! SPDX-License-Identifier: MIT
!> Moving sources of heat-only scenes, shear stress of stirring sources from strength tables, and
!> checks of sources and conductivities.
module setup_heat_sources
  use base_kinds, only: pi, rp
  use heat_curve, only: curve_t, table_value
  use heat_sources, only: heat_source_t, kind_stir
  use input_tables, only: rises
  use input_values, only: input_t
  use physics_flow_law, only: softening_from
  implicit none (type, external)
  private

  public :: check_heat_sense, check_tables, n_values, read_heat_sources

contains

  !> Check that strengths are pairs of rising temperature, and that pieces have five values.
  subroutine check_tables(input)
    type(input_t), intent(in) :: input
    real(rp), allocatable :: t(:), v(:)
    integer :: i, n

    do i = 1, input%count('MATERIAL')
      n = n_values(input, i, 'YIELD_TABLE')
      if (n > 0) then
        call split_pairs(input, i, 'YIELD_TABLE', t, v)
        if (.not. rises(t)) call input%report('MATERIAL', i, 'YIELD_TABLE', 'must be pairs in '// &
                                              'rising temperature')
      end if
      if (mod(n_values(input, i, 'YIELD_LOGISTIC'), 5) /= 0) then
        call input%report('MATERIAL', i, 'YIELD_LOGISTIC', 'must be pieces of five values')
      end if
    end do
  end subroutine check_tables

  !> Number of values given in a list: up to the last nonzero one.
  integer function n_values(input, i, key)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    character(*), intent(in) :: key
    real(rp) :: x(64)
    integer :: max_values

    n_values = 0
    if (.not. input%given('MATERIAL', i, key)) return
    max_values = merge(25, 64, key == 'YIELD_LOGISTIC')
    x = 0.0_rp
    x(:max_values) = input%reals('MATERIAL', i, key, max_values)
    n_values = findloc(abs(x) > 0.0_rp, .true., dim=1, back=.true.)
    if (key == 'YIELD_TABLE') n_values = n_values + mod(n_values, 2)   ! a table may end with 0 Pa
  end function n_values

  !> Temperatures and values of a table.
  subroutine split_pairs(input, i, key, t, v)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    character(*), intent(in) :: key
    real(rp), allocatable, intent(out) :: t(:), v(:)
    real(rp) :: x(64)
    integer :: n

    x = input%reals('MATERIAL', i, key, 64)
    n = n_values(input, i, key)
    t = x(1:n:2)
    v = x(2:n:2)
  end subroutine split_pairs

  !> Report sources without heat, and conduction without conductivity.
  subroutine check_heat_sense(input)
    type(input_t), intent(in) :: input
    real(rp) :: conductivity
    integer :: i

    do i = 1, input%count('SOURCE')
      if (input%text('SOURCE', i, 'KIND') == 'stir') then
        call check_stir(input, i)
      else if (abs(input%real('SOURCE', i, 'POWER')) <= 0.0_rp) then
        call input%report('SOURCE', i, 'POWER', 'the source gives no heat')
      end if
    end do
    if (input%count('HEAT') == 0) return
    conductivity = 0.0_rp
    do i = 1, input%count('MATERIAL')
      conductivity = max(conductivity, input%real('MATERIAL', i, 'CONDUCTIVITY'))
      if (input%given('MATERIAL', i, 'CONDUCTIVITY_TABLE')) conductivity = max(conductivity, 1.0_rp)
    end do
    if (conductivity <= 0.0_rp .and. .not. input%logical('METHOD', 1, 'MECHANICS')) then
      call input%report('MATERIAL', 1, 'CONDUCTIVITY', 'must be above 0 with MECHANICS = F')
    else if (conductivity <= 0.0_rp) then
      call input%warn('MATERIAL', 1, 'CONDUCTIVITY', 'there is a &HEAT group, and no material '// &
                      'conducts')
    end if
  end subroutine check_heat_sense

  !> Check that a stirring source rotates, and that a sliding one has pressure and friction.
  subroutine check_stir(input, i)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    character(:), allocatable :: contact

    contact = input%text('SOURCE', i, 'CONTACT')
    if (abs(input%real('SOURCE', i, 'SPIN_RPM')) <= 0.0_rp) then
      call input%report('SOURCE', i, 'SPIN_RPM', 'the source does not turn (0 is the default): '// &
                        'it gives no heat')
    end if
    if (input%given('SOURCE', i, 'SHARE') .and. input%real('SOURCE', i, 'SHARE') <= 0.0_rp) then
      call input%report('SOURCE', i, 'SHARE', 'none of the heat enters the body')
    end if
    if (contact == 'sticking') return
    if (contact == 'mixed' .and. input%real('SOURCE', i, 'SLIP') <= 0.0_rp) return
    if (input%real('SOURCE', i, 'PRESSURE') <= 0.0_rp) then
      call input%report('SOURCE', i, 'PRESSURE', "is 0 (the default): CONTACT = '"//contact// &
                        "' gives no heat by sliding")
    end if
    if (input%real('SOURCE', i, 'FRICTION') <= 0.0_rp) then
      call input%report('SOURCE', i, 'FRICTION', "is 0 (the default): CONTACT = '"//contact// &
                        "' gives no heat by sliding")
    end if
  end subroutine check_stir

  !> Read all &SOURCE groups. Stirring sources share the heat with the tool by effusivities.
  subroutine read_heat_sources(input, m, conductivity, capacity, source)
    type(input_t), intent(in) :: input
    integer, intent(in) :: m                       !! index of the material
    real(rp), intent(in) :: conductivity            !! [W/(m K)]
    real(rp), intent(in) :: capacity                !! volumetric heat capacity [J/(m3 K)]
    type(heat_source_t), allocatable, intent(out) :: source(:)
    real(rp) :: effusivity(2), share
    integer :: i

    allocate (source(input%count('SOURCE')))
    do i = 1, size(source)
      associate (s => source(i))
        call s%read_keys(input, i)
        if (s%kind == kind_stir) then
          effusivity = sqrt([conductivity*capacity, input%real('SOURCE', i, 'TOOL_CONDUCTIVITY') &
                             *input%real('SOURCE', i, 'TOOL_DENSITY') &
                             *input%real('SOURCE', i, 'TOOL_SPECIFIC_HEAT')])
          share = effusivity(1)/sum(effusivity)
          if (input%given('SOURCE', i, 'SHARE')) share = input%real('SOURCE', i, 'SHARE')
          s%spin = share*abs(input%real('SOURCE', i, 'SPIN_RPM'))*2.0_rp*pi/60.0_rp
          s%shear = shear_curve(input, i, m)
        end if
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
    real(rp) :: piece(25), from, last, sliding, t_melt
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
    ! 0 at the melting temperature; decreasing over its last 5 % or above the last given temperature
    t_melt = input%real('MATERIAL', m, 'T_MELT')
    from = softening_from(t_melt, last)
    sticking = sticking*max(0.0_rp, min(1.0_rp, (t_melt - step*[(k, k=0, n)])/(t_melt - from)))
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

end module setup_heat_sources
