! SPDX-License-Identifier: MIT
!> List of the volumes that a heat source can cover, named by KIND of a &SOURCE.
module heat_volumes
  use heat_volume, only: volume_t
  implicit none (type, external)
  private

  public :: make_volume

  !> Names of all volumes. A new one has its name here and its type in `make_volume`.
  character(32), parameter, public :: volume_names(1) = [character(32) :: 'ball']

contains

  !> Make the volume of this name, without its keys; a ball for the sources without a volume.
  subroutine make_volume(name, volume)
    character(*), intent(in) :: name
    class(volume_t), allocatable, intent(out) :: volume

    select case (name)
    case default; allocate (volume_t :: volume)
    end select
  end subroutine make_volume

end module heat_volumes
