! SPDX-License-Identifier: MIT
!> Heat that tools take from the metal under their faces. A particle that was in contact since the
!> last conduction step gives h A (T_s - T_f): A is its mean area in contact, 1/h the half spacing
!> of metal between its centre and the face and the gap, T_s its temperature and, of the heat that
!> the face makes, what that drives through the metal. The temperature T_f of the face is that at
!> the end of the step (contact_tool_heat).
module heat_tools
  use base_kinds, only: nlane, rp
  use comm_world, only: world_t
  use contact_tool, only: tool_t
  use mapping_blocks, only: weights_of
  use mapping_nodes, only: nodes_t
  use particles_store, only: f_pos, f_temp, particles_t
  use state_books, only: books_t, e_tool
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: touched_t, draw_heat, find_touched, forget_touched, heat_tools_by

  !> The particles of this rank at tools that take heat, in a conduction step.
  type :: touched_t
    integer :: n = 0
    integer, allocatable :: tool(:), node(:, :)        !! (27, n)
    real(rp), allocatable :: weight(:, :)              !! (27, n)
    real(rp), allocatable :: conductance(:)            !! h A [W/K]
    real(rp), allocatable :: beyond(:)                 !! T_s over that of the nodes [K]
    real(rp), allocatable :: whole(:)                  !! conductance of each tool, all ranks [W/K]
    real(rp), allocatable :: still(:), per_power(:)    !! what its face answers [K], [K/W]
    real(rp), allocatable :: power(:)                  !! that it takes [W]
  end type touched_t

contains

  !> Collective. List the particles in contact, with the means over the `waited` since the last
  !> conduction step, for one of length `dt`.
  subroutine find_touched(world, scene, particles, nodes, tool, waited, dt, touched)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    type(particles_t), intent(in) :: particles
    type(nodes_t), intent(in) :: nodes
    type(tool_t), intent(in) :: tool(:)
    real(rp), intent(in) :: waited, dt                 !! [s]
    type(touched_t), intent(inout) :: touched
    integer :: b, k, n

    touched%n = 0
    if (.not. any(tool%heat%is_on)) return
    n = 0
    do k = 1, size(tool)
      if (.not. tool(k)%heat%is_on) cycle
      do b = 1, particles%nblk
        n = n + count(particles%ps(:particles%count(b), tool(k)%heat%place, b) > 0.0_rp)
      end do
    end do
    touched = touched_t()
    allocate (touched%tool(n), touched%node(27, n), touched%weight(27, n), &
              touched%conductance(n), touched%beyond(n))
    allocate (touched%whole(size(tool)), touched%still(size(tool)), &
              touched%per_power(size(tool)), touched%power(size(tool)), source=0.0_rp)
    do k = 1, size(tool)
      if (.not. tool(k)%heat%is_on) cycle
      call tool(k)%heat%answer(dt, touched%still(k), touched%per_power(k))
      do b = 1, particles%nblk
        if (.not. any(particles%ps(:particles%count(b), tool(k)%heat%place, b) > 0.0_rp)) cycle
        call list_block(scene, nodes, tool(k), k, particles%body(b), particles%count(b), &
                        particles%nf, particles%ps(:, :, b), waited, touched)
      end do
    end do
    call world%sum(touched%whole)
  end subroutine find_touched

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
    associate (mat => scene%material(scene%body(body)%material), t => touched, &
               spacing => scene%body(body)%spacing)
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
        metal = 0.5_rp*norm2(normal*spacing)/mat%conductivity
        area = ps(p, tool%heat%place)/waited
        t%tool(t%n) = k
        t%conductance(t%n) = area/(metal + 1.0_rp/tool%heat%conductance)
        t%whole(k) = t%whole(k) + t%conductance(t%n)
        t%beyond(t%n) = ps(p, f_temp) - sum(t%weight(:, t%n)*nodes%g(5, t%node(:, t%n), 1)) &
                        + metal*ps(p, tool%heat%place + 1)/(waited*area)
      end do
    end associate
  end subroutine list_block

  !> Collective. Take from the nodes in `dt`, at the temperatures in lane 4, what goes into the
  !> tools: lane 5 of `flux`; to lane 6 the conductance.
  subroutine draw_heat(world, nodes, dt, touched, flux)
    type(world_t), intent(in) :: world
    type(nodes_t), intent(in) :: nodes
    real(rp), intent(in) :: dt                         !! [s]
    type(touched_t), intent(inout) :: touched
    real(rp), intent(inout) :: flux(8, nodes%patch%nn)
    real(rp) :: heat, surface(touched%n)
    integer :: c, i

    if (.not. allocated(touched%power)) return
    associate (t => touched)
      t%power = 0.0_rp
      do i = 1, t%n
        surface(i) = t%beyond(i) + sum(t%weight(:, i)*nodes%g(4, t%node(:, i), 1))
        t%power(t%tool(i)) = t%power(t%tool(i)) + t%conductance(i)*surface(i)
      end do
      call world%sum(t%power)
      t%power = (t%power - t%whole*t%still)/(1.0_rp + t%whole*t%per_power)
      do i = 1, t%n
        associate (k => t%tool(i))
          heat = dt*t%conductance(i)*(surface(i) - t%still(k) - t%per_power(k)*t%power(k))
        end associate
        do c = 1, 27
          flux(5, t%node(c, i)) = flux(5, t%node(c, i)) - t%weight(c, i)*heat
          flux(6, t%node(c, i)) = flux(6, t%node(c, i)) + t%weight(c, i)*t%conductance(i)
        end do
      end do
    end associate
  end subroutine draw_heat

  !> A conduction step of `dt` is made: the tools take their heat, which one rank books.
  subroutine heat_tools_by(world, dt, touched, tool, books)
    type(world_t), intent(in) :: world
    real(rp), intent(in) :: dt                         !! [s]
    type(touched_t), intent(in) :: touched
    type(tool_t), intent(inout) :: tool(:)
    type(books_t), intent(inout) :: books
    integer :: k

    do k = 1, size(tool)
      if (.not. tool(k)%heat%is_on) cycle
      call tool(k)%heat%take(dt, touched%power(k))
      if (world%is_root()) books%sums(e_tool) = books%sums(e_tool) + dt*touched%power(k)
    end do
  end subroutine heat_tools_by

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

end module heat_tools
