! SPDX-License-Identifier: MIT
!> Memory that a scene needs, checked before it is allocated; volumes of the shapes and of the
!> particles that fill them.
module setup_volumes
  use base_kinds, only: rp
  use base_log, only: log_line
  use base_system, only: available_memory
  use base_text, only: str
  use base_world, only: world_t
  use input_values, only: input_t
  use setup_lattice, only: lattice_of, lattice_t
  use setup_solids, only: bounds, extent_of, holds, is_inside, read_all_solids, read_body_solids, &
                          shapes_of, solid_t, solids_t
  use state_nodes, only: bytes_per_node
  use state_scene, only: scene_t
  implicit none (type, external)
  private

  public :: check_memory, check_volumes, filled_share, measure_volumes, report_volumes, volumes_t

  ! Lower bounds of measured values (docs/speed.md), so that a scene that fits is never rejected.
  !> Lower bound per particle and field, with reserve [bytes].
  real(rp), parameter :: per_field = 12.0_rp
  real(rp), parameter :: per_cell = 100.0_rp      !! lower bound per cell of a heat-only run [bytes]
  !> Largest number of lattice points of a rank; more take minutes to fill.
  real(rp), parameter :: max_lattice_points = 4.0e9_rp

  !> Volume that each shape of a body adds (positive) or removes (negative).
  type :: volumes_t
    integer, allocatable :: shape(:)                        !! indices of the &SHAPE groups
    real(rp), allocatable :: exact(:)                       !! volume by geometry [m3]
    real(rp), allocatable :: filled(:)                      !! volume of the particles [m3]
  end type volumes_t

  !> Largest relative error of the volume without a warning.
  real(rp), parameter :: max_error = 0.02_rp
  integer, parameter :: max_level = 7   !! subdivisions of the box around a shape for its volume
  !> Subdivisions in which only cells cut by the surface are divided.
  integer, parameter :: cut_level = 3
  real(rp), parameter :: inset = 1.0e-6_rp  !! inset of sampled corners of a cell, over its edge

contains

  !> Collective. Report if the particles and grid nodes, or the cells of a heat-only run, need more
  !> memory than the computers have. The scene must have no errors.
  subroutine check_memory(world, input, scene)
    type(world_t), intent(in) :: world
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(solid_t), allocatable :: solids(:)
    real(rp) :: points, particles, nodes, bytes, share, lacking(1)
    real(rp), dimension(3) :: cells, lower, top, upper
    character(:), allocatable :: what
    integer :: b

    points = 0.0_rp
    particles = 0.0_rp
    nodes = 0.0_rp
    top = scene%grid%lower
    do b = 1, size(scene%body)
      call read_body_solids(input, b, solids)
      call extent_of(solids, lower, upper)
      upper = max(upper, lower)
      top = max(top, upper)
      cells = cells_in(scene, lower, upper)
      points = points + product(cells*scene%grid%h/scene%body(b)%spacing)
      particles = particles + filled_share([solids_t(solids)], lower, upper - lower) &
                  *product(cells*scene%grid%h/scene%body(b)%spacing)
      nodes = max(nodes, product(cells))
    end do
    if (scene%method%has_mechanics) then
      nodes = product(cells_in(scene, scene%grid%lower, top))  ! stored from the lower corner on
      bytes = per_field*scene%layout%n*particles &
        + real(bytes_per_node(scene)*maxval(scene%body%group), rp)*nodes
      what = str(particles)//' particles and '//str(nodes)//' nodes'
    else
      bytes = per_cell*nodes
      what = str(nodes)//' cells'
    end if
    share = real(world%ranks_here(), rp)/world%size
    lacking(1) = share*bytes - available_memory()
    call world%max(lacking)
    if (lacking(1) > 0.0_rp) then
      call input%report('GRID', 1, 'CELL', 'makes about '//what//', which need '// &
                        gigabytes(share*bytes)//' of memory on each computer; '// &
                        gigabytes(share*bytes - lacking(1))//' are free')
    else if (points > max_lattice_points*world%size .and. scene%method%has_mechanics) then
      call input%report('GRID', 1, 'CELL', 'makes '//str(points)//' places of particles; at '// &
                        'most '//str(max_lattice_points)//' a rank can be checked')
    end if
  end subroutine check_memory

  !> Text of a memory size.
  function gigabytes(bytes) result(text)
    real(rp), intent(in) :: bytes
    character(:), allocatable :: text

    text = str(1.0e-3_rp*anint(bytes*1.0e-6_rp))//' GB'
  end function gigabytes

  !> Number of cells along each axis from `lower` to `upper`, not rounded.
  pure function cells_in(scene, lower, upper) result(cells)
    type(scene_t), intent(in) :: scene
    real(rp), intent(in) :: lower(3), upper(3)   !! lower corner, upper corner [m]
    real(rp) :: cells(3)
    integer :: a

    cells = (upper - lower)/scene%grid%h
    do a = 1, 3
      associate (grading => scene%grid%grading(a))
        if (grading%is_graded) cells(a) = grading%place(upper(a)) - grading%place(lower(a))
      end associate
    end do
  end function cells_in

  !> Share of a box that is inside all bodies of a list, estimated from samples.
  pure real(rp) function filled_share(list, lower, edges)
    type(solids_t), intent(in) :: list(:)
    real(rp), intent(in) :: lower(3), edges(3)   !! lower corner, edges [m]
    integer, parameter :: n = 24                 ! samples along each axis
    real(rp) :: x(3)
    integer :: b, hits, i, j, k

    hits = 0
    do i = 1, n
      do j = 1, n
        do k = 1, n
          x = lower + edges*([i, j, k] - 0.5_rp)/n
          if (all([(is_inside(list(b)%solid, x), b=1, size(list))])) hits = hits + 1
        end do
      end do
    end do
    filled_share = real(hits, rp)/real(n, rp)**3
  end function filled_share

  !> Collective. Volumes of the shapes and of the particles for all bodies.
  subroutine measure_volumes(world, input, scene, volumes)
    type(world_t), intent(in) :: world
    type(input_t), intent(in) :: input
    type(scene_t), intent(in) :: scene
    type(volumes_t), allocatable, intent(out) :: volumes(:)
    type(solids_t), allocatable :: solids(:)
    integer :: b, i, s

    call read_all_solids(input, solids)
    allocate (volumes(size(solids)))
    do b = 1, size(solids)
      associate (v => volumes(b), solid => solids(b)%solid)
        v%shape = shapes_of(input, b)
        allocate (v%exact(size(solid)), v%filled(size(solid)), source=0.0_rp)
        do i = 1 + world%rank, size(solid), world%size
          v%exact(i) = exact_volume(pack(solid(:i), [(boxes_overlap(solid(s), solid(i)), s=1, i)]))
        end do
        call sum_particle_volumes(world, scene, b, solid, v%filled)
        call world%sum(v%exact)
        call world%sum(v%filled)
      end associate
    end do
  end subroutine measure_volumes

  !> Volume that the last solid of a list adds or removes [m3].
  pure real(rp) function exact_volume(solid) result(volume)
    type(solid_t), intent(in) :: solid(:)
    real(rp) :: lower(3), upper(3), around(3, 2)

    call bounds(solid(size(solid)), lower, upper)
    call extent_of(solid, around(:, 1), around(:, 2))
    lower = max(lower, around(:, 1))
    upper = min(upper, around(:, 2))
    volume = 0.0_rp
    if (any(upper <= lower)) return
    if (size(solid) == 1 .and. allocated(solid(1)%mesh)) then
      volume = solid(1)%mesh%volume
      return
    end if
    volume = product(upper - lower)*change_in_cell(solid, lower, upper - lower, max_level)
  end function exact_volume

  !> Share of a cell that the last solid adds or removes, by recursive subdivision.
  pure recursive real(rp) function change_in_cell(solid, corner, edge, left) result(part)
    type(solid_t), intent(in) :: solid(:)
    real(rp), intent(in) :: corner(3), edge(3)  !! corner of the cell, edges of the cell [m]
    integer, intent(in) :: left                             !! remaining subdivisions
    real(rp) :: at(3)
    integer :: c, first, now

    if (left <= cut_level) then
      first = change_at(solid, corner + 0.5_rp*edge)
      part = first
      do c = 0, 7
        at = merge(inset, 1.0_rp - inset, [btest(c, 0), btest(c, 1), btest(c, 2)])
        now = change_at(solid, corner + at*edge)
        if (now /= first) exit
      end do
      if (now == first) return
    end if
    part = 0.0_rp
    do c = 0, 7
      at = merge(0.0_rp, 0.5_rp, [btest(c, 0), btest(c, 1), btest(c, 2)])
      if (left > 0) then
        part = part + 0.125_rp*change_in_cell(solid, corner + at*edge, 0.5_rp*edge, left - 1)
      else
        part = part + 0.125_rp*change_at(solid, corner + (at + 0.25_rp)*edge)
      end if
    end do
  end function change_in_cell

  !> 1 where the last solid adds material, -1 where it removes some, 0 elsewhere.
  pure integer function change_at(solid, x)
    type(solid_t), intent(in) :: solid(:)
    real(rp), intent(in) :: x(3)

    change_at = 0
    associate (last => solid(size(solid)))
      if (.not. holds(last, x)) return
      if (is_inside(solid(:size(solid) - 1), x) .neqv. last%adds) then
        change_at = merge(1, -1, last%adds)
      end if
    end associate
  end function change_at

  !> True if the bounding boxes of two solids overlap.
  pure logical function boxes_overlap(one, other)
    type(solid_t), intent(in) :: one, other
    real(rp), dimension(3) :: lower, upper, lower_other, upper_other

    call bounds(one, lower, upper)
    call bounds(other, lower_other, upper_other)
    boxes_overlap = all(lower <= upper_other .and. lower_other <= upper)
  end function boxes_overlap

  !> Sum the volumes of particles that each solid adds or removes, on this rank's lattice planes.
  subroutine sum_particle_volumes(world, scene, body, solid, filled)
    type(world_t), intent(in) :: world
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: body
    type(solid_t), intent(in) :: solid(:)
    real(rp), intent(inout) :: filled(:)                    !! volumes of the particles [m3]
    type(lattice_t) :: lattice
    real(rp) :: volume, x(3)
    integer :: i, j, k, s
    logical :: is_in, was_in

    lattice = lattice_of(scene, scene%body(body), solid)
    do i = world%rank, lattice%n(1) - 1, world%size
      do j = 0, lattice%on_ring(i) - 1
        do k = 0, lattice%n(3) - 1
          volume = product(scene%body(body)%spacing)*lattice%share(i, j, k)
          x = lattice%point(i, j, k)
          is_in = .false.
          do s = 1, size(solid)
            was_in = is_in
            if (is_in .neqv. solid(s)%adds) then
              if (holds(solid(s), x)) is_in = solid(s)%adds
            end if
            if (is_in .neqv. was_in) filled(s) = filled(s) + merge(volume, -volume, is_in)
          end do
        end do
      end do
    end do
  end subroutine sum_particle_volumes

  !> Warn of shapes without effect, and of shapes whose particles have a different volume.
  subroutine check_volumes(input, volumes)
    type(input_t), intent(in) :: input
    type(volumes_t), intent(in) :: volumes(:)
    integer :: b, i

    do b = 1, size(volumes)
      do i = 1, size(volumes(b)%shape)
        associate (exact => volumes(b)%exact(i), filled => volumes(b)%filled(i), &
                   s => volumes(b)%shape(i))
          if (abs(exact) <= 0.0_rp) then
            call input%warn('SHAPE', s, '', 'changes nothing of its body')
          else if (abs(filled - exact) > max_error*abs(exact)) then
            call input%warn('SHAPE', s, '', trim(merge('adds', 'cuts', exact > 0.0_rp))//' '// &
                            in_mm3(abs(filled))//' instead of '//in_mm3(abs(exact))//' ('// &
                            deviation(filled, exact)//'), by the particle spacing')
          end if
        end associate
      end do
    end do
  end subroutine check_volumes

  !> Print the volumes for `--check`.
  subroutine report_volumes(scene, volumes)
    type(scene_t), intent(in) :: scene
    type(volumes_t), intent(in) :: volumes(:)
    integer :: b, i

    do b = 1, size(volumes)
      associate (v => volumes(b), body => scene%body(b))
        call log_line('volume       '//trim(body%name)//': '//in_mm3(sum(v%filled))//' for '// &
                      in_mm3(sum(v%exact))//' required ('// &
                      deviation(sum(v%filled), sum(v%exact))//'), '// &
                      str(scene%material(body%material)%rho/body%start%jac*sum(v%filled))//' kg')
        do i = 1, merge(size(v%shape), 0, size(v%shape) > 1)
          call log_line('             &SHAPE '//str(v%shape(i))//': '//in_mm3(v%filled(i))// &
                        ' for '// &
                        in_mm3(v%exact(i))//' ('//deviation(v%filled(i), v%exact(i))//')')
        end do
      end associate
    end do
  end subroutine report_volumes

  !> Text of a volume in mm3.
  pure function in_mm3(volume) result(text)
    real(rp), intent(in) :: volume                          !! [m3]
    character(:), allocatable :: text

    text = str(1.0e9_rp*volume)//' mm3'
  end function in_mm3

  !> Text of a relative deviation, as `+12.1 %`.
  function deviation(filled, exact) result(text)
    real(rp), intent(in) :: filled, exact
    character(:), allocatable :: text
    character(12) :: digits

    if (abs(exact) <= 0.0_rp) then
      text = '-'
      return
    end if
    write (digits, '(sp,f9.2)') 100.0_rp*(filled/exact - 1.0_rp)
    text = trim(adjustl(digits))
    if (text == '-0.00') text = '+0.00'
    text = text//' %'
  end function deviation

end module setup_volumes
