! SPDX-License-Identifier: MIT
!> What the face of a tool has: area, temperature, the layer of metal that shears under it
!> (tool_contact_limits). Columns of the history, and means of the whole run for its summary.
module output_faces
  use base_kinds, only: rp
  use base_log, only: say
  use base_text, only: str
  use contact_tool, only: n_tool_sums, s_area, s_face_heat, s_faster, s_friction, s_layer, &
                          s_layer_work, s_motion, s_sliding, s_strength, s_thickness, tool_t
  use io_row, only: row_t
  use output_audit, only: history_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: add_face, faces_json, has_face, say_faces

  !> Means over the face where friction acts on metal that can flow.
  type :: face_t
    real(rp) :: temperature = 0.0_rp     !! [K]
    real(rp) :: strength = 0.0_rp        !! of the metal, in shear [Pa]
    real(rp) :: thickness = 0.0_rp       !! of the layer [m]
    real(rp) :: layer_slip = 0.0_rp      !! that it shears [m/s]
    real(rp) :: sliding = 0.0_rp         !! the rest of the slip [m/s]
    real(rp) :: faster = 0.0_rp          !! its metal than its particles [m/s]
    real(rp) :: sticks = 0.0_rp          !! 1 less the sliding over the speed of the tool
    real(rp) :: sheared = 0.0_rp         !! part of the friction heat that is work of the layer
  end type face_t

contains

  !> Whether metal that can flow may lie under the face of a tool, and its strength limit friction.
  pure logical function has_face(scene, tool)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool
    integer :: k

    has_face = tool%has_layer() &
               .and. any([(scene%can_flow(k), k=1, maxval(scene%body%group))])
  end function has_face

  !> Means of a time in which the books of a tool grew by `d`.
  pure type(face_t) function means(d) result(face)
    real(rp), intent(in) :: d(n_tool_sums)

    if (d(s_area) > 0.0_rp) then
      face%temperature = d(s_face_heat)/d(s_area)
      face%strength = d(s_strength)/d(s_area)
      face%thickness = d(s_thickness)/d(s_area)
      face%layer_slip = d(s_layer)/d(s_area)
      face%sliding = d(s_sliding)/d(s_area)
      face%faster = d(s_faster)/d(s_area)
    end if
    if (d(s_motion) > 0.0_rp) face%sticks = max(0.0_rp, 1.0_rp - d(s_sliding)/d(s_motion))
    if (d(s_friction) > 0.0_rp) face%sheared = d(s_layer_work)/d(s_friction)
  end function means

  !> Columns of the face of a tool, means since the last row. A face that sticks moves its metal
  !> with it, by shear or as a whole.
  subroutine add_face(name, d, per_second, hottest, row)
    character(*), intent(in) :: name
    real(rp), intent(in) :: d(n_tool_sums)       !! its books since the last row
    real(rp), intent(in) :: per_second           !! over the time since then [1/s]
    real(rp), intent(in) :: hottest              !! place of the face now [K]
    type(row_t), intent(inout) :: row

    associate (face => means(d))
      call row%add(name//'_face_area', 'm2', d(s_area)*per_second)
      call row%add(name//'_face_temperature', 'K', face%temperature)
      call row%add(name//'_face_temperature_max', 'K', hottest)
      call row%add(name//'_shear_strength', 'Pa', face%strength)
      call row%add(name//'_layer_thickness', 'm', face%thickness)
      call row%add(name//'_layer_slip', 'm/s', face%layer_slip)
      call row%add(name//'_sliding', 'm/s', face%sliding)
      call row%add(name//'_stick_share', '%', 100.0_rp*face%sticks)
      call row%add(name//'_layer_velocity', 'm/s', face%faster)
    end associate
    call row%add(name//'_layer_power', 'W', d(s_layer_work)*per_second)
    call row%add(name//'_sliding_power', 'W', (d(s_friction) - d(s_layer_work))*per_second)
  end subroutine add_face

  !> Entries of NAME_summary.json, means of the whole run up to the last row.
  function faces_json(scene, tool, history) result(text)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    type(history_t), intent(in) :: history
    character(:), allocatable :: text
    character(*), parameter :: nl = new_line('a')
    integer :: k

    text = ''
    do k = 1, size(tool)
      if (.not. has_face(scene, tool(k))) cycle
      associate (face => means(history%row_sums(:, k)), begin => '    "'//trim(tool(k)%name))
        text = text//trim(merge(',', ' ', len(text) > 0))//nl// &
          begin//'_face_temperature_K": '//str(face%temperature)//','//nl// &
          begin//'_shear_strength_Pa": '//str(face%strength)//','//nl// &
          begin//'_layer_thickness_m": '//str(face%thickness)//','//nl// &
          begin//'_layer_slip_m/s": '//str(face%layer_slip)//','//nl// &
          begin//'_sliding_m/s": '//str(face%sliding)//','//nl// &
          begin//'_stick_share_percent": '//str(100.0_rp*face%sticks)//','//nl// &
          begin//'_layer_share_of_heat_percent": '//str(100.0_rp*face%sheared)
      end associate
    end do
    if (len(text) > 0) text = nl//'  "faces": {'//text//nl//'  },'
  end function faces_json

  !> The same in a line for each tool.
  subroutine say_faces(scene, tool, history)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool(:)
    type(history_t), intent(in) :: history
    integer :: k

    do k = 1, size(tool)
      if (.not. has_face(scene, tool(k))) cycle
      if (history%row_sums(s_area, k) <= 0.0_rp) cycle
      associate (face => means(history%row_sums(:, k)))
        call say(trim(tool(k)%name)//': face at '//str(face%temperature)// &
                 ' K in the mean, sticks to '//str(100.0_rp*face%sticks)// &
                 ' %; the layer under it shears '//str(face%layer_slip)//' m/s over '// &
                 str(face%thickness)//' m and has '//str(100.0_rp*face%sheared)// &
                 ' % of the friction heat')
      end associate
    end do
  end subroutine say_faces

end module output_faces
