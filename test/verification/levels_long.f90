!> Nested levels: a bar rings for 10 000 coarse steps and 20 periods at least, beside the same on one level
!> (levels_waves has the short form). Its level 2 is over the middle third, level 3 in the middle of that.
!> Energy (the mean over a period) stays between 0.97 and 1.01 of that at the start for a bar of 60 cells, as
!> in one dimension (theory.md). A bar of 24 cells, and a cube of 12 with a cube of 8 in it, lose much of it
!> in so many periods on one level too; there nothing may be gained.
!test: long
!test: limit 900
program levels_long
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_scene, only: scene_t
   use m_assertions, only: assertions_t
   use m_nested
   implicit none
   integer, parameter :: steps = 10000
   type(communicator_t) :: comm
   type(assertions_t) :: test
   integer :: half
   call comm%start()
   call test%start(comm, 'levels_long')
   if (comm%is_root()) &
      print '(3x,a)', 'safety, periods, energy/start (last, lowest, highest mean, highest), momentum'
   do half = 1, 2
      call one(60, manner_t(levels=1), 0.25_wp*half)
      call one(60, manner_t(affine=.false., levels=1), 0.25_wp*half)
      call one(60, manner_t(), 0.25_wp*half)
      call one(60, manner_t(affine=.false.), 0.25_wp*half)
   end do
   call one(60, manner_t(subcycle=.false.), 0.5_wp)
   call one(24, manner_t(levels=1), 0.5_wp)
   call one(24, manner_t(), 0.5_wp)
   call one(24, manner_t(levels=3), 0.5_wp)
   call one(0, manner_t(levels=1), 0.5_wp)
   call one(0, manner_t(), 0.5_wp)
   call test%finish()

contains

   subroutine one(long, manner, safety)
      integer, intent(in) :: long !< cells of the bar; 0 is a cube
      type(manner_t), intent(in) :: manner
      real(wp), intent(in) :: safety
      type(ringing_t) :: ringing
      type(scene_t) :: scene
      character(len=:), allocatable :: name
      character(len=10) :: shape
      if (long > 0) scene = ringing_bar(manner, long)
      if (long == 0) scene = ringing_block(manner)
      ringing = ring(comm, scene, manner, safety, max(steps, nint(20.5_wp*2*long*wave/bar_wave/safety)) &
                     *merge(1, 2**(manner%levels - 1), manner%subcycle), long)
      write (shape, '(a,i3,a)') merge('bar  ', 'cube ', long > 0), merge(long, 12, long > 0), ', '
      name = shape//manner%text()
      if (comm%is_root()) then
         print '(6x,a,t60,f5.2,i5,4f9.5,2es9.1,i7,f7.1,a)', name, safety, ringing%periods, ringing%last, &
            ringing%lowest, ringing%highest, ringing%largest, ringing%momentum, ringing%mass, &
            ringing%particles, ringing%seconds, ' s'
         flush (6)
      end if
      call test%check(.not. ringing%failed, 'goes on, '//name)
      call test%check(ringing%highest < 1.01_wp, 'no more energy, '//name)
      if (long >= 60) &
         call test%check(ringing%lowest > 0.97_wp .or. manner%levels == 1, 'no less energy, '//name)
      call test%check_close(ringing%momentum, 0.0_wp, 1.0e-12_wp, 'momentum, '//name)
      call test%check_close(ringing%mass, 0.0_wp, 1.0e-14_wp, 'mass, '//name)
   end subroutine one

end program levels_long
