! SPDX-License-Identifier: MIT
!> Conditions that prescribe velocities of nodes: each that the input knows obeys what `clamp_t`
!> promises.
program test_conditions
  use base_kinds, only: rp
  use check, only: begin_tests, end_tests, expect
  use input_reading, only: read_input_text
  use input_values, only: input_t
  use setup_keys, only: key_table
  use state_clamp, only: clamp_t
  use state_conditions, only: append_clamp, clamp_groups, held_t, make_clamp
  implicit none (type, external)

  call begin_tests()
  call random_init(.true., .false.)
  call test_kinds()
  call test_append()
  call end_tests()

contains

  !> What all promise, of each group.
  subroutine test_kinds()
    class(clamp_t), allocatable :: clamp
    character(16), allocatable :: groups(:)
    integer :: k

    allocate (groups, source=clamp_groups)
    do k = 1, size(groups)
      call make_clamp(trim(groups(k)), clamp)
      call read_sample(trim(groups(k)), clamp)
      call test_velocity(trim(groups(k)), clamp)
    end do
    call make_clamp('no such group', clamp)
    call expect('a name of no group', .not. allocated(clamp))
  end subroutine test_kinds

  !> A moving condition on x and z in a box, as the input describes it. A new one is a case here.
  subroutine read_sample(group, clamp)
    character(*), intent(in) :: group
    class(clamp_t), intent(inout) :: clamp
    character(40), parameter :: no_sets(0) = ''
    character(*), parameter :: nl = new_line('a')
    character(*), parameter :: rest = '&GRID CELL=1 LOWER=3*0 UPPER=3*9 /'//nl// &
      '&TIME END=1 /'//nl//"&MATERIAL NAME='m' DENSITY=1 YOUNGS_MODULUS=1 POISSON_RATIO=0 /"//nl// &
      "&BODY NAME='b' MATERIAL='m' /"//nl//"&SHAPE BODY='b' LOWER=3*0 UPPER=3*1 /"//nl
    character(:), allocatable :: keys
    type(input_t) :: input

    select case (group)
    case ('CLAMP')
      keys = 'VELOCITY=3,0,-1'
    case default
      keys = ''
    end select
    call expect('there is a sample of &'//group, keys /= '')
    keys = '&'//group//" LOWER=1,2,3 UPPER=4,5,6 COMPONENTS='xz' "//keys//' /'//nl//rest
    call read_input_text(key_table(), 't.nml', keys, no_sets, input)
    call clamp%read_keys(input, 1)
    call expect(group//': nothing is wrong with its sample', input%diagnostics%count() == 0)
    if (input%diagnostics%count() > 0) call input%diagnostics%print(6)
    call expect(group//': lower corner', all(nint(clamp%lower) == [1, 2, 3]))
    call expect(group//': upper corner', all(nint(clamp%upper) == [4, 5, 6]))
    call expect(group//': components', all(clamp%held .eqv. [.true., .false., .true.]))
  end subroutine read_sample

  !> One velocity everywhere and always if it is uniform; it moves.
  subroutine test_velocity(group, clamp)
    character(*), intent(in) :: group
    class(clamp_t), intent(in) :: clamp
    real(rp) :: t, v(3), x(3)
    logical :: differs, is_fast
    integer :: i

    differs = .false.
    is_fast = .false.
    do i = 1, 100
      call random_number(x)
      call random_number(t)
      v = clamp%velocity_at(clamp%lower + x*(clamp%upper - clamp%lower), t)
      differs = differs .or. any(abs(v - clamp%velocity) > 0.0_rp)
      is_fast = is_fast .or. any(abs(v) > 0.0_rp)
    end do
    call expect(group//': even or not', clamp%is_uniform .neqv. differs)
    call expect(group//': moves', is_fast .and. clamp%moves())
  end subroutine test_velocity

  !> A list keeps what it has; a wall is at rest.
  subroutine test_append()
    type(held_t), allocatable :: list(:)

    allocate (list(0))
    call append_clamp(list, clamp_t(place=3))
    call append_clamp(list, clamp_t(place=7, velocity=[0.0_rp, 2.0_rp, 0.0_rp]))
    call expect('two in a list', size(list) == 2)
    call expect('in their order', list(1)%clamp%place == 3 .and. list(2)%clamp%place == 7)
    call expect('at rest', .not. list(1)%clamp%moves())
    call expect('moving', list(2)%clamp%moves())
  end subroutine test_append

end program test_conditions
