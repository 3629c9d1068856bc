!> The ranks of a run, and the one way to make an error common to all.
module m_communicator
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_null_char
   use, intrinsic :: ieee_exceptions, only: ieee_all, ieee_get_halting_mode, ieee_set_halting_mode
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   implicit none
   private
   public :: communicator_t

   interface
      integer(c_int) function c_setenv(name, value, overwrite) bind(c, name='setenv')
         import :: c_char, c_int
         character(kind=c_char), intent(in) :: name(*), value(*)
         integer(c_int), value :: overwrite
      end function c_setenv
   end interface

   !> A group of ranks. Created once by the application and passed as an argument.
   type :: communicator_t
      type(MPI_Comm) :: comm = MPI_COMM_NULL
      integer :: rank = 0
      integer :: ranks = 1
      logical, private :: initialised = .false. !< MPI was initialised by this program
   contains
      procedure :: start
      procedure :: finish
      procedure :: is_root
      procedure :: agree
      procedure :: broadcast_text
      procedure :: sum_count
      procedure :: sum_real
      procedure :: maximum
      procedure :: minimum
   end type communicator_t

contains

   !> Initialise MPI, if the runtime of coarrays has not, and create our own communicator. Open MPI protects
   !> shared file pointers, which are not used here, by a named semaphore of the machine: a process killed
   !> while it opens a file leaves it locked, and later runs, also in other directories, would wait forever on
   !> a file of the same name. That component (sharedfp sm) is excluded, unless the environment chooses.
   !> HDF5's file locking is turned off: a run has its directory to itself (m_output_lock), and file systems
   !> of clusters often refuse locks.
   subroutine start(self)
      class(communicator_t), intent(out) :: self
      integer(c_int) :: status
      logical :: there, halts(size(ieee_all))
      status = c_setenv('HDF5_USE_FILE_LOCKING'//c_null_char, 'FALSE'//c_null_char, 0_c_int)
      ! without memory: unchanged
      status = c_setenv('OMPI_MCA_sharedfp'//c_null_char, '^sm'//c_null_char, 0_c_int)
      call MPI_Initialized(there)
      ! exceptions that MPI raises as it starts (seen of Open MPI 5.0) are no business of the debug build
      call ieee_get_halting_mode(ieee_all, halts)
      call ieee_set_halting_mode(ieee_all, .false.)
      if (.not. there) call MPI_Init()
      call ieee_set_halting_mode(ieee_all, halts)
      self%initialised = .not. there
      call MPI_Comm_dup(MPI_COMM_WORLD, self%comm)
      call MPI_Comm_rank(self%comm, self%rank)
      call MPI_Comm_size(self%comm, self%ranks)
   end subroutine start

   !> Free the communicator and finalise MPI, where it was initialised here.
   subroutine finish(self)
      class(communicator_t), intent(inout) :: self
      call MPI_Comm_free(self%comm)
      if (self%initialised) call MPI_Finalize()
   end subroutine finish

   pure logical function is_root(self)
      class(communicator_t), intent(in) :: self
      is_root = self%rank == 0
   end function is_root

   !> Collective: if any rank holds an error, every rank returns with that of the lowest such rank.
   subroutine agree(self, error)
      class(communicator_t), intent(in) :: self
      type(error_t), intent(inout) :: error
      integer :: first
      first = self%ranks
      if (error%happened()) first = self%rank
      call MPI_Allreduce(MPI_IN_PLACE, first, 1, MPI_INTEGER, MPI_MIN, self%comm)
      if (first == self%ranks) return
      call MPI_Bcast(error%status, 1, MPI_INTEGER, first, self%comm)
      call MPI_Bcast(error%recoverable, 1, MPI_LOGICAL, first, self%comm)
      call self%broadcast_text(error%message, first)
   end subroutine agree

   !> Collective: send the text of rank `root` to every rank.
   subroutine broadcast_text(self, text, root)
      class(communicator_t), intent(in) :: self
      character(len=:), allocatable, intent(inout) :: text
      integer, intent(in) :: root
      character(len=:), allocatable :: buffer
      integer :: length
      length = 0
      if (self%rank == root .and. allocated(text)) length = len(text)
      call MPI_Bcast(length, 1, MPI_INTEGER, root, self%comm)
      allocate (character(len=length) :: buffer)
      if (self%rank == root .and. allocated(text)) buffer(:) = text
      call MPI_Bcast(buffer, length, MPI_CHARACTER, root, self%comm)
      text = buffer
   end subroutine broadcast_text

   !> Collective: sum of a count over all ranks.
   integer(i8) function sum_count(self, count) result(total)
      class(communicator_t), intent(in) :: self
      integer(i8), intent(in) :: count
      call MPI_Allreduce(count, total, 1, MPI_INTEGER8, MPI_SUM, self%comm)
   end function sum_count

   !> Collective: sum of a value over all ranks; its last bits depend on the number of ranks.
   real(wp) function sum_real(self, value) result(total)
      class(communicator_t), intent(in) :: self
      real(wp), intent(in) :: value
      call MPI_Allreduce(value, total, 1, MPI_DOUBLE_PRECISION, MPI_SUM, self%comm)
   end function sum_real

   !> Collective: the largest of a value over all ranks.
   real(wp) function maximum(self, value) result(largest)
      class(communicator_t), intent(in) :: self
      real(wp), intent(in) :: value
      call MPI_Allreduce(value, largest, 1, MPI_DOUBLE_PRECISION, MPI_MAX, self%comm)
   end function maximum

   !> Collective: the smallest of a value over all ranks.
   real(wp) function minimum(self, value) result(smallest)
      class(communicator_t), intent(in) :: self
      real(wp), intent(in) :: value
      call MPI_Allreduce(value, smallest, 1, MPI_DOUBLE_PRECISION, MPI_MIN, self%comm)
   end function minimum

end module m_communicator
