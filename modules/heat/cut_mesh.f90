! SPDX-License-Identifier: MIT
!> Embedded-boundary discretization of a solid on a mesh: cut cells have their true volume and face
!> areas (Johansen & Colella 1998). Cells with a small volume are merged with the neighbour across
!> their largest face. Between two materials half cells of both conduct in series.
module heat_cut_mesh
  use base_kinds, only: rp
  use heat_curve, only: property_t
  use heat_mesh, only: heat_mesh_t, boundary_face_t
  implicit none (type, external)
  private

  public :: cut_cells_t, cut_mesh, n_halo_planes

  !> Number of planes needed beyond the own ones on each side.
  integer, parameter :: n_halo_planes = 3
  real(rp), parameter :: min_volume = 0.4_rp    !! volume fraction below which a cell is merged
  real(rp), parameter :: tolerance = 1.0e-9_rp  !! relative tolerance of areas and volumes

  !> Fractions of volume and faces of the cells of some planes that lie in the solid.
  type :: cut_cells_t
    real(rp), allocatable :: volume(:, :, :)      !! (nz, ny, planes)
    real(rp), allocatable :: face(:, :, :, :)     !! (6, nz, ny, planes), xmin xmax ymin .. zmax
    integer, allocatable :: body(:, :, :)         !! body of each cell; 0: none
  end type cut_cells_t

contains

  !> Set rates, capacities and boundary faces of the own cells from the cut cells of the own planes
  !> and `n_halo_planes` more. `property` is that of the first material.
  subroutine cut_mesh(self, cuts, property, conductivity, capacity)
    type(heat_mesh_t), intent(inout) :: self
    type(cut_cells_t), intent(in) :: cuts
    type(property_t), intent(in) :: property
    real(rp), intent(in) :: conductivity(:)         !! conductivity of each body [W/(m K)]
    real(rp), intent(in) :: capacity(:)             !! volumetric capacity of each body [J/(m3 K)]
    integer, allocatable :: target(:, :, :, :)      ! cell that each cell is merged into
    real(rp), allocatable :: conductance(:, :, :, :)  ! from each cell to the next [W/K]
    integer :: first, last

    first = max(1, self%lo - n_halo_planes)
    last = min(self%n(1), self%hi + n_halo_planes)
    if (self%nx == 0) last = first - 1
    allocate (target(3, self%n(3), self%n(2), first:last))
    allocate (conductance(3, self%n(3), self%n(2), first:last), source=0.0_rp)
    call choose_targets(self, cuts, first, last, target)
    call sum_conductances(self, cuts, conductivity, first, last, target, conductance)
    call set_line_rates(self, property)
    call set_cells(self, cuts, capacity, first, last, target, conductance)
    call list_walls(self, cuts, first, last, target)
  end subroutine cut_mesh

  !> Fraction of the face between a cell and the next along `axis` that is in the solid on both
  !> sides.
  pure real(rp) function shared(cuts, at, axis, first)
    type(cut_cells_t), intent(in) :: cuts
    integer, intent(in) :: at(3), axis, first
    integer :: next(3)

    next = at
    next(axis) = next(axis) + 1
    shared = min(cuts%face(2*axis, at(3), at(2), at(1) - first + 1), &
                 cuts%face(2*axis - 1, next(3), next(2), next(1) - first + 1))
  end function shared

  !> Target of each cell: itself, the neighbour into which a small cell is merged, or 0 for none.
  pure subroutine choose_targets(self, cuts, first, last, target)
    type(heat_mesh_t), intent(in) :: self
    type(cut_cells_t), intent(in) :: cuts
    integer, intent(in) :: first, last
    integer, intent(out) :: target(3, self%n(3), self%n(2), first:last)
    real(rp) :: best, a
    integer :: axis, i, j, k, side, at(3), next(3)

    do i = first, last
      do j = 1, self%n(2)
        do k = 1, self%n(3)
          at = [i, j, k]
          target(:, k, j, i) = 0
          associate (volume => cuts%volume(k, j, i - first + 1))
            if (volume > tolerance) target(:, k, j, i) = at
            if (volume <= tolerance .or. volume >= min_volume) cycle
          end associate
          best = 0.0_rp
          do axis = 1, 3
            do side = -1, 1, 2
              next = at
              next(axis) = next(axis) + side
              if (next(1) < first .or. next(1) > last .or. any(next < 1) .or. &
                  any(next > self%n)) cycle
              if (cuts%volume(next(3), next(2), next(1) - first + 1) < min_volume) cycle
              a = shared(cuts, merge(at, next, side > 0), axis, first)*face_area(self, at, axis)
              if (a <= best*(1.0_rp + tolerance)) cycle
              best = a
              target(:, k, j, i) = next
            end do
          end do
        end do
      end do
    end do
  end subroutine choose_targets

  !> Full area of the face of a cell normal to `axis` [m2].
  pure real(rp) function face_area(self, at, axis)
    type(heat_mesh_t), intent(in) :: self
    integer, intent(in) :: at(3), axis
    real(rp) :: d(3), b(3, 2)

    b = self%box(at(1), at(2), at(3))
    d = b(:, 2) - b(:, 1)
    face_area = product(d)/d(axis)
  end function face_area

  !> Sum the conductances between cell centres through shared faces; those of merged cells count for
  !> their targets.
  pure subroutine sum_conductances(self, cuts, conductivity, first, last, target, conductance)
    type(heat_mesh_t), intent(in) :: self
    type(cut_cells_t), intent(in) :: cuts
    real(rp), intent(in) :: conductivity(:)
    integer, intent(in) :: first, last, target(3, self%n(3), self%n(2), first:last)
    real(rp), intent(inout) :: conductance(3, self%n(3), self%n(2), first:last)
    integer :: a(3), at(3), axis, b(3), i, j, k, next(3), to
    real(rp) :: fraction

    do i = first, last
      do j = 1, self%n(2)
        do k = 1, self%n(3)
          at = [i, j, k]
          do axis = 1, 3
            next = at
            next(axis) = next(axis) + 1
            if (next(1) > last .or. any(next > self%n)) cycle
            fraction = shared(cuts, at, axis, first)
            if (fraction <= 0.0_rp) cycle
            a = target(:, k, j, i)
            b = target(:, next(3), next(2), next(1))
            if (any(a == 0) .or. any(b == 0) .or. sum(abs(b - a)) /= 1) cycle
            to = maxloc(abs(b - a), dim=1)
            if (b(to) < a(to)) a = b
            conductance(to, a(3), a(2), a(1)) = conductance(to, a(3), a(2), a(1)) &
              + fraction*face_area(self, at, axis)/resistance(self, cuts, conductivity, first, a, &
                                                              to)
          end do
        end do
      end do
    end do
  end subroutine sum_conductances

  !> Thermal resistance of unit area between the centres of a cell and the next along `axis`, half a
  !> cell of each material [m2 K/W].
  pure real(rp) function resistance(self, cuts, conductivity, first, at, axis)
    type(heat_mesh_t), intent(in) :: self
    type(cut_cells_t), intent(in) :: cuts
    real(rp), intent(in) :: conductivity(:)
    integer, intent(in) :: first, at(3), axis
    real(rp) :: b(3, 2), k(2), width(2)
    integer :: next(3)

    next = at
    next(axis) = next(axis) + 1
    b = self%box(at(1), at(2), at(3))
    width(1) = b(axis, 2) - b(axis, 1)
    b = self%box(next(1), next(2), next(3))
    width(2) = b(axis, 2) - b(axis, 1)
    k = conductivity([body_of(cuts, at, first), body_of(cuts, next, first)])
    resistance = 0.5_rp*(width(1)/k(1) + width(2)/k(2))
  end function resistance

  !> Body of a cell, at least 1.
  pure integer function body_of(cuts, at, first)
    type(cut_cells_t), intent(in) :: cuts
    integer, intent(in) :: at(3), first

    body_of = max(1, cuts%body(at(3), at(2), at(1) - first + 1))
  end function body_of

  !> Set the rates of uncut cells, which depend on one coordinate each.
  pure subroutine set_line_rates(self, property)
    type(heat_mesh_t), intent(inout) :: self
    type(property_t), intent(in) :: property
    real(rp) :: xm(self%n(1)), xp(self%n(1)), ym(self%n(2)), yp(self%n(2)), zm(self%n(3)), &
                zp(self%n(3)), kappa
    integer :: j, p

    kappa = property%k_ref/(property%rho*property%c_ref)
    call line_rates(kappa, self%n(1), self%x, xm, xp)
    call line_rates(kappa, self%n(2), self%y, ym, yp)
    call line_rates(kappa, self%n(3), self%z, zm, zp)
    self%xm = xm(self%lo:self%hi)
    self%xp = xp(self%lo:self%hi)
    allocate (self%ym(self%np), self%yp(self%np), self%zm(self%np), self%zp(self%np))
    do j = 1, self%n(2)
      p = self%n(3)*(j - 1)
      self%ym(p + 1:p + self%n(3)) = ym(j)
      self%yp(p + 1:p + self%n(3)) = yp(j)
      self%zm(p + 1:p + self%n(3)) = zm
      self%zp(p + 1:p + self%n(3)) = zp
    end do
  end subroutine set_line_rates

  !> Rates kappa/(cell width times centre distance) to the previous and the next cell along an axis;
  !> 0 at the ends [1/s].
  pure subroutine line_rates(kappa, n, x, before, after)
    real(rp), intent(in) :: kappa
    integer, intent(in) :: n
    real(rp), intent(in) :: x(0:n)
    real(rp), intent(out) :: before(n), after(n)
    integer :: i

    before = 0.0_rp
    after = 0.0_rp
    do i = 1, n - 1
      after(i) = kappa/((x(i) - x(i - 1))*0.5_rp*(x(i + 1) - x(i - 1)))
      before(i + 1) = kappa/((x(i + 1) - x(i))*0.5_rp*(x(i + 1) - x(i - 1)))
    end do
  end subroutine line_rates

  !> Set the capacities, and the rates of cells that differ from those of uncut cells.
  subroutine set_cells(self, cuts, capacity, first, last, target, conductance)
    type(heat_mesh_t), intent(inout) :: self
    type(cut_cells_t), intent(in) :: cuts
    real(rp), intent(in) :: capacity(:)
    integer, intent(in) :: first, last, target(3, self%n(3), self%n(2), first:last)
    real(rp), intent(in) :: conductance(3, self%n(3), self%n(2), first:last)
    real(rp), allocatable :: cell_capacity(:, :, :)  ! [J/K]
    real(rp) :: rate(6), expected(6), b(3, 2), volume
    integer :: at(3), c, i, j, k, n_irregular, t(3), axis
    integer, allocatable :: irregular(:)
    real(rp), allocatable :: irregular_rate(:, :)

    allocate (cell_capacity(self%n(3), self%n(2), first:last), source=0.0_rp)
    self%volume = 0.0_rp
    do i = max(first, self%lo - 1), min(last, self%hi + 1)
      do j = 1, self%n(2)
        do k = 1, self%n(3)
          t = target(:, k, j, i)
          if (any(t == 0)) cycle
          b = self%box(i, j, k)
          volume = product(b(:, 2) - b(:, 1))*cuts%volume(k, j, i - first + 1)
          cell_capacity(t(3), t(2), t(1)) = cell_capacity(t(3), t(2), t(1)) &
            + capacity(body_of(cuts, [i, j, k], first))*volume
          if (t(1) >= self%lo .and. t(1) <= self%hi) self%volume = self%volume + volume
        end do
      end do
    end do
    allocate (self%capacity(self%np*self%nx), self%body(self%np*self%nx))
    allocate (irregular(self%np*self%nx), irregular_rate(6, self%np*self%nx))
    n_irregular = 0
    do c = 1, self%np*self%nx
      call self%place(c, i, j, k)
      at = [i, j, k]
      self%capacity(c) = cell_capacity(k, j, i)
      self%body(c) = body_of(cuts, at, first)
      if (self%capacity(c) <= 0.0_rp) cycle
      do axis = 1, 3
        rate(2*axis) = conductance(axis, k, j, i)
        rate(2*axis - 1) = 0.0_rp
        t = at
        t(axis) = t(axis) - 1
        if (t(axis) >= 1) rate(2*axis - 1) = conductance(axis, t(3), t(2), t(1))
      end do
      rate = rate/self%capacity(c)
      i = i - self%lo + 1
      k = 1 + mod(c - 1, self%np)
      expected = [self%xm(i), self%xp(i), self%ym(k), self%yp(k), self%zm(k), self%zp(k)]
      if (all(abs(rate - expected) <= tolerance*maxval(expected))) cycle
      n_irregular = n_irregular + 1
      irregular(n_irregular) = c
      irregular_rate(:, n_irregular) = rate
    end do
    self%void = pack([(c, c=1, self%np*self%nx)], self%capacity <= 0.0_rp)
    self%irregular = irregular(:n_irregular)
    self%irregular_rate = irregular_rate(:, :n_irregular)
  end subroutine set_cells

  !> List the boundary faces of the own cells: on cell faces the part that the next cell does not
  !> share, inside cells the surface whose area vector closes that of the faces.
  subroutine list_walls(self, cuts, first, last, target)
    type(heat_mesh_t), intent(inout) :: self
    type(cut_cells_t), intent(in) :: cuts
    integer, intent(in) :: first, last, target(3, self%n(3), self%n(2), first:last)
    type(boundary_face_t), allocatable :: list(:)
    type(boundary_face_t) :: wall
    real(rp) :: b(3, 2), open, whole(3), vector(3)
    integer :: axis, face, i, j, k, n, at(3), next(3), t(3)

    allocate (list(1024))
    n = 0
    do i = max(first, self%lo - 1), min(last, self%hi + 1)
      do j = 1, self%n(2)
        do k = 1, self%n(3)
          t = target(:, k, j, i)
          if (any(t == 0) .or. t(1) < self%lo .or. t(1) > self%hi) cycle
          at = [i, j, k]
          b = self%box(i, j, k)
          wall%at = at
          wall%cell = 1 + (t(1) - self%lo)*self%np + (t(2) - 1)*self%n(3) + t(3) - 1
          wall%body = body_of(cuts, at, first)
          associate (faces => cuts%face(:, k, j, i - first + 1))
            do face = 1, 6
              axis = (face + 1)/2
              whole(axis) = face_area(self, at, axis)
              next = at
              next(axis) = next(axis) + merge(1, -1, mod(face, 2) == 0)
              open = 0.0_rp
              if (next(axis) >= 1 .and. next(axis) <= self%n(axis)) open = &
                shared(cuts, merge(at, next, mod(face, 2) == 0), axis, first)
              if (faces(face) - open <= tolerance) cycle
              wall%face = face
              wall%area = (faces(face) - open)*whole(axis)
              wall%depth = 0.5_rp*(b(axis, 2) - b(axis, 1))
              if (n == size(list)) list = [list, list]
              n = n + 1
              list(n) = wall
            end do
            vector = (faces(1:5:2) - faces(2:6:2))*whole
          end associate
          if (norm2(vector) <= tolerance*maxval(whole)) cycle
          axis = maxloc(abs(vector), dim=1)
          wall%face = 2*axis - merge(0, 1, vector(axis) > 0.0_rp)
          wall%area = norm2(vector)
          wall%depth = 0.5_rp*min(minval(b(:, 2) - b(:, 1)), cuts%volume(k, j, i - first + 1) &
                                  *product(b(:, 2) - b(:, 1))/wall%area)
          wall%at = 0
          if (n == size(list)) list = [list, list]
          n = n + 1
          list(n) = wall
        end do
      end do
    end do
    self%wall = list(:n)
  end subroutine list_walls

end module heat_cut_mesh
