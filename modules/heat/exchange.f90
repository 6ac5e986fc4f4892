! SPDX-License-Identifier: MIT
!> Exchange of heat between particles and what is outside their body: films and radiation on faces,
!> backings behind films, and tools. Each contact of a particle carries the heat flow G (T_s - T_o),
!> with the surface temperature T_s = T_p + q d/k, which includes the temperature drop of a friction
!> heat flux q over the depth d = half a spacing, the temperature T_o outside, and the conductance G
!> = A/(1/h + d/k). Faces move with their particles; their area and normal are constant. A particle
!> that was in contact with a tool since the last conduction step has its mean contact area A in
!> this time.
!>
!> Heat is taken from the nodes by the weights w of the particle. An explicit step takes the mean
!> flow of a difference that falls exponentially at the rate sum w_i L_i/C_i, with the conductances
!> L and capacities C of the nodes, while all other heat comes evenly. This is stable for any
!> conductance and step (docs/method.md). The temperatures of sinks (tools, and the columns of
!> backings) are those at the end of the step.
module heat_exchange
  use base_kinds, only: i8, rp
  use mpm_blocks, only: weights_of
  use particles_block, only: block_t, view_block
  use particles_store, only: f_pos, f_temp, n_conduction, particles_t, tag_faces
  use state_budget, only: e_film, e_tool, n_sums
  use state_nodes, only: nodes_t
  use state_scene, only: film_t, of_pressure, scene_t, stefan_boltzmann
  use tools_heat_sink, only: backing_t, find_backing
  use tools_tool, only: tool_t
  use transfer_conduction, only: relax
  implicit none (type, external)
  private

  public :: add_conductances, add_exchange, contacts_t, exchanges_heat, films_need_pressure, &
            find_contacts, reset_contact_sums, warm_sinks

  !> Contacts of this rank's particles in a conduction step. Sinks are the tools, followed by the
  !> columns of all backings.
  type :: contacts_t
    integer :: n = 0, n_tools = 0
    integer, allocatable :: sink(:)           !! (n) sink; 0: surroundings of given temperature
    integer, allocatable :: group(:)          !! (n) heat group of the body
    integer, allocatable :: first(:)          !! (n) first of the 27 nodes
    real(rp), allocatable :: weight(:, :)     !! (9, n) weights of these nodes along the axes
    real(rp), allocatable :: conductance(:)   !! (n) G [W/K]
    real(rp), allocatable :: excess(:)        !! (n) T_s less the mean of the nodal temperatures [K]
    real(rp), allocatable :: outside(:)       !! (n) T_o of surroundings [K]
    real(rp), allocatable :: t_face0(:)       !! (sinks) face temperature without heat flow [K]
    real(rp), allocatable :: dt_face_dp(:)    !! (sinks) its slope with the heat flow [K/W]
    real(rp), allocatable :: power(:)         !! (sinks) heat flow [W]
  end type contacts_t

contains

  !> True if the coefficient of any film depends on pressure.
  pure logical function films_need_pressure(scene)
    type(scene_t), intent(in) :: scene
    integer :: b

    films_need_pressure = any([(any(scene%body(b)%film%of == of_pressure), b=1, size(scene%body))])
  end function films_need_pressure

  !> True if any body exchanges heat with what is outside it.
  pure logical function exchanges_heat(scene, tools)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tools(:)
    integer :: b

    exchanges_heat = any(tools%heat%is_on) .or. allocated(scene%gap) &
      .or. any([(any(scene%body(b)%film%acts()), b=1, size(scene%body))])
  end function exchanges_heat

  !> List the contacts of this rank for a conduction step `dt` [s], the time since the last one,
  !> from the temperatures and pressures at the nodes (heat_nodes).
  subroutine find_contacts(scene, tools, backings, particles, nodes, dt, x)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(inout) :: tools(:)
    type(backing_t), intent(inout) :: backings(:)
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: dt
    type(contacts_t), intent(out) :: x
    integer :: b, i, k, n
    type(block_t) :: block

    n = 0
    do b = 1, particles%nblk
      n = n + count_contacts(scene, tools, particles, b)
    end do
    allocate (x%sink(n), x%group(n), x%first(n), x%weight(9, n), x%conductance(n), x%excess(n), &
              x%outside(n))
    x%n_tools = size(tools)
    n = x%n_tools + sum([(size(backings(k)%column), k=1, size(backings))])
    allocate (x%t_face0(n), x%dt_face_dp(n), x%power(n), source=0.0_rp)
    do b = 1, particles%nblk
      if (count_contacts(scene, tools, particles, b) == 0) cycle
      call particles%fetch(b + 1, n_conduction)
      call view_block(particles, b, block)
      call weights_of(scene, nodes, block)
      call list_faces(scene, backings, nodes, particles%tag(:, b), block, x)
      do k = 1, size(tools)
        if (tools(k)%heat%is_on) call list_tool(scene, tools(k), nodes, k, dt, block, x)
      end do
    end do
    n = size(tools)
    do k = 1, n
      if (tools(k)%heat%is_on) call tools(k)%heat%face_response(dt, x%t_face0(k), x%dt_face_dp(k))
    end do
    do k = 1, size(backings)
      do i = 1, size(backings(k)%column)
        n = n + 1
        call backings(k)%column(i)%face_response(dt, x%t_face0(n), x%dt_face_dp(n))
      end do
    end do
  end subroutine find_contacts

  !> Number of contacts of the particles of block `b`.
  pure integer function count_contacts(scene, tools, particles, b) result(n)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tools(:)
    type(particles_t), intent(in) :: particles
    integer, intent(in) :: b
    logical :: acts(6)
    integer :: face, k

    n = 0
    associate (p => particles)
      acts = scene%body(p%body(b))%film%acts()
      do face = 1, 6
        if (.not. acts(face)) cycle
        n = n + count(btest(tag_faces(p%tag(:p%count(b), b)), face - 1))
      end do
      do k = 1, size(tools)
        if (.not. tools(k)%heat%is_on) cycle
        n = n + count(p%ps(:p%count(b), tools(k)%heat%place, b) > 0.0_rp)
      end do
    end associate
  end function count_contacts

  !> Add the faces with films of the particles of a block.
  subroutine list_faces(scene, backings, nodes, tag, block, x)
    type(scene_t), intent(in) :: scene
    type(backing_t), intent(in) :: backings(:)
    type(nodes_t), intent(in) :: nodes
    integer(i8), intent(in) :: tag(:)                  !! tags of the particles
    type(block_t), intent(in) :: block
    type(contacts_t), intent(inout) :: x
    real(rp) :: area, at(3), coefficient, edge(3), outside
    logical :: acts(6)
    integer :: axis, face, i, k, p, sink

    associate (body => block%body, ps => block%ps)
      associate (film => scene%body(body)%film, group => scene%body(body)%heat_group)
        acts = film%acts()
        do p = 1, block%n
          if (tag_faces(tag(p)) == 0) cycle
          do face = 1, 6
            if (.not. (acts(face) .and. btest(tag_faces(tag(p)), face - 1))) cycle
            axis = (face + 1)/2
            edge = scene%spacing_of(body, ps(p, :))
            area = product(edge)/edge(axis)
            call find_film(film(face), ps(p, f_temp), &
                           mean_at(nodes, block%w(p, :9), block%first(p), 5 + axis, group), &
                           coefficient, outside)
            sink = 0
            if (film(face)%has_backing) then
              at = ps(p, f_pos:f_pos + 2)
              at(axis) = at(axis) + merge(0.5_rp, -0.5_rp, mod(face, 2) == 0)*edge(axis)
              k = find_backing(backings, body, face)
              sink = x%n_tools + backings(k)%column_at(at) &
                     + sum([(size(backings(i)%column), i=1, k - 1)])
            end if
            call add_contact(scene, nodes, block, p, sink, area, coefficient, &
                             0.5_rp*edge(axis), 0.0_rp, outside, x)
          end do
        end do
      end associate
    end associate
  end subroutine list_faces

  !> Heat-transfer coefficient [W/(m2 K)] of a film at the pressure of the body and the temperature
  !> outside [K]. Radiation is linearised about the temperature of the metal: its share of the
  !> coefficient is 4 eps sigma T^3, and the temperature outside is such that the flow is exact at
  !> T.
  pure subroutine find_film(film, temp, pressure, coefficient, outside)
    type(film_t), intent(in) :: film
    real(rp), intent(in) :: temp, pressure          !! [K], [Pa]
    real(rp), intent(out) :: coefficient, outside
    real(rp) :: flow, slope

    coefficient = film%coefficient_at(pressure)
    outside = film%ambient
    if (film%emissivity <= 0.0_rp) return
    slope = 4.0_rp*film%emissivity*stefan_boltzmann*temp**3
    flow = coefficient*(temp - film%ambient) &
           + film%emissivity*stefan_boltzmann*(temp**4 - film%ambient**4)
    coefficient = coefficient + slope
    outside = temp - flow/coefficient
  end subroutine find_film

  !> Add the particles of a block in contact with tool `k`.
  subroutine list_tool(scene, tool, nodes, k, dt, block, x)
    type(scene_t), intent(in) :: scene
    type(tool_t), intent(in) :: tool
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: k
    real(rp), intent(in) :: dt                         !! time since the last conduction step [s]
    type(block_t), intent(in) :: block
    type(contacts_t), intent(inout) :: x
    real(rp) :: area, depth, gap, normal(3)
    integer :: p

    associate (ps => block%ps)
      do p = 1, block%n
        if (ps(p, tool%heat%place) <= 0.0_rp) cycle
        call tool%distance(ps(p, f_pos:f_pos + 2), gap, normal)
        depth = 0.5_rp*norm2(normal*scene%spacing_of(block%body, ps(p, :)))
        area = ps(p, tool%heat%place)/dt
        call add_contact(scene, nodes, block, p, k, area, tool%heat%gap_coefficient, &
                         depth, ps(p, tool%heat%place + 1)/(dt*area), 0.0_rp, x)
      end do
    end associate
  end subroutine list_tool

  !> Add a contact of particle `p` of a block with the friction heat flux `flux` [W/m2] at the
  !> distance `depth` [m] from its centre.
  pure subroutine add_contact(scene, nodes, block, p, sink, area, coefficient, depth, flux, &
                              outside, x)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(block_t), intent(in) :: block
    integer, intent(in) :: p, sink
    real(rp), intent(in) :: area, coefficient, depth, flux, outside
    type(contacts_t), intent(inout) :: x
    real(rp) :: conductivity, resistance               ! [W/(m K)]; of the metal to the surface
                                                       ! [m2 K/W]

    associate (body => scene%body(block%body), temp => block%ps(p, f_temp))
      conductivity = scene%material(body%material)%conductivity_at(temp)
      resistance = 0.0_rp                              ! without conduction a particle is even
      if (conductivity > 0.0_rp) resistance = depth/conductivity
      x%n = x%n + 1
      x%sink(x%n) = sink
      x%group(x%n) = body%heat_group
      x%first(x%n) = block%first(p)
      x%weight(:, x%n) = block%w(p, :9)
      x%conductance(x%n) = 0.0_rp
      if (coefficient > 0.0_rp) x%conductance(x%n) = area/(1.0_rp/coefficient + resistance)
      x%excess(x%n) = temp - mean_at(nodes, block%w(p, :9), block%first(p), 5, body%heat_group) &
        + resistance*flux
      x%outside(x%n) = outside
    end associate
  end subroutine add_contact

  !> Mean of a lane of the first grid with the weights of a particle.
  pure real(rp) function mean_at(nodes, w, first, lane, group) result(mean)
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: w(9)
    integer, intent(in) :: first, lane, group
    integer :: i, j, q

    mean = 0.0_rp
    do i = 1, 3
      do j = 1, 3
        q = first + (i - 1)*nodes%patch%stride(1) + (j - 1)*nodes%patch%stride(2)
        mean = mean + w(i)*w(3 + j)*(w(7)*nodes%g(lane, q, group) &
                                     + w(8)*nodes%g(lane, q + 1, group) &
                                     + w(9)*nodes%g(lane, q + 2, group))
      end do
    end do
  end function mean_at

  !> Collective. Subtract the heat flows of a step `dt` [s] from lane 5 of the second grid and add
  !> them to `sums`, if present. With the nodal temperatures at the end of the step in lane 4
  !> (`ends`) they are those at these temperatures. Otherwise lane 4 is the temperature before the
  !> step, lane 5 its increment by all other heat, and lane 2 the rate L/C of the conductances; the
  !> flow is then its mean in the step, with the response of the metal to an even flow through its
  !> neighbours.
  subroutine add_exchange(nodes, dt, ends, x, sums)
    type(nodes_t), intent(inout) :: nodes
    real(rp), intent(in) :: dt
    logical, intent(in) :: ends
    type(contacts_t), intent(inout) :: x
    real(rp), intent(inout), optional :: sums(n_sums)
    real(rp) :: conductance(x%n), heat, part, share, surface(x%n)
    real(rp) :: power(size(x%t_face0)), total(size(x%t_face0))  ! of each sink: heat flow [W],
                                                                ! conductance [W/K]
    integer :: e

    power = 0.0_rp
    total = 0.0_rp
    do e = 1, x%n
      surface(e) = x%excess(e) + mean_of(nodes, x, e, 4)
      conductance(e) = x%conductance(e)
      if (.not. ends) then
        call relax(dt*mean_of(nodes, x, e, 2), share, part)
        surface(e) = surface(e) + part/share*mean_of(nodes, x, e, 5)
        conductance(e) = share*conductance(e)
      end if
      associate (k => x%sink(e))
        if (k == 0) cycle
        power(k) = power(k) + conductance(e)*(surface(e) - x%t_face0(k))
        total(k) = total(k) + conductance(e)
      end associate
    end do
    if (size(power) > 0) then
      call nodes%halo%world%sum(power)
      call nodes%halo%world%sum(total)
      power = power/(1.0_rp + total*x%dt_face_dp)
    end if
    do e = 1, x%n
      associate (k => x%sink(e))
        if (k == 0) then
          heat = dt*conductance(e)*(surface(e) - x%outside(e))
        else
          heat = dt*conductance(e)*(surface(e) - x%t_face0(k) - x%dt_face_dp(k)*power(k))
        end if
        if (present(sums)) then
          associate (taken => sums(merge(e_tool, e_film, k > 0 .and. k <= x%n_tools)))
            taken = taken + heat
          end associate
        end if
      end associate
      call add_to_nodes(nodes, x, e, 5, -heat)
    end do
    x%power = power
  end subroutine add_exchange

  !> Add the conductances of this rank's contacts to lane 6 of the second grid.
  subroutine add_conductances(nodes, x)
    type(nodes_t), intent(inout) :: nodes
    type(contacts_t), intent(in) :: x
    integer :: e

    do e = 1, x%n
      call add_to_nodes(nodes, x, e, 6, x%conductance(e))
    end do
  end subroutine add_conductances

  !> Mean of a lane of the first grid with the weights of a contact.
  pure real(rp) function mean_of(nodes, x, e, lane) result(mean)
    type(nodes_t), intent(in) :: nodes
    type(contacts_t), intent(in) :: x
    integer, intent(in) :: e, lane

    mean = mean_at(nodes, x%weight(:, e), x%first(e), lane, x%group(e))
  end function mean_of

  !> Add `value` to a lane of the second grid by the weights of a contact.
  pure subroutine add_to_nodes(nodes, x, e, lane, value)
    type(nodes_t), intent(inout) :: nodes
    type(contacts_t), intent(in) :: x
    integer, intent(in) :: e, lane
    real(rp), intent(in) :: value
    integer :: i, j, k, q

    associate (g2 => nodes%g2(:, :, x%group(e)), stride => nodes%patch%stride)
      do i = 1, 3
        do j = 1, 3
          q = x%first(e) + (i - 1)*stride(1) + (j - 1)*stride(2)
          do k = 0, 2
            g2(lane, q + k) = g2(lane, q + k) &
              + x%weight(i, e)*x%weight(3 + j, e)*x%weight(7 + k, e)*value
          end do
        end do
      end do
    end associate
  end subroutine add_to_nodes

  !> Give the sinks the heat of a step `dt` [s].
  subroutine warm_sinks(tools, backings, dt, x)
    type(tool_t), intent(inout) :: tools(:)
    type(backing_t), intent(inout) :: backings(:)
    real(rp), intent(in) :: dt
    type(contacts_t), intent(in) :: x
    integer :: i, k, sink

    do k = 1, size(tools)
      if (tools(k)%heat%is_on) call tools(k)%heat%absorb(dt, x%power(k))
    end do
    sink = size(tools)
    do k = 1, size(backings)
      do i = 1, size(backings(k)%column)
        sink = sink + 1
        call backings(k)%column(i)%absorb(dt, x%power(sink))
      end do
    end do
  end subroutine warm_sinks

  !> Reset contact area and heat of the particles at the end of a conduction step.
  pure subroutine reset_contact_sums(tools, particles)
    type(tool_t), intent(in) :: tools(:)
    type(particles_t), intent(inout) :: particles
    integer :: k

    do k = 1, size(tools)
      if (.not. tools(k)%heat%is_on) cycle
      particles%ps(:, tools(k)%heat%place:tools(k)%heat%place + 1, :particles%nblk) = 0.0_rp
    end do
  end subroutine reset_contact_sums

end module heat_exchange
