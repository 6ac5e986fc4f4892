! SPDX-License-Identifier: MIT
!> System functions not in Fortran: aligned memory, atomic renaming of files, directories, signals,
!> prefetch, dynamic loading of libraries, and the memory that is available on this node.
module base_system
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_f_pointer, c_funptr, &
                                         c_int, c_int64_t, c_loc, c_null_char, c_ptr, c_size_t
  use base_errors, only: fatal
  use base_kinds, only: i8, rp
  implicit none (type, external)
  private

  public :: allocate_aligned, available_memory, data_file, free_aligned, leave_signals, &
            make_directory, note_step, open_library, prefetch_lines, register_prefetch, &
            pack_records, peak_memory, program_folder, remove_file, rename_file, resize_aligned, &
            set_default_variable, stop_signal, symbol_of, watch_signals

  interface
    function c_aligned_alloc(alignment, size) bind(c, name='aligned_alloc') result(p)
      import :: c_ptr, c_size_t
      implicit none (type, external)
      integer(c_size_t), value :: alignment, size
      type(c_ptr) :: p
    end function c_aligned_alloc

    function c_resize(old, size) bind(c, name='stirpoint_resize') result(p)
      import :: c_ptr, c_size_t
      implicit none (type, external)
      type(c_ptr), value :: old
      integer(c_size_t), value :: size
      type(c_ptr) :: p
    end function c_resize

    subroutine c_free(p) bind(c, name='free')
      import :: c_ptr
      implicit none (type, external)
      type(c_ptr), value :: p
    end subroutine c_free

    integer(c_int) function c_rename(from, to) bind(c, name='rename')
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: from(*), to(*)
    end function c_rename

    integer(c_int) function c_mkdir(path, mode) bind(c, name='mkdir')
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
      integer(c_int), value :: mode
    end function c_mkdir

    integer(c_int) function c_setenv(name, value, overwrites) bind(c, name='setenv')
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: name(*), value(*)
      integer(c_int), value :: overwrites
    end function c_setenv

    integer(c_int) function c_remove(path) bind(c, name='remove')
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: path(*)
    end function c_remove

    !> Set a flag on SIGUSR1, SIGTERM, SIGINT and SIGHUP; a second signal ends the program
    !> (native.c).
    subroutine watch_signals() bind(c, name='stirpoint_watch_signals')
      implicit none (type, external)
    end subroutine watch_signals

    !> Restore the default action of these signals, also for one that has arrived.
    subroutine leave_signals() bind(c, name='stirpoint_leave_signals')
      implicit none (type, external)
    end subroutine leave_signals

    !> Report that step `step` has ended, or with a negative number that the last step has. If then
    !> no step ends for ten minutes (or the seconds in the variable STIRPOINT_SILENCE), a message is
    !> written to standard error.
    subroutine note_step(step) bind(c, name='stirpoint_note_step')
      import :: c_int64_t
      implicit none (type, external)
      integer(c_int64_t), value :: step
    end subroutine note_step

    !> Number of the signal that has arrived, or 0.
    integer(c_int) function stop_signal() bind(c, name='stirpoint_stop_signal')
      import :: c_int
      implicit none (type, external)
    end function stop_signal

    !> Register `bytes` of memory from `p`, except those from `gap_from` to `gap_to`, for
    !> prefetching by `prefetch_lines`.
    subroutine register_prefetch(p, bytes, gap_from, gap_to) &
      bind(c, name='stirpoint_register_prefetch')
      import :: c_double, c_int
      implicit none (type, external)
      real(c_double), intent(in) :: p(*)
      integer(c_int), value :: bytes, gap_from, gap_to
    end subroutine register_prefetch

    !> Prefetch the next `lines` cache lines of 64 bytes of the registered memory.
    subroutine prefetch_lines(lines) bind(c, name='stirpoint_prefetch_lines')
      import :: c_int
      implicit none (type, external)
      integer(c_int), value :: lines
    end subroutine prefetch_lines

    !> Records rec(8, 4, n) of n particles (a multiple of 8) for the transfer to the grid: values
    !> from `value(n, 8)`, lanes 5:7 of the slope parts from `slope(n, 9)`, all other lanes 0.
    pure subroutine pack_records(n, value, slope, rec) bind(c, name='stirpoint_pack_records')
      import :: c_double, c_int
      implicit none (type, external)
      integer(c_int), value :: n
      real(c_double), intent(in) :: value(*), slope(*)
      real(c_double), intent(inout) :: rec(*)
    end subroutine pack_records

    function c_open_library(name) bind(c, name='stirpoint_open_library') result(trouble)
      import :: c_char, c_ptr
      implicit none (type, external)
      character(kind=c_char), intent(in) :: name(*)
      type(c_ptr) :: trouble
    end function c_open_library

    function c_symbol(name) bind(c, name='stirpoint_symbol') result(address)
      import :: c_char, c_funptr
      implicit none (type, external)
      character(kind=c_char), intent(in) :: name(*)
      type(c_funptr) :: address
    end function c_symbol

    subroutine c_program_folder(link, path, n) bind(c, name='stirpoint_program_folder')
      import :: c_char, c_int
      implicit none (type, external)
      character(kind=c_char), intent(in) :: link(*)
      character(kind=c_char), intent(inout) :: path(4096)
      integer(c_int), value :: n
    end subroutine c_program_folder

    !> Peak resident memory of this process [bytes].
    real(c_double) function peak_memory() bind(c, name='stirpoint_peak_memory')
      import :: c_double
      implicit none (type, external)
    end function peak_memory
  end interface

contains

  !> Set an environment variable that has no value.
  subroutine set_default_variable(name, value)
    character(*), intent(in) :: name, value

    if (c_setenv(name//c_null_char, value//c_null_char, 0_c_int) /= 0) call fatal('out of memory')
  end subroutine set_default_variable

  !> Allocate zeroed memory for `n` reals on a 64-byte boundary, so that records are aligned to
  !> cache lines.
  subroutine allocate_aligned(n, a)
    integer(i8), intent(in) :: n
    real(rp), pointer, contiguous, intent(out) :: a(:)
    type(c_ptr) :: p

    p = c_aligned_alloc(64_c_size_t, whole_lines(n))
    if (.not. c_associated(p)) call fatal('out of memory')
    call c_f_pointer(p, a, [n])
    a = 0.0_rp
  end subroutine allocate_aligned

  !> Resize memory of `allocate_aligned` to `n` reals; values are kept, new ones are 0. Large arrays
  !> are moved without a copy.
  subroutine resize_aligned(n, a)
    integer(i8), intent(in) :: n
    real(rp), pointer, contiguous, intent(inout) :: a(:)
    type(c_ptr) :: p
    integer(i8) :: old

    old = size(a, kind=i8)
    p = c_resize(c_loc(a), whole_lines(n))
    if (.not. c_associated(p)) call fatal('out of memory')
    call c_f_pointer(p, a, [n])
    a(old + 1:) = 0.0_rp
  end subroutine resize_aligned

  !> Size of `n` reals in bytes, rounded up to cache lines.
  pure integer(c_size_t) function whole_lines(n)
    integer(i8), intent(in) :: n

    whole_lines = 64_c_size_t*((8_c_size_t*max(n, 1_i8) + 63_c_size_t)/64_c_size_t)
  end function whole_lines

  !> Free memory of `allocate_aligned`.
  subroutine free_aligned(a)
    real(rp), pointer, contiguous, intent(inout) :: a(:)

    if (associated(a)) then
      if (size(a) > 0) call c_free(c_loc(a))
    end if
    nullify (a)
  end subroutine free_aligned

  !> Replace `to` by `from` atomically; `ok` if it worked.
  subroutine rename_file(from, to, ok)
    character(*), intent(in) :: from, to
    logical, intent(out) :: ok

    ok = c_rename(trim(from)//c_null_char, trim(to)//c_null_char) == 0
  end subroutine rename_file

  !> Make a directory, if it does not exist.
  subroutine make_directory(path, ok)
    character(*), intent(in) :: path
    logical, intent(out) :: ok
    integer(c_int), parameter :: mode = int(o'755', c_int)
    integer(c_int) :: status

    status = c_mkdir(trim(path)//c_null_char, mode)
    inquire (file=trim(path)//'/.', exist=ok)
    ok = ok .or. status == 0
  end subroutine make_directory

  !> Remove a file, if it exists.
  subroutine remove_file(path)
    character(*), intent(in) :: path
    integer(c_int) :: status

    status = c_remove(trim(path)//c_null_char)
    if (status /= 0) return
  end subroutine remove_file

  !> Folder of the program with a trailing /, from the symbolic `link`; '' if unknown.
  function program_folder(link) result(here)
    character(*), intent(in) :: link
    character(:), allocatable :: here
    character(kind=c_char) :: folder(4096)
    integer :: k, n

    call c_program_folder(link//c_null_char, folder, int(size(folder), c_int))
    n = findloc(folder, c_null_char, dim=1) - 1
    here = repeat(' ', n)
    do k = 1, n
      here(k:k) = folder(k)
    end do
  end function program_folder

  !> Path of a data file of the program: in ../share/stirpoint of an installed program, in
  !> share/stirpoint of a build. `problem` is '' if it exists.
  subroutine data_file(name, path, problem)
    character(*), intent(in) :: name
    character(:), allocatable, intent(out) :: path, problem
    character(:), allocatable :: here
    character(*), parameter :: places(2) = [character(18) :: '../share/stirpoint', &
                                            'share/stirpoint']
    logical :: is_there
    integer :: k

    here = program_folder('/proc/self/exe')
    problem = ''
    do k = 1, size(places)
      path = here//trim(places(k))//'/'//name
      inquire (file=path, exist=is_there)
      if (is_there) return
    end do
    path = here//trim(places(1))//'/'//name
    problem = 'is not there'
  end subroutine data_file

  !> Load a shared library; `trouble` is the error message, '' on success.
  subroutine open_library(name, trouble)
    character(*), intent(in) :: name
    character(:), allocatable, intent(out) :: trouble
    character(kind=c_char), pointer :: text(:)
    type(c_ptr) :: message
    integer :: i

    trouble = ''
    message = c_open_library(name//c_null_char)
    if (.not. c_associated(message)) return
    call c_f_pointer(message, text, [1000])
    do i = 1, size(text)
      if (text(i) == c_null_char) exit
      trouble = trouble//text(i)
    end do
  end subroutine open_library

  !> Address of a procedure of the loaded library.
  type(c_funptr) function symbol_of(name)
    character(*), intent(in) :: name

    symbol_of = c_symbol(name//c_null_char)
    if (.not. c_associated(symbol_of)) call fatal('the opened library lacks '//name)
  end function symbol_of

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
    !> Reduce the available memory to the limits of a control group and its parents.
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
      read (line(14:), *, iostat=status) kernel_memory     ! the file has kB
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

end module base_system
