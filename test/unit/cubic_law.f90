!test: ranks 1 2
!> A law that is not isotropic, has no Young's modulus, and goes on while nothing moves: what the model asks
!> of a law is asked of the law.
module m_made_cubic
   use m_kinds, only: wp
   use m_field_table, only: field_table_t, layout_t
   use m_group_reader, only: group_reader_t
   use m_material, only: material_t
   implicit none
   private
   public :: cubic_t

   !> A crystal of cubic symmetry along the grid, for small turns, that has something in it which decays.
   type, extends(material_t) :: cubic_t
      real(wp) :: c11 = 2.0e6_wp, c12 = 1.2e6_wp, c44 = 1.5e6_wp !< Pa
      real(wp) :: rate = 0.0_wp   !< of the decay, 1/s; below a hundredth nothing is left
      logical :: tells = .true.   !< that it goes on
      integer :: excess = 0       !< column of what decays
   contains
      procedure :: variables
      procedure :: declare
      procedure :: initial
      procedure :: is_at_rest
      procedure :: p_wave_modulus
      procedure :: complementary_energy
      procedure :: update
      procedure :: strain_energy
      procedure :: stretch
   end type cubic_t

contains

   !> No scene calls for it by name.
   subroutine variables(self, group)
      class(cubic_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
   end subroutine variables

   pure subroutine declare(self, table, has_tools)
      class(cubic_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      logical, intent(in) :: has_tools
      call table%declare('excess', 1, '1', written=.true.)
      self%excess = table%column('excess')
   end subroutine declare

   pure subroutine initial(self, column, layout, first, last)
      class(cubic_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      column(first:last, self%excess) = 1.0_wp
   end subroutine initial

   pure logical function is_at_rest(self, column, layout, first, last)
      class(cubic_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      is_at_rest = .not. (self%tells .and. any(column(first:last, self%excess) > 0.0_wp))
   end function is_at_rest

   !> Along the diagonal of a cube where that is the stiffest way.
   pure real(wp) function p_wave_modulus(self)
      class(cubic_t), intent(in) :: self
      p_wave_modulus = max(self%c11, (self%c11 + 2.0_wp*self%c12 + 4.0_wp*self%c44)/3.0_wp)
   end function p_wave_modulus

   pure real(wp) function complementary_energy(self, stress) result(energy)
      class(cubic_t), intent(in) :: self
      real(wp), intent(in) :: stress(6)
      energy = 0.5_wp*(dot_product(stress(1:3), strain_of(self, stress)) + sum(stress(4:6)**2)/self%c44)
   end function complementary_energy

   !> xx yy zz of the elastic strain.
   pure function strain_of(self, stress) result(strain)
      class(cubic_t), intent(in) :: self
      real(wp), intent(in) :: stress(6)
      real(wp) :: strain(3)
      strain = (stress(1:3) - self%c12/(self%c11 + 2.0_wp*self%c12)*sum(stress(1:3)))/(self%c11 - self%c12)
   end function strain_of

   pure subroutine update(self, column, layout, gradient, time_step, first, last)
      class(cubic_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      real(wp) :: along(3), across(3)
      integer :: p
      do p = first, last
         along = time_step*gradient(p, 1:9:4)
         across = time_step*[gradient(p, 6) + gradient(p, 8), gradient(p, 3) + gradient(p, 7), &
                             gradient(p, 2) + gradient(p, 4)]
         associate (stress => column(p, layout%stress:layout%stress + 5), excess => column(p, self%excess))
            stress(1:3) = stress(1:3) + (self%c11 - self%c12)*along + self%c12*sum(along)
            stress(4:6) = stress(4:6) + self%c44*across
            excess = merge(excess*(1.0_wp - self%rate*time_step), 0.0_wp, excess > 0.01_wp)
         end associate
      end do
   end subroutine update

   pure real(wp) function strain_energy(self, column, layout, first, last) result(energy)
      class(cubic_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      integer :: p
      energy = 0.0_wp
      do p = first, last
         energy = energy + column(p, layout%volume) &
                  *self%complementary_energy(column(p, layout%stress:layout%stress + 5))
      end do
   end function strain_energy

   pure real(wp) function stretch(self, values, layout, direction)
      class(cubic_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: direction(3)
      stretch = 1.0_wp + sum(direction**2*strain_of(self, values(layout%stress:layout%stress + 5)))
   end function stretch

end module m_made_cubic

program cubic_law
   use m_kinds, only: wp
   use m_constants, only: pi
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_box, only: box_t
   use m_scene, only: scene_t
   use m_made_cubic, only: cubic_t
   use m_model, only: model_t
   use m_advance, only: advance
   use m_speed_bounds, only: bound_speeds
   use m_energy, only: balance_t
   use m_indicators, only: stress_error_t, estimate_stress_error
   use m_assertions, only: assertions_t
   use m_chance, only: say
   implicit none
   real(wp), parameter :: cell = 0.1_wp, density = 1000.0_wp
   type(communicator_t) :: comm
   type(assertions_t) :: test
   call comm%start()
   call test%start(comm, 'cubic_law')
   call decay(tells=.true.)
   call decay(tells=.false.)
   call vibration()
   call test%finish()

contains

   !> A free block of 2 x 2 x 10 cells over two blocks of nodes.
   subroutine build(law, model)
      type(cubic_t), intent(in) :: law
      type(model_t), intent(inout) :: model
      type(scene_t) :: scene
      type(error_t) :: error
      scene%title = 'block'
      scene%time%affine = .false.
      scene%grid%cells = [8, 8, 16]
      scene%grid%upper = [8, 8, 16]*cell
      scene%grid%cell_size = cell
      allocate (scene%materials(1), scene%bodies(1), scene%tools(0), scene%probes(0))
      scene%materials(1)%name = 'crystal'
      scene%materials(1)%density = density
      allocate (scene%materials(1)%law, source=law)
      scene%bodies(1)%name = 'block'
      scene%bodies(1)%material = 1
      scene%bodies(1)%shape = box_t(lower=3*cell, upper=[5, 5, 13]*cell)
      call model%build(comm, scene, error)
      call test%check(.not. error%happened(), 'a model is built')
      call bound_speeds(model)
   end subroutine build

   !> At rest a law that goes on goes on, until it says that it is at rest; one that does not say so is left
   !> out.
   subroutine decay(tells)
      logical, intent(in) :: tells
      type(model_t) :: model
      type(error_t) :: error
      real(wp), parameter :: step = 1.0e-4_wp, rate = 1000.0_wp
      real(wp) :: expected, off
      integer :: n, b
      call build(cubic_t(rate=rate, tells=tells), model)
      expected = 1.0_wp
      do n = 1, 60
         call advance(model, step, error)
         expected = merge(expected*(1.0_wp - rate*step), 0.0_wp, expected > 0.01_wp)
         if (n /= 30 .and. n /= 60) cycle
         off = 0.0_wp
         do b = 1, size(model%levels(1)%blocks)
            associate (particles => model%levels(1)%blocks(b)%particles, &
                       x => model%levels(1)%table%column('excess'))
               if (particles%count > 0) &
                  off = max(off, maxval(abs(particles%column(:particles%count, x) - expected)))
            end associate
         end do
         off = comm%maximum(off)
         if (tells) call test%check_close(off, 0.0_wp, 1.0e-13_wp, 'what goes on at rest goes on')
         if (.not. tells) call test%check(off > 0.5_wp, 'what does not say so is left out')
      end do
      call test%check(.not. error%happened(), 'runs')
      call test%check(comm%sum_count(model%particle_steps_at_rest) > 0, 'at last nothing is done')
      call model%release()
   end subroutine decay

   !> Half a period of the first mode of a free bar along an edge of the crystal's cube, by Young's modulus in
   !> that direction. The speed of sound is the law's, and the estimate of the stress error takes the law's
   !> energy.
   subroutine vibration()
      type(model_t) :: model
      type(error_t) :: error
      type(balance_t) :: balance
      type(stress_error_t) :: estimate
      integer, parameter :: steps = 150
      ! (c11 - c12)(c11 + 2 c12)/(c11 + c12)
      real(wp), parameter :: length = 10.0_wp*cell, young = 0.8e6_wp*4.4e6_wp/3.2e6_wp
      real(wp) :: fastest, back
      integer :: n, b, p
      call build(cubic_t(), model)
      fastest = sqrt((2.0e6_wp + 2.4e6_wp + 6.0e6_wp)/3.0_wp/density)
      call test%check_close(comm%maximum(model%bounds%wave_speed), fastest, 1.0e-10_wp, &
                            'the fastest wave goes along the diagonal')
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, at => model%levels(1)%layout)
            do p = 1, particles%count
               particles%column(p, at%velocity + 2) = 0.01_wp*mode(particles%column(p, at%position + 2))
            end do
         end associate
      end do
      call balance%begin(model)
      do n = 1, steps
         call advance(model, length/sqrt(young/density)/steps, error)
         if (n == steps/2) call balance%follow(model)
         if (n == steps/2) call estimate_stress_error(model, estimate)
      end do
      call test%check(.not. error%happened(), 'vibrates')
      back = moves(model)
      if (comm%is_root()) call say('after half a period: velocity over that of the start', back)
      call test%check_close(back, -1.0_wp, 0.05_wp, 'half a period')
      call test%check(balance%now%strain > 0.9_wp*balance%start%energy(), &
                      'after a quarter all energy is elastic')
      call test%check_close(estimate%energy, balance%now%strain, 1.0e-10_wp*balance%start%energy(), &
                            'the estimate takes the law''s energy')
      call model%release()
   end subroutine vibration

   pure real(wp) function mode(z)
      real(wp), intent(in) :: z
      mode = sin(pi*(z/cell - 8.0_wp)/10.0_wp)
   end function mode

   !> How much of the mode is in the velocities of all particles, in that of the start.
   real(wp) function moves(model)
      type(model_t), intent(in) :: model
      real(wp) :: sums(2)
      integer :: b, p
      sums = 0.0_wp
      do b = 1, size(model%levels(1)%blocks)
         associate (particles => model%levels(1)%blocks(b)%particles, at => model%levels(1)%layout)
            do p = 1, particles%count
               sums = sums + [particles%column(p, at%velocity + 2)/0.01_wp, &
                              mode(particles%column(p, at%position + 2))] &
                      *mode(particles%column(p, at%position + 2))
            end do
         end associate
      end do
      moves = comm%sum_real(sums(1))/comm%sum_real(sums(2))
   end function moves

end program cubic_law
