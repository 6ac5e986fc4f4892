! SPDX-License-Identifier: MIT
!> Tool shape: a shoulder with a flat or concave conical face and an optional pin.
module tools_shape_shoulder
  use base_kinds, only: pi, rp
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  use tools_shape, only: add_radius, add_tilt, far_larger, length_text, tilted_frame
  use tools_shape_cut_keys, only: add_cut_keys, has_cut_keys
  use tools_shape_revolved, only: profile_t, revolved_t
  implicit none (type, external)
  private

  public :: shoulder_t, new_shoulder

  type, extends(revolved_t) :: shoulder_t
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, check_size
  end type shoulder_t

contains

  !> Shoulder with the rim of its face at z = 0.
  pure type(shoulder_t) function new_shoulder(radius, height, concavity, pin_radius, tip_radius, &
                                              pin_length) result(new)
    real(rp), intent(in) :: radius          !! radius of the shoulder [m]
    real(rp), intent(in) :: height          !! height of the top of the tool [m]
    real(rp), intent(in) :: concavity       !! angle by which the face rises towards the axis [rad]
    real(rp), intent(in) :: pin_radius      !! radius of the pin at the face; 0: no pin [m]
    real(rp), intent(in) :: tip_radius      !! radius of the pin at the tip [m]
    real(rp), intent(in) :: pin_length      !! length of the pin [m]

    new%radius = radius
    call new%profile%corner(0.0_rp, height)
    call new%profile%corner(radius, height)
    call new%profile%corner(radius, 0.0_rp)
    if (pin_radius > 0.0_rp .and. pin_length > 0.0_rp) then
      new%pin_radius = pin_radius
      call new%profile%corner(pin_radius, (radius - pin_radius)*tan(concavity))
      call new%profile%corner(tip_radius, -pin_length)
      call new%profile%corner(0.0_rp, -pin_length)
    else
      call new%profile%corner(0.0_rp, radius*tan(concavity))
    end if
  end function new_shoulder

  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t

    call add_radius(t, 'shoulder')
    call t%key('HEIGHT', 'real', 1, 'm', '0.02 if KIND = shoulder', '(0,inf)', &
               'height of the shoulder above its face')
    call t%key('CONCAVITY_DEG', 'real', 1, 'deg', '0 if KIND = shoulder', '[0,30)', &
               'angle by which the face of the shoulder rises towards its axis')
    call t%key('PIN_RADIUS', 'real', 1, 'm', '0 if KIND = shoulder', '[0,inf)', &
               'radius of the pin at the face; 0: no pin')
    call t%key('PIN_TIP_RADIUS', 'real', 1, 'm', '0 if KIND = shoulder', '[0,inf)', &
               'radius of the pin at its tip; 0: as at the face (a cylinder)')
    call t%key('PIN_LENGTH', 'real', 1, 'm', '0 if KIND = shoulder', '[0,inf)', &
               'length of the pin below the face')
    call t%key('BOBBIN_RADIUS', 'real', 1, 'm', '0 if KIND = shoulder', '[0,inf)', &
               'radius of a second shoulder at the tip of the pin, facing up; 0: none')
    call t%key('BORE_RADIUS', 'real', 1, 'm', '0 if KIND = shoulder', '[0,inf)', &
               'radius of a bore along the axis: the tool is a sleeve without a pin; 0: none')
    call add_cut_keys(t)
    call add_tilt(t, 'shoulder')
  end subroutine add_keys

  subroutine read_keys(self, input, i, frame)
    class(shoulder_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(out) :: frame(3, 3)
    type(shoulder_t) :: new
    real(rp) :: length, pin, radius, tip

    radius = input%real('TOOL', i, 'RADIUS')
    pin = input%real('TOOL', i, 'PIN_RADIUS')
    tip = input%real('TOOL', i, 'PIN_TIP_RADIUS')
    length = input%real('TOOL', i, 'PIN_LENGTH')
    if (pin >= radius .and. radius > 0.0_rp) then
      call input%report('TOOL', i, 'PIN_RADIUS', 'must be below RADIUS')
    end if
    if (pin > 0.0_rp .and. length <= 0.0_rp) then
      call input%report('TOOL', i, 'PIN_RADIUS', 'makes no pin without PIN_LENGTH')
    end if
    if (pin <= 0.0_rp .and. tip > 0.0_rp) then
      call input%report('TOOL', i, 'PIN_TIP_RADIUS', 'makes no pin without PIN_RADIUS')
    else if (tip >= radius .and. radius > pin) then
      call input%report('TOOL', i, 'PIN_TIP_RADIUS', 'must be below RADIUS')
    end if
    if (pin <= 0.0_rp .and. length > 0.0_rp) then
      call input%report('TOOL', i, 'PIN_LENGTH', 'makes no pin without PIN_RADIUS')
    end if
    if (tip <= 0.0_rp) tip = pin
    new = new_shoulder(radius, input%real('TOOL', i, 'HEIGHT'), &
                       input%real('TOOL', i, 'CONCAVITY_DEG')*pi/180.0_rp, pin, tip, length)
    self%radius = max(new%radius, input%real('TOOL', i, 'BOBBIN_RADIUS'))
    self%pin_radius = new%pin_radius
    self%profile = new%profile
    frame = tilted_frame(input, i)
    call read_variants(input, i, self%profile)
  end subroutine read_keys

  !> Change the outline to that of a bobbin tool or of a sleeve, if the `i`-th &TOOL is one.
  subroutine read_variants(input, i, profile)
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    type(profile_t), intent(inout) :: profile
    real(rp) :: bobbin, bore, height, length, radius

    bobbin = input%real('TOOL', i, 'BOBBIN_RADIUS')
    bore = input%real('TOOL', i, 'BORE_RADIUS')
    radius = input%real('TOOL', i, 'RADIUS')
    height = input%real('TOOL', i, 'HEIGHT')
    length = input%real('TOOL', i, 'PIN_LENGTH')
    if (max(bobbin, bore) > 0.0_rp .and. has_cut_keys(input, i)) then
      call input%report('TOOL', i, 'KIND', 'with a BOBBIN_RADIUS or BORE_RADIUS takes no '// &
                        'thread, flats or scroll')
    end if
    if (bobbin > 0.0_rp) then
      if (bobbin <= profile%r(profile%n - 1) .or. length <= 0.0_rp) call input%report('TOOL', i, &
        'BOBBIN_RADIUS', 'must be above the radius of the tip of a pin')
      profile%n = profile%n - 1
      call profile%corner(bobbin, -length)
      call profile%corner(bobbin, -length - height)
      call profile%corner(0.0_rp, -length - height)
    end if
    if (bore <= 0.0_rp) return
    if (bore >= radius .or. length > 0.0_rp) call input%report('TOOL', i, 'BORE_RADIUS', &
      'must be below RADIUS, without a pin')
    ! the outline begins and ends in the bore wall
    profile%n = 0
    call profile%corner(bore, 0.5_rp*height)
    call profile%corner(bore, height)
    call profile%corner(radius, height)
    call profile%corner(radius, 0.0_rp)
    call profile%corner(bore, (radius - bore) &
                        *tan(input%real('TOOL', i, 'CONCAVITY_DEG')*pi/180.0_rp))
    call profile%corner(bore, 0.5_rp*height)
  end subroutine read_variants

  subroutine check_size(self, input, i, grid, cell, width, spins)
    class(shoulder_t), intent(in) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i
    real(rp), intent(in) :: grid, cell(3), width
    logical, intent(in) :: spins

    if (self%radius > 2.0_rp*grid) then
      call input%report('TOOL', i, 'RADIUS', far_larger(grid))
    else if (2.0_rp*self%radius > width .and. spins) then
      call input%warn('TOOL', i, 'RADIUS', 'a shoulder of '//length_text(2.0_rp*self%radius)// &
                      ' across is wider than the bodies, '//length_text(width))
    end if
  end subroutine check_size

end module tools_shape_shoulder
