! SPDX-License-Identifier: MIT
!> Rows of NAME_history.csv: energies and their balance, temperatures, reactions on each tool,
!> forces of walls and clamps, microstructure. A new column is one line here.
!>
!> The contact face of each tool: area, temperature and the shear layer under it
!> (contact_tool_limits), also as means over the whole run for its summary.
module output_history
  use base_kinds, only: rp
  use base_log, only: log_line
  use base_text, only: str
  use io_histories, only: row_t
  use output_microstructure, only: add_micro_columns, find_microstructure_means, micro_means_t, &
                                   zero_means
  use output_totals, only: zero_totals, sum_totals, totals_t
  use state_budget, only: d_elastic, d_heat, d_kinetic, d_mass, e_body, e_film, e_plastic, &
                          e_scaling, e_sleep, e_source, e_wall, e_wall_heat, sum_of
  use state_clock, only: clock_t
  use state_parts, only: history_t, simulation_t
  use state_scene, only: scene_t
  use tools_heat_sink, only: backing_t
  use tools_sums, only: mean_of, n_tool_sums, s_area, s_face_temperature, s_force, s_friction, &
                        s_heat, s_layer_slip, s_layer_strength, s_layer_thickness, s_layer_work, &
                        s_surface_slip, s_surface_speed, tool_sum_of
  use tools_tool, only: tool_t
  implicit none (type, external)
  private

  public :: history_headings, make_history_row, faces_json, log_faces

contains

  !> Names and units of the columns.
  function history_headings(sim) result(headings)
    type(simulation_t), intent(in) :: sim
    character(:), allocatable :: headings(:)
    type(row_t) :: row

    call add_columns(sim, zero_totals(sim%scene, sim%tool, sim%budget), zero_means(sim%scene), row)
    headings = row%headings()
  end function history_headings

  !> Collective. One row of the history; means of the next row start at this time.
  subroutine make_history_row(sim, row)
    type(simulation_t), intent(inout) :: sim
    type(row_t), intent(out) :: row
    type(micro_means_t) :: micro
    type(totals_t) :: totals

    call sum_totals(sim, totals)
    call find_microstructure_means(sim%world, sim%scene, sim%particles, micro)
    sim%clock%now%is_broken = sim%clock%now%is_broken .or. .not. totals%is_sound
    call sim%history%row_inertia%advance(sim%clock%mass_scaling, [sim%clock%time, &
      totals%now%motion, totals%work], &
                                       totals%tool(s_force:s_force + 2, :))
    call add_columns(sim, totals, micro, row)
    sim%history%row_gained = totals%tool - sim%history%row_sums
    sim%history%row_sums = totals%tool
    sim%history%row_impulse = totals%impulse
    sim%history%row_time = sim%clock%time
  end subroutine make_history_row

  !> Add all columns in order.
  subroutine add_columns(sim, totals, micro, row)
    type(simulation_t), intent(in) :: sim
    type(totals_t), intent(in) :: totals
    type(micro_means_t), intent(in) :: micro
    type(row_t), intent(inout) :: row
    real(rp) :: per_second
    integer :: i, k

    per_second = 0.0_rp                        ! 0 in the first row
    if (sim%clock%time > sim%history%row_time) per_second = 1.0_rp/(sim%clock%time &
      - sim%history%row_time)
    call add_common(sim%scene, sim%clock, sim%history, totals, row)
    do k = 1, size(sim%tool)
      call add_tool(sim%tool(k), totals%tool(:, k) - sim%history%row_sums(:, k), per_second, row)
      if (has_face(sim%scene, sim%tool(k))) then
        call add_face(trim(sim%tool(k)%name), totals%tool(:, k) - sim%history%row_sums(:, k), &
                      per_second, totals%max_face_temperature(k), row)
      end if
    end do
    do k = 1, size(sim%backing)
      call add_backing(sim%backing(k), row)
    end do
    do k = 1, size(sim%scene%condition)
      call add_force(sim%scene%condition(k), (totals%impulse(:, k) &
                                              - sim%history%row_impulse(:, k))*per_second, row)
    end do
    do k = 1, size(sim%hook)
      associate (hook => sim%hook(k)%it)
        do i = 1, size(hook%column)
          call row%add(trim(hook%name)//'_'//trim(hook%column(i)), trim(hook%unit(i)), &
                       totals%hooks(hook%last + i))
        end do
      end associate
    end do
    call add_micro_columns(sim%scene, micro, row)
    call row%add('mass_scaling', '', sim%clock%mass_scaling)
    call add_sums(totals, [e_scaling], row)
  end subroutine add_columns

  !> Add time, energies and extremes. The heat content is 0 unless the specific heat of every
  !> material is given.
  subroutine add_common(scene, clock, history, totals, row)
    type(scene_t), intent(in) :: scene
    type(clock_t), intent(in) :: clock
    type(history_t), intent(in) :: history
    type(totals_t), intent(in) :: totals
    type(row_t), intent(inout) :: row

    associate (t => totals, now => totals%now, budget => totals%budget)
      call row%add('time', 's', clock%time)
      call row%add('step', '', real(clock%step, rp))
      call row%add('dt', 's', clock%dt)
      call row%add('kinetic', 'J', now%kinetic)
      call row%add('elastic', 'J', now%elastic)
      call add_sums(totals, [e_plastic], row)
      call row%add('tool_work', 'J', t%work)
      call add_sums(totals, [e_body, e_wall], row)
      call row%add('friction_heat', 'J', t%friction_heat)
      call row%add('contact_loss', 'J', t%contact)
      call row%add('numerical_loss', 'J', t%loss)
      call add_sums(totals, [e_sleep, d_mass], row)
      call row%add('debris_energy', 'J', budget(d_kinetic) + budget(d_elastic))
      call add_sums(totals, [d_heat], row)
      call row%add('audit_error', '%', t%audit_error)
      call add_sums(totals, [e_film], row)
      call row%add('heat_content', 'J', merge(now%heat, 0.0_rp, &
                                              all(scene%material%has_heat_capacity)))
      call row%add('temperature_max', 'K', now%max_temperature)
      call row%add('temperature_min', 'K', now%min_temperature)
      call row%add('strain_rate_max', '1/s', now%max_strain_rate)
      call row%add('kinetic_over_internal', '%', t%over_internal)
      call row%add('inertial_stress_over_flow', '%', 100.0_rp*now%inertial_ratio)
      call row%add('packing', '%', 100.0_rp*now%packing)
      call row%add('inertial_force', 'N', history%row_inertia%of_inertia(1))
      call row%add('inertial_power', 'W', history%row_inertia%of_inertia(2))
      call row%add('friction_heat_to_bodies', 'J', t%to_bodies)
      call add_sums(totals, [e_wall_heat, e_source], row)
      call row%add('conduction_error', '%', t%conduction_error)
    end associate
  end subroutine add_common

  !> Add sums over the steps, under their names.
  subroutine add_sums(totals, indices, row)
    type(totals_t), intent(in) :: totals
    integer, intent(in) :: indices(:)
    type(row_t), intent(inout) :: row
    integer :: k

    do k = 1, size(indices)
      associate (it => sum_of(indices(k)))
        call row%add(trim(it%name), trim(it%unit), totals%budget(indices(k)))
      end associate
    end do
  end subroutine add_sums

  !> Add the columns of a tool: means of force, torque, powers and speeds since the last row, the
  !> share of its friction in the heat of friction and plastic work since the last row (0 without
  !> such heat), and its current pose.
  subroutine add_tool(tool, d, per_second, row)
    type(tool_t), intent(in) :: tool
    real(rp), intent(in) :: d(n_tool_sums)       !! increase of the sums since the last row
    real(rp), intent(in) :: per_second           !! 1 over the time since the last row [1/s]
    type(row_t), intent(inout) :: row
    character(:), allocatable :: name
    real(rp) :: share
    integer :: k

    name = trim(tool%name)
    do k = 1, n_tool_sums
      if (.not. tool_sum_of(k)%is_of_face) call add_mean(name, d, k, per_second, row)
    end do
    share = 0.0_rp
    if (d(s_heat) > 0.0_rp) share = 100.0_rp*d(s_friction)/d(s_heat)
    call row%add(name//'_friction_share', '%', share)
    call row%add(name//'_x', 'm', tool%position(1))
    call row%add(name//'_y', 'm', tool%position(2))
    call row%add(name//'_z', 'm', tool%position(3))
    call row%add(name//'_angle', 'rad', tool%angle)
    call row%add(name//'_tilt', 'rad', tool%tilt())
    if (tool%monitor%is_on) call row%add(name//'_phase', '', real(tool%monitor%phase, rp))
    if (.not. tool%heat%is_on) return
    call row%add(name//'_tool_face_temperature', 'K', tool%heat%face_temperature)
    call row%add(name//'_heat_content', 'J', tool%heat%content())
    call row%add(name//'_heat_gained', 'J', tool%heat%gained)
    call row%add(name//'_heat_lost', 'J', tool%heat%lost)
  end subroutine add_tool

  !> Add the column of sum `k` of a tool, if it has one.
  subroutine add_mean(name, d, k, per_second, row)
    character(*), intent(in) :: name
    real(rp), intent(in) :: d(n_tool_sums), per_second
    integer, intent(in) :: k
    type(row_t), intent(inout) :: row

    associate (it => tool_sum_of(k))
      if (it%column /= '') call row%add(name//'_'//trim(it%column), trim(it%column_unit), &
                                        mean_of(d, k, per_second))
    end associate
  end subroutine add_mean

  !> Add temperature and heat of a backing.
  subroutine add_backing(backing, row)
    type(backing_t), intent(in) :: backing
    type(row_t), intent(inout) :: row

    call row%add(backing%name//'_temperature_max', 'K', backing%max_face_temperature())
    call row%add(backing%name//'_heat_content', 'J', backing%content())
    call row%add(backing%name//'_heat_gained', 'J', sum(backing%column%gained))
    call row%add(backing%name//'_heat_lost', 'J', sum(backing%column%lost))
  end subroutine add_backing

  !> Add a mean force since the last row: on a tool, or of a wall or clamp on the bodies.
  subroutine add_force(name, force, row)
    character(*), intent(in) :: name
    real(rp), intent(in) :: force(3)             !! [N]
    type(row_t), intent(inout) :: row

    call row%add(trim(name)//'_force_x', 'N', force(1))
    call row%add(trim(name)//'_force_y', 'N', force(2))
    call row%add(trim(name)//'_force_z', 'N', force(3))
  end subroutine add_force

  !> True if material that can flow may lie under the face of a tool, so that its strength limits
  !> the friction.
  pure logical function has_face(scene, tool)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool
    integer :: k

    has_face = tool%has_layer() &
               .and. any([(scene%can_flow(k), k=1, maxval(scene%body%group))])
  end function has_face

  !> Share of the speed of a face that the material takes up [%].
  pure real(rp) function sticking(d)
    real(rp), intent(in) :: d(n_tool_sums)       !! increase of the sums of the tool

    sticking = 0.0_rp
    if (d(s_surface_speed) > 0.0_rp) sticking &
      = 100.0_rp*max(0.0_rp, 1.0_rp - d(s_surface_slip)/d(s_surface_speed))
  end function sticking

  !> Share of the friction heat of a face that arises in the layer under it [%].
  pure real(rp) function heat_of_layer(d)
    real(rp), intent(in) :: d(n_tool_sums)       !! increase of the sums of the tool

    heat_of_layer = 0.0_rp
    if (d(s_friction) > 0.0_rp) heat_of_layer = 100.0_rp*(d(s_layer_work)/d(s_friction))
  end function heat_of_layer

  !> Add the columns of a tool face, means since the last row. A face that sticks moves the material
  !> with it, by shear or as a whole.
  subroutine add_face(name, d, per_second, max_temperature, row)
    character(*), intent(in) :: name
    real(rp), intent(in) :: d(n_tool_sums)       !! increase of the sums since the last row
    real(rp), intent(in) :: per_second           !! 1 over the time since the last row [1/s]
    real(rp), intent(in) :: max_temperature      !! current maximum temperature of the face [K]
    type(row_t), intent(inout) :: row
    integer :: k

    do k = 1, n_tool_sums
      if (tool_sum_of(k)%is_of_face) call add_mean(name, d, k, per_second, row)
    end do
    call row%add(name//'_face_temperature_max', 'K', max_temperature)
    call row%add(name//'_stick_share', '%', sticking(d))
    call row%add(name//'_sliding_power', 'W', (d(s_friction) - d(s_layer_work))*per_second)
  end subroutine add_face

  !> Entries of NAME_summary.json: means over the run up to the last row.
  function faces_json(scene, tools, history) result(text)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tools(:)
    type(history_t), intent(in) :: history
    character(:), allocatable :: text
    character(*), parameter :: nl = new_line('a')
    integer, parameter :: means(*) = [s_face_temperature, s_layer_strength, s_layer_thickness, &
                                      s_layer_slip, s_surface_slip]
    character(:), allocatable :: begin
    integer :: i, k

    text = ''
    do k = 1, size(tools)
      if (.not. has_face(scene, tools(k))) cycle
      begin = nl//'    "'//trim(tools(k)%name)//'_'
      if (len(text) > 0) text = text//','
      associate (sums => history%row_sums(:, k))
        do i = 1, size(means)
          associate (it => tool_sum_of(means(i)))
            text = text//begin//trim(it%column)//'_'//trim(it%column_unit)//'": '// &
                   str(mean_of(sums, means(i), 0.0_rp))//','
          end associate
        end do
        text = text//begin//'stick_share_percent": '//str(sticking(sums))//','// &
               begin//'layer_share_of_heat_percent": '//str(heat_of_layer(sums))
      end associate
    end do
    if (len(text) > 0) text = nl//'  "faces": {'//text//nl//'  },'
  end function faces_json

  !> Log the means over the run in a line for each tool.
  subroutine log_faces(scene, tools, history)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tools(:)
    type(history_t), intent(in) :: history
    integer :: k

    do k = 1, size(tools)
      if (.not. has_face(scene, tools(k))) cycle
      if (history%row_sums(s_area, k) <= 0.0_rp) cycle
      associate (sums => history%row_sums(:, k))
        call log_line(trim(tools(k)%name)//': face at '// &
                      str(mean_of(sums, s_face_temperature, 0.0_rp))// &
                      ' K in the mean, sticks to '//str(sticking(sums))// &
                      ' %; the layer under it shears '//str(mean_of(sums, s_layer_slip, 0.0_rp))// &
                      ' m/s over '//str(mean_of(sums, s_layer_thickness, 0.0_rp))//' m and has '// &
                      str(heat_of_layer(sums))//' % of the friction heat')
      end associate
    end do
  end subroutine log_faces

end module output_history
