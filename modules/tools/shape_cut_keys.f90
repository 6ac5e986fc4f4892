! SPDX-License-Identifier: MIT
!> Keys of thread and flats on the pin of a shoulder tool, and of the scroll in its face.
module tools_shape_cut_keys
  use base_kinds, only: rp
  use base_text, only: str
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  use tools_shape, only: length_text
  use tools_shape_cuts, only: cut_pin_shape_t
  use tools_shape_grooves, only: profile_names
  implicit none (type, external)
  private

  public :: add_cut_keys, has_cut_keys, check_cuts, read_cuts

  ! Keys of details of a cut, and the keys that enable the cut.
  character(14), parameter :: detail(9) = [character(14) :: 'THREAD_PITCH', 'THREAD_STARTS', &
    'THREAD_HAND', 'THREAD_PROFILE', 'FLAT_DEPTH', 'SCROLL_PITCH', 'SCROLL_ARMS', 'SCROLL_SENSE', &
    'SCROLL_PROFILE']
  character(12), parameter :: enabling(9) = [character(12) :: 'THREAD_DEPTH', 'THREAD_DEPTH', &
    'THREAD_DEPTH', 'THREAD_DEPTH', 'FLATS', 'SCROLL_DEPTH', 'SCROLL_DEPTH', 'SCROLL_DEPTH', &
    'SCROLL_DEPTH']

contains

  !> Add the rows of thread, flats and scroll to &TOOL.
  subroutine add_cut_keys(t)
    type(key_table_t), intent(inout) :: t

    call t%key('THREAD_DEPTH', 'real', 1, 'm', '0 if KIND = shoulder', '[0,inf)', &
               'depth of the grooves of a thread on the pin; 0: no thread')
    call t%key('THREAD_PITCH', 'real', 1, 'm', '0 if KIND = shoulder', '[0,inf)', &
               'pitch of the thread along the pin')
    call t%key('THREAD_STARTS', 'integer', 1, '', '1 if KIND = shoulder', '[1,12]', &
               'number of starts of the thread')
    call t%key('THREAD_HAND', 'choice', 1, '', 'left if KIND = shoulder', 'left right', &
               'hand of the thread: turning clockwise seen from above (SPIN_RPM above 0), left '// &
               'carries metal down to the tip, right up')
    call t%key('THREAD_PROFILE', 'choice', 1, '', 'square if KIND = shoulder', profile_names, &
               'section of the grooves of the thread: rectangles half a pitch wide; '// &
               'triangles; a cosine')
    call t%key('FLATS', 'integer', 1, '', '0 if KIND = shoulder', '[0,36]', &
               'flats on the pin, the first ahead (+x) at t = 0')
    call t%key('FLAT_DEPTH', 'real', 1, 'm', '0 if KIND = shoulder', '[0,inf)', &
               'depth of the flats below the radius of the pin')
    call t%key('SCROLL_DEPTH', 'real', 1, 'm', '0 if KIND = shoulder', '[0,inf)', &
               'depth of the spiral grooves in the face of the shoulder; 0: no scroll')
    call t%key('SCROLL_PITCH', 'real', 1, 'm', '0 if KIND = shoulder', '[0,inf)', &
               'distance of the grooves along the radius')
    call t%key('SCROLL_ARMS', 'integer', 1, '', '1 if KIND = shoulder', '[1,36]', &
               'number of spiral grooves')
    call t%key('SCROLL_SENSE', 'choice', 1, '', 'inward if KIND = shoulder', 'inward outward', &
               'where the scroll carries metal when the tool turns clockwise seen from above')
    call t%key('SCROLL_PROFILE', 'choice', 1, '', 'square if KIND = shoulder', profile_names, &
               'section of the grooves of the scroll, as THREAD_PROFILE')
  end subroutine add_cut_keys

  !> True if the `i`-th &TOOL, a shoulder, has cuts, or has keys of details without the cut.
  logical function has_cut_keys(input, i)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    integer :: k

    has_cut_keys = input%real('TOOL', i, 'THREAD_DEPTH') > 0.0_rp &
                    .or. input%integer('TOOL', i, 'FLATS') > 0 &
                    .or. input%real('TOOL', i, 'SCROLL_DEPTH') > 0.0_rp
    do k = 1, size(detail)
      has_cut_keys = has_cut_keys .or. lacks_cut(input, i, k)
    end do
  end function has_cut_keys

  !> True if the `k`-th key of details is given without the key that enables the cut.
  logical function lacks_cut(input, i, k)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i, k

    lacks_cut = input%given('TOOL', i, trim(detail(k)))
    if (lacks_cut) lacks_cut = .not. input%given('TOOL', i, trim(enabling(k)))
  end function lacks_cut

  !> Read and check the cuts of the `i`-th &TOOL, a shoulder whose sizes have been read.
  subroutine read_cuts(input, i, cut, is_sound)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(cut_pin_shape_t), intent(inout) :: cut
    logical, intent(out) :: is_sound        !! there are cuts without errors
    real(rp) :: min_radius
    integer :: before, k
    logical :: has_cuts

    before = input%diagnostics%count()
    cut%thread%depth = input%real('TOOL', i, 'THREAD_DEPTH')
    cut%thread%pitch = input%real('TOOL', i, 'THREAD_PITCH')
    cut%thread%rise = input%integer('TOOL', i, 'THREAD_STARTS')
    if (input%text('TOOL', i, 'THREAD_HAND') == 'right') cut%thread%rise = -cut%thread%rise
    call cut%thread%set_profile(input%text('TOOL', i, 'THREAD_PROFILE'))
    cut%n_flats = input%integer('TOOL', i, 'FLATS')
    cut%flat_depth = input%real('TOOL', i, 'FLAT_DEPTH')
    cut%scroll%depth = input%real('TOOL', i, 'SCROLL_DEPTH')
    cut%scroll%pitch = input%real('TOOL', i, 'SCROLL_PITCH')
    cut%scroll%rise = input%integer('TOOL', i, 'SCROLL_ARMS')
    if (input%text('TOOL', i, 'SCROLL_SENSE') == 'outward') cut%scroll%rise = -cut%scroll%rise
    call cut%scroll%set_profile(input%text('TOOL', i, 'SCROLL_PROFILE'))
    has_cuts = cut%thread%depth > 0.0_rp .or. cut%n_flats > 0 .or. cut%scroll%depth > 0.0_rp

    do k = 1, size(detail)
      if (lacks_cut(input, i, k)) call input%report('TOOL', i, trim(detail(k)), 'has no effect '// &
        'without '//trim(enabling(k)))
    end do
    call check_pair('THREAD_DEPTH', 'THREAD_PITCH', cut%thread%depth, cut%thread%pitch)
    call check_pair('FLATS', 'FLAT_DEPTH', real(cut%n_flats, rp), cut%flat_depth)
    call check_pair('SCROLL_DEPTH', 'SCROLL_PITCH', cut%scroll%depth, cut%scroll%pitch)
    if (cut%pin_radius <= 0.0_rp) then
      if (cut%thread%depth > 0.0_rp) call input%report('TOOL', i, 'THREAD_DEPTH', &
        'makes no thread without PIN_RADIUS')
      if (cut%n_flats > 0) call input%report('TOOL', i, 'FLATS', &
                                             'have no effect without PIN_RADIUS')
    else
      min_radius = min(cut%pin_radius, cut%tip_radius)
      if (cut%thread%depth >= min_radius) call input%report('TOOL', i, 'THREAD_DEPTH', &
        'must be below the least radius of the pin, '//length_text(min_radius))
      if (cut%flat_depth >= min_radius) call input%report('TOOL', i, 'FLAT_DEPTH', &
        'must be below the least radius of the pin, '//length_text(min_radius))
    end if
    if (cut%scroll%depth >= cut%height) call input%report('TOOL', i, 'SCROLL_DEPTH', &
      'must be below HEIGHT')
    if (cut%scroll%depth > 0.0_rp .and. cut%radius <= cut%scroll%pitch) call input%report('TOOL', &
      i, 'SCROLL_PITCH', 'must be below RADIUS')
    is_sound = has_cuts .and. input%diagnostics%count() == before &
      .and. cut%radius > cut%pin_radius .and. (cut%pin_radius <= 0.0_rp &
      .or. cut%pin_length > 0.0_rp) .and. cut%height > cut%slope*cut%radius + cut%scroll%depth
    if (has_cuts .and. input%diagnostics%count() == before &
      .and. cut%height <= cut%slope*cut%radius + cut%scroll%depth) call input%report('TOOL', i, &
      'HEIGHT', 'must be above the highest place of the face')
  contains
    !> Report a key that needs another.
    subroutine check_pair(one, other, a, b)
      character(*), intent(in) :: one, other
      real(rp), intent(in) :: a, b

      if (a > 0.0_rp .and. b <= 0.0_rp) call input%report('TOOL', i, one, 'needs '//other)
    end subroutine check_pair
  end subroutine read_cuts

  !> Warn of cells that do not resolve the grooves.
  subroutine check_cuts(input, i, cell)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: cell(3)         !! edges of the grid cells [m]

    call check('THREAD', cell(3))
    call check('SCROLL', maxval(cell(:2)))
  contains
    subroutine check(name, edge)
      character(*), intent(in) :: name
      real(rp), intent(in) :: edge
      real(rp), parameter :: min_cells = 2.0_rp  ! cells per pitch: one groove, one ridge
      real(rp) :: pitch

      if (input%real('TOOL', i, name//'_DEPTH') <= 0.0_rp) return
      pitch = input%real('TOOL', i, name//'_PITCH')
      if (pitch >= min_cells*edge*(1.0_rp - 1.0e-9_rp)) return
      call input%warn('TOOL', i, name//'_PITCH', 'is '//str(pitch/edge)//' cells: grooves less '// &
                      'than two cells apart cannot be resolved')
    end subroutine check
  end subroutine check_cuts

end module tools_shape_cut_keys
