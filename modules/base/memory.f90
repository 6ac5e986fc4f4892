! SPDX-License-Identifier: MIT
!> Memory available on this node, by the kernel and the limits of control groups.
module base_memory
  use base_kinds, only: rp
  implicit none (type, external)
  private

  public :: available_memory

contains

  !> Available memory of this node [bytes]; huge if unknown.
  real(rp) function available_memory()
    character(4096) :: line
    integer :: colon, status, unit

    available_memory = kernel_memory()
    open (newunit=unit, file='/proc/self/cgroup', action='read', status='old', iostat=status)
    if (status /= 0) return
    do
      read (unit, '(a)', iostat=status) line
      if (status /= 0) exit
      colon = index(line, ':', back=.true.)
      if (line(:3) == '0::') then
        call restrict('/sys/fs/cgroup', trim(line(colon + 1:)), '/memory.max', '/memory.current')
      else if (index(line, ':memory:') > 0) then
        call restrict('/sys/fs/cgroup/memory', trim(line(colon + 1:)), '/memory.limit_in_bytes', &
                      '/memory.usage_in_bytes')
      end if
    end do
    close (unit)
  contains
    !> Apply the limits of a control group and its parents.
    subroutine restrict(root, group, limit, used)
      character(*), intent(in) :: root, group, limit, used
      character(:), allocatable :: path
      real(rp) :: memory_limit

      path = group
      do
        memory_limit = number_in(root//path//limit)
        if (memory_limit < huge(1.0_rp)) available_memory = min(available_memory, memory_limit &
                                                                - number_in(root//path//used))
        if (index(path, '/', back=.true.) == 0) exit
        path = path(:index(path, '/', back=.true.) - 1)
      end do
      memory_limit = number_in(root//limit)
      if (memory_limit < huge(1.0_rp)) available_memory = min(available_memory, memory_limit &
                                                              - number_in(root//used))
    end subroutine restrict
  end function available_memory

  !> Memory that the kernel reports as available [bytes].
  real(rp) function kernel_memory()
    character(256) :: line
    integer :: status, unit

    kernel_memory = huge(1.0_rp)
    open (newunit=unit, file='/proc/meminfo', action='read', status='old', iostat=status)
    if (status /= 0) return
    do
      read (unit, '(a)', iostat=status) line
      if (status /= 0) exit
      if (line(:13) /= 'MemAvailable:') cycle
      read (line(14:), *, iostat=status) kernel_memory     ! in kB
      if (status == 0) kernel_memory = 1024.0_rp*kernel_memory
      exit
    end do
    close (unit)
  end function kernel_memory

  !> Number in a small file; huge if it has none (`max`) or does not exist.
  real(rp) function number_in(path)
    character(*), intent(in) :: path
    character(64) :: text
    integer :: status, unit

    number_in = huge(1.0_rp)
    open (newunit=unit, file=path, action='read', status='old', iostat=status)
    if (status /= 0) return
    read (unit, '(a)', iostat=status) text
    close (unit)
    if (status /= 0 .or. verify(trim(text), '0123456789') > 0 .or. text == '') return
    read (text, *, iostat=status) number_in
    if (status /= 0) number_in = huge(1.0_rp)
  end function number_in

end module base_memory
