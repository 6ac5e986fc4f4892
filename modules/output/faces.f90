! SPDX-License-Identifier: MIT
!> Output on the contact face of each tool: area, temperature and the shear layer under it
!> (contact_tool_limits). Columns of the history, and means over the whole run for its summary.
module output_faces
  use base_kinds, only: rp
  use base_log, only: say
  use base_text, only: str
  use io_histories, only: row_t
  use simulation_parts, only: simulation_t
  use state_scene, only: scene_t
  use tools_tool, only: n_tool_sums, s_area, s_face_temperature, s_excess_speed, s_friction, &
                        s_layer_slip, s_layer_work, s_surface_speed, s_surface_slip, &
                        s_layer_strength, s_layer_thickness, tool_t
  implicit none (type, external)
  private

  public :: add_face, faces_json, has_face, log_faces

  !> Area means over the face where friction acts on material that can flow.
  type :: face_means_t
    real(rp) :: temperature = 0.0_rp         !! [K]
    real(rp) :: shear_strength = 0.0_rp      !! [Pa]
    real(rp) :: layer_thickness = 0.0_rp     !! [m]
    real(rp) :: layer_slip = 0.0_rp          !! slip taken up by shear of the layer [m/s]
    real(rp) :: sliding = 0.0_rp             !! remaining slip at the face [m/s]
    real(rp) :: layer_velocity = 0.0_rp  !! velocity of the layer relative to its particles [m/s]
    real(rp) :: stick_share = 0.0_rp         !! 1 - sliding/tool speed
    real(rp) :: layer_heat_share = 0.0_rp    !! share of the layer's work in the friction heat
  end type face_means_t

contains

  !> True if material that can flow may lie under the face of a tool, so that its strength limits
  !> the friction.
  pure logical function has_face(scene, tool)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool
    integer :: k

    has_face = tool%has_layer() &
               .and. any([(scene%can_flow(k), k=1, maxval(scene%body%group))])
  end function has_face

  !> Means over a time in which the sums of a tool increased by `d`.
  pure type(face_means_t) function means_from(d) result(face)
    real(rp), intent(in) :: d(n_tool_sums)

    if (d(s_area) > 0.0_rp) then
      face%temperature = d(s_face_temperature)/d(s_area)
      face%shear_strength = d(s_layer_strength)/d(s_area)
      face%layer_thickness = d(s_layer_thickness)/d(s_area)
      face%layer_slip = d(s_layer_slip)/d(s_area)
      face%sliding = d(s_surface_slip)/d(s_area)
      face%layer_velocity = d(s_excess_speed)/d(s_area)
    end if
    if (d(s_surface_speed) > 0.0_rp) face%stick_share &
      = max(0.0_rp, 1.0_rp - d(s_surface_slip)/d(s_surface_speed))
    if (d(s_friction) > 0.0_rp) face%layer_heat_share = d(s_layer_work)/d(s_friction)
  end function means_from

  !> Add the columns of a tool face, means since the last row. A face that sticks moves the material
  !> with it, by shear or as a whole.
  subroutine add_face(name, d, per_second, max_temperature, row)
    character(*), intent(in) :: name
    real(rp), intent(in) :: d(n_tool_sums)       !! increase of its sums since the last row
    real(rp), intent(in) :: per_second           !! 1 over the time since the last row [1/s]
    real(rp), intent(in) :: max_temperature      !! current maximum temperature of the face [K]
    type(row_t), intent(inout) :: row

    associate (face => means_from(d))
      call row%add(name//'_face_area', 'm2', d(s_area)*per_second)
      call row%add(name//'_face_temperature', 'K', face%temperature)
      call row%add(name//'_face_temperature_max', 'K', max_temperature)
      call row%add(name//'_shear_strength', 'Pa', face%shear_strength)
      call row%add(name//'_layer_thickness', 'm', face%layer_thickness)
      call row%add(name//'_layer_slip', 'm/s', face%layer_slip)
      call row%add(name//'_sliding', 'm/s', face%sliding)
      call row%add(name//'_stick_share', '%', 100.0_rp*face%stick_share)
      call row%add(name//'_layer_velocity', 'm/s', face%layer_velocity)
    end associate
    call row%add(name//'_layer_power', 'W', d(s_layer_work)*per_second)
    call row%add(name//'_sliding_power', 'W', (d(s_friction) - d(s_layer_work))*per_second)
  end subroutine add_face

  !> Entries of NAME_summary.json: means over the run up to the last row.
  function faces_json(sim) result(text)
    type(simulation_t), intent(in) :: sim
    character(:), allocatable :: text
    character(*), parameter :: nl = new_line('a')
    integer :: k

    text = ''
    do k = 1, size(sim%tool)
      if (.not. has_face(sim%scene, sim%tool(k))) cycle
      associate (face => means_from(sim%history%row_sums(:, k)), begin => '    "'// &
                 trim(sim%tool(k)%name))
        text = text//trim(merge(',', ' ', len(text) > 0))//nl// &
          begin//'_face_temperature_K": '//str(face%temperature)//','//nl// &
          begin//'_shear_strength_Pa": '//str(face%shear_strength)//','//nl// &
          begin//'_layer_thickness_m": '//str(face%layer_thickness)//','//nl// &
          begin//'_layer_slip_m/s": '//str(face%layer_slip)//','//nl// &
          begin//'_sliding_m/s": '//str(face%sliding)//','//nl// &
          begin//'_stick_share_percent": '//str(100.0_rp*face%stick_share)//','//nl// &
          begin//'_layer_share_of_heat_percent": '//str(100.0_rp*face%layer_heat_share)
      end associate
    end do
    if (len(text) > 0) text = nl//'  "faces": {'//text//nl//'  },'
  end function faces_json

  !> Log the means over the run in a line for each tool.
  subroutine log_faces(sim)
    type(simulation_t), intent(in) :: sim
    integer :: k

    do k = 1, size(sim%tool)
      if (.not. has_face(sim%scene, sim%tool(k))) cycle
      if (sim%history%row_sums(s_area, k) <= 0.0_rp) cycle
      associate (face => means_from(sim%history%row_sums(:, k)))
        call say(trim(sim%tool(k)%name)//': face at '//str(face%temperature)// &
                 ' K in the mean, sticks to '//str(100.0_rp*face%stick_share)// &
                 ' %; the layer under it shears '//str(face%layer_slip)//' m/s over '// &
                 str(face%layer_thickness)//' m and has '//str(100.0_rp*face%layer_heat_share)// &
                 ' % of the friction heat')
      end associate
    end do
  end subroutine log_faces

end module output_faces
