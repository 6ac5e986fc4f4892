! SPDX-License-Identifier: MIT
!> Heat that tools take from the metal under their faces, and backings through the films of theirs.
!> A particle that was in contact with a tool since the last conduction step gives h A (T_s - T_f):
!> A is its mean area in contact, 1/h the half spacing of metal between its centre and the face and
!> the gap, T_s its temperature and, of the heat that the face makes, what that drives through the
!> metal. A face of a particle in front of a backing gives the same, with the coefficient of its
!> film and the temperature of the nodes at the face. The temperature T_f of the sink is that at the
!> end of the step (contact_heat_sink).
module heat_sinks
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use contact_backing, only: backing_t, find_backing
  use contact_tool, only: tool_t
  use heat_films, only: face_of
  use mapping_blocks, only: weights_of
  use mapping_nodes, only: nodes_t
  use particles_store, only: f_mass, f_pos, f_temp, particles_t, tag_faces
  use state_books, only: books_t, e_film, e_tool
  use state_scene, only: scene_t
  use transfer_conduction, only: least_capacity
  use transfer_weights, only: point_nodes
  implicit none (type, external)
  private

  public :: touched_t, draw_heat, find_touched, forget_touched, heat_sinks_by

  !> The particles of this rank at sinks, in a conduction step: tools, and behind them the columns
  !> of all backings.
  type :: touched_t
    integer :: n = 0
    integer, allocatable :: sink(:), group(:)          !! of each; of heat
    integer, allocatable :: node(:, :)                 !! (27, n)
    real(rp), allocatable :: weight(:, :)              !! (27, n)
    real(rp), allocatable :: conductance(:)            !! h A [W/K]
    real(rp), allocatable :: beyond(:)                 !! T_s over that of the nodes [K]
    real(rp), allocatable :: whole(:)                  !! conductance of each sink, all ranks [W/K]
    real(rp), allocatable :: still(:), per_power(:)    !! what its face answers [K], [K/W]
    real(rp), allocatable :: power(:)                  !! that it takes [W]
  end type touched_t

contains

  !> Collective. List the particles in contact, with the means over the `waited` since the last
  !> conduction step, for one of length `dt`.
  subroutine find_touched(world, scene, particles, nodes, tool, backing, waited, dt, touched)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    type(tool_t), intent(in) :: tool(:)
    type(backing_t), intent(in) :: backing(:)
    real(rp), intent(in) :: waited, dt                 !! [s]
    type(touched_t), intent(inout) :: touched
    integer :: b, i, k, n, sinks

    touched%n = 0
    if (.not. any(tool%heat%is_on) .and. size(backing) == 0) return
    n = count_faces(scene, particles)
    do k = 1, size(tool)
      if (.not. tool(k)%heat%is_on) cycle
      do b = 1, particles%nblk
        n = n + count(particles%ps(:particles%count(b), tool(k)%heat%place, b) > 0.0_rp)
      end do
    end do
    touched = touched_t()
    allocate (touched%sink(n), touched%group(n), touched%node(27, n), touched%weight(27, n), &
              touched%conductance(n), touched%beyond(n))
    sinks = size(tool) + sum([(size(backing(k)%column), k=1, size(backing))])
    allocate (touched%whole(sinks), touched%still(sinks), touched%per_power(sinks), &
              touched%power(sinks), source=0.0_rp)
    do k = 1, size(tool)
      if (.not. tool(k)%heat%is_on) cycle
      call tool(k)%heat%answer(dt, touched%still(k), touched%per_power(k))
      do b = 1, particles%nblk
        if (.not. any(particles%ps(:particles%count(b), tool(k)%heat%place, b) > 0.0_rp)) cycle
        call list_block(scene, nodes, tool(k), k, particles%body(b), particles%count(b), &
                        particles%nf, particles%ps(:, :, b), waited, touched)
      end do
    end do
    if (size(backing) > 0) then
      call list_faces(scene, particles, nodes, size(tool), backing, touched)
      sinks = size(tool)
      do k = 1, size(backing)
        do i = 1, size(backing(k)%column)
          sinks = sinks + 1
          call backing(k)%column(i)%answer(dt, touched%still(sinks), touched%per_power(sinks))
        end do
      end do
    end if
    call world%sum(touched%whole)
  end subroutine find_touched

  !> How many faces of this rank's particles are in front of a backing.
  pure integer function count_faces(scene, particles) result(n)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    integer :: b, face, p

    n = 0
    do b = 1, particles%nblk
      associate (film => scene%body(particles%body(b))%film)
        if (.not. any(film%has_backing)) cycle
        do p = 1, particles%count(b)
          do face = 1, 6
            if (.not. film(face)%has_backing) cycle
            if (btest(tag_faces(particles%tag(p, b)), face - 1)) n = n + 1
          end do
        end do
      end associate
    end do
  end function count_faces

  !> These faces: linear weights of the nodes around, and the coefficient at the pressure there.
  subroutine list_faces(scene, particles, nodes, n_tools, backing, touched)
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    integer, intent(in) :: n_tools
    type(backing_t), intent(in) :: backing(:)
    type(touched_t), intent(inout) :: touched
    real(rp) :: area, weight(0:7), x(3)
    integer :: axis, b, face, i, k, p, q(0:7)

    do b = 1, particles%nblk
      associate (body => scene%body(particles%body(b)), t => touched, patch => nodes%patch)
        if (.not. any(body%film%has_backing)) cycle
        do p = 1, particles%count(b)
          do face = 1, 6
            if (.not. body%film(face)%has_backing) cycle
            if (.not. btest(tag_faces(particles%tag(p, b)), face - 1)) cycle
            call face_of(scene%spacing_of(particles%body(b), particles%ps(p, f_mass, b)), face, &
                         particles%ps(p, f_pos:f_pos + 2, b), axis, x, area)
            k = find_backing(backing, particles%body(b), face)
            t%n = t%n + 1
            t%sink(t%n) = n_tools + backing(k)%column_at(x) &
                          + sum([(size(backing(i)%column), i=1, k - 1)])
            t%group(t%n) = body%heat_group
            call point_nodes(patch%linear_place(x), patch%stride, 1, least_capacity, patch%nn, &
                             nodes%g(:, :, body%heat_group), q, weight)
            t%node(:, t%n) = q(0)
            t%node(:8, t%n) = q
            t%weight(:, t%n) = 0.0_rp
            t%weight(:8, t%n) = weight
            t%beyond(t%n) = 0.0_rp
            t%conductance(t%n) = area*sum(weight)*body%film(face)%coefficient_at( &
              sum(weight*nodes%g(5 + axis, q, body%heat_group)))
            t%whole(t%sink(t%n)) = t%whole(t%sink(t%n)) + t%conductance(t%n)
          end do
        end do
      end associate
    end do
  end subroutine list_faces

  !> Those of a block at tool `k`.
  subroutine list_block(scene, nodes, tool, k, body, n, nf, ps, waited, touched)
    type(scene_t), intent(in) :: scene
    type(nodes_t), intent(in) :: nodes
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: k, body, n, nf
    real(rp), intent(in) :: ps(nlane, nf), waited
    type(touched_t), intent(inout) :: touched
    integer :: c, first(nlane), i, j, l, p
    real(rp) :: area, gap, metal, normal(3), room, w(nlane, 18)

    call weights_of(scene, nodes, body, nf, ps, w, first)
    associate (mat => scene%material(scene%body(body)%material), t => touched)
      do p = 1, n
        if (ps(p, tool%heat%place) <= 0.0_rp) cycle
        t%n = t%n + 1
        c = 0
        do i = 1, 3
          do j = 1, 3
            do l = 1, 3
              c = c + 1
              t%node(c, t%n) = first(p) + (i - 1)*nodes%patch%stride(1) &
                               + (j - 1)*nodes%patch%stride(2) + l - 1
              t%weight(c, t%n) = w(p, i)*w(p, 3 + j)*w(p, 6 + l)
            end do
          end do
        end do
        call tool%distance(ps(p, f_pos:f_pos + 2), gap, normal, room)
        metal = 0.5_rp*norm2(normal*scene%spacing_of(body, ps(p, f_mass))) &
                /mat%conductivity_at(ps(p, f_temp))
        area = ps(p, tool%heat%place)/waited
        t%sink(t%n) = k
        t%group(t%n) = scene%body(body)%heat_group
        t%conductance(t%n) = area/(metal + 1.0_rp/tool%heat%conductance)
        t%whole(k) = t%whole(k) + t%conductance(t%n)
        t%beyond(t%n) = ps(p, f_temp) - sum(t%weight(:, t%n)*nodes%g(5, t%node(:, t%n), &
        t%group(t%n))) &
                        + metal*ps(p, tool%heat%place + 1)/(waited*area)
      end do
    end associate
  end subroutine list_block

  !> Collective. Take from the nodes in `dt`, at the temperatures in lane 4, what goes into the
  !> sinks: lane 5 of the second grid; to lane 6 the conductance.
  subroutine draw_heat(world, nodes, dt, touched)
    type(world_t), intent(in) :: world
    type(nodes_t), intent(inout) :: nodes
    real(rp), intent(in) :: dt                         !! [s]
    type(touched_t), intent(inout) :: touched
    real(rp) :: heat, surface(touched%n)
    integer :: c, i

    if (.not. allocated(touched%power)) return
    associate (t => touched)
      t%power = 0.0_rp
      do i = 1, t%n
        surface(i) = t%beyond(i) + sum(t%weight(:, i)*nodes%g(4, t%node(:, i), t%group(i)))
        t%power(t%sink(i)) = t%power(t%sink(i)) + t%conductance(i)*surface(i)
      end do
      call world%sum(t%power)
      t%power = (t%power - t%whole*t%still)/(1.0_rp + t%whole*t%per_power)
      do i = 1, t%n
        associate (k => t%sink(i))
          heat = dt*t%conductance(i)*(surface(i) - t%still(k) - t%per_power(k)*t%power(k))
        end associate
        associate (flux => nodes%g2(:, :, t%group(i)))
          do c = 1, 27
            flux(5, t%node(c, i)) = flux(5, t%node(c, i)) - t%weight(c, i)*heat
            flux(6, t%node(c, i)) = flux(6, t%node(c, i)) + t%weight(c, i)*t%conductance(i)
          end do
        end associate
      end do
    end associate
  end subroutine draw_heat

  !> A conduction step of `dt` is made: the sinks take their heat, which one rank books.
  subroutine heat_sinks_by(world, dt, touched, tool, backing, books)
    type(world_t), intent(in) :: world
    real(rp), intent(in) :: dt                         !! [s]
    type(touched_t), intent(in) :: touched
    type(tool_t), intent(inout) :: tool(:)
    type(backing_t), intent(inout) :: backing(:)
    type(books_t), intent(inout) :: books
    integer :: i, k, sink

    do k = 1, size(tool)
      if (.not. tool(k)%heat%is_on) cycle
      call tool(k)%heat%take(dt, touched%power(k))
      if (world%is_root()) books%sums(e_tool) = books%sums(e_tool) + dt*touched%power(k)
    end do
    sink = size(tool)
    do k = 1, size(backing)
      do i = 1, size(backing(k)%column)
        sink = sink + 1
        call backing(k)%column(i)%take(dt, touched%power(sink))
        if (world%is_root()) books%sums(e_film) = books%sums(e_film) + dt*touched%power(sink)
      end do
    end do
  end subroutine heat_sinks_by

  !> All conduction steps since the last are made: contact is counted anew.
  pure subroutine forget_touched(tool, particles)
    type(tool_t), intent(in) :: tool(:)
    type(particles_t), intent(inout) :: particles
    integer :: k

    do k = 1, size(tool)
      if (.not. tool(k)%heat%is_on) cycle
      particles%ps(:, tool(k)%heat%place:tool(k)%heat%place + 1, :particles%nblk) = 0.0_rp
    end do
  end subroutine forget_touched

end module heat_sinks
