! SPDX-License-Identifier: MIT
!> Cells of one axis, graded or not. Shape functions are the quadratic B-splines on a row of spans
!> of any width: node i has span i and is located at its middle, which is the mean of the two inner
!> knots (Greville abscissa), so that linear fields are reproduced exactly. With equal widths they
!> are the cells of a uniform grid.
!>
!> The place of a point is measured in spans: i + (x - middle of i)/width of i. It corresponds to
!> the node number on a uniform axis.
module grid_grading
  use base_kinds, only: nlane, rp
  use base_text, only: str
  implicit none (type, external)
  private

  public :: grading_t, make_grading

  integer, parameter :: pad = 3            !! mirrored spans beyond each end of the axis

  !> Spans of a graded axis; without grading it has no arrays.
  type :: grading_t
    logical :: is_graded = .false.
    integer :: first = 0                 !! index of the first stored span, below 0
    real(rp), allocatable :: edge(:)  !! lower edge of each span, and the upper edge of the last [m]
    !> Middle [m], 1/width [1/m], coefficients of the functions of the lower and the upper
    !> neighbour, width [m], (5, spans).
    real(rp), allocatable :: span(:, :)
    integer, allocatable :: bin(:)       !! span in which each bin of equal length begins
    real(rp) :: inv_bin = 0.0_rp         !! 1/length of a bin [1/m]
  contains
    procedure :: growth, longest, middle, centre, share, span_of, spans_of, place, position, &
      linear_place
    procedure :: mean_place, weights, is_mirrored
  end type grading_t

contains

  !> Make spans from `lower` to `upper`, with nodes at both: of width `cell` in the zone, whose ends
  !> are nodes, and growing from there to both sides by at most the factor `growth` per span, up to
  !> `largest`. `message` explains what does not fit, or is empty.
  pure subroutine make_grading(lower, upper, zone, cell, growth, largest, grading, n, message)
    real(rp), intent(in) :: lower, upper, zone(2), cell   !! [m]
    real(rp), intent(in) :: growth                        !! ratio of neighbouring cells [-]
    real(rp), intent(in) :: largest                       !! largest cell [m]
    type(grading_t), intent(out) :: grading
    integer, intent(out) :: n                           !! number of nodes
    character(:), allocatable, intent(out) :: message
    real(rp), allocatable :: above(:), below(:), w(:)
    integer :: fine, i, m

    n = 0
    fine = nint((zone(2) - zone(1))/cell)
    call grow(zone(1) - lower, cell, growth, largest, 'below', below, message)
    if (len(message) > 0) return
    call grow(upper - zone(2), cell, growth, largest, 'above', above, message)
    if (len(message) > 0) return
    n = size(below) + fine + 1 + size(above)
    w = [below(size(below):1:-1), [(cell, i=0, fine)], above]
    grading%is_graded = .true.
    grading%first = -pad
    allocate (grading%edge(-pad:n + pad))
    m = size(below)
    grading%edge(m) = zone(1) - 0.5_rp*cell
    do i = m + 1, n + pad
      grading%edge(i) = grading%edge(i - 1) + w(mirrored(i - 1, n) + 1)
    end do
    do i = m + 1, m + fine + 1
      grading%edge(i) = zone(1) + (i - m - 0.5_rp)*cell
    end do
    do i = m + fine + 2, n + pad
      grading%edge(i) = grading%edge(i - 1) + w(mirrored(i - 1, n) + 1)
    end do
    do i = m - 1, -pad, -1
      grading%edge(i) = grading%edge(i + 1) - w(mirrored(i, n) + 1)
    end do
    call tabulate(grading, n)
  end subroutine make_grading

  !> Span of which span `i` beyond the ends is the mirror image.
  pure integer function mirrored(i, n)
    integer, intent(in) :: i, n

    mirrored = i
    if (i < 0) mirrored = -i
    if (i > n - 1) mirrored = 2*(n - 1) - i
    mirrored = max(0, min(n - 1, mirrored))
  end function mirrored

  !> Widths of the spans from the end of the uniform zone to the end of the box, at the distance
  !> `length`, in the middle of the last span.
  pure subroutine grow(length, cell, growth, largest, side, w, message)
    real(rp), intent(in) :: length, cell, growth, largest
    character(*), intent(in) :: side
    real(rp), allocatable, intent(out) :: w(:)
    character(:), allocatable, intent(out) :: message
    real(rp), parameter :: small = 1.0e-9_rp
    real(rp) :: low, high, factor
    integer :: i, m

    message = ''
    allocate (w(0))
    if (length <= small*cell) return
    m = 1
    do while (reach(m, growth) < length*(1.0_rp - small))
      m = m + 1
    end do
    if (reach(m, 1.0_rp) > length*(1.0_rp + small)) then
      message = 'no cells that grow by at most GROWTH fit into the '//str(1.0e3_rp*length) &
                //' mm of the box '//side//' it; '//str(m)//' cells take '// &
                str(1.0e3_rp*reach(m, 1.0_rp))//' to '//str(1.0e3_rp*reach(m, growth))//' mm'
      return
    end if
    low = 1.0_rp
    high = growth
    do i = 1, 60
      factor = 0.5_rp*(low + high)
      if (reach(m, factor) < length) low = factor
      if (reach(m, factor) >= length) high = factor
    end do
    w = [(min(largest, cell*high**i), i=1, m)]
  contains
    !> Distance from the middle of the last uniform span to that of the `m`-th wider one [m].
    pure real(rp) function reach(m, factor)
      integer, intent(in) :: m
      real(rp), intent(in) :: factor
      integer :: k

      reach = 0.5_rp*(cell + min(largest, cell*factor**m)) &
              + sum([(min(largest, cell*factor**k), k=1, m - 1)])
    end function reach
  end subroutine grow

  !> Fill the tables for lookups and weights from the edges.
  pure subroutine tabulate(grading, n)
    type(grading_t), intent(inout) :: grading
    integer, intent(in) :: n
    real(rp) :: length, w(-pad:n + pad - 1)
    integer :: b, bins, i

    associate (edge => grading%edge)
      w = edge(-pad + 1:n + pad) - edge(-pad:n + pad - 1)
      allocate (grading%span(5, -pad:n + pad - 1))
      do i = -pad, n + pad - 1
        grading%span(1, i) = 0.5_rp*(edge(i) + edge(i + 1))
        grading%span(2, i) = 1.0_rp/w(i)
        grading%span(3, i) = w(i)/(w(i) + w(max(-pad, i - 1)))
        grading%span(4, i) = w(i)/(w(i) + w(min(n + pad - 1, i + 1)))
        grading%span(5, i) = w(i)
      end do
      length = edge(n + pad) - edge(-pad)
      bins = ceiling(1.01_rp*length/minval(w)) + 1   ! at most one edge per bin
      grading%inv_bin = (bins - 1)/length
      allocate (grading%bin(0:bins))
      i = -pad
      do b = 0, bins
        do while (i < n + pad - 1)
          if (edge(i + 1) > edge(-pad) + b/grading%inv_bin) exit
          i = i + 1
        end do
        grading%bin(b) = i
      end do
    end associate
  end subroutine tabulate

  !> Largest ratio of the widths of two neighbouring spans.
  pure real(rp) function growth(self)
    class(grading_t), intent(in) :: self
    integer :: i

    growth = 1.0_rp
    do i = self%first, ubound(self%span, 2) - 1
      growth = max(growth, self%span(5, i)/self%span(5, i + 1), self%span(5, i + 1)/self%span(5, i))
    end do
  end function growth

  !> Width of the widest span [m].
  pure real(rp) function longest(self)
    class(grading_t), intent(in) :: self

    longest = maxval(self%span(5, :))
  end function longest

  !> Position of node `i` [m].
  pure real(rp) function middle(self, i)
    class(grading_t), intent(in) :: self
    integer, intent(in) :: i

    middle = self%span(1, i)
  end function middle

  !> Centre of the function of node `i` [m]: the mean of its four knots.
  pure real(rp) function centre(self, i)
    class(grading_t), intent(in) :: self
    integer, intent(in) :: i

    centre = 0.25_rp*sum(self%edge(i - 1:i + 2))
  end function centre

  !> Length that belongs to node `i`: the integral of its shape function [m].
  pure real(rp) function share(self, i)
    class(grading_t), intent(in) :: self
    integer, intent(in) :: i

    share = (self%edge(i + 2) - self%edge(i - 1))/3.0_rp
  end function share

  !> Span that contains `x`; the first or last one beyond the ends.
  pure integer function span_of(self, x)
    class(grading_t), intent(in) :: self
    real(rp), intent(in) :: x               !! position [m]

    associate (last => ubound(self%span, 2))
      span_of = self%bin(int(max(0.0_rp, min(real(ubound(self%bin, 1), rp), &
                                             (x - self%edge(self%first))*self%inv_bin))))
      if (span_of < last) then
        if (x >= self%edge(span_of + 1)) span_of = span_of + 1
      end if
    end associate
  end function span_of

  !> Spans from `first` to `last` that contain the positions of a block, or are nearest to them.
  pure subroutine spans_of(self, first, last, x, spans)
    class(grading_t), intent(in) :: self
    integer, intent(in) :: first, last
    real(rp), intent(in) :: x(nlane)        !! positions [m]
    integer, intent(out) :: spans(nlane)

    call find_spans(ubound(self%bin, 1), size(self%edge), self%first, self%bin, self%edge, &
                    self%inv_bin, first, last, x, spans)
  end subroutine spans_of

  !> Spans from `first` to `last` that contain the positions `x`, or are nearest to them, from the
  !> lookup tables in a vectorised loop.
  pure subroutine find_spans(n_bins, n_edges, lowest, bin, edge, inv_bin, first, last, x, spans)
    integer, intent(in) :: n_bins, n_edges, lowest, first, last, bin(0:n_bins)
    real(rp), intent(in) :: edge(lowest:lowest + n_edges - 1), inv_bin, x(nlane)
    integer, intent(out) :: spans(nlane)
    real(rp) :: most, origin
    integer :: i, p

    most = real(n_bins, rp)
    origin = edge(lowest)
    !$omp simd private(i)
    do p = 1, nlane
      i = bin(int(max(0.0_rp, min(most, (x(p) - origin)*inv_bin))))
      i = i + merge(1, 0, x(p) >= edge(i + 1))
      spans(p) = max(first, min(last, i))
    end do
  end subroutine find_spans

  !> Place of `x` in spans from the middle of span 0.
  pure real(rp) function place(self, x)
    class(grading_t), intent(in) :: self
    real(rp), intent(in) :: x               !! position [m]
    integer :: i

    i = self%span_of(x)
    place = i + (x - self%span(1, i))*self%span(2, i)
  end function place

  !> Position at a place [m].
  pure real(rp) function position(self, place) result(x)
    class(grading_t), intent(in) :: self
    real(rp), intent(in) :: place           !! place in spans from the middle of span 0
    integer :: i

    i = max(self%first, min(ubound(self%span, 2), floor(place + 0.5_rp)))
    x = self%span(1, i) + (place - i)*self%span(5, i)
  end function position

  !> Index of the node below `x` plus the fraction of the way to the next one, for linear weights.
  pure real(rp) function linear_place(self, x)
    class(grading_t), intent(in) :: self
    real(rp), intent(in) :: x               !! position [m]
    integer :: i

    i = self%span_of(x)
    if (x < self%span(1, i)) i = i - 1
    i = max(self%first, min(ubound(self%span, 2) - 1, i))
    linear_place = i + (x - self%span(1, i))/(self%span(1, i + 1) - self%span(1, i))
  end function linear_place

  !> Index of the nodal function whose centre is below `x`, plus the fraction of the way to the next
  !> centre. Nodal values mapped from particles are means at these centres.
  pure real(rp) function mean_place(self, x)
    class(grading_t), intent(in) :: self
    real(rp), intent(in) :: x               !! position [m]
    integer :: i

    i = max(self%first + 1, min(ubound(self%span, 2) - 2, self%span_of(x)))
    if (x < self%centre(i)) i = max(self%first + 1, i - 1)
    mean_place = i + (x - self%centre(i))/(self%centre(i + 1) - self%centre(i))
  end function mean_place

  !> Weights of node `i` and its neighbours at a point `d` widths above the middle of span `i`.
  pure function weights(self, i, d) result(w)
    class(grading_t), intent(in) :: self
    integer, intent(in) :: i
    real(rp), intent(in) :: d
    real(rp) :: w(3)

    w(1) = self%span(3, i)*(0.5_rp - d)**2
    w(3) = self%span(4, i)*(0.5_rp + d)**2
    w(2) = 1.0_rp - w(1) - w(3)
  end function weights

  !> True if the spans on both sides of node `i` have equal widths.
  pure logical function is_mirrored(self, i)
    class(grading_t), intent(in) :: self
    integer, intent(in) :: i

    is_mirrored = abs(self%span(5, i - 1) - self%span(5, i + 1)) <= 1.0e-6_rp*self%span(5, i)
  end function is_mirrored

end module grid_grading
