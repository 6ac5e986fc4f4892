! SPDX-License-Identifier: MIT
!> Check of the memory that a scene needs, before anything is allocated.
module checks_memory
  use base_kinds, only: rp
  use base_memory, only: available_memory
  use base_text, only: str
  use bodies_solids, only: body_solids, extent_of, is_inside, solid_t
  use comm_world, only: world_t
  use input_diagnostics, only: diagnostics_t
  use input_values, only: input_t
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: check_memory

  ! Lower bounds of measured values (docs/speed.md), so that a scene that fits is never rejected.
  real(rp), parameter :: per_field = 12.0_rp    !! per particle and field, with reserve [bytes]
  real(rp), parameter :: per_node = 64.0_rp       !! per grid node [bytes]
  real(rp), parameter :: per_cell = 100.0_rp      !! per cell of a heat-only run [bytes]
  real(rp), parameter :: max_lattice_points = 4.0e9_rp  !! per rank: more take minutes to fill

contains

  !> Collective. Report if the particles and grid nodes, or the cells of a heat-only run, need more
  !> memory than the computers have. The scene must have no errors.
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
      call extent_of(solids, lower, upper)
      upper = max(upper, lower)
      cells = cells_in(scene, lower, upper)
      points = points + product(cells*scene%grid%h/scene%body(b)%spacing)
      particles = particles + filled_share(solids, lower, upper) &
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
                        ', which need '//size_text(share*bytes)//' of memory on each computer; '// &
                        size_text(share*bytes - lacking(1))//' are free')
    else if (points > max_lattice_points*world%size .and. scene%method%has_mechanics) then
      call input%report(diagnostics, 'GRID', 1, 'CELL', 'makes '//str(points)// &
                        ' places for particles; at most '//str(max_lattice_points)// &
                        ' a rank can be looked at')
    end if
  end subroutine check_memory

  !> Number of cells along each axis from `lower` to `upper`, not rounded.
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

  !> Share of a box that is inside the solids, estimated from samples.
  real(rp) function filled_share(solids, lower, upper)
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
    filled_share = real(hits, rp)/real(n, rp)**3
  end function filled_share

  !> Text of a memory size in MB, GB or TB.
  function size_text(bytes) result(text)
    real(rp), intent(in) :: bytes
    character(:), allocatable :: text

    if (bytes < 1.0e9_rp) then
      text = str(anint(bytes*1.0e-6_rp))//' MB'
    else if (bytes < 1.0e12_rp) then
      text = str(anint(bytes*1.0e-8_rp)*0.1_rp)//' GB'
    else
      text = str(anint(bytes*1.0e-11_rp)*0.1_rp)//' TB'
    end if
  end function size_text

end module checks_memory
