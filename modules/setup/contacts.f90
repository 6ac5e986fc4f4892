! SPDX-License-Identifier: MIT
!> Which bodies have a velocity field of their own, and what happens between them.
module setup_contacts
  use contact_pair, only: law_coulomb, law_frictionless, law_stick, pair_law_t, contact_t, &
                          moves_as_one, normal_gradient, normal_regression
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  use keys_names, only: find, known
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: read_contacts

contains

  !> All &CONTACT groups. A body in contact and a rigid one get a group each, the others share the
  !> first; two groups without a &CONTACT move as one where they are in contact.
  subroutine read_contacts(input, scene, diagnostics)
    type(input_t), intent(in) :: input
    type(scene_t), intent(inout) :: scene
    type(diagnostics_t), intent(inout) :: diagnostics
    integer :: body(2, input%count('CONTACT')), i, j, k

    do i = 1, input%count('CONTACT')
      body(1, i) = find(scene%body%name, input%text('CONTACT', i, 'BODY'))
      body(2, i) = find(scene%body%name, input%text('CONTACT', i, 'OTHER'))
      if (body(1, i) == 0) then
        call input%report(diagnostics, 'CONTACT', i, 'BODY', &
                          'there is no &BODY of this name; '//known(scene%body%name))
      end if
      if (body(2, i) == 0) then
        call input%report(diagnostics, 'CONTACT', i, 'OTHER', &
                          'there is no &BODY of this name; '//known(scene%body%name))
      end if
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
    call divide_groups(body, scene)
    allocate (scene%contact(0))
    do j = 2, size(scene%tool_of)
      do i = 1, j - 1
        if (all(scene%is_rigid_group([i, j]))) cycle   ! no contact of rigid bodies
        scene%contact = [scene%contact, contact_t(group=[i, j], normal=moves_as_one)]
      end do
    end do
    do i = 1, size(body, 2)
      if (any(body(:, i) == 0)) cycle
      k = place_of(scene, scene%body(body(:, i))%group)
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

  !> Number the groups; no number is left out.
  subroutine divide_groups(body, scene)
    integer, intent(in) :: body(:, :)
    type(scene_t), intent(inout) :: scene
    logical :: is_alone(size(scene%body))
    integer :: b, n_groups

    is_alone = [(any(body == b) .or. scene%body(b)%is_rigid(), b=1, size(is_alone))]
    n_groups = merge(0, 1, all(is_alone) .and. size(is_alone) > 0)
    do b = 1, size(is_alone)
      scene%body(b)%group = 1
      if (.not. is_alone(b)) cycle
      n_groups = n_groups + 1
      scene%body(b)%group = n_groups
    end do
    allocate (scene%tool_of(n_groups), source=0)
    do b = 1, size(is_alone)
      if (scene%body(b)%is_rigid()) scene%tool_of(scene%body(b)%group) = scene%body(b)%tool
    end do
  end subroutine divide_groups

  !> Place of the contact of two groups in the list; 0 if it is not there.
  pure integer function place_of(scene, groups)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: groups(2)

    do place_of = size(scene%contact), 1, -1
      if (all(scene%contact(place_of)%group == [minval(groups), maxval(groups)])) exit
      if (all(scene%contact(place_of)%group == [maxval(groups), minval(groups)])) exit
    end do
  end function place_of

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
