! SPDX-License-Identifier: MIT
!> The flow law that LAW of a &MATERIAL names.
module materials_flow_laws
  use base_kinds, only: rp
  use base_text, only: str
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  use physics_annealing, only: arrhenius_t
  use physics_flow_law, only: flow_law_t
  use physics_flow_table, only: flow_table_t
  use physics_johnson_cook, only: johnson_cook_t
  use physics_material, only: material_t
  use physics_norton, only: norton_t
  use physics_sellars_tegart, only: sellars_tegart_t
  use physics_two_phase, only: alpha_star_t, n_two_phase, n_two_phase_annealing, two_phase_t
  use physics_zerilli_armstrong, only: zerilli_armstrong_t
  implicit none (type, external)
  private

  public :: read_flow_law, softening_from

  character(*), parameter :: group = 'MATERIAL'

contains

  !> Allocate `material%flow`; stays unallocated for LAW = 'elastic'. A new law is one line here.
  subroutine read_flow_law(input, i, material, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i                        !! number of the &MATERIAL
    type(material_t), intent(inout) :: material     !! with its elastic constants
    type(diagnostics_t), intent(inout) :: diagnostics

    select case (input%text(group, i, 'LAW'))
    case ('johnson-cook')
      call read_johnson_cook(input, i, material, diagnostics)
    case ('norton')
      allocate (material%flow, source=norton_t(k=input%real(group, i, 'NORTON_K'), &
                                               n=input%real(group, i, 'NORTON_N')))
    case ('two-phase')
      call read_two_phase(input, i, material, diagnostics)
    case ('zerilli-armstrong')
      allocate (material%flow, source=zerilli_armstrong_t( &
        c0=input%real(group, i, 'ZA_C0'), c1=input%real(group, i, 'ZA_C1'), &
        c2=input%real(group, i, 'ZA_C2'), c3=input%real(group, i, 'ZA_C3'), &
        c4=input%real(group, i, 'ZA_C4'), c5=input%real(group, i, 'ZA_C5'), &
        n=input%real(group, i, 'ZA_N')))
    case ('sellars-tegart')
      allocate (material%flow, source=sellars_tegart_t( &
        alpha=input%real(group, i, 'ST_ALPHA'), n=input%real(group, i, 'ST_N'), &
        log_a=input%real(group, i, 'ST_LN_A'), q=input%real(group, i, 'ST_Q')))
    case ('table')
      call read_table(input, i, material, diagnostics)
    case default   ! elastic
    end select
    if (allocated(material%flow)) call read_melting(input, i, material%flow, diagnostics)
  end subroutine read_flow_law

  !> Temperature from which strength falls to 0 at `t_melt`: the last twentieth, but not where the
  !> law is `calibrated` [K].
  pure real(rp) function softening_from(t_melt, calibrated)
    real(rp), intent(in) :: t_melt, calibrated

    softening_from = max(0.95_rp*t_melt, min(calibrated, 0.999_rp*t_melt))
  end function softening_from

  !> The strength of a law that knows no melting falls to 0 over the last twentieth of T_MELT, but
  !> not below the highest temperature it is calibrated for.
  subroutine read_melting(input, i, law, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    class(flow_law_t), intent(inout) :: law
    type(diagnostics_t), intent(inout) :: diagnostics
    real(rp) :: calibrated, range(2), t_melt
    logical :: is_given

    is_given = input%given(group, i, 'T_MELT')
    if (.not. is_given) return
    t_melt = input%real(group, i, 'T_MELT')
    calibrated = 0.0_rp
    select type (law)
    type is (johnson_cook_t)
      return
    type is (two_phase_t)
      is_given = input%given(group, i, 'TP_CALIBRATED')
      range = input%reals(group, i, 'TP_CALIBRATED', 2)
      if (is_given) calibrated = range(2)
    type is (flow_table_t)
      if (size(law%temp) > 1) calibrated = law%temp(size(law%temp))
      if (calibrated > t_melt) call input%report(diagnostics, group, i, 'TABLE_T', &
        'reaches above T_MELT = '//str(t_melt)//' K')
    class default
    end select
    law%melts_at = t_melt
    law%softens_at = softening_from(t_melt, calibrated)
  end subroutine read_melting

  subroutine read_johnson_cook(input, i, material, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(material_t), intent(inout) :: material
    type(diagnostics_t), intent(inout) :: diagnostics
    type(johnson_cook_t) :: law

    law%a = input%real(group, i, 'JC_A')
    law%b = input%real(group, i, 'JC_B')
    law%n = input%real(group, i, 'JC_N')
    law%c = input%real(group, i, 'JC_C')
    law%m = input%real(group, i, 'JC_M')
    law%rate0 = input%real(group, i, 'JC_RATE0')
    law%t_room = input%real(group, i, 'T_ROOM')
    law%t_melt = input%real(group, i, 'T_MELT')
    if (law%t_melt > 0.0_rp .and. law%t_melt <= law%t_room) call input%report(diagnostics, group, &
        i, 'T_MELT', &
      'must be above T_ROOM')
    allocate (material%flow, source=law)
  end subroutine read_johnson_cook

  subroutine read_two_phase(input, i, material, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(material_t), intent(inout) :: material
    type(diagnostics_t), intent(inout) :: diagnostics
    type(two_phase_t) :: law

    law%sigma0 = input%real(group, i, 'TP_SIGMA0')
    law%taylor = input%real(group, i, 'TP_TAYLOR')
    law%alpha = input%real(group, i, 'TP_ALPHA')
    law%shear = material%g
    law%burgers = input%real(group, i, 'TP_BURGERS')
    law%beta = input%real(group, i, 'TP_BETA')
    law%k0 = input%real(group, i, 'TP_K0')
    law%a = input%real(group, i, 'TP_A')
    law%b = input%real(group, i, 'TP_B')
    law%rate0 = input%real(group, i, 'TP_RATE0')
    law%size = input%real(group, i, 'TP_SIZE')
    law%f0 = input%real(group, i, 'TP_F0')
    law%f_end = input%real(group, i, 'TP_F_END')
    law%gamma = input%real(group, i, 'TP_GAMMA')
    law%walls = input%real(group, i, 'TP_WALLS')
    law%interior = input%real(group, i, 'TP_INTERIOR')
    law%calibrated = input%reals(group, i, 'TP_CALIBRATED', 2)
    call read_alpha_star(input, i, law%alpha_star, diagnostics)
    call read_annealing(input, i, law, diagnostics)
    law%n_state = merge(n_two_phase_annealing, n_two_phase, law%anneals)
    allocate (material%flow, source=law)
  end subroutine read_two_phase

  !> alpha* as a table, a constant or a fit.
  subroutine read_alpha_star(input, i, star, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(alpha_star_t), intent(inout) :: star
    type(diagnostics_t), intent(inout) :: diagnostics

    if (input%given(group, i, 'TP_STAR_FIT') .eqv. input%given(group, i, 'TP_STAR')) then
      call input%report(diagnostics, group, i, 'TP_STAR', &
                          'give alpha* either by TP_STAR or by TP_STAR_FIT')
    else if (input%given(group, i, 'TP_STAR_FIT')) then
      if (size(input%list(group, i, 'TP_STAR_RANGE')) + size(input%list(group, i, 'TP_STAR_ENDS')) &
          < 4) then
        call input%report(diagnostics, group, i, 'TP_STAR_FIT', &
                            'needs TP_STAR_RANGE and TP_STAR_ENDS')
        return
      end if
      star%fit = input%reals(group, i, 'TP_STAR_FIT', 3)
      associate (range => input%reals(group, i, 'TP_STAR_RANGE', 2), &
                 ends => input%reals(group, i, 'TP_STAR_ENDS', 2))
        star%from = range(1)
        star%to = range(2)
        star%below = ends(1)
        star%above = ends(2)
      end associate
      if (star%to < star%from) call input%report(diagnostics, group, i, 'TP_STAR_RANGE', &
                                                   'must rise')
      if (star%from + star%fit(2) <= 0.0_rp) call input%report(diagnostics, group, i, &
        'TP_STAR_FIT', 'has its pole within TP_STAR_RANGE')
    else
      star%value = input%list(group, i, 'TP_STAR')
      star%t = [1.0_rp]
      if (size(star%value) > 1) star%t = input%list(group, i, 'TP_STAR_T')
      call check_points(input, i, 'TP_STAR_T', star%t, diagnostics)
      if (size(star%t) /= size(star%value)) call input%report(diagnostics, group, i, 'TP_STAR', &
        'has '//str(size(star%value))//' values, TP_STAR_T '//str(size(star%t)))
    end if
  end subroutine read_alpha_star

  subroutine read_annealing(input, i, law, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(two_phase_t), intent(inout) :: law
    type(diagnostics_t), intent(inout) :: diagnostics

    associate (a => law%annealing)
      a%recovery = arrhenius('RECOVERY')
      a%growth = arrhenius('GROWTH')
      a%mobility = arrhenius('RECRYSTALLISATION')
      a%recovery_exponent = input%real(group, i, 'RECOVERY_EXPONENT')
      a%growth_exponent = input%real(group, i, 'GROWTH_EXPONENT')
      a%threshold = input%real(group, i, 'NUCLEATION_DENSITY')
      a%spacing = input%real(group, i, 'NUCLEUS_SPACING')
      a%strain = input%real(group, i, 'RECRYSTALLISED_STRAIN')
      law%anneals = a%recovery%factor > 0.0_rp .or. a%growth%factor > 0.0_rp &
                    .or. a%mobility%factor > 0.0_rp
      if (a%mobility%factor > 0.0_rp .and. a%spacing <= 0.0_rp) call input%report(diagnostics, &
        group, i, 'NUCLEUS_SPACING', 'must be above 0 with RECRYSTALLISATION')
    end associate
  contains
    type(arrhenius_t) function arrhenius(key)
      character(*), intent(in) :: key
      real(rp) :: pair(2)

      pair = input%reals(group, i, key, 2)
      arrhenius = arrhenius_t(pair(1), pair(2))
    end function arrhenius
  end subroutine read_annealing

  subroutine read_table(input, i, material, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(material_t), intent(inout) :: material
    type(diagnostics_t), intent(inout) :: diagnostics
    type(flow_table_t) :: law
    real(rp), allocatable :: values(:)
    integer :: wanted

    law%strain = input%list(group, i, 'TABLE_STRAIN')
    law%log_rate = log(input%list(group, i, 'TABLE_RATE'))
    law%temp = input%list(group, i, 'TABLE_T')
    values = input%list(group, i, 'TABLE_STRESS')
    call check_points(input, i, 'TABLE_STRAIN', law%strain, diagnostics)
    call check_points(input, i, 'TABLE_RATE', law%log_rate, diagnostics)
    call check_points(input, i, 'TABLE_T', law%temp, diagnostics)
    wanted = size(law%strain)*size(law%log_rate)*size(law%temp)
    if (wanted == 0 .or. size(values) /= wanted) then
      call input%report(diagnostics, group, i, 'TABLE_STRESS', 'has '//str(size(values))// &
                          ' values, the table has '//str(wanted))
      return
    end if
    law%sigma = reshape(values, [size(law%strain), size(law%log_rate), size(law%temp)])
    allocate (material%flow, source=law)
  end subroutine read_table

  !> Points of a table must rise.
  subroutine check_points(input, i, key, points, diagnostics)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    character(*), intent(in) :: key
    real(rp), intent(in) :: points(:)
    type(diagnostics_t), intent(inout) :: diagnostics

    if (size(points) == 0) return
    if (any(points(2:) <= points(:size(points) - 1))) call input%report(diagnostics, group, i, &
      key, 'must rise from value to value')
  end subroutine check_points

end module materials_flow_laws
