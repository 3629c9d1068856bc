!> The edge of a tool's contact at the time of a snapshot: a Tecplot zone of points along J (VTK's reader
!> returns nothing for a zone that is long in I alone).
module m_outline_file
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_text, only: to_text, exact_text
   use m_snapshot, only: step_digits
   use m_part_file, only: publish_part
   use m_text_file, only: text_file_t
   use m_tecplot_snapshot, only: quoted
   implicit none
   private
   public :: write_outline

   character(len=1), parameter :: newline = achar(10)

contains

   !> Collective: write `<directory>/outline_<tool>_<step>.dat`, if there are points. All ranks return with
   !> the same error (exit_files).
   subroutine write_outline(communicator, directory, tool, title, time, step, outline, error)
      type(communicator_t), intent(in) :: communicator
      character(len=*), intent(in) :: directory, tool, title
      real(wp), intent(in) :: time !< s
      integer, intent(in) :: step
      real(wp), intent(in) :: outline(:, :) !< (3, points), m, the same on all ranks
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: path
      character(len=80) :: line
      type(text_file_t) :: file
      integer :: n
      if (size(outline, 2) == 0) return
      path = directory//'/outline_'//tool//'_'//step_digits(step)//'.dat'
      if (communicator%is_root()) then
         call file%open(path, error)
         call file%put('TITLE='//quoted(title)//newline//'VARIABLES="X(m)", "Y(m)", "Z(m)"'//newline// &
                       'ZONE T='//quoted('contact of '//tool)//', STRANDID=1, SOLUTIONTIME='// &
                       exact_text(time)//', I=1, J='//to_text(size(outline, 2))//', K=1, DATAPACKING=POINT', &
                       error)
         do n = 1, size(outline, 2)
            write (line, '(3(1x,es24.16e3))') outline(:, n)
            call file%put(trim(line), error)
         end do
         call file%close(error)
         call publish_part(path, error)
      end if
      call communicator%agree(error)
   end subroutine write_outline

end module m_outline_file
