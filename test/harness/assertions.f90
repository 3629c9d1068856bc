!> Assertions of the test programs. A program makes one assertions_t, checks, and finishes:
!>
!>    type(communicator_t) :: comm
!>    type(assertions_t) :: test
!>    call comm%start()
!>    call test%start(comm, 'weights')
!>    call test%check(size(list) == 8, 'eight nodes')
!>    call test%check_close(sum(weight), 1.0_wp, 1.0e-14_wp, 'partition of unity')
!>    call test%finish()
!>
!> A case is a name; checks of the same name, in a loop or on several ranks, are one case, which fails once if
!> any of them does. Checks are local to a rank; start and finish are collective. A NaN or an infinity never
!> passes.
module m_assertions
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use mpi_f08, only: MPI_Gather, MPI_Gatherv, MPI_Bcast, MPI_INTEGER, MPI_CHARACTER
   use m_kinds, only: wp, i8
   use m_text, only: to_text
   use m_leaving, only: leave
   use m_communicator, only: communicator_t
   implicit none
   private
   public :: assertions_t

   integer, parameter :: name_length = 120, message_length = 200

   type :: case_t
      character(len=name_length) :: name = ''
      integer :: checks = 0
      integer :: failures = 0
      character(len=message_length) :: message = '' !< of the first failure
   end type case_t

   type :: assertions_t
      private
      type(communicator_t) :: comm
      character(len=:), allocatable :: program_name
      type(case_t), allocatable :: cases(:)
      integer :: count = 0
   contains
      procedure, public :: start
      procedure, public :: check
      generic, public :: check_close => check_close_scalar, check_close_array
      generic, public :: check_equal => check_equal_default, check_equal_long
      procedure, public :: finish
      procedure :: check_close_scalar
      procedure :: check_close_array
      procedure :: check_equal_default
      procedure :: check_equal_long
      procedure :: record
      procedure :: merge_ranks
   end type assertions_t

contains

   !> Collective: begin the checks of a program.
   subroutine start(self, comm, program_name)
      class(assertions_t), intent(out) :: self
      type(communicator_t), intent(in) :: comm
      character(len=*), intent(in) :: program_name
      self%comm = comm
      self%program_name = program_name
      allocate (self%cases(16))
   end subroutine start

   !> The case fails unless the condition holds.
   subroutine check(self, condition, name, message)
      class(assertions_t), intent(inout) :: self
      logical, intent(in) :: condition
      character(len=*), intent(in) :: name
      character(len=*), intent(in), optional :: message !< what to print when it does not
      if (present(message)) then
         call self%record(condition, name, message)
      else
         call self%record(condition, name, '')
      end if
   end subroutine check

   !> The case fails unless value is finite and within the absolute tolerance of expected.
   subroutine check_close_scalar(self, value, expected, tolerance, name)
      class(assertions_t), intent(inout) :: self
      real(wp), intent(in) :: value, expected, tolerance
      character(len=*), intent(in) :: name
      character(len=message_length) :: message
      write (message, '(3(a,es24.16e3),a)') 'is', value, ', expected', expected, ' within', tolerance
      call self%record(is_close(value, expected, tolerance), name, message)
   end subroutine check_close_scalar

   !> The same for every element; the lengths must agree too.
   subroutine check_close_array(self, values, expected, tolerance, name)
      class(assertions_t), intent(inout) :: self
      real(wp), intent(in) :: values(:), expected(:), tolerance
      character(len=*), intent(in) :: name
      character(len=message_length) :: message
      integer :: i
      if (size(values) /= size(expected)) then
         write (message, '(a,i0,a,i0)') 'has length ', size(values), ', expected ', size(expected)
         call self%record(.false., name, message)
         return
      end if
      do i = 1, size(values)
         if (is_close(values(i), expected(i), tolerance)) cycle
         write (message, '(a,i0,3(a,es24.16e3))') 'element ', i, ' is', values(i), ', expected', &
            expected(i), ' within', tolerance
         call self%record(.false., name, message)
         return
      end do
      call self%record(.true., name, '')
   end subroutine check_close_array

   subroutine check_equal_default(self, value, expected, name)
      class(assertions_t), intent(inout) :: self
      integer, intent(in) :: value, expected
      character(len=*), intent(in) :: name
      call self%check_equal_long(int(value, i8), int(expected, i8), name)
   end subroutine check_equal_default

   subroutine check_equal_long(self, value, expected, name)
      class(assertions_t), intent(inout) :: self
      integer(i8), intent(in) :: value, expected
      character(len=*), intent(in) :: name
      character(len=message_length) :: message
      write (message, '(a,i0,a,i0)') 'is ', value, ', expected ', expected
      call self%record(value == expected, name, message)
   end subroutine check_equal_long

   !> Collective: print the summary, finalise MPI and end the program: status 1 if a case failed on any rank
   !> or nothing was checked.
   subroutine finish(self)
      class(assertions_t), intent(inout) :: self
      integer :: i, failed
      call self%merge_ranks()
      failed = count(self%cases(:self%count)%failures > 0)
      if (self%comm%is_root()) then
         do i = 1, self%count
            if (self%cases(i)%failures == 0) cycle
            print '(2a,2(i0,a))', 'FAILED ', trim(self%cases(i)%name)//' (', self%cases(i)%failures, ' of ', &
               self%cases(i)%checks, ' checks): '//trim(self%cases(i)%message)
         end do
         if (self%count == 0) print '(a)', 'FAILED: nothing was checked'
         print '(2a,4(i0,a))', self%program_name, ': ', self%count, ' cases, ', &
            sum(self%cases(:self%count)%checks), ' checks on ', self%comm%ranks, ' ranks, ', failed, ' failed'
      end if
      if (self%count == 0) failed = 1
      call MPI_Bcast(failed, 1, MPI_INTEGER, 0, self%comm%comm)
      call self%comm%finish()
      if (failed > 0) call leave(1)
   end subroutine finish

   pure logical function is_close(value, expected, tolerance)
      real(wp), intent(in) :: value, expected, tolerance
      is_close = .false.
      ! Not left to the comparison: a NaN there would trap in the debug build.
      if (.not. (ieee_is_finite(value) .and. ieee_is_finite(expected) .and. ieee_is_finite(tolerance))) return
      is_close = abs(value - expected) <= tolerance
   end function is_close

   !> Count a check under its case.
   subroutine record(self, passed, name, message)
      class(assertions_t), intent(inout) :: self
      logical, intent(in) :: passed
      character(len=*), intent(in) :: name, message
      type(case_t) :: one
      one%name = name
      one%checks = 1
      if (.not. passed) then
         one%failures = 1
         one%message = message
      end if
      call add(self%cases, self%count, one)
   end subroutine record

   !> Add the checks of a case to those of the same name.
   subroutine add(cases, count, one)
      type(case_t), allocatable, intent(inout) :: cases(:)
      integer, intent(inout) :: count
      type(case_t), intent(in) :: one
      type(case_t), allocatable :: longer(:)
      integer :: i
      do i = count, 1, -1
         if (cases(i)%name == one%name) exit
      end do
      if (i == 0) then
         if (count == size(cases)) then
            allocate (longer(2*count))
            longer(:count) = cases
            call move_alloc(longer, cases)
         end if
         count = count + 1
         cases(count) = one
         return
      end if
      if (cases(i)%failures == 0) cases(i)%message = one%message
      cases(i)%checks = cases(i)%checks + one%checks
      cases(i)%failures = cases(i)%failures + one%failures
   end subroutine add

   !> Collective: the root takes the cases of all ranks together; a failure elsewhere says its rank.
   subroutine merge_ranks(self)
      class(assertions_t), intent(inout) :: self
      integer, parameter :: record_length = name_length + message_length + 20
      character(len=record_length), allocatable :: mine(:), all(:)
      character(len=message_length) :: message
      integer, allocatable :: counts(:), offsets(:)
      type(case_t) :: one
      integer :: i, rank
      allocate (mine(self%count), counts(self%comm%ranks), offsets(self%comm%ranks))
      do i = 1, self%count
         write (mine(i), '(2a,2i10)') self%cases(i)%name, self%cases(i)%message, self%cases(i)%checks, &
            self%cases(i)%failures
      end do
      call MPI_Gather(self%count, 1, MPI_INTEGER, counts, 1, MPI_INTEGER, 0, self%comm%comm)
      if (.not. self%comm%is_root()) counts = 0
      offsets(1) = 0
      do rank = 2, self%comm%ranks
         offsets(rank) = offsets(rank - 1) + counts(rank - 1)
      end do
      allocate (all(sum(counts)))
      call MPI_Gatherv(mine, self%count*record_length, MPI_CHARACTER, all, counts*record_length, &
                       offsets*record_length, MPI_CHARACTER, 0, self%comm%comm)
      if (.not. self%comm%is_root()) return
      do rank = 1, self%comm%ranks - 1
         do i = offsets(rank + 1) + 1, offsets(rank + 1) + counts(rank + 1)
            read (all(i), '(2a,2i10)') one%name, message, one%checks, one%failures
            one%message = 'rank '//to_text(rank)//': '//message ! the end of a long one is cut
            if (one%failures == 0) one%message = ''
            call add(self%cases, self%count, one)
         end do
      end do
   end subroutine merge_ranks

end module m_assertions
