! SPDX-License-Identifier: MIT
!> The libraries of materials and pairs: every entry is a good input with a source for each value;
!> flow curves are plausible, constants beside mechanics are the means of their tables; values of
!> pairs are within the range in which they are known.
program test_library
  use base_kinds, only: rp
  use base_system, only: data_file
  use base_text, only: str
  use check, only: begin_tests, end_tests, expect, expect_close
  use input_library, only: library_table
  use input_reading, only: read_input, read_input_text
  use input_syntax, only: split_words
  use input_values, only: input_t
  use physics_material, only: material_t
  use physics_point, only: point_t
  use setup_keys, only: key_table
  use setup_materials, only: check_properties, read_materials
  implicit none (type, external)

  character(*), parameter :: group = 'MATERIAL'
  type(input_t) :: library
  type(material_t), allocatable :: material(:)
  character(:), allocatable :: path, problem
  character(1) :: no_sets(0)
  integer :: m

  call begin_tests()
  call data_file('materials.nml', path, problem)
  call expect('the library is there', problem == '')
  call read_input(library_table(key_table()), path, no_sets, library)
  call read_materials(library, material)
  if (library%diagnostics%count() > 0) call library%diagnostics%print(6)
  call expect('nothing is wrong with the library', library%diagnostics%count() == 0)
  call expect('it has entries', size(material) >= 9)
  do m = 1, size(material)
    call test_sources(group, m)
    call test_curves(m)
    call test_means(m, 'SPECIFIC_HEAT')
    call test_means(m, 'CONDUCTIVITY')
  end do
  call test_needs()
  call data_file('pairs.nml', path, problem)
  call read_input(library_table(key_table()), path, no_sets, library)
  if (library%diagnostics%count() > 0) call library%diagnostics%print(6)
  call expect('nothing is wrong with the pairs', library%diagnostics%count() == 0)
  call expect('there are pairs', library%count('PAIR') >= 10)
  do m = 1, library%count('PAIR')
    call test_sources('PAIR', m)
  end do
  do m = 1, library%count('REFERENCE')
    call test_range(m)
  end do
  call end_tests()

contains

  !> Each value has one source, and each source stands for values that are there.
  subroutine test_sources(group, m)
    character(*), intent(in) :: group
    integer, intent(in) :: m
    character(48), allocatable :: keys(:), all(:)
    character(:), allocatable :: key, name
    integer :: k, r

    name = library%text(group, m, 'NAME')
    allocate (all(0))
    do r = 1, library%count('REFERENCE')
      if (library%text('REFERENCE', r, group) /= name) cycle
      call split_words(library%text('REFERENCE', r, 'KEYS'), keys)
      all = [character(48) :: all, keys]
      do k = 1, size(keys)
        call expect(name//': a source of '//trim(keys(k)), is_given(group, m, trim(keys(k))))
      end do
    end do
    associate (row => library%table%groups(library%table%find_group(group)))
      do k = row%first, row%last
        key = trim(library%table%keys(k)%name)
        if (key == 'NAME' .or. .not. is_given(group, m, key)) cycle
        call expect(name//': one source of '//key, count(all == key) == 1)
      end do
    end associate
  end subroutine test_sources

  !> Whether an entry has a key.
  logical function is_given(group, m, key)
    character(*), intent(in) :: group, key
    integer, intent(in) :: m

    is_given = library%table%find_key(library%table%find_group(group), key) > 0
    if (is_given) is_given = library%given(group, m, key)
  end function is_given

  !> Numbers of a pair, but for places of a table, are within the range of their source.
  subroutine test_range(r)
    integer, intent(in) :: r
    character(:), allocatable :: name
    character(48), allocatable :: keys(:)
    real(rp) :: range(2)
    integer :: k, m

    name = library%text('REFERENCE', r, 'PAIR')
    range = library%reals('REFERENCE', r, 'RANGE', 2)
    call expect(name//': a range', library%given('REFERENCE', r, 'RANGE') .and. range(1) < range(2))
    do m = 1, library%count('PAIR')
      if (library%text('PAIR', m, 'NAME') == name) exit
    end do
    call split_words(library%text('REFERENCE', r, 'KEYS'), keys)
    do k = 1, size(keys)
      associate (t => library%table)
        if (t%keys(t%find_key(t%find_group('PAIR'), keys(k)))%kind /= 'real') cycle
        if (index(keys(k), '_AT') > 0) cycle
        call expect(name//': '//trim(keys(k))//' is within its range', all( &
          library%list('PAIR', m, trim(keys(k))) >= range(1) .and. &
          library%list('PAIR', m, trim(keys(k))) <= range(2)))
      end associate
    end do
  end subroutine test_range

  !> Flow stress is above 0 and of a metal below T_MELT, falls with temperature, does not fall with
  !> the rate, and is nothing at T_MELT.
  subroutine test_curves(m)
    integer, intent(in) :: m
    real(rp), parameter :: rates(4) = [1.0e-3_rp, 1.0_rp, 30.0_rp, 300.0_rp]
    real(rp), parameter :: strains(3) = [0.0_rp, 0.3_rp, 10.0_rp]
    integer, parameter :: levels = 20
    real(rp) :: sigma(0:levels, size(rates))
    integer :: r, s, t

    do s = 1, size(strains)
      do r = 1, size(rates)
        do t = 0, levels
          sigma(t, r) = flow_stress(material(m), strains(s), rates(r), &
                                    298.0_rp + (material(m)%t_melt - 298.0_rp)*t/levels)
        end do
      end do
      associate (label => trim(material(m)%name)//' at a strain of '//str(strains(s)))
        call expect(label//': above 0', all(sigma(:levels - 1, :) > 0.0_rp))
        call expect(label//': below 2.5 GPa', all(sigma < 2.5e9_rp))
        call expect(label//': a metal when cold', all(sigma(0, :) > 15.0e6_rp))
        call expect(label//': falls with temperature', all(sigma(1:, :) < sigma(:levels - 1, :)))
        call expect(label//': does not fall with the rate', &
                    all(sigma(:, 2:) >= sigma(:, :size(rates) - 1)))
        call expect_close(label//': molten', maxval(sigma(levels, :)), 0.0_rp, atol=1.0_rp)
      end associate
    end do
  end subroutine test_curves

  !> At a plastic strain reached at one rate and temperature [Pa].
  real(rp) function flow_stress(material, strain, rate, temp)
    type(material_t), intent(in) :: material
    real(rp), intent(in) :: strain, rate, temp     !! [-], [1/s], [K]
    type(point_t) :: point
    integer :: k, n

    call point%init(material, temp, rate)
    n = nint(strain/0.05_rp)
    do k = 1, n
      call point%strain_to(material, strain/n, rate, temp)
    end do
    flow_stress = point%sigma
  end function flow_stress

  !> The constant is the mean of the table from 298 K to T_MELT, within its three digits.
  subroutine test_means(m, key)
    integer, intent(in) :: m
    character(*), intent(in) :: key
    integer, parameter :: parts = 20000
    real(rp), allocatable :: pairs(:), t(:), v(:)
    real(rp) :: mean, x
    integer :: k, n

    if (.not. is_given(group, m, key//'_TABLE')) return
    allocate (pairs, source=library%list(group, m, key//'_TABLE'))
    t = pairs(1::2)
    v = pairs(2::2)
    mean = 0.0_rp
    do k = 1, parts
      x = 298.0_rp + (material(m)%t_melt - 298.0_rp)*(k - 0.5_rp)/parts
      n = min(max(count(t <= x), 1), size(t) - 1)
      x = min(max((x - t(n))/(t(n + 1) - t(n)), 0.0_rp), 1.0_rp)
      mean = mean + ((1.0_rp - x)*v(n) + x*v(n + 1))/parts
    end do
    call expect_close(trim(material(m)%name)//': mean of '//key, &
                      library%real(group, m, key), mean, rtol=3.0e-3_rp)
  end subroutine test_means

  !> Of three materials that conduct, any one may lack its conductivity: that alone is reported.
  subroutine test_needs()
    character, parameter :: nl = new_line('a')
    character(:), allocatable :: text
    type(input_t) :: input
    integer :: i, lacks

    do lacks = 0, 3
      text = '&GRID CELL=1 LOWER=3*0 UPPER=3*9 /'//nl//'&TIME END=1 /'//nl//'&HEAT /'//nl// &
             "&BODY NAME='b' MATERIAL='1' /"//nl//"&SHAPE BODY='b' LOWER=3*0 UPPER=3*1 /"//nl
      do i = 1, 3
        text = text//"&MATERIAL NAME='"//str(i)//"' DENSITY=1 YOUNGS_MODULUS=1 POISSON_RATIO=0 "// &
               'SPECIFIC_HEAT=1 T_MELT=900'
        if (i /= lacks) text = text//' CONDUCTIVITY=1'
        text = text//' /'//nl
      end do
      call read_input_text(key_table(), 't.nml', text, no_sets, input)
      call check_properties(input)
      associate (said => input%diagnostics)
        call expect('what material '//str(lacks)//' lacks', said%count() == merge(1, 0, lacks > 0))
        if (said%count() /= 1) cycle
        call expect('where it is reported', &
                    index(said%text(1), 't.nml:'//str(5 + lacks)//': ') == 1 .and. &
                    index(said%text(1), 'CONDUCTIVITY') > 0)
      end associate
    end do
  end subroutine test_needs

end program test_library
