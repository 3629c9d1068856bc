!> The lock on an output directory, `run.lock`: one run at a time writes there, across all machines that share
!> the file system.
!>
!> The lock is created atomically, as a hard link to a file of this run (link is atomic on every file system,
!> NFS too), and names its owner. No file-system locks are needed. A run touches it every half minute. A lock
!> is stale, and taken over, if its owner process no longer exists on this machine; a lock of another machine,
!> whose processes are not visible here, if it has not been touched for ten minutes. Both times are by the
!> file system's clock. A run whose lock was taken over (because it was stopped for that long) ends without
!> writing.
module m_output_lock
   use, intrinsic :: iso_c_binding, only: c_char, c_int, c_int64_t, c_null_char
   use m_kinds, only: wp
   use m_constants, only: exit_files
   use m_errors, only: error_t, fail
   use m_communicator, only: communicator_t
   use m_filesystem, only: make_directory, read_file, link_file, create_file, touch_file, time_of_file, &
                           rename_file, remove_file
   use m_machine, only: date_text
   use m_process, only: process_t, this_process
   use m_part_file, only: part_name
   use m_text_file, only: text_file_t
   use m_text, only: to_text, duration
   use m_timers, only: wall_time
   implicit none
   private
   public :: drop_lock

   real(wp), parameter :: touch_every = 30.0_wp !< s
   integer, parameter :: dead_after = 600       !< s
   integer, parameter :: longest = 4096, max_attempts = 10
   character(len=*), parameter :: first_line = 'gimp3d output lock'
   character(len=1), parameter :: newline = achar(10)

   !> Only rank 0 holds it; the other ranks have no state.
   type, public :: output_lock_t
      character(len=:), allocatable :: note !< the stale lock that was taken over; not allocated if there was
                                            !< none
      real(wp) :: touch_every = touch_every         !< s
      character(len=:), allocatable, private :: directory, path, text
      logical, private :: held = .false.
      real(wp), private :: touched = 0.0_wp         !< wall time, s
   contains
      procedure :: take
      procedure :: is_lost
      procedure :: release
      procedure, private :: take_over
   end type output_lock_t

   integer, parameter :: longest_path = 4096
   character(kind=c_char) :: held_path(longest_path) = c_null_char !< path of the lock that this process
                                                                   !< holds; empty: none

contains

   !> Collective: take the lock of a directory, which is created if it does not exist. If an active run holds
   !> it all ranks return with an error (exit_files), and nothing has been changed. No action if it is held
   !> already.
   subroutine take(self, communicator, directory, error)
      class(output_lock_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: directory
      type(error_t), intent(inout) :: error
      logical :: ok
      if (communicator%is_root() .and. .not. (error%happened() .or. self%held)) then
         call make_directory(directory, ok)
         if (.not. ok) call fail(error, exit_files, 'cannot make the directory '//directory)
         if (ok) call take_alone(self, directory, error)
      end if
      call communicator%agree(error)
   end subroutine take

   !> The same, for one rank.
   subroutine take_alone(self, directory, error)
      type(output_lock_t), intent(inout) :: self
      character(len=*), intent(in) :: directory
      type(error_t), intent(inout) :: error
      type(process_t) :: own
      type(text_file_t) :: file
      character(len=:), allocatable :: mine
      integer :: try
      logical :: ignored
      own = this_process()
      self%directory = directory
      self%path = directory//'/run.lock'
      self%text = text_of(own)
      mine = self%path//'.'//own%host//'.'//to_text(own%id)
      call file%open(mine, error)
      if (error%happened()) return
      call file%put(self%text(:len(self%text) - 1), error)
      call file%close(error)
      do try = 1, max_attempts
         if (error%happened()) exit
         call link_file(part_name(mine), self%path, self%held)
         if (.not. self%held .and. time_of_file(self%path) < 0) &
            call create_file(self%path, self%text, self%held)
         if (.not. self%held) call self%take_over(own, part_name(mine), error)
         if (self%held) exit
      end do
      call remove_file(part_name(mine), ignored)
      self%touched = wall_time()
      if (self%held) call remember(self%path)
      if (.not. self%held) call fail(error, exit_files, 'cannot write '//self%path// &
                                     ': other processes create and remove it repeatedly')
   end subroutine take_alone

   !> Check the owner of the lock: refuse if its run is active, else remove the lock. `mine` is a file of this
   !> run written just before.
   subroutine take_over(self, own, mine, error)
      class(output_lock_t), intent(inout) :: self
      type(process_t), intent(in) :: own
      character(len=*), intent(in) :: mine
      type(error_t), intent(inout) :: error
      type(process_t) :: other
      character(len=:), allocatable :: text, who, way_out
      integer(c_int64_t) :: age
      logical :: ok
      call read_file(self%path, longest, text, ok)
      age = time_of_file(mine) - time_of_file(self%path)
      if (.not. ok .and. time_of_file(self%path) < 0) return ! removed meanwhile
      self%held = ok .and. text == self%text ! the reply to the link was lost
      if (self%held) return
      other = process_in(text)
      who = 'a process that its lock does not name'
      if (other%id > 0) who = 'process '//to_text(other%id)//' on '//other%host//' since '// &
                              value_of(text, 'since')
      way_out = ': wait for its end, stop it, or give this run another directory'
      if (own%neighbours(other)) then
         if (other%runs()) call fail(error, exit_files, self%directory// &
                                     ' is in use by a running gimp3d, '//who//way_out)
      else if (age <= dead_after) then
         call fail(error, exit_files, self%directory//' is in use by a running gimp3d, '//who// &
                   ', last seen '//duration(real(max(age, 0_c_int64_t), wp))//' ago'//way_out// &
                   '; if it is dead, remove '//self%path)
      end if
      if (error%happened()) return
      call remove_dead(self%path, text, mine//'.old')
      self%note = 'of '//who//' taken over: that run is dead'
   end subroutine take_over

   !> Remove the lock with this text. Another run may have done so just before, and have created a valid one.
   subroutine remove_dead(path, text, aside)
      character(len=*), intent(in) :: path, text
      character(len=*), intent(in) :: aside !< a name that no other process uses
      character(len=:), allocatable :: found
      logical :: ok
      call rename_file(path, aside, ok)
      if (.not. ok) return
      call read_file(aside, longest, found, ok)
      if (ok .and. found /= text) call link_file(aside, path, ok)
      call remove_file(aside, ok)
   end subroutine remove_dead

   !> Called before each step: true if another run has taken the lock over. It is touched every `touch_every`.
   logical function is_lost(self)
      class(output_lock_t), intent(inout) :: self
      character(len=:), allocatable :: text
      logical :: ok
      is_lost = .false.
      if (.not. self%held) return
      if (wall_time() - self%touched < self%touch_every) return
      self%touched = wall_time()
      call read_file(self%path, longest, text, ok)
      if (ok) then
         is_lost = text /= self%text
         if (.not. is_lost) call touch_file(self%path, ok)
      else if (time_of_file(self%path) < 0) then
         call create_file(self%path, self%text, ok) ! another process has removed it
      end if
      if (is_lost) self%held = .false.
      if (is_lost) call remember('')
   end function is_lost

   !> Release the lock, if it is still this run's.
   subroutine release(self)
      class(output_lock_t), intent(inout) :: self
      character(len=:), allocatable :: text
      logical :: ok
      if (.not. self%held) return
      self%held = .false.
      call remember('')
      call read_file(self%path, longest, text, ok)
      if (ok .and. text == self%text) call remove_file(self%path, ok)
   end subroutine release

   !> Record the lock that this process holds, for `drop_lock`.
   subroutine remember(path)
      character(len=*), intent(in) :: path
      integer :: i
      held_path = c_null_char
      if (len(path) >= longest_path) return
      do i = 1, len(path)
         held_path(i) = path(i:i)
      end do
   end subroutine remember

   !> Release the lock of this process when it ends at once; allocates no memory.
   subroutine drop_lock()
      interface
         integer(c_int) function c_unlink(path) bind(c, name='unlink')
            import :: c_char, c_int
            character(kind=c_char), intent(in) :: path(*)
         end function c_unlink
      end interface
      integer(c_int) :: ignored
      if (held_path(1) /= c_null_char) ignored = c_unlink(held_path)
   end subroutine drop_lock

   !> The text of the lock of a process.
   function text_of(process) result(text)
      type(process_t), intent(in) :: process
      character(len=:), allocatable :: text
      text = first_line//newline//'host '//process%host//newline//'process '//to_text(process%id)//newline// &
             'started '//process%start//newline//'system '//process%system//newline//'since '// &
             date_text()//newline
   end function text_of

   !> The owner process of a lock; its id is 0 if there is none.
   type(process_t) function process_in(text) result(process)
      character(len=*), intent(in) :: text
      integer :: status
      process%host = value_of(text, 'host')
      process%system = value_of(text, 'system')
      process%start = value_of(text, 'started')
      read (text(index(text, newline//'process ') + 9:), *, iostat=status) process%id
      if (status /= 0 .or. index(text, first_line) /= 1) process%id = 0
   end function process_in

   !> The text after a word at the beginning of a line; empty if no line begins with it.
   pure function value_of(text, word) result(value)
      character(len=*), intent(in) :: text, word
      character(len=:), allocatable :: value
      integer :: first
      value = ''
      first = index(text, newline//word//' ')
      if (first == 0) return
      first = first + len(word) + 2
      value = text(first:first + index(text(first:)//newline, newline) - 2)
   end function value_of

end module m_output_lock
