!> Number of grains of a polycrystal that have particles, for the introduction of a run.
module m_grain_report
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_text, only: to_text
   use m_scene, only: scene_t
   use m_model, only: model_t
   use m_console, only: console_t
   use m_grains, only: grains_t
   implicit none
   private
   public :: introduce_grains

   real(wp), parameter :: few = 0.5_wp !< share of the grains below which most are absent

contains

   !> Collective: grains with particles, of all grains, and particles without a grain.
   subroutine introduce_grains(console, scene, model)
      type(console_t), intent(inout) :: console
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      character(len=:), allocatable :: text
      logical, allocatable :: present_here(:)
      integer :: e, column, present_ones
      integer(i8) :: without
      if (model%time > 0.0_wp) return
      do e = 1, size(model%effects)
         select type (effect => model%effects(e)%effect)
         class is (grains_t)
            allocate (present_here(effect%count), source=.false.)
            column = model%levels(1)%table%column('grain')
            without = 0
            call count_grains(model, column, present_here, without)
            without = model%communicator%sum_count(without)
            call MPI_Allreduce(MPI_IN_PLACE, present_here, size(present_here), MPI_LOGICAL, MPI_LOR, &
                               model%communicator%comm)
            present_ones = count(present_here)
            text = to_text(present_ones)//' of '//to_text(effect%count)//' are present, '// &
                   to_text(without)//' particles are in none'
            call console%line('grains     '//text)
            if (present_ones < few*effect%count) &
               call console%line('warning    most grains are absent; check that their positions are in m '// &
                  'and inside the body')
            deallocate (present_here)
         end select
      end do
   end subroutine introduce_grains

   subroutine count_grains(model, column, present_here, without)
      type(model_t), intent(in) :: model
      integer, intent(in) :: column
      logical, intent(inout) :: present_here(:)
      integer(i8), intent(inout) :: without
      integer :: l, b, p, grain
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (particles => model%levels(l)%blocks(b)%particles)
               do p = 1, particles%count
                  grain = nint(particles%column(p, column))
                  if (grain > 0) present_here(grain) = .true.
                  if (grain == 0) without = without + 1
               end do
            end associate
         end do
      end do
   end subroutine count_grains

end module m_grain_report
