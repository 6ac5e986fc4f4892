! SPDX-License-Identifier: MIT
!> Rows of the table of input keys that belong to flow laws and to paths of a material point.
module groups_laws
  use keys_table, only: key_table_t
  implicit none (type, external)
  private

  public :: add_laws, add_paths, most_points, most_values

  integer, parameter :: most_points = 64     !! of a table in one variable
  integer, parameter :: most_values = 4096   !! of a table of flow stress

contains

  !> Keys of &MATERIAL for the flow laws.
  subroutine add_laws(t)
    type(key_table_t), intent(inout) :: t

    call t%key('LAW', 'choice', 1, '', 'elastic', &
      'elastic johnson-cook norton two-phase zerilli-armstrong sellars-tegart table', &
      'material law')
    call t%key('NORTON_K', 'real', 1, 'Pa', 'required if LAW = norton', '(0,inf)', &
      'flow stress at a strain rate of 1/s: NORTON_K rate^NORTON_N')
    call t%key('NORTON_N', 'real', 1, '', 'required if LAW = norton', '(0,1]', &
      'exponent of the strain rate')
    call add_johnson_cook(t)
    call add_two_phase(t)
    call add_annealing(t)
    call add_others(t)
  end subroutine add_laws

  subroutine add_johnson_cook(t)
    type(key_table_t), intent(inout) :: t

    call t%key('JC_A', 'real', 1, 'Pa', 'required if LAW = johnson-cook', '(0,inf)', &
      'initial yield stress at T_ROOM and JC_RATE0')
    call t%key('JC_B', 'real', 1, 'Pa', 'required if LAW = johnson-cook', '[0,inf)', &
      'hardening modulus')
    call t%key('JC_N', 'real', 1, '', 'required if LAW = johnson-cook', '[0,inf)', &
      'hardening exponent')
    call t%key('JC_C', 'real', 1, '', 'required if LAW = johnson-cook', '[0,inf)', &
      'sensitivity to the strain rate')
    call t%key('JC_M', 'real', 1, '', 'required if LAW = johnson-cook', '(0,inf)', &
      'exponent of thermal softening')
    call t%key('JC_RATE0', 'real', 1, '1/s', '1 if LAW = johnson-cook', '(0,inf)', &
      'reference strain rate')
  end subroutine add_johnson_cook

  subroutine add_two_phase(t)
    type(key_table_t), intent(inout) :: t

    call t%key('TP_SIGMA0', 'real', 1, 'Pa', '0 if LAW = two-phase', '[0,inf)', &
      'flow stress without dislocations, sigma_0')
    call t%key('TP_ALPHA', 'real', 1, '', '0.25 if LAW = two-phase', '(0,inf)', &
      'alpha of M alpha G b sqrt(rho); G is the shear modulus of the elastic constants')
    call t%key('TP_BURGERS', 'real', 1, 'm', 'required if LAW = two-phase', '(0,inf)', &
      'Burgers vector, b')
    call t%key('TP_TAYLOR', 'real', 1, '', '3.06 if LAW = two-phase', '(0,inf)', 'Taylor factor, M')
    call t%key('TP_WALLS', 'real', 1, '1/m2', 'required if LAW = two-phase', '(0,inf)', &
      'initial dislocation density in the walls of the subgrains')
    call t%key('TP_INTERIOR', 'real', 1, '1/m2', 'required if LAW = two-phase', '(0,inf)', &
      'initial dislocation density inside the subgrains')
    call t%key('TP_F0', 'real', 1, '', '0.25 if LAW = two-phase', '(0,1)', &
      'initial volume fraction of the walls')
    call t%key('TP_F_END', 'real', 1, '', '0.06 if LAW = two-phase', '(0,1)', &
      'volume fraction of the walls at the end')
    call t%key('TP_GAMMA', 'real', 1, '', '3.2 if LAW = two-phase', '(0,inf)', &
      'shear strain in which the fraction of the walls falls')
    call t%key('TP_SIZE', 'real', 1, '', 'required if LAW = two-phase', '(0,inf)', &
      'K of the grain size K/sqrt(rho)')
    call t%key('TP_BETA', 'real', 1, '', 'required if LAW = two-phase', '[0,inf)', &
      'beta*: dislocations from the interior stored in the walls')
    call t%key('TP_K0', 'real', 1, '', 'required if LAW = two-phase', '[0,inf)', &
      'dynamic recovery, k_0')
    call t%key('TP_A', 'real', 1, 'K', '30000 if LAW = two-phase', '(0,inf)', &
      'm = A/T, 1/m: exponent of the rate')
    call t%key('TP_B', 'real', 1, 'K', '14900 if LAW = two-phase', '(0,inf)', &
      'n = B/T, 1/n: exponent of the rate in dynamic recovery')
    call t%key('TP_RATE0', 'real', 1, '1/s', '1000 if LAW = two-phase', '(0,inf)', &
      'reference shear rate; shear rates should stay below it')
    call t%key('TP_STAR', 'real', -most_points, '', 'if LAW = two-phase', '', &
      'alpha* at the temperatures TP_STAR_T: linear between, constant outside; one value: constant')
    call t%key('TP_STAR_T', 'real', -most_points, 'K', 'if LAW = two-phase', '(0,inf)', &
      'rising temperatures of TP_STAR')
    call t%key('TP_STAR_FIT', 'real', 3, '', 'if LAW = two-phase', '', &
      'instead of TP_STAR: a [K], b [K], c of alpha* = a/(T + b) + c')
    call t%key('TP_STAR_RANGE', 'real', 2, 'K', 'if LAW = two-phase', '(0,inf)', &
      'temperatures between which it holds')
    call t%key('TP_STAR_ENDS', 'real', 2, '', 'if LAW = two-phase', '', 'alpha* below and above')
    call t%key('TP_CALIBRATED', 'real', 2, 'K', '0 1e5 if LAW = two-phase', '[0,inf)', &
      'temperatures between which the law was fitted; flow outside is counted and reported')
  end subroutine add_two_phase

  subroutine add_annealing(t)
    type(key_table_t), intent(inout) :: t

    call t%key('RECOVERY', 'real', 2, '', '0 0 if LAW = two-phase', '[0,inf)', &
      'two-phase: C [m^(2n-2)/s] and Q [J/mol] of d rho/dt = -C exp(-Q/(R T)) rho^n; 0: none')
    call t%key('RECOVERY_EXPONENT', 'real', 1, '', '2 if LAW = two-phase', '(1,10]', 'n')
    call t%key('GROWTH', 'real', 2, '', '0 0 if LAW = two-phase', '[0,inf)', &
      'two-phase: C [m^m/s] and Q [J/mol] of d(d^m)/dt = C exp(-Q/(R T)) of the grain size; '// &
      '0: none')
    call t%key('GROWTH_EXPONENT', 'real', 1, '', '2 if LAW = two-phase', '[1,20]', 'm')
    call t%key('RECRYSTALLISATION', 'real', 2, '', '0 0 if LAW = two-phase', '[0,inf)', &
      'two-phase: mobility [m4/(J s)] and Q [J/mol] of the fronts of new grains; 0: none')
    call t%key('NUCLEATION_DENSITY', 'real', 1, '1/m2', '0 if LAW = two-phase', '[0,inf)', &
      'dislocation density above which new grains grow')
    call t%key('NUCLEUS_SPACING', 'real', 1, 'm', '0 if LAW = two-phase', '[0,inf)', &
      'distance of the nuclei, and size of the new grains; above 0 with RECRYSTALLISATION')
    call t%key('RECRYSTALLISED_STRAIN', 'real', 1, '', '0.5 if LAW = two-phase', '(0,inf)', &
      'plastic strain in which new grains become deformed ones')
  end subroutine add_annealing

  subroutine add_others(t)
    type(key_table_t), intent(inout) :: t

    call t%key('ZA_C0', 'real', 1, 'Pa', 'required if LAW = zerilli-armstrong', '[0,inf)', &
      'sigma = C0 + (C1 + C2 sqrt(eps)) exp(-C3 T + C4 T ln(rate)) + C5 eps^N')
    call t%key('ZA_C1', 'real', 1, 'Pa', '0 if LAW = zerilli-armstrong', '[0,inf)', &
      'body-centred metals')
    call t%key('ZA_C2', 'real', 1, 'Pa', '0 if LAW = zerilli-armstrong', '[0,inf)', &
      'face-centred metals')
    call t%key('ZA_C3', 'real', 1, '1/K', 'required if LAW = zerilli-armstrong', '[0,inf)', &
      'thermal softening')
    call t%key('ZA_C4', 'real', 1, '1/K', 'required if LAW = zerilli-armstrong', '[0,inf)', &
      'sensitivity to the strain rate')
    call t%key('ZA_C5', 'real', 1, 'Pa', '0 if LAW = zerilli-armstrong', '[0,inf)', &
      'athermal hardening')
    call t%key('ZA_N', 'real', 1, '', '0.5 if LAW = zerilli-armstrong', '(0,1]', 'its exponent')
    call t%key('ST_ALPHA', 'real', 1, '1/Pa', 'required if LAW = sellars-tegart', '(0,inf)', &
      'sigma = asinh((Z/A)^(1/n))/alpha, Z = rate exp(Q/(R T))')
    call t%key('ST_N', 'real', 1, '', 'required if LAW = sellars-tegart', '[1,inf)', 'n')
    call t%key('ST_LN_A', 'real', 1, '', 'required if LAW = sellars-tegart', '', 'ln A, A in 1/s')
    call t%key('ST_Q', 'real', 1, 'J/mol', 'required if LAW = sellars-tegart', '[0,inf)', &
      'activation energy')
    call t%key('TABLE_STRAIN', 'real', -most_points, '', 'required if LAW = table', '[0,inf)', &
      'rising plastic strains of the table')
    call t%key('TABLE_RATE', 'real', -most_points, '1/s', '1 if LAW = table', '(0,inf)', &
      'rising strain rates; between them the stress is linear in ln(rate)')
    call t%key('TABLE_T', 'real', -most_points, 'K', '298 if LAW = table', '(0,inf)', &
      'rising temperatures')
    call t%key('TABLE_STRESS', 'real', -most_values, 'Pa', 'required if LAW = table', '[0,inf)', &
      'flow stress; the strain runs fastest, then the rate, then the temperature; '// &
      'constant outside the table')
  end subroutine add_others

  !> The group &PATH of `stirpoint --material`.
  subroutine add_paths(t)
    type(key_table_t), intent(inout) :: t

    call t%group('PATH', 'repeat', &
      'A path of a material point for stirpoint --material: one curve NAME.csv. Not used in runs.')
    call t%key('NAME', 'text', 1, '', 'required', 'file name', 'name of the curve and of its file')
    call t%key('MATERIAL', 'text', 1, '', 'required', '', 'NAME of the &MATERIAL')
    call t%key('KIND', 'choice', 1, '', 'strain', 'strain shear history', &
      'strain: at given plastic strain rate; shear: simple shear through elasticity and '// &
      'return; history: as FILE says')
    call t%key('RATE', 'real', 1, '1/s', '1 if KIND = strain or shear', '(0,inf)', &
      'plastic strain rate; shear: von Mises rate, the shear rate is sqrt(3) of it')
    call t%key('STRAIN', 'real', 1, '', '1 if KIND = strain or shear', '(0,inf)', &
      'strain at the end')
    call t%key('TEMPERATURE', 'real', 1, 'K', '298', '(0,inf)', 'at the start')
    call t%key('ADIABATIC', 'logical', 1, '', '.false.', '', &
      'PLASTIC_HEAT of the plastic work heats the point')
    call t%key('STEP', 'real', 1, '', '1e-3', '(0,0.1]', 'longest increment of strain')
    call t%key('ROWS', 'integer', 1, '', '200', '[1,1000000]', 'rows of the curve')
    call t%key('FILE', 'text', 1, '', 'required if KIND = history', '', &
      'CSV with columns time[s], temperature[K] and plastic_strain[1] or strain_rate[1/s], '// &
      'beside the input')

    call t%may_change('PATH', '*')
  end subroutine add_paths

end module groups_laws
