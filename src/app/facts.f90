!> Contents of the closing summary: lines for people, and the same for programs, for the head of cost.dat and
!> as JSON.
module m_facts
   use m_kinds, only: wp, i8
   use m_text, only: to_text
   use m_history, only: history_text_length
   use m_cost_report, only: cost_line_length
   implicit none
   private
   public :: percent

   !> Lines for people, and the same as `name=value`.
   type, public :: facts_t
      character(len=cost_line_length), allocatable :: lines(:)
      character(len=history_text_length), allocatable :: notes(:)
   contains
      procedure :: say
      procedure :: note
   end type facts_t

   !> Data of a run for its closing summary.
   type, public :: course_t
      integer(i8) :: particles = 0       !< when the program started
      real(wp) :: memory = 0.0_wp        !< of particles and node tiles then, bytes
      integer(i8) :: steps = 0           !< taken by the program, repeated ones included
      character(len=:), allocatable :: stop_reason !< why the run ends before the scene; empty: it does not
      real(wp) :: early_elapsed = 0.0_wp !< wall-clock time when the last tenth of the scene began, s; 0
                                         !< before that
      real(wp) :: early_contact = 0.0_wp !< part of it spent in contact, s
   end type course_t

contains

   !> A line of the summary.
   subroutine say(self, text)
      class(facts_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      character(len=cost_line_length) :: line
      line = text
      self%lines = [self%lines, line]
   end subroutine say

   !> A line of the head of cost.dat.
   subroutine note(self, name, text)
      class(facts_t), intent(inout) :: self
      character(len=*), intent(in) :: name, text
      character(len=history_text_length) :: line
      line = name//'='//text
      self%notes = [self%notes, line]
   end subroutine note

   !> A share in percent; empty if `whole` is 0.
   function percent(part, whole) result(text)
      real(wp), intent(in) :: part, whole
      character(len=:), allocatable :: text
      text = ''
      if (whole > 0.0_wp) text = ', '//to_text(100.0_wp*part/whole, 3)//' %'
   end function percent

end module m_facts
