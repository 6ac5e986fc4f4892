! SPDX-License-Identifier: MIT
!> Whether there is memory for a scene, before anything of its size is made.
module checks_memory
  use base_kinds, only: rp
  use base_memory, only: available_memory
  use base_text, only: str
  use bodies_filling, only: body_solids
  use bodies_solids, only: bounds, is_inside, solid_t
  use comm_world, only: world_t
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: check_memory

  ! Less than what was measured (docs/speed.md): a scene that fits is never refused.
  real(rp), parameter :: per_field = 12.0_rp    !! bytes of a field of a particle, with growth
  real(rp), parameter :: per_node = 64.0_rp       !! bytes of a node of the grid
  real(rp), parameter :: per_cell = 100.0_rp      !! bytes of a cell of heat alone
  real(rp), parameter :: most_counted = 4.0e9_rp  !! points of lattices: more take minutes to count

contains

  !> Collective. Complaint if the particles and nodes, or the cells of heat alone, need more memory
  !> than the nodes have on which the ranks run. The scene has no errors.
  subroutine check_memory(world, input, scene, diagnostics)
    type(world_t), intent(in) :: world
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(diagnostics_t), intent(inout) :: diagnostics
    type(solid_t), allocatable :: solids(:)
    real(rp) :: points, particles, nodes, bytes, share, cells(3), lower(3), upper(3), lacking(1)
    character(:), allocatable :: what
    integer :: b

    points = 0.0_rp
    particles = 0.0_rp
    nodes = 0.0_rp
    do b = 1, size(scene%body)
      call body_solids(input, b, solids)
      call box_of(solids, lower, upper)
      cells = cells_in(scene, lower, upper)
      points = points + product(cells*scene%grid%h/scene%body(b)%spacing)
      particles = particles + filled(solids, lower, upper) &
                  *product(cells*scene%grid%h/scene%body(b)%spacing)
      nodes = max(nodes, product(cells))
    end do
    if (scene%method%has_mechanics) then
      bytes = per_field*scene%layout%n*particles + per_node*nodes
      what = str(particles)//' particles and '//str(nodes)//' nodes'
    else
      bytes = per_cell*nodes
      what = str(nodes)//' cells'
    end if
    share = real(world%ranks_here(), rp)/world%size
    lacking(1) = share*bytes - available_memory()
    call world%max(lacking)
    if (lacking(1) > 0.0_rp) then
      call input%report(diagnostics, 'GRID', 1, 'CELL', 'the bodies have about '//what// &
                        ', which need '//in_words(share*bytes)//' of memory on each computer; '// &
                        in_words(share*bytes - lacking(1))//' are free')
    else if (points > most_counted*world%size .and. scene%method%has_mechanics) then
      call input%report(diagnostics, 'GRID', 1, 'CELL', 'makes '//str(points)// &
                        ' places for particles; at most '//str(most_counted)// &
                        ' a rank can be looked at')
    end if
  end subroutine check_memory

  !> Cells along each axis from `lower` to `upper`.
  pure function cells_in(scene, lower, upper) result(cells)
    type(scene_t), intent(in) :: scene
    real(rp), intent(in) :: lower(3), upper(3)   !! [m]
    real(rp) :: cells(3)

    cells = (upper - lower)/scene%grid%h
    associate (grading => scene%grid%grading)
      if (grading%axis > 0) cells(grading%axis) = grading%place(upper(grading%axis)) &
                                                  - grading%place(lower(grading%axis))
    end associate
  end function cells_in

  !> Box around the solids that add material.
  subroutine box_of(solids, lower, upper)
    type(solid_t), intent(in) :: solids(:)
    real(rp), intent(out) :: lower(3), upper(3)
    real(rp) :: low(3), high(3)
    integer :: i

    lower = huge(1.0_rp)
    upper = -huge(1.0_rp)
    do i = 1, size(solids)
      if (.not. solids(i)%adds) cycle
      call bounds(solids(i), low, high)
      lower = min(lower, low)
      upper = max(upper, high)
    end do
    upper = max(upper, lower)
  end subroutine box_of

  !> About the part of a box that is inside the solids, from samples.
  real(rp) function filled(solids, lower, upper)
    type(solid_t), intent(in) :: solids(:)
    real(rp), intent(in) :: lower(3), upper(3)
    integer, parameter :: n = 24
    integer :: hits, i, j, k

    hits = 0
    do i = 1, n
      do j = 1, n
        do k = 1, n
          if (is_inside(solids, lower + (upper - lower)*(real([i, j, k], rp) - 0.5_rp)/n)) then
            hits = hits + 1
          end if
        end do
      end do
    end do
    filled = real(hits, rp)/real(n, rp)**3
  end function filled

  !> Bytes in a unit that makes them short to read.
  function in_words(bytes) result(text)
    real(rp), intent(in) :: bytes
    character(:), allocatable :: text

    if (bytes < 1.0e9_rp) then
      text = str(anint(bytes*1.0e-6_rp))//' MB'
    else if (bytes < 1.0e12_rp) then
      text = str(anint(bytes*1.0e-8_rp)*0.1_rp)//' GB'
    else
      text = str(anint(bytes*1.0e-11_rp)*0.1_rp)//' TB'
    end if
  end function in_words

end module checks_memory
