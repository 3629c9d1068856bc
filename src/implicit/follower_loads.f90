!> Loads that follow a surface within an implicit step: their forces under a trial displacement, and their
!> part of the stiffness (theory.md, eq. follower-load).
module m_follower_loads
   use m_kinds, only: wp
   use m_node_values, only: f_x, f_z
   use m_face_weights, only: face_weights_t, add_to_nodes
   use m_level, only: level_t
   use m_effect, only: effect_slot_t
   use m_effect_step, only: effect_step_t
   implicit none
   private
   public :: follower_loads_t

   !> A particle on whose face an effect acts.
   type :: follower_t
      integer :: effect = 0            !< its number
      integer :: particle = 0
      type(face_weights_t) :: face     !< of the step's beginning
      real(wp) :: before(3) = 0.0_wp   !< force without displacement, N
      real(wp) :: slopes(3, 9) = 0.0_wp !< derivative of the force by the displacement gradient, N
   end type follower_t

   !> Those of a block.
   type :: follower_loads_t
      private
      real(wp) :: time = 0.0_wp        !< s: of the step's end
      real(wp) :: share = 1.0_wp       !< of the loads that acts: below 1 while they are ramped
      type(follower_t), allocatable :: list(:)
   contains
      procedure :: find
      procedure :: add_changes
      procedure :: linearise
      procedure :: stiffness
      procedure :: multiply
   end type follower_loads_t

   real(wp), parameter :: difference = 1.0e-5_wp !< of a gradient component, for the slopes

contains

   !> List the loaded particles of a block at the step's beginning.
   subroutine find(self, effects, step, level, b, time, share)
      class(follower_loads_t), intent(inout) :: self
      type(effect_slot_t), intent(in) :: effects(:)
      type(effect_step_t), intent(in) :: step
      type(level_t), intent(in) :: level
      integer, intent(in) :: b         !< number of the block
      real(wp), intent(in) :: time     !< s: of the step's end
      real(wp), intent(in) :: share    !< of the loads that acts then
      integer, allocatable :: which(:)
      integer :: i, n
      if (allocated(self%list)) deallocate (self%list)
      allocate (self%list(0))
      if (.not. step%is_loaded(b)) return
      self%time = time
      self%share = share
      associate (block => level%blocks(b))
         do i = 1, size(step%add_forces)
            associate (effect => effects(step%add_forces(i))%effect)
               which = effect%pushed(block%particles)
               self%list = [self%list, [(one(which(n)), n=1, size(which))]]
            end associate
         end do
      end associate
   contains
      type(follower_t) function one(particle)
         integer, intent(in) :: particle
         one%effect = step%add_forces(i)
         one%particle = particle
         associate (effect => effects(one%effect)%effect, block => level%blocks(b))
            one%face = effect%face_of(block, particle, level%layout, level%grid)
            one%before = force_of(self, effects, one, block%particles%column(particle, :), &
                                  spread(0.0_wp, 1, 9))
         end associate
      end function one
   end subroutine find

   !> Force on a particle under a displacement gradient, N.
   pure function force_of(self, effects, follower, column, gradient) result(force)
      class(follower_loads_t), intent(in) :: self
      type(effect_slot_t), intent(in) :: effects(:)
      type(follower_t), intent(in) :: follower
      real(wp), intent(in) :: column(:), gradient(9)
      real(wp) :: force(3)
      force = self%share*effects(follower%effect)%effect%force_after(column, gradient, self%time)
   end function force_of

   !> Add the change of the forces by the present gradients to the forces on the nodes of the block.
   pure subroutine add_changes(self, effects, column, gradient, forces)
      class(follower_loads_t), intent(in) :: self
      type(effect_slot_t), intent(in) :: effects(:)
      real(wp), intent(in) :: column(:, :), gradient(:, :) !< (particles, :)
      real(wp), intent(inout), contiguous :: forces(:, 0:, 0:, 0:)
      integer :: n
      do n = 1, size(self%list)
         associate (it => self%list(n), p => self%list(n)%particle)
            call add_to_nodes(it%face, &
                              force_of(self, effects, it, column(p, :), gradient(p, :)) - it%before, &
                              forces(f_x:f_z, :, :, :))
         end associate
      end do
   end subroutine add_changes

   !> The slopes at the present gradients.
   pure subroutine linearise(self, effects, column, gradient)
      class(follower_loads_t), intent(inout) :: self
      type(effect_slot_t), intent(in) :: effects(:)
      real(wp), intent(in) :: column(:, :), gradient(:, :)
      real(wp) :: near(9, 2)
      integer :: c, n
      do n = 1, size(self%list)
         associate (it => self%list(n), p => self%list(n)%particle)
            do c = 1, 9
               near = spread(gradient(p, :), 2, 2)
               near(c, :) = near(c, :) + [-difference, difference]
               it%slopes(:, c) = (force_of(self, effects, it, column(p, :), near(:, 2)) &
                                  - force_of(self, effects, it, column(p, :), near(:, 1)))/(2.0_wp*difference)
            end do
         end associate
      end do
   end subroutine linearise

   !> The largest component of the slopes, N.
   pure real(wp) function stiffness(self)
      class(follower_loads_t), intent(in) :: self
      integer :: n
      stiffness = 0.0_wp
      do n = 1, size(self%list)
         stiffness = max(stiffness, maxval(abs(self%list(n)%slopes)))
      end do
   end function stiffness

   !> Add their stiffness times displacements, whose gradients are given, to the forces of a product.
   pure subroutine multiply(self, gradient, forces)
      class(follower_loads_t), intent(in) :: self
      real(wp), intent(in), contiguous :: gradient(:, :) !< (particles, 9)
      real(wp), intent(inout), contiguous :: forces(:, 0:, 0:, 0:)
      integer :: n
      do n = 1, size(self%list)
         associate (it => self%list(n))
            call add_to_nodes(it%face, -matmul(it%slopes, gradient(it%particle, :)), &
                              forces(f_x:f_z, :, :, :))
         end associate
      end do
   end subroutine multiply

end module m_follower_loads
