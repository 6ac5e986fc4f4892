! SPDX-License-Identifier: MIT
!> Contact between bodies: groups with a velocity field of their own, contact laws, and heat
!> transfer by contact conductances with separate nodal temperatures.
module setup_contacts
  use base_kinds, only: rp
  use input_key_table, only: find
  use input_tables, only: check_rising
  use input_values, only: input_t
  use state_scene, only: film_t, of_pressure, scene_t
  use tools_pair, only: contact_t, law_coulomb, law_frictionless, law_stick, moves_as_one, &
                        normal_gradient, normal_regression, pair_law_t
  implicit none (type, external)
  private

  public :: read_contacts, read_gaps

contains

  !> Read all &CONTACT groups. Each body in contact and each rigid body gets a group of its own, the
  !> others share the first one. Groups without a &CONTACT between them stick to each other.
  subroutine read_contacts(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    character(12), parameter :: names(3) = [character(12) :: 'stick', 'frictionless', 'coulomb']
    integer, parameter :: laws(3) = [law_stick, law_frictionless, law_coulomb]
    integer :: body(2, input%count('CONTACT')), i, j, k

    do i = 1, input%count('CONTACT')
      body(:, i) = bodies_of(input, i, scene)
      if (any(body(:, i) == 0)) cycle
      if (body(1, i) == body(2, i)) then
        call input%report('CONTACT', i, 'OTHER', 'must be another body than BODY')
      end if
      if (body(1, i) /= body(2, i) .and. all(scene%body(body(:, i))%is_rigid())) then
        call input%report('CONTACT', i, 'OTHER', 'both bodies are rigid')
      end if
      do j = 1, i - 1
        if (all(body(:, j) == body(:, i)) .or. all(body(:, j) == body([2, 1], i))) then
          call input%report('CONTACT', i, 'OTHER', 'another &CONTACT is between these bodies')
        end if
      end do
    end do
    call assign_groups(body, scene)
    allocate (scene%contact(0))
    do j = 2, size(scene%tool_of)
      do i = 1, j - 1
        if (all(scene%is_rigid_group([i, j]))) cycle   ! no contact of rigid bodies
        scene%contact = [scene%contact, contact_t(group=[i, j], normal=moves_as_one)]
      end do
    end do
    do i = 1, size(body, 2)
      if (any(body(:, i) == 0)) cycle
      k = index_of_contact(scene, scene%body(body(:, i))%group)
      if (k == 0) cycle                                    ! reported before
      scene%contact(k)%group = scene%body(body(:, i))%group
      scene%contact(k)%normal = normal_gradient
      if (input%text('CONTACT', i, 'NORMAL') == 'regression') then
        scene%contact(k)%normal = normal_regression
      end if
      scene%contact(k)%law = pair_law_t(laws(find(names, input%text('CONTACT', i, 'LAW'))), &
                                        input%real('CONTACT', i, 'FRICTION'))
      if (input%diagnostics%count() > 0) cycle             ! a material may be unknown
      scene%contact(k)%melts_at = merge(huge(1.0_rp), scene%material(scene%body(body(:, i))% &
                                      material)%t_melt, scene%body(body(:, i))%is_rigid())
    end do
  end subroutine read_contacts

  !> Assign each body a group of bodies, numbered consecutively from 1.
  subroutine assign_groups(body, scene)
    integer, intent(in) :: body(:, :)     !! (2, n) bodies of each &CONTACT; 0: unknown name
    type(scene_t), intent(inout) :: scene
    logical :: has_own_group(size(scene%body))
    integer :: b, n_groups

    has_own_group = [(any(body == b) .or. scene%body(b)%is_rigid(), b=1, size(has_own_group))]
    n_groups = merge(0, 1, all(has_own_group) .and. size(has_own_group) > 0)
    do b = 1, size(has_own_group)
      scene%body(b)%group = 1
      if (.not. has_own_group(b)) cycle
      n_groups = n_groups + 1
      scene%body(b)%group = n_groups
    end do
    allocate (scene%tool_of(n_groups), source=0)
    do b = 1, size(has_own_group)
      if (scene%body(b)%is_rigid()) scene%tool_of(scene%body(b)%group) = scene%body(b)%tool
    end do
  end subroutine assign_groups

  !> Index of the contact of two groups in the list; 0 if there is none.
  pure integer function index_of_contact(scene, groups)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: groups(2)

    do index_of_contact = size(scene%contact), 1, -1
      if (all(scene%contact(index_of_contact)%group == [minval(groups), maxval(groups)])) exit
      if (all(scene%contact(index_of_contact)%group == [maxval(groups), minval(groups)])) exit
    end do
  end function index_of_contact

  !> Read the conductances of all &CONTACT groups. Bodies without a conductance between them are in
  !> perfect thermal contact and share their nodal temperatures. Contacts must have been read.
  subroutine read_gaps(input, scene)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    logical :: has_gap(size(scene%body), size(scene%body))
    logical :: is_given(input%count('CONTACT'))
    type(film_t) :: film
    integer :: body(2), c, i

    has_gap = .false.
    do i = 1, input%count('CONTACT')
      call read_gap(input, i, scene, film, is_given(i))
      if (.not. is_given(i)) cycle
      body = bodies_of(input, i, scene)
      if (any(body == 0) .or. input%diagnostics%count() > 0) cycle
      if (.not. allocated(scene%gap)) allocate (scene%gap(size(scene%contact)))
      has_gap(body(1), body(2)) = .true.
      has_gap(body(2), body(1)) = .true.
      do c = 1, size(scene%contact)
        if (minval(scene%contact(c)%group) /= minval(scene%body(body)%group)) cycle
        if (maxval(scene%contact(c)%group) /= maxval(scene%body(body)%group)) cycle
        scene%gap(c) = film
      end do
    end do
    if (.not. any(has_gap)) return
    call assign_heat_groups(scene, has_gap)
    do i = 1, input%count('CONTACT')
      body = bodies_of(input, i, scene)
      if (any(body == 0) .or. .not. is_given(i)) cycle
      if (scene%body(body(1))%heat_group == scene%body(body(2))%heat_group) then
        call input%report('CONTACT', i, '', 'both bodies conduct perfectly to a third, and so '// &
                          'to each other: give a &CONTACT with CONDUCTANCE for one of these pairs')
      end if
    end do
  end subroutine read_gaps

  !> Indices of the two bodies of the `i`-th &CONTACT; 0 for an unknown name.
  function bodies_of(input, i, scene) result(body)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(scene_t), intent(in) :: scene
    integer :: body(2)

    body = [find(scene%body%name, input%text('CONTACT', i, 'BODY')), &
            find(scene%body%name, input%text('CONTACT', i, 'OTHER'))]
  end function bodies_of

  !> Read and check the conductance of the `i`-th &CONTACT, as a film, if it is given.
  subroutine read_gap(input, i, scene, film, is_given)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(scene_t), intent(in) :: scene
    type(film_t), intent(out) :: film
    logical, intent(out) :: is_given
    real(rp), allocatable :: values(:)
    integer :: b, n

    allocate (values, source=input%list('CONTACT', i, 'CONDUCTANCE_TABLE'))
    n = size(values)
    film%coefficient = input%real('CONTACT', i, 'CONDUCTANCE')
    is_given = input%given('CONTACT', i, 'CONDUCTANCE') &
               .or. input%given('CONTACT', i, 'CONDUCTANCE_TABLE')
    if (.not. is_given) return
    if (.not. scene%method%conducts) call input%report('CONTACT', i, 'CONDUCTANCE', &
      'has no effect without a &HEAT group')
    do b = 1, size(scene%body)
      if (all(bodies_of(input, i, scene) /= b) .or. scene%body(b)%material == 0) cycle
      if (scene%material(scene%body(b)%material)%conducts()) cycle
      call input%report('CONTACT', i, 'CONDUCTANCE', "needs bodies that conduct: '"// &
                        trim(scene%body(b)%name)//"' has a CONDUCTIVITY of 0")
    end do
    if (n == 0) return
    if (input%given('CONTACT', i, 'CONDUCTANCE')) call input%report('CONTACT', i, &
      'CONDUCTANCE_TABLE', 'takes the place of CONDUCTANCE: give one of them')
    if (mod(n, 2) /= 0) then
      call input%report('CONTACT', i, 'CONDUCTANCE_TABLE', 'must be pairs of pressure and '// &
                        'conductance')
      return
    end if
    film%of = of_pressure
    film%at = values(1::2)
    film%there = values(2::2)
    call check_rising(input, 'CONTACT', i, 'CONDUCTANCE_TABLE', film%at, 'pressures')
  end subroutine read_gap

  !> Assign groups with a common nodal temperature: bodies without a gap between them, directly or
  !> through other bodies, belong to one group.
  pure subroutine assign_heat_groups(scene, has_gap)
    type(scene_t), intent(inout) :: scene
    logical, intent(in) :: has_gap(:, :)      !! whether a conductance is given between two bodies
    integer :: a, b, group(size(scene%body)), n, sweep

    group = [(a, a=1, size(group))]
    do sweep = 1, size(group)
      do a = 1, size(group)
        do b = 1, size(group)
          if (.not. has_gap(a, b)) group([a, b]) = minval(group([a, b]))
        end do
      end do
    end do
    n = 0
    do a = 1, size(group)
      if (group(a) == a) n = n + 1
      scene%body(a)%heat_group = n
      if (group(a) /= a) scene%body(a)%heat_group = scene%body(group(a))%heat_group
    end do
    scene%n_heat_groups = n
  end subroutine assign_heat_groups

end module setup_contacts
