! SPDX-License-Identifier: MIT
!> Mesh for conduction from the solids of the bodies: lines on their plane faces, and volume and
!> face fractions of cut cells from sample points.
module setup_cut_cells
  use base_kinds, only: rp
  use base_world, only: world_t
  use heat_cut_mesh, only: cut_cells_t, n_halo_planes
  use heat_mesh, only: lay_lines, heat_mesh_t
  use setup_solids, only: body_at, bounds, solid_box, solid_cylinder, solid_t, solid_trapezoid, &
                          solids_t
  implicit none (type, external)
  private

  public :: make_mesh, cut_cells

  integer, parameter :: n_samples = 12         !! samples along each edge of a cut cell
  real(rp), parameter :: inside = 1.0e-6_rp    !! relative distance of samples from faces

contains

  !> Mesh with cell edges of about `h` around all solids that add material.
  subroutine make_mesh(world, h, list, mesh)
    type(world_t), intent(in) :: world
    real(rp), intent(in) :: h(3)               !! cell edges [m]
    type(solids_t), intent(in) :: list(:)
    type(heat_mesh_t), intent(out) :: mesh
    real(rp), allocatable :: x(:), y(:), z(:)

    call lay_lines(h(1), planes_of(list, 1), x)
    call lay_lines(h(2), planes_of(list, 2), y)
    call lay_lines(h(3), planes_of(list, 3), z)
    call mesh%init(world, x, y, z)
  end subroutine make_mesh

  !> Positions of plane faces normal to `axis`, the ends first: of solids that add, then of those
  !> that cut.
  pure function planes_of(list, axis) result(planes)
    type(solids_t), intent(in) :: list(:)
    integer, intent(in) :: axis
    real(rp), allocatable :: planes(:)
    real(rp) :: lower(3), upper(3), ends(2)
    integer :: b, i, pass

    ends = [huge(1.0_rp), -huge(1.0_rp)]
    allocate (planes(0))
    do pass = 1, 2
      do b = 1, size(list)
        do i = 1, size(list(b)%solid)
          associate (s => list(b)%solid(i))
            if (s%adds .neqv. pass == 1) cycle
            call bounds(s, lower, upper)
            if (s%adds) ends = [min(ends(1), lower(axis)), max(ends(2), upper(axis))]
            if (is_flat(s, axis)) planes = [planes, lower(axis), upper(axis)]
          end associate
        end do
      end do
    end do
    planes = [ends, planes]
  end function planes_of

  !> True if a solid has plane faces normal to `axis`.
  pure logical function is_flat(s, axis)
    type(solid_t), intent(in) :: s
    integer, intent(in) :: axis

    select case (s%kind)
    case (solid_box)
      is_flat = .true.
    case (solid_trapezoid)
      is_flat = axis /= s%across
    case (solid_cylinder)
      is_flat = axis == s%axis
    case default
      is_flat = .false.
    end select
  end function is_flat

  !> Volume and face fractions of the cells of this rank's planes and `n_halo_planes` more.
  subroutine cut_cells(list, mesh, cuts)
    type(solids_t), intent(in) :: list(:)
    type(heat_mesh_t), intent(in) :: mesh
    type(cut_cells_t), intent(out) :: cuts
    integer :: first, i, j, k, last, p

    first = max(1, mesh%lo - n_halo_planes)
    last = min(mesh%n(1), mesh%hi + n_halo_planes)
    if (mesh%nx == 0) last = first - 1
    p = last - first + 1
    allocate (cuts%volume(mesh%n(3), mesh%n(2), p), cuts%face(6, mesh%n(3), mesh%n(2), p), &
              cuts%body(mesh%n(3), mesh%n(2), p))
    do i = first, last
      p = i - first + 1
      do j = 1, mesh%n(2)
        do k = 1, mesh%n(3)
          call cut_cell(list, mesh%box(i, j, k), cuts%volume(k, j, p), cuts%face(:, k, j, p), &
                        cuts%body(k, j, p))
        end do
      end do
    end do
  end subroutine cut_cells

  !> Volume and face fractions of a cell; it is full or empty if its corners, quarter points and
  !> centre agree.
  pure subroutine cut_cell(list, box, volume, face, body)
    type(solids_t), intent(in) :: list(:)
    real(rp), intent(in) :: box(3, 2)          !! corners of the cell [m]
    !> Fractions of volume and of the six faces in the solid.
    real(rp), intent(out) :: volume, face(6)
    integer, intent(out) :: body               !! body that the cell belongs to; 0: none
    real(rp), parameter :: at(4) = [inside, 0.25_rp, 0.75_rp, 1.0_rp - inside]
    real(rp) :: s(3)
    integer :: c, n_inside, body_here, n

    body = body_at(list, place([0.5_rp, 0.5_rp, 0.5_rp]))
    n_inside = merge(1, 0, body > 0)
    n = 1
    do c = 0, 15
      s = merge(at(2), at(3), [btest(c, 0), btest(c, 1), btest(c, 2)])
      if (c > 7) s = merge(at(1), at(4), [btest(c, 0), btest(c, 1), btest(c, 2)])
      body_here = body_at(list, place(s))
      if (body == 0) body = body_here
      n = n + 1
      if (body_here > 0) n_inside = n_inside + 1
      if (n_inside > 0 .and. n_inside < n) exit
    end do
    volume = merge(1.0_rp, 0.0_rp, n_inside > 0)
    face = volume
    if (n_inside > 0 .and. n_inside < n) call sample(volume, face)
  contains
    !> Position of relative coordinates in the cell [m].
    pure function place(part) result(x)
      real(rp), intent(in) :: part(3)
      real(rp) :: x(3)

      x = box(:, 1) + part*(box(:, 2) - box(:, 1))
    end function place

    !> Volume and face fractions of the cell from samples.
    pure subroutine sample(volume, face)
      real(rp), intent(out) :: volume, face(6)
      real(rp) :: s(3)
      integer :: a, i, j, k

      volume = 0.0_rp
      face = 0.0_rp
      do i = 1, n_samples
        do j = 1, n_samples
          s = [real(i, rp), real(j, rp), 0.0_rp] - 0.5_rp
          s = s/real(n_samples, rp)
          do k = 1, n_samples
            s(3) = (real(k, rp) - 0.5_rp)/real(n_samples, rp)
            if (body_at(list, place(s)) > 0) volume = volume + 1.0_rp/real(n_samples, rp)**3
          end do
          do a = 1, 3
            s(3) = inside
            if (body_at(list, place(cshift(s, -a))) > 0) face(2*a - 1) = face(2*a - 1) + 1.0_rp
            s(3) = 1.0_rp - inside
            if (body_at(list, place(cshift(s, -a))) > 0) face(2*a) = face(2*a) + 1.0_rp
          end do
        end do
      end do
      face = face/real(n_samples, rp)**2
    end subroutine sample
  end subroutine cut_cell

end module setup_cut_cells
