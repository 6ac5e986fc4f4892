! SPDX-License-Identifier: MIT
!> Sums that each tool accumulates from the start of the run. History and checkpoint take names,
!> units and columns from the table here.
module tools_sums
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: mean_of

  !> A sum that a tool accumulates from the start of the run. Its column of the history, if it has
  !> one, is the increase since the last row, over that of the sum named by `over` or else over the
  !> time.
  type :: tool_sum_t
    character(16) :: name
    character(6) :: unit                !! name and unit in checkpoints
    logical :: is_of_face = .false.     !! column of faces under which metal shears in a layer
    character(18) :: column = ''
    character(3) :: column_unit = ''
    character(16) :: over = ''
  end type tool_sum_t

  type(tool_sum_t), parameter, public :: tool_sum_of(*) = [ &
    ! angular impulse on the tool about its axis against the spin
    tool_sum_t('torque', 'N m s', .false., 'torque', 'Nm'), &
    ! impulse on the tool
    tool_sum_t('force_x', 'N s', .false., 'force_x', 'N'), &
    tool_sum_t('force_y', 'N s', .false., 'force_y', 'N'), &
    tool_sum_t('force_z', 'N s', .false., 'force_z', 'N'), &
    ! work of the tool on the material
    tool_sum_t('work', 'J', .false., 'power', 'W'), &
    ! friction heat
    tool_sum_t('friction', 'J', .false., 'friction_power', 'W'), &
    ! energy lost in normal contact
    tool_sum_t('normal_loss', 'J'), &
    tool_sum_t('normal_impulse', 'N s'), &
    ! normal impulse on metal that the tool has not reached
    tool_sum_t('early_impulse', 'N s', .false., 'early_force', 'N'), &
    ! normal impulse times tangential speed of the material
    tool_sum_t('metal_slip', 'N m', .false., 'interface_velocity', 'm/s', 'normal_impulse'), &
    ! normal impulse times tangential speed of the tool
    tool_sum_t('tool_slip', 'N m', .false., 'tool_velocity', 'm/s', 'normal_impulse'), &
    ! friction heat given to the material
    tool_sum_t('to_plate', 'J'), &
    ! friction heat and plastic work of all bodies, set in reports only
    tool_sum_t('heat', 'J'), &
    ! area times time, weight of the others
    tool_sum_t('area', 'm2 s', .true., 'face_area', 'm2'), &
    ! temperature of the face
    tool_sum_t('face_temperature', 'K m2 s', .true., 'face_temperature', 'K', 'area'), &
    ! impulse of the layer strength
    tool_sum_t('layer_strength', 'N s', .true., 'shear_strength', 'Pa', 'area'), &
    ! thickness of the shear layer
    tool_sum_t('layer_thickness', 'm3 s', .true., 'layer_thickness', 'm', 'area'), &
    ! slip accommodated by layer shear
    tool_sum_t('layer_slip', 'm3', .true., 'layer_slip', 'm/s', 'area'), &
    ! slip accommodated by sliding
    tool_sum_t('surface_slip', 'm3', .true., 'sliding', 'm/s', 'area'), &
    ! tool speed along its surface
    tool_sum_t('surface_speed', 'm3', .true.), &
    ! velocity of the layer relative to its particles
    tool_sum_t('excess_speed', 'm3', .true., 'layer_velocity', 'm/s', 'area'), &
    ! friction heat from shear of the layer
    tool_sum_t('layer_work', 'J', .true., 'layer_power', 'W')]
  integer, parameter, public :: n_tool_sums = size(tool_sum_of)

  ! Their indices.
  integer, parameter, public :: &
    s_force = findloc(tool_sum_of%name, 'force_x', 1), &
    s_torque = findloc(tool_sum_of%name, 'torque', 1), &
    s_work = findloc(tool_sum_of%name, 'work', 1), &
    s_friction = findloc(tool_sum_of%name, 'friction', 1), &
    s_metal_slip = findloc(tool_sum_of%name, 'metal_slip', 1), &
    s_tool_slip = findloc(tool_sum_of%name, 'tool_slip', 1), &
    s_normal_impulse = findloc(tool_sum_of%name, 'normal_impulse', 1), &
    s_early = findloc(tool_sum_of%name, 'early_impulse', 1), &
    s_normal_loss = findloc(tool_sum_of%name, 'normal_loss', 1), &
    s_to_plate = findloc(tool_sum_of%name, 'to_plate', 1), &
    s_heat = findloc(tool_sum_of%name, 'heat', 1), &
    s_area = findloc(tool_sum_of%name, 'area', 1), &
    s_face_temperature = findloc(tool_sum_of%name, 'face_temperature', 1), &
    s_layer_strength = findloc(tool_sum_of%name, 'layer_strength', 1), &
    s_layer_thickness = findloc(tool_sum_of%name, 'layer_thickness', 1), &
    s_layer_slip = findloc(tool_sum_of%name, 'layer_slip', 1), &
    s_surface_slip = findloc(tool_sum_of%name, 'surface_slip', 1), &
    s_surface_speed = findloc(tool_sum_of%name, 'surface_speed', 1), &
    s_excess_speed = findloc(tool_sum_of%name, 'excess_speed', 1), &
    s_layer_work = findloc(tool_sum_of%name, 'layer_work', 1)

contains

  !> Value of the column of sum `k`, for increases `d` of the sums of a tool; 0 without weight.
  pure real(rp) function mean_of(d, k, per_second)
    real(rp), intent(in) :: d(n_tool_sums)
    integer, intent(in) :: k
    real(rp), intent(in) :: per_second       !! 1 over the time in which they increased [1/s]
    integer :: weight

    mean_of = 0.0_rp
    weight = findloc(tool_sum_of%name, tool_sum_of(k)%over, 1)
    if (weight == 0) then
      mean_of = d(k)*per_second
    else if (d(weight) > 0.0_rp) then
      mean_of = d(k)/d(weight)
    end if
  end function mean_of

end module tools_sums
