! SPDX-License-Identifier: MIT
!> Contact between bodies: groups with a velocity field of their own, and their contact laws.
module setup_contacts
  use contact_pair, only: law_coulomb, law_frictionless, law_stick, pair_law_t, contact_t, &
                          moves_as_one, normal_gradient, normal_regression
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  use keys_names, only: find
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: read_contacts

contains

  !> Read all &CONTACT groups. Each body in contact and each rigid body gets a group of its own, the
  !> others share the first one. Groups without a &CONTACT between them stick to each other.
  subroutine read_contacts(input, scene, diagnostics)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: body(2, input%count('CONTACT')), i, j, k

    do i = 1, input%count('CONTACT')
      body(1, i) = find(scene%body%name, input%text('CONTACT', i, 'BODY'))
      body(2, i) = find(scene%body%name, input%text('CONTACT', i, 'OTHER'))
      if (any(body(:, i) == 0)) cycle
      if (body(1, i) == body(2, i)) then
        call input%report(diagnostics, 'CONTACT', i, 'OTHER', 'must be another body than BODY')
      end if
      if (body(1, i) /= body(2, i) .and. all(scene%body(body(:, i))%is_rigid())) then
        call input%report(diagnostics, 'CONTACT', i, 'OTHER', 'both bodies are rigid')
      end if
      do j = 1, i - 1
        if (all(body(:, j) == body(:, i)) .or. all(body(:, j) == body([2, 1], i))) then
          call input%report(diagnostics, 'CONTACT', i, 'OTHER', &
                            'another &CONTACT is between these bodies')
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
      if (k == 0) cycle                                    ! is reported already
      scene%contact(k)%group = scene%body(body(:, i))%group
      scene%contact(k)%normal = normal_gradient
      if (input%text('CONTACT', i, 'NORMAL') == 'regression') then
        scene%contact(k)%normal = normal_regression
      end if
      scene%contact(k)%law = pair_law_t(law_of(input%text('CONTACT', i, 'LAW')), &
                                        input%real('CONTACT', i, 'FRICTION'))
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

  integer function law_of(text)
    character(*), intent(in) :: text

    select case (text)
    case ('stick')
      law_of = law_stick
    case ('frictionless')
      law_of = law_frictionless
    case default
      law_of = law_coulomb
    end select
  end function law_of

end module setup_contacts
