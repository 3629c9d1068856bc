!> Particles under a trial displacement: they are not changed; the gradient of the displacement, the stress of
!> their law from the beginning of the step, and the tangent are stored separately (theory.md, eq.
!> static-residual).
module m_trial_state
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use, intrinsic :: iso_fortran_env, only: real32
   use m_kinds, only: wp
   use m_vectors, only: cross
   use m_field_table, only: layout_t
   use m_particle_store, only: particle_store_t
   use m_level, only: level_t
   use m_scene_materials, only: materials_t
   use m_closed_tangent, only: closed_tangent, pull_back
   implicit none
   private
   public :: trial_block_t, trial_status_t, relaxation, part_of_gradient, sum_of_squares, squares_of_section

   integer, parameter :: lanes = 64 !< particles at once: their columns stay in the first-level cache
   integer, parameter :: flow_parts = 8 !< parts of a step at whose midpoints the stress of flowing material
                                        !< is evaluated
   real(wp), parameter :: difference = 1.0e-7_wp !< of a component of the gradient

   !> Trial state of one block's particles.
   type :: trial_block_t
      logical :: flat = .false. !< of a section: no motion or change along y, except for the hoop
      integer :: parts = 1 !< number of parts of a step for the laws: creep is integrated implicitly
      logical :: mean = .false. !< for material that may flow the force is twice the mean over the step, minus
                                !< that of the beginning (eq. mean-force)
      real(wp), allocatable :: gradient(:, :) !< (:, 9): A = du/dX, component ij at 3 (j-1) + i; after the
                                              !< first product that of the product's displacements
      real(wp), allocatable :: force(:, :)    !< (:, 9): minus volume times the first Piola-Kirchhoff stress
                                              !< with respect to the beginning of the step, N m
      real(wp), allocatable :: acting(:, :)   !< (:, 9): the part of it that acts on nodes, with means over
                                              !< cells; or the corresponding part of a product
      real(wp), allocatable :: value(:)       !< values averaged over cells; where means are taken
      integer, allocatable :: cell(:)         !< tile index of a particle's cell; likewise
      real(real32), allocatable :: tangent(:, :, :) !< (lanes, 81, :): its derivative, d ij/d kl at 9 (kl-1) +
                                                    !< ij, opposite sign, J, of groups of particles. Single
                                                    !< precision is enough for Newton's method, and products
                                                    !< are limited by memory bandwidth
   contains
      procedure :: fit
      procedure :: update
      procedure :: work_in_flow
      procedure :: linearise
      procedure :: multiply
      procedure :: diagonal
   end type trial_block_t

   !> Status of a trial state; on one rank.
   type :: trial_status_t
      real(wp) :: smallest = huge(1.0_wp)  !< determinant of I + A
      real(wp) :: largest = 0.0_wp         !< component of A, size
      integer :: block = 0, particle = 0   !< of the smallest determinant
      integer :: level = 0                 !< likewise, set by the caller where it is 0
      logical :: finite = .true.           !< all stresses are finite
      logical :: too_long = .false.        !< a law requests a smaller step
   end type trial_status_t

contains

   !> Allocate data for a number of particles; `tangents`: their tangents too.
   subroutine fit(self, count, tangents)
      class(trial_block_t), intent(inout) :: self
      integer, intent(in) :: count
      logical, intent(in) :: tangents
      if (allocated(self%gradient)) then
         if (size(self%gradient, 1) < count) deallocate (self%gradient, self%force, self%acting)
      end if
      if (.not. allocated(self%gradient)) allocate (self%gradient(count, 9), self%force(count, 9), &
                                                    self%acting(count, 9))
      if (.not. tangents) return
      if (allocated(self%tangent)) then
         if (lanes*size(self%tangent, 3) < count) deallocate (self%tangent)
      end if
      if (allocated(self%tangent)) return
      allocate (self%tangent(lanes, 81, group_of(size(self%gradient, 1))), source=0.0_real32)
   end subroutine fit

   !> The group of lanes of a particle.
   pure integer function group_of(particle)
      integer, intent(in) :: particle
      group_of = (particle + lanes - 1)/lanes
   end function group_of

   !> The stress of all particles for the present gradient.
   subroutine update(self, particles, materials, layout, time_step, trial_status, b)
      class(trial_block_t), intent(inout) :: self
      type(particle_store_t), intent(in) :: particles
      type(materials_t), intent(in) :: materials
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time_step !< s
      type(trial_status_t), intent(inout) :: trial_status
      integer, intent(in) :: b !< number of the block, for the status
      real(wp) :: determinant(lanes)
      integer :: first, last, n, run
      first = 1
      do while (first <= particles%count)
         run = particles%run_end(first)
         do while (first <= run)
            last = min(first + lanes - 1, run)
            n = last - first + 1
            call force_of(self, particles, materials, layout, time_step, first, n, &
                          self%gradient(first:last, :), self%force(first:last, :), determinant, &
                          trial_status%too_long)
            trial_status%largest = max(trial_status%largest, maxval(abs(self%gradient(first:last, :))))
            if (.not. all(ieee_is_finite(self%force(first:last, :)))) trial_status%finite = .false.
            if (.not. minval(determinant(:n)) >= trial_status%smallest) then
               trial_status%smallest = minval(determinant(:n))
               trial_status%block = b
               trial_status%level = 0
               trial_status%particle = first - 1 + minloc(determinant(:n), dim=1)
            end if
            first = last + 1
         end do
      end do
   end subroutine update

   !> Work of the stress of material that may flow as the gradient grows linearly to its present value, minus
   !> that of the mean of the stresses at both ends, J: the stress first rises, and then is constant where the
   !> material flows.
   real(wp) function work_in_flow(self, particles, materials, layout, time_step) result(work)
      class(trial_block_t), intent(in) :: self
      type(particle_store_t), intent(in) :: particles
      type(materials_t), intent(in) :: materials
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time_step !< s
      real(wp) :: mean(lanes, 9), before(lanes, 9)
      integer :: first, last, n
      work = 0.0_wp
      first = 1
      do while (first <= particles%count)
         last = min(first + lanes - 1, particles%run_end(first))
         n = last - first + 1
         associate (a => self%gradient(first:last, :), &
                    law => materials%slots(materials%of_body(particles%body(first)))%law)
            if (law%may_flow()) then
               call mean_force(self%parts, particles, materials, layout, time_step, first, n, a, mean(:n, :))
               call force_before(particles, layout, first, n, before(:n, :))
               work = work + sum((0.5_wp*(self%force(first:last, :) + before(:n, :)) - mean(:n, :))*a)
            end if
         end associate
         first = last + 1
      end do
   end function work_in_flow

   !> Minus V P as stress_of, or its equivalent in a step whose forces are means over the step.
   subroutine force_of(self, particles, materials, layout, time_step, first, n, gradient, force, &
                       determinant, too_long)
      class(trial_block_t), intent(in) :: self
      type(particle_store_t), intent(in) :: particles
      type(materials_t), intent(in) :: materials
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, n
      real(wp), intent(in) :: gradient(:, :) !< (n, 9)
      real(wp), intent(out) :: force(:, :)   !< (n, 9)
      real(wp), intent(out) :: determinant(:)
      logical, intent(inout) :: too_long     !< true where the law requests a smaller step
      real(wp) :: before(n, 9)
      call stress_of(self%parts, particles, materials, layout, time_step, first, n, gradient, force, &
                     determinant, too_long)
      if (.not. self%mean) return
      associate (law => materials%slots(materials%of_body(particles%body(first)))%law)
         if (.not. law%may_flow()) return
      end associate
      call mean_force(self%parts, particles, materials, layout, time_step, first, n, gradient, force)
      call force_before(particles, layout, first, n, before)
      force = 2.0_wp*force - before
   end subroutine force_of

   !> Mean of minus V P as the gradient grows linearly: over the midpoints of equal parts.
   subroutine mean_force(parts, particles, materials, layout, time_step, first, n, gradient, mean)
      integer, intent(in) :: parts
      type(particle_store_t), intent(in) :: particles
      type(materials_t), intent(in) :: materials
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, n
      real(wp), intent(in) :: gradient(:, :) !< (n, 9)
      real(wp), intent(out) :: mean(:, :)    !< (n, 9)
      real(wp) :: force(n, 9), determinant(n), share
      integer :: k
      logical :: too_long
      too_long = .false. ! the whole step has been evaluated for this
      mean = 0.0_wp
      do k = 1, flow_parts
         share = (k - 0.5_wp)/flow_parts
         call stress_of(parts, particles, materials, layout, share*time_step, first, n, share*gradient, &
                        force, determinant, too_long)
         mean = mean + force/flow_parts
      end do
   end subroutine mean_force

   !> Minus V times the stress of the step's beginning.
   pure subroutine force_before(particles, layout, first, n, force)
      type(particle_store_t), intent(in) :: particles
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, n
      real(wp), intent(out) :: force(:, :) !< (n, 9)
      integer, parameter :: at(9) = [1, 6, 5, 6, 2, 4, 5, 4, 3]
      integer :: c
      associate (column => particles%column(first:first + n - 1, :))
         do c = 1, 9
            force(:, c) = -column(:, layout%volume)*column(:, layout%stress + at(c) - 1)
         end do
      end associate
   end subroutine force_before

   !> Derivative of the mean force: closed tangents along the way, where the law has them.
   subroutine mean_tangent(parts, particles, materials, layout, time_step, first, n, gradient, tangent, known)
      integer, intent(in) :: parts
      type(particle_store_t), intent(in) :: particles
      type(materials_t), intent(in) :: materials
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, n
      real(wp), intent(in) :: gradient(:, :)     !< (n, 9)
      real(wp), intent(inout) :: tangent(:, :)   !< (n, 81), of force_of
      logical, intent(out) :: known
      real(wp) :: near(n, 9), force(n, 9), determinant(n), part(n, 81), share
      integer :: k
      logical :: too_long
      too_long = .false.
      tangent = 0.0_wp
      do k = 1, flow_parts
         share = (k - 0.5_wp)/flow_parts
         near = share*gradient
         call stress_of(parts, particles, materials, layout, share*time_step, first, n, near, force, &
                        determinant, too_long)
         call closed_tangent(parts, particles, materials, layout, share*time_step, first, n, near, force, &
                             part, known)
         if (.not. known) return
         tangent = tangent + 2.0_wp*share/flow_parts*part
      end do
   end subroutine mean_tangent

   !> The tangents at the present gradient: in closed form, if the law has it, or by finite differences.
   subroutine linearise(self, particles, materials, layout, time_step)
      class(trial_block_t), intent(inout) :: self
      type(particle_store_t), intent(in) :: particles
      type(materials_t), intent(in) :: materials
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time_step !< s
      real(wp) :: near(lanes, 9), force(lanes, 9), determinant(lanes), tangent(lanes, 81)
      integer :: first, last, kl, lane, n, run
      logical :: known, too_long
      too_long = .false. ! unused here
      first = 1
      do while (first <= particles%count)
         run = particles%run_end(first)
         do while (first <= run)
            last = min(lanes*group_of(first), run)
            n = last - first + 1
            lane = first - lanes*(group_of(first) - 1)
            associate (law => materials%slots(materials%of_body(particles%body(first)))%law)
               if (self%mean .and. law%may_flow()) then
                  call mean_tangent(self%parts, particles, materials, layout, time_step, first, n, &
                                    self%gradient(first:last, :), tangent(:n, :), known)
               else
                  call closed_tangent(self%parts, particles, materials, layout, time_step, first, n, &
                                      self%gradient(first:last, :), self%force(first:last, :), &
                                      tangent(:n, :), known)
               end if
            end associate
            do kl = merge(10, 1, known), 9
               near(:n, :) = self%gradient(first:last, :)
               near(:n, kl) = near(:n, kl) + difference
               call force_of(self, particles, materials, layout, time_step, first, n, near(:n, :), &
                             force(:n, :), determinant, too_long)
               tangent(:n, 9*kl - 8:9*kl) = (self%force(first:last, :) - force(:n, :))/difference
            end do
            self%tangent(lane:lane + n - 1, :, group_of(first)) = real(tangent(:n, :), real32)
            first = last + 1
         end do
      end do
   end subroutine linearise

   !> Sum of squares of forces, over the volumes of their particles.
   pure real(wp) function sum_of_squares(force, volume) result(squares)
      real(wp), intent(in) :: force(:, :), volume(:) !< N m; m3
      integer :: c
      squares = 0.0_wp
      do c = 1, 9
         squares = squares + sum(force(:, c)**2/volume)
      end do
   end function sum_of_squares

   !> The same for a block of a section, times the depth, N2.
   pure real(wp) function squares_of_section(force, level, b) result(squares)
      real(wp), intent(in) :: force(:, :) !< N m
      type(level_t), intent(in) :: level
      integer, intent(in) :: b
      associate (column => level%blocks(b)%particles%column, n => size(force, 1), at => level%layout)
         squares = sum_of_squares(force, column(:n, at%volume)/at%section%depth(column(:n, at%position)))
      end associate
   end function squares_of_section

   !> Change of the stress of particles at rest over a time, and its size: sums of squares over components and
   !> volumes, Pa2 m3.
   function relaxation(particles, materials, layout, time_step) result(sizes)
      type(particle_store_t), intent(in) :: particles
      type(materials_t), intent(in) :: materials
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time_step !< s
      real(wp) :: sizes(2)
      real(wp) :: still(lanes, 9), force(lanes, 9), determinant(lanes)
      integer, parameter :: at(9) = [1, 6, 5, 6, 2, 4, 5, 4, 3]
      integer :: c, first, last, n, run
      logical :: too_long
      too_long = .false. ! unused here
      sizes = 0.0_wp
      still = 0.0_wp
      first = 1
      do while (first <= particles%count)
         run = particles%run_end(first)
         do while (first <= run)
            last = min(first + lanes - 1, run)
            n = last - first + 1
            call stress_of(1, particles, materials, layout, time_step, first, n, still(:n, :), &
                           force(:n, :), determinant, too_long)
            associate (column => particles%column(first:last, :))
               do c = 1, 9
                  sizes(1) = sizes(1) + sum((force(:n, c) + column(:, layout%volume) &
                                             *column(:, layout%stress + at(c) - 1))**2 &
                                            /column(:, layout%volume))
                  sizes(2) = sizes(2) + sum(column(:, layout%volume)*column(:, layout%stress + at(c) - 1)**2)
               end do
            end associate
            first = last + 1
         end do
      end do
   end function relaxation

   !> Minus V P of `count` particles of one body from `first` on: P = sigma cof F, F = I + A. The law gets a
   !> copy of their columns.
   subroutine stress_of(parts, particles, materials, layout, time_step, first, count, gradient, force, &
                        determinant, too_long)
      integer, intent(in) :: parts
      type(particle_store_t), intent(in) :: particles
      type(materials_t), intent(in) :: materials
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, count
      real(wp), intent(in) :: gradient(:, :) !< (count, 9)
      real(wp), intent(out) :: force(:, :)   !< (count, 9)
      real(wp), intent(out) :: determinant(:)
      logical, intent(inout) :: too_long     !< true where the law requests a smaller step
      real(wp) :: column(count, size(particles%column, 2)), rate(count, 9)
      integer :: k
      column = particles%column(first:first + count - 1, :)
      associate (law => materials%slots(materials%of_body(particles%body(first)))%law)
         do k = 1, parts
            call part_of_gradient(count, gradient, k, parts, time_step, rate)
            call law%update(column, layout, rate, time_step/parts, 1, count)
            too_long = too_long .or. law%requests_cutback(column, 1, count)
         end do
      end associate
      call pull_back(count, gradient, particles%column(first:first + count - 1, layout%volume), &
                     column(:, layout%stress:layout%stress + 5), force, determinant)
   end subroutine stress_of

   !> Velocity gradient of the k-th of `parts` equal parts of a step, at the part's beginning, for a
   !> displacement that grows linearly: A (I + (k-1)/parts A)^-1 over the step, 1/s.
   pure subroutine part_of_gradient(n, a, k, parts, time_step, rate)
      integer, intent(in) :: n, k, parts
      real(wp), intent(in) :: a(:, :)      !< (n or more, 9)
      real(wp), intent(in) :: time_step    !< s
      real(wp), intent(inout) :: rate(:, :) !< (n or more, 9)
      real(wp) :: f(3, 3), inverse(3, 3), s, determinant
      integer :: i, p
      if (k == 1) then
         rate(:n, :) = a(:n, :)/time_step
         return
      end if
      s = (k - 1.0_wp)/parts
      do p = 1, n
         f = s*reshape(a(p, :), [3, 3])
         do i = 1, 3
            f(i, i) = f(i, i) + 1.0_wp
         end do
         inverse(:, 1) = cross(f(:, 2), f(:, 3))
         inverse(:, 2) = cross(f(:, 3), f(:, 1))
         inverse(:, 3) = cross(f(:, 1), f(:, 2))
         determinant = dot_product(f(:, 1), inverse(:, 1))
         rate(p, :) = reshape(matmul(reshape(a(p, :), [3, 3]), transpose(inverse)), [9]) &
                       /(determinant*time_step)
      end do
   end subroutine part_of_gradient

   !> acting = tangent : gradient.
   pure subroutine multiply(self, count)
      class(trial_block_t), intent(inout) :: self
      integer, intent(in) :: count
      real(wp) :: acting(lanes, 9), gradient(lanes, 9)
      integer :: first, group, ij, kl, n, p, step
      gradient = 0.0_wp
      step = merge(2, 1, self%flat) ! even components have index 2, except 5, yy
      do group = 1, group_of(count)
         first = lanes*(group - 1)
         n = min(lanes, count - first)
         gradient(:n, :) = self%gradient(first + 1:first + n, :)
         acting = 0.0_wp
         do kl = 1, 9, step
            do ij = 1, 9, step
               !$omp simd
               do p = 1, lanes
                  acting(p, ij) = acting(p, ij) + self%tangent(p, 9*kl - 9 + ij, group)*gradient(p, kl)
               end do
            end do
         end do
         self%acting(first + 1:first + n, :) = acting(:n, :)
      end do
   end subroutine multiply

   !> Terms of the diagonal of the stiffness: d ab/d ad at 9 (a-1) + 3 (d-1) + b, J.
   pure subroutine diagonal(self, count, modulus)
      class(trial_block_t), intent(in) :: self
      integer, intent(in) :: count
      real(wp), intent(inout), contiguous :: modulus(:, :) !< (:, 27)
      integer :: a, b, d, first, group, n
      do group = 1, group_of(count)
         first = lanes*(group - 1)
         n = min(lanes, count - first)
         do a = 1, 3
            do d = 1, 3
               do b = 1, 3
                  modulus(first + 1:first + n, 9*a - 9 + 3*d - 3 + b) = &
                     self%tangent(:n, 9*(3*(d - 1) + a) - 9 + 3*(b - 1) + a, group)
               end do
            end do
         end do
      end do
   end subroutine diagonal

end module m_trial_state
