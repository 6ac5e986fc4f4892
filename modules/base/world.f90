! SPDX-License-Identifier: MIT
!> Ranks of the run: start and end of MPI, collective operations, and agreement on errors: an error
!> of any rank becomes the error of all ranks.
module base_world
  use base_errors, only: error_t, fatal, set_abort_hook
  use base_kinds, only: i8, rp
  use base_system, only: set_default_variable
  use base_timers, only: wall_time
  use mpi_f08, only: mpi_abort, mpi_allgather, mpi_allgatherv, mpi_allreduce, mpi_barrier, &
                     mpi_bcast, mpi_character, mpi_comm, mpi_comm_free, mpi_comm_rank, &
                     mpi_comm_size, mpi_comm_split_type, mpi_comm_type_shared, mpi_comm_world, &
                     mpi_double_precision, mpi_finalize, mpi_get_library_version, mpi_iallreduce, &
                     mpi_in_place, mpi_info_null, mpi_init, mpi_integer, mpi_integer8, mpi_max, &
                     mpi_max_library_version_string, mpi_min, mpi_proc_null, mpi_request, &
                     mpi_sendrecv, mpi_status_ignore, mpi_sum, mpi_test, mpi_wait
  implicit none (type, external)
  private

  public :: agree, end_world, mpi_text, reduction_t, start_world, world_t

  !> Communicator, own rank (from 0) and number of ranks.
  type :: world_t
    type(mpi_comm) :: comm
    integer :: rank = 0, size = 1
  contains
    procedure :: is_root, ranks_here, barrier
    procedure, private :: sum_reals, sum_longs, sum_integers, sum_long
    generic :: sum => sum_reals, sum_longs, sum_integers, sum_long
    procedure, private :: max_reals
    generic :: max => max_reals
    procedure :: broadcast, gather, all_true, share_message, swap
  end type world_t

  !> Non-blocking maximum over ranks.
  type :: reduction_t
    real(rp), allocatable :: value(:)        !! values of this rank, then maxima of all ranks
    type(mpi_request), private :: request
  contains
    procedure :: start => start_reduction, is_done, finish => finish_reduction
  end type reduction_t

  real(rp), parameter :: wait_limit = 60.0_rp  !! longest wait for other ranks after an error [s]

contains

  !> Collective. Number of ranks on this computer.
  integer function ranks_here(self)
    class(world_t), intent(in) :: self
    type(mpi_comm) :: here

    call mpi_comm_split_type(self%comm, mpi_comm_type_shared, 0, mpi_info_null, here)
    call mpi_comm_size(here, ranks_here)
    call mpi_comm_free(here)
  end function ranks_here

  !> Start MPI (without mpirun one rank). Shared file pointers of Open MPI are disabled: they use a
  !> named semaphore of the node, which a killed run leaves locked and whose name cannot hold long
  !> paths. Open MPI of a program without a launcher starts no daemon, makes no session directory
  !> (which single processes would share), and searches no networks; hwloc looks for no devices.
  subroutine start_world(world)
    type(world_t), intent(out) :: world

    call set_default_variable('OMPI_MCA_sharedfp', 'individual')
    if (.not. has_launcher()) then
      call set_default_variable('OMPI_MCA_ess_singleton_isolated', '1')
      call set_default_variable('OMPI_MCA_orte_create_session_dirs', '0')
      call set_default_variable('OMPI_MCA_pml', 'ob1')
      call set_default_variable('HWLOC_COMPONENTS', '-linuxio')
      call set_default_variable('HWLOC_PLUGINS_PATH', '/')
    end if
    call mpi_init()
    world%comm = mpi_comm_world
    call mpi_comm_rank(world%comm, world%rank)
    call mpi_comm_size(world%comm, world%size)
    call set_abort_hook(abort_world)
  end subroutine start_world

  !> True if the environment has variables of mpirun, PMIx, PMI or Slurm.
  logical function has_launcher()
    character(18), parameter :: names(6) = [character(18) :: 'OMPI_UNIVERSE_SIZE', 'PMIX_RANK', &
                                            'PMIX_NAMESPACE', 'PMI_RANK', 'PMI_FD', 'SLURM_PROCID']
    integer :: i, status

    has_launcher = .false.
    do i = 1, size(names)
      call get_environment_variable(trim(names(i)), status=status)
      has_launcher = has_launcher .or. status /= 1
    end do
  end function has_launcher

  subroutine end_world()
    call mpi_finalize()
  end subroutine end_world

  !> First line of the version text of the MPI library.
  function mpi_text() result(text)
    character(:), allocatable :: text
    character(mpi_max_library_version_string) :: name
    integer :: i, length

    call mpi_get_library_version(name, length)
    i = scan(name(:length), new_line('a')//achar(0))
    if (i > 0) length = i - 1
    text = trim(name(:length))
  end function mpi_text

  subroutine abort_world()
    call mpi_abort(mpi_comm_world, 1)
  end subroutine abort_world

  pure logical function is_root(self)
    class(world_t), intent(in) :: self

    is_root = self%rank == 0
  end function is_root

  subroutine barrier(self)
    class(world_t), intent(in) :: self

    call mpi_barrier(self%comm)
  end subroutine barrier

  !> Sums over ranks, in place.
  subroutine sum_reals(self, a)
    class(world_t), intent(in) :: self
    real(rp), intent(inout), contiguous :: a(:)

    call mpi_allreduce(mpi_in_place, a, size(a), mpi_double_precision, mpi_sum, self%comm)
  end subroutine sum_reals

  subroutine sum_longs(self, a)
    class(world_t), intent(in) :: self
    integer(i8), intent(inout), contiguous :: a(:)

    call mpi_allreduce(mpi_in_place, a, size(a), mpi_integer8, mpi_sum, self%comm)
  end subroutine sum_longs

  subroutine sum_integers(self, a)
    class(world_t), intent(in) :: self
    integer, intent(inout), contiguous :: a(:)

    call mpi_allreduce(mpi_in_place, a, size(a), mpi_integer, mpi_sum, self%comm)
  end subroutine sum_integers

  subroutine sum_long(self, a)
    class(world_t), intent(in) :: self
    integer(i8), intent(inout) :: a

    call mpi_allreduce(mpi_in_place, a, 1, mpi_integer8, mpi_sum, self%comm)
  end subroutine sum_long

  !> Largest values over ranks, in place.
  subroutine max_reals(self, a)
    class(world_t), intent(in) :: self
    real(rp), intent(inout), contiguous :: a(:)

    call mpi_allreduce(mpi_in_place, a, size(a), mpi_double_precision, mpi_max, self%comm)
  end subroutine max_reals

  !> Collective. Start the maximum of `value` over the ranks.
  subroutine start_reduction(self, world, value)
    class(reduction_t), intent(inout) :: self
    type(world_t), intent(in) :: world
    real(rp), intent(in) :: value(:)

    self%value = value
    call mpi_iallreduce(mpi_in_place, self%value, size(self%value), mpi_double_precision, mpi_max, &
                        world%comm, self%request)
  end subroutine start_reduction

  !> True if the maximum is complete.
  logical function is_done(self)
    class(reduction_t), intent(inout) :: self

    call mpi_test(self%request, is_done, mpi_status_ignore)
  end function is_done

  !> Wait for the maximum.
  subroutine finish_reduction(self)
    class(reduction_t), intent(inout) :: self

    call mpi_wait(self%request, mpi_status_ignore)
  end subroutine finish_reduction

  !> Broadcast values of rank 0.
  subroutine broadcast(self, a)
    class(world_t), intent(in) :: self
    real(rp), intent(inout), contiguous :: a(:)

    call mpi_bcast(a, size(a), mpi_double_precision, 0, self%comm)
  end subroutine broadcast

  !> Collective. Columns `a` of all ranks, in the order of the ranks.
  function gather(self, a) result(columns)
    class(world_t), intent(in) :: self
    real(rp), intent(in), contiguous :: a(:, :)
    real(rp), allocatable :: columns(:, :)
    integer :: before(0:self%size), i, sizes(self%size)

    call mpi_allgather(size(a), 1, mpi_integer, sizes, 1, mpi_integer, self%comm)
    before = [0, (sum(sizes(:i)), i=1, self%size)]
    allocate (columns(size(a, 1), before(self%size)/size(a, 1)))
    call mpi_allgatherv(a, size(a), mpi_double_precision, columns, sizes, before(:self%size - 1), &
                        mpi_double_precision, self%comm)
  end function gather

  !> True if `ok` holds on every rank.
  logical function all_true(self, ok)
    class(world_t), intent(in) :: self
    logical, intent(in) :: ok
    integer :: flag

    flag = merge(1, 0, ok)
    call mpi_allreduce(mpi_in_place, flag, 1, mpi_integer, mpi_min, self%comm)
    all_true = flag == 1
  end function all_true

  !> Collective. Message of the lowest rank that has one; '' if none.
  subroutine share_message(self, local_message, message)
    class(world_t), intent(in) :: self
    character(*), intent(in) :: local_message
    character(:), allocatable, intent(inout) :: message
    integer :: first, length

    first = merge(self%rank, self%size, local_message /= '')
    call mpi_allreduce(mpi_in_place, first, 1, mpi_integer, mpi_min, self%comm)
    message = ''
    if (first == self%size) return
    length = len(local_message)
    call mpi_bcast(length, 1, mpi_integer, first, self%comm)
    message = repeat(' ', length)
    if (self%rank == first) message = local_message
    call mpi_bcast(message, length, mpi_character, first, self%comm)
  end subroutine share_message

  !> Exchange data with the previous and the next rank (-1: none) in a row of ranks.
  subroutine swap(self, before, after, to_before, to_after, from_before, from_after)
    class(world_t), intent(in) :: self
    integer, intent(in) :: before, after
    real(rp), intent(in), contiguous :: to_before(:), to_after(:)
    real(rp), intent(inout), contiguous :: from_before(:), from_after(:)
    integer :: b, a

    b = merge(before, mpi_proc_null, before >= 0)
    a = merge(after, mpi_proc_null, after >= 0)
    call mpi_sendrecv(to_before, size(to_before), mpi_double_precision, b, 1, from_after, &
                      size(from_after), mpi_double_precision, a, 1, self%comm, mpi_status_ignore)
    call mpi_sendrecv(to_after, size(to_after), mpi_double_precision, a, 2, from_before, &
                      size(from_before), mpi_double_precision, b, 2, self%comm, mpi_status_ignore)
  end subroutine swap

  !> Collective. If any rank has an error, the lowest such rank sends its message to ranks without
  !> one.
  !>
  !> A collective write may fail on some ranks and never return on others, as with a full disk. A
  !> rank with an error therefore waits for the others up to a limit, and then aborts the run.
  subroutine agree(world, error)
    type(world_t), intent(in) :: world
    type(error_t), intent(inout) :: error
    character(:), allocatable :: message
    type(mpi_request) :: request
    integer, asynchronous :: own_rank, first
    integer :: length

    own_rank = merge(world%rank, world%size, error%is_set())
    call mpi_iallreduce(own_rank, first, 1, mpi_integer, mpi_min, world%comm, request)
    if (error%is_set()) then
      call wait_for_others(request, error%message)
    else
      call mpi_wait(request, mpi_status_ignore)
    end if
    if (first == world%size) return

    length = 0
    if (world%rank == first) length = len(error%message)
    call mpi_bcast(length, 1, mpi_integer, first, world%comm)
    allocate (character(length) :: message)
    if (world%rank == first) message(:) = error%message
    call mpi_bcast(message, length, mpi_character, first, world%comm)
    call error%raise(message)
  end subroutine agree

  !> Wait for all ranks up to the limit, then abort.
  subroutine wait_for_others(request, message)
    type(mpi_request), intent(inout) :: request
    character(*), intent(in) :: message
    real(rp) :: start
    logical :: done

    start = wall_time()
    do
      call mpi_test(request, done, mpi_status_ignore)
      if (done) return
      if (wall_time() - start > wait_limit) call fatal(message//' (disk full?)')
    end do
  end subroutine wait_for_others

end module base_world
