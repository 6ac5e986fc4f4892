! SPDX-License-Identifier: MIT
!> Volume that a heat source covers: a ball. Another volume is a type that extends this one in a
!> file of its own, and a line in heat_volumes.
module heat_volume
  use base_kinds, only: rp
  use input_key_table, only: key_table_t
  use input_values, only: input_t
  implicit none (type, external)
  private

  public :: volume_t

  type :: volume_t
    real(rp) :: radius = 0.0_rp              !! distance from the centre that heat reaches [m]
  contains
    procedure, nopass :: add_keys
    procedure :: read_keys, weight
  end type volume_t

contains

  !> Add keys to &SOURCE.
  subroutine add_keys(t)
    type(key_table_t), intent(inout) :: t
  end subroutine add_keys

  !> Read the keys of the `i`-th &SOURCE.
  subroutine read_keys(self, input, i)
    class(volume_t), intent(inout) :: self
    type(input_t), intent(in) :: input
    integer, intent(in) :: i

    self%radius = input%real('SOURCE', i, 'RADIUS')
  end subroutine read_keys

  !> Heat over heat capacity, up to a constant factor, of a cube with an edge of `width` whose
  !> centre is at `d` from the centre of the source; the power of the source determines the factor.
  !> A cube at the edge counts by the covered part of its width.
  pure real(rp) function weight(self, d, width)
    class(volume_t), intent(in) :: self
    real(rp), intent(in) :: d(3)    !! vector from the centre of the source [m]
    real(rp), intent(in) :: width   !! edge of the cube [m]

    weight = max(0.0_rp, min(1.0_rp, (self%radius - norm2(d))/width + 0.5_rp))
  end function weight

end module heat_volume
