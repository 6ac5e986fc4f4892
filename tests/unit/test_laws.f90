! SPDX-License-Identifier: MIT
!> Flow laws: each that LAW can name obeys what `flow_law_t` promises.
program test_laws
  use base_kinds, only: nlane, rp
  use base_text, only: str
  use check, only: begin_tests, end_tests, expect, expect_close
  use input_reading, only: read_input_text
  use input_values, only: input_t
  use physics_flow_law, only: flow_law_t, law_output_t, max_warnings, n_work
  use physics_laws, only: law_names, make_law
  use setup_keys, only: key_table
  implicit none (type, external)

  real(rp), parameter :: t_melt = 1356.0_rp, shear = 46.0e9_rp   !! [K], [Pa]
  class(flow_law_t), allocatable :: law
  character(32), allocatable :: names(:)
  integer :: k

  call begin_tests()
  call random_init(.true., .false.)
  allocate (names, source=[character(32) :: law_names])
  do k = 1, size(names)
    call make_law(trim(names(k)), law)
    call read_sample(trim(names(k)), law)
    call test_stress(trim(names(k)), law)
    call test_melting(trim(names(k)), law)
    call test_state(trim(names(k)), law)
    call test_words(trim(names(k)), law)
  end do
  call make_law('elastic', law)
  call expect('elastic material has no law', .not. allocated(law))
  call end_tests()

contains

  !> A law as the input describes it. A new law is a case here.
  subroutine read_sample(name, law)
    character(*), intent(in) :: name
    class(flow_law_t), intent(inout) :: law
    character(40), parameter :: no_sets(0) = ''
    character(*), parameter :: nl = new_line('a')
    character(*), parameter :: rest = ' /'//nl//'&GRID CELL=1 LOWER=3*0 UPPER=3*9 /'//nl// &
      '&TIME END=1 /'//nl//"&BODY NAME='b' MATERIAL='m' /"//nl// &
      "&SHAPE BODY='b' LOWER=3*0 UPPER=3*1 /"//nl
    character(:), allocatable :: keys
    type(input_t) :: input

    select case (name)
    case ('johnson-cook')
      keys = 'JC_A=90e6 JC_B=292e6 JC_N=0.31 JC_C=0.025 JC_M=1.09'
    case ('voce')
      keys = 'VOCE_YIELD=90e6 VOCE_SATURATION=400e6 VOCE_STRAIN=0.3 VOCE_C=0.02 VOCE_M=1.1 '// &
             'DRX_STRESS=300e6 DRX_CRITICAL_STRAIN=0.05 DRX_STRAIN=1.5'
    case ('norton')
      keys = 'NORTON_K=300e6 NORTON_N=0.2'
    case ('two-phase')
      keys = 'TP_BURGERS=2.56e-10 TP_WALLS=1e13 TP_INTERIOR=1e12 TP_SIZE=10 TP_BETA=0.0018 '// &
             'TP_K0=4.6 TP_STAR=0.2,0.05 TP_STAR_T=300,1100 RECOVERY=1e-9,80e3'
    case ('zerilli-armstrong')
      keys = 'ZA_C0=65e6 ZA_C2=890e6 ZA_C3=0.0028 ZA_C4=0.000115 ZA_C5=20e6'
    case ('sellars-tegart')
      keys = 'ST_ALPHA=1e-7 ST_N=5 ST_LN_A=30 ST_Q=260e3'
    case ('hot-working')
      keys = 'JC_A=90e6 JC_B=292e6 JC_N=0.31 JC_C=0.025 JC_M=1.09 '// &
             'ST_ALPHA=1e-7 ST_N=5 ST_LN_A=30 ST_Q=260e3'
    case ('table')
      keys = 'TABLE_STRAIN=0,0.2,1 TABLE_RATE=1,1e4 TABLE_T=298,900 '// &
             'TABLE_STRESS=9e7,2.5e8,3.8e8,1.2e8,3e8,4.5e8,4e7,1.2e8,1.8e8,6e7,1.5e8,2.2e8'
    case default
      keys = ''
    end select
    call expect('there is a sample of '//name, keys /= '')
    keys = "&MATERIAL NAME='m' LAW='"//name//"' DENSITY=1 YOUNGS_MODULUS=1 POISSON_RATIO=0"// &
           ' T_MELT='//str(t_melt)//' '//keys//rest
    call read_input_text(key_table(), 't.nml', keys, no_sets, input)
    call law%read_keys(input, 1, shear)
    call expect(name//': nothing is wrong with its sample', input%diagnostics%count() == 0)
    if (input%diagnostics%count() > 0) call input%diagnostics%print(6)
  end subroutine read_sample

  !> Random states of a block after a strain of 0.1.
  subroutine random_block(law, temp, alpha, log_rate, state)
    class(flow_law_t), intent(in) :: law
    real(rp), intent(out), dimension(nlane) :: temp, alpha, log_rate   !! [K], [-], [ln 1/s]
    real(rp), intent(out) :: state(nlane, law%n_state)
    real(rp) :: work(nlane, n_work), x(nlane)
    integer :: p

    call random_number(temp)
    temp = 300.0_rp + 900.0_rp*temp
    call random_number(alpha)
    alpha = 0.1_rp + 0.05_rp*alpha
    call random_number(log_rate)
    log_rate = log(1.0e-3_rp) + log(1.0e5_rp)*log_rate
    do p = 1, nlane
      call law%start(state(p, :))
    end do
    call law%prepare(temp, state, work)
    x = alpha
    call law%advance(work, x, log_rate, state)
  end subroutine random_block

  !> Stress is there, does not fall with the rate, and its slope is the difference quotient by ln x;
  !> with internal variables only of small increments, as the slope leaves out what the rate changes
  !> in them.
  subroutine test_stress(name, law)
    character(*), intent(in) :: name
    class(flow_law_t), intent(in) :: law
    real(rp), parameter :: h = 1.0e-4_rp
    real(rp), dimension(nlane) :: temp, alpha, log_rate, x, sigma, slope, above, below, unused
    real(rp) :: state(nlane, law%n_state), work(nlane, n_work)

    call random_block(law, temp, alpha, log_rate, state)
    x = merge(1.0e-6_rp, 1.0e-2_rp, law%n_state > 0)
    call law%prepare(temp, state, work)
    call law%stress(work, alpha, x, log_rate, sigma, slope)
    call law%stress(work, alpha, x*exp(h), log_rate + h, above, unused)
    call law%stress(work, alpha, x*exp(-h), log_rate - h, below, unused)
    call expect(name//': stress', all(sigma > 0.0_rp))
    call expect(name//': it does not fall with the rate', all(slope >= 0.0_rp))
    call expect(name//': and grows somewhere', any(slope > 1.0e-3_rp*sigma))
    call expect_close(name//': slope', maxval(abs(slope - (above - below)/(2.0_rp*h))/sigma), &
                      0.0_rp, atol=merge(2.0e-6_rp, 1.0e-7_rp, law%n_state > 0))
  end subroutine test_stress

  !> No strength from T_MELT on.
  subroutine test_melting(name, law)
    character(*), intent(in) :: name
    class(flow_law_t), intent(in) :: law
    real(rp), dimension(nlane) :: temp, alpha, log_rate, x, sigma, slope
    real(rp) :: state(nlane, law%n_state), work(nlane, n_work)
    integer :: p

    call random_block(law, temp, alpha, log_rate, state)
    temp = [(t_melt*(1.0_rp + 0.1_rp*p), p=0, nlane - 1)]
    x = 1.0e-4_rp
    call law%prepare(temp, state, work)
    call law%stress(work, alpha, x, log_rate, sigma, slope)
    call expect_close(name//': molten', maxval(abs(sigma)), 0.0_rp, atol=1.0e-3_rp)
  end subroutine test_melting

  !> No increment, no change of the internal variables; outputs are numbers.
  subroutine test_state(name, law)
    character(*), intent(in) :: name
    class(flow_law_t), intent(in) :: law
    real(rp), dimension(nlane) :: temp, alpha, log_rate, none
    real(rp) :: before(nlane, law%n_state), state(nlane, law%n_state), work(nlane, n_work)
    real(rp), allocatable :: values(:, :)

    call random_block(law, temp, alpha, log_rate, state)
    before = state
    none = 0.0_rp
    call law%prepare(temp, state, work)
    call law%advance(work, none, log_rate, state)
    call expect(name//': state without an increment', all(abs(state - before) <= 0.0_rp))
    associate (list => law%outputs())
      allocate (values(nlane, size(list)), source=-huge(1.0_rp))
      call law%describe(state, size(list), values)
      call expect(name//': outputs', all(values >= 0.0_rp .and. values < huge(1.0_rp)))
    end associate
  end subroutine test_state

  !> Outputs and warnings have names, all different, and are not too many; far outside of all that a
  !> law may have been fitted for, only kinds that have a name are counted.
  subroutine test_words(name, law)
    character(*), intent(in) :: name
    class(flow_law_t), intent(in) :: law
    type(law_output_t), allocatable :: list(:)
    character(48), allocatable :: texts(:)
    real(rp), dimension(nlane) :: temp, alpha, log_rate, rate
    real(rp) :: state(nlane, law%n_state)
    integer :: counts(max_warnings), lane(max_warnings), i

    allocate (list, source=law%outputs())
    call law%list_warnings(texts)
    call expect(name//': not too many warnings', size(texts) <= max_warnings)
    call expect(name//': names', all(list%name /= '') .and. all(texts /= ''))
    do i = 2, size(list)
      call expect(name//': outputs differ', all(list(:i - 1)%name /= list(i)%name))
    end do
    call random_block(law, temp, alpha, log_rate, state)
    temp = 1.0e6_rp
    rate = 1.0e12_rp
    counts = 0
    lane = 0
    call law%inspect(nlane - 1, temp, rate, state, counts, lane)
    call expect(name//': kinds of warnings', all(counts(size(texts) + 1:) == 0))
    call expect(name//': as many as looked at', all(counts <= nlane - 1))
    call expect(name//': the first of each kind', all((counts > 0) .eqv. (lane > 0)))
  end subroutine test_words

end program test_laws
