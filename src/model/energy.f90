!> Sums over the whole model: energies, momentum, mass, and the energy balance.
module m_energy
   use mpi_f08
   use m_kinds, only: wp
   use m_block, only: sum_count
   use m_inner_motion, only: inner_motion
   use m_effect_step, only: kinds_booked
   use m_model, only: model_t
   implicit none
   private
   public :: sums_t, balance_t, measure, take_sums

   !> Sums over all particles of all ranks; the same bits on any number of ranks.
   type :: sums_t
      real(wp) :: mass = 0.0_wp               !< kg
      real(wp) :: kinetic = 0.0_wp            !< including the motion within particles by their gradients, J
      real(wp) :: strain = 0.0_wp             !< including the energy of the contact compliance below the
                                              !< cells, J
      real(wp) :: plastic = 0.0_wp            !< plastic work since the start, J
      real(wp) :: momentum(3) = 0.0_wp        !< kg m/s
      real(wp) :: angular_momentum(3) = 0.0_wp !< including the motion within particles, kg m2/s about the
                                               !< origin
      real(wp) :: dissipated = 0.0_wp         !< by effects, taken from particles since the start, J
      real(wp) :: potential = 0.0_wp          !< in the fields of effects, J
   contains
      procedure :: energy
   end type sums_t

   !> Sources and sinks of energy since the start.
   type :: balance_t
      type(sums_t) :: start, now
      real(wp) :: external_work = 0.0_wp      !< done by tools and effects, J
      real(wp) :: damped = 0.0_wp !< dissipated by effects, friction and the merging of particles, J
      real(wp) :: driven = 0.0_wp !< net energy supplied by effects that should dissipate, J
      real(wp) :: largest = 0.0_wp            !< largest energy or work so far, J: reference of the error
      real(wp) :: worst = 0.0_wp              !< largest error so far, J
      real(wp) :: effects_apart = 0.0_wp !< work of effects by the nodes' motion, minus that by the
                                         !< particles', J
      real(wp) :: tools_apart = 0.0_wp        !< the same for tools, by their own motion, J
      real(wp) :: worst_of_effects = 0.0_wp, worst_of_tools = 0.0_wp !< largest magnitude of these so far, J
   contains
      procedure :: begin
      procedure :: follow
      procedure :: glance
      procedure :: particle_work
      procedure, private :: take
      procedure :: error
      procedure :: excess
   end type balance_t

contains

   !> Collective: the sums of a model. Block by block, then over blocks by their index, so that neither the
   !> number of ranks nor the order of arrival matters (adding the zeros of other ranks changes no bit).
   function measure(model) result(sums)
      type(model_t), intent(in) :: model
      type(sums_t) :: sums
      real(wp), allocatable :: parts(:, :) ! of every block that exists, on any rank
      real(wp) :: total(sum_count)
      integer :: b, index, l, n
      allocate (parts(sum_count, sum([(count(model%levels(l)%owner >= 0), l=1, size(model%levels))])), &
                source=0.0_wp)
      n = 0
      do l = 1, size(model%levels)
         associate (level => model%levels(l))
            do index = 1, size(level%owner)
               if (level%owner(index) < 0) cycle
               n = n + 1
               b = level%slot(index)
               if (b == 0 .or. b > size(level%blocks)) cycle ! on another rank
               parts(:, n) = level%blocks(b)%sums
               if (.not. level%blocks(b)%sums_hold()) parts(:, n) = block_sums(model, l, b)
            end do
         end associate
      end do
      call MPI_Allreduce(MPI_IN_PLACE, parts, size(parts), MPI_DOUBLE_PRECISION, MPI_SUM, &
                         model%communicator%comm)
      total = 0.0_wp
      do b = 1, size(parts, 2)
         total = total + parts(:, b)
      end do
      associate (states => model%contact%states)
         if (size(states) > 0) total(3) = total(3) + sum(states%stored + states%stored_shear)
      end associate
      associate (pairs => model%contact%pairs%states)
         if (size(pairs) > 0) total(3) = total(3) + sum(pairs%stored + pairs%stored_shear)
      end associate
      if (allocated(model%atoms)) total(:10) = total(:10) + [model%atoms%sums%mass, &
                  model%atoms%sums%kinetic, model%atoms%sums%potential, 0.0_wp, model%atoms%sums%momentum, &
                  model%atoms%sums%angular_momentum]
      sums = sums_t(mass=total(1), kinetic=total(2), strain=total(3), plastic=total(4), momentum=total(5:7), &
                    angular_momentum=total(8:10), dissipated=total(11), potential=total(12))
   end function measure

   !> Compute the sums of one block in advance.
   subroutine take_sums(model, l, b)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b
      model%levels(l)%blocks(b)%sums = block_sums(model, l, b)
      model%levels(l)%blocks(b)%sums_of = model%levels(l)%blocks(b)%particles%state()
   end subroutine take_sums

   !> Kinetic energy, strain energy and plastic work together, J.
   pure real(wp) function energy(self)
      class(sums_t), intent(in) :: self
      energy = self%kinetic + self%strain + self%plastic
   end function energy

   !> Mass, kinetic energy, strain energy, plastic work, momentum, angular momentum of one block, the energy
   !> dissipated by effects, and the potential energy in their fields.
   pure function block_sums(model, l, b) result(sums)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      real(wp) :: sums(sum_count), kinetic, angular(3)
      integer :: first, last, m, steps(size(model%levels))
      steps = model%steps_of_levels()
      associate (particles => model%levels(l)%blocks(b)%particles, at => model%levels(l)%layout)
         sums = 0.0_wp
         if (particles%count == 0) return
         call moments(particles%count, particles%column(:, at%position:at%position + 2), &
                      particles%column(:, at%velocity:at%velocity + 2), particles%column(:, at%mass), sums)
         call inner_motion(particles%column, 1, particles%count, at, kinetic, angular)
         sums(2) = sums(2) + kinetic
         sums(8:10) = sums(8:10) + angular
         if (at%section%is_round()) sums([5, 8, 9, 10]) = 0.0_wp ! they vanish around the full ring
         if (.not. model%has_inertia) sums([2, 5, 6, 7, 8, 9, 10]) = 0.0_wp
         first = 1
         do while (first <= particles%count)
            last = particles%run_end(first)
            m = model%materials%of_body(particles%body(first))
            sums(3) = sums(3) + model%materials%slots(m)%law%strain_energy(particles%column, at, first, last)
            sums(4) = sums(4) + model%materials%slots(m)%law%plastic_energy(particles%column, first, last)
            first = last + 1
         end do
         do m = 1, size(model%effects)
            sums(11) = sums(11) + model%effects(m)%effect%dissipated(particles%column, 1, particles%count)
            sums(12) = sums(12) + model%effects(m)%effect%potential(particles%column, at, 1, &
                  particles%count, &
                                                                     0.5_wp*model%last_step/steps(l))
         end do
      end associate
   end function block_sums

   !> The parts of block_sums that depend on the particles' velocities; energies of laws are not changed.
   pure subroutine moments(count, x, v, m, sums)
      integer, intent(in) :: count
      real(wp), intent(in), contiguous :: x(:, :), v(:, :), m(:)
      real(wp), intent(inout) :: sums(sum_count)
      real(wp) :: mass, kinetic, px, py, pz, lx, ly, lz
      integer :: p
      mass = 0.0_wp; kinetic = 0.0_wp
      px = 0.0_wp; py = 0.0_wp; pz = 0.0_wp
      lx = 0.0_wp; ly = 0.0_wp; lz = 0.0_wp
      !$omp simd reduction(+: mass, kinetic, px, py, pz, lx, ly, lz)
      do p = 1, count
         mass = mass + m(p)
         kinetic = kinetic + m(p)*(v(p, 1)**2 + v(p, 2)**2 + v(p, 3)**2)
         px = px + m(p)*v(p, 1)
         py = py + m(p)*v(p, 2)
         pz = pz + m(p)*v(p, 3)
         lx = lx + m(p)*(x(p, 2)*v(p, 3) - x(p, 3)*v(p, 2))
         ly = ly + m(p)*(x(p, 3)*v(p, 1) - x(p, 1)*v(p, 3))
         lz = lz + m(p)*(x(p, 1)*v(p, 2) - x(p, 2)*v(p, 1))
      end do
      sums(1) = mass
      sums(2) = 0.5_wp*kinetic
      sums(5:10) = [px, py, pz, lx, ly, lz]
   end subroutine moments

   !> Collective: initialise the balance.
   subroutine begin(self, model)
      class(balance_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      self%start = measure(model)
      self%now = self%start
      self%largest = self%start%energy()
   end subroutine begin

   !> Collective: update the balance to the model's present state.
   subroutine follow(self, model)
      class(balance_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      real(wp) :: accumulated(kinds_booked + 1)
      self%now = measure(model)
      call model%reduce_accumulated()
      accumulated = 0.0_wp
      accumulated(3) = -sum(model%effect_step%ahead_work)
      call self%take(model, accumulated)
   end subroutine follow

   !> Collective: the balance that `follow` would give, without any change of the model or of accumulated
   !> values. The last bits of the sums depend on the number of ranks.
   type(balance_t) function glance(self, model) result(seen)
      class(balance_t), intent(in) :: self
      type(model_t), intent(in) :: model
      real(wp) :: accumulated(kinds_booked + 1)
      integer :: b, l
      seen = self
      seen%now = measure(model)
      accumulated = 0.0_wp
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            accumulated(:kinds_booked) = accumulated(:kinds_booked) &
                                    + model%effect_step(l)%accumulated(model%levels(l)%blocks(b)%index)
            accumulated(3) = accumulated(3) - model%effect_step(l)%work_ahead(model%levels(l)%blocks(b)%index)
         end do
      end do
      accumulated(kinds_booked + 1) = sum(model%lost_in_merging)
      call MPI_Allreduce(MPI_IN_PLACE, accumulated, size(accumulated), MPI_DOUBLE_PRECISION, MPI_SUM, &
                         model%communicator%comm)
      call seen%take(model, accumulated)
   end function glance

   !> The balance from the present sums, and the accumulated values: totals up to the last reduction, and
   !> those since then.
   pure subroutine take(self, model, accumulated)
      class(balance_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: accumulated(:) !< J: effect_step%accumulated minus the part ahead of velocities;
                                             !< lost in merging
      real(wp) :: by_effects, taken
      by_effects = sum(model%effect_step%external_work) + accumulated(1)
      taken = sum(model%effect_step%damped) - accumulated(2)
      self%external_work = sum(model%contact%states%work) + sum(model%contact%pairs%states%pressed) &
                           + by_effects + model%static_losses%in_flow
      if (allocated(model%atoms)) self%external_work = self%external_work + model%atoms%tool_work &
                                                       - model%atoms%tool_work_in_balance
      self%damped = taken + self%now%dissipated + sum(model%contact%states%heat) &
                    + sum(model%contact%pairs%states%heat) + model%contact%relaxed() &
                    + sum(model%contact%pairs%states%parting) + model%lost + accumulated(4) &
                    + model%static_losses%total()
      if (allocated(model%atoms)) self%damped = self%damped + model%atoms%sums%taken
      associate (states => model%contact%states)
         if (model%contact%followed) self%tools_apart = sum(states%work - states%heat - states%stored &
                                              - states%stored_shear - states%relaxed - states%particle_work)
      end associate
      if (allocated(model%atoms)) self%tools_apart = self%tools_apart - model%atoms%tool_work_in_balance
      self%driven = max(0.0_wp, -taken)
      self%largest = max(self%largest, abs(self%external_work), abs(self%damped), self%now%energy())
      self%worst = max(self%worst, abs(self%excess()))
      if (all(model%effect_step%follows_particles)) &
         self%effects_apart = by_effects - (self%start%potential - self%now%potential) &
                              - sum(model%effect_step%particle_work) - accumulated(3)
      self%worst_of_effects = max(self%worst_of_effects, abs(self%effects_apart))
      self%worst_of_tools = max(self%worst_of_tools, abs(self%tools_apart))
   end subroutine take

   !> External work by the motion of the particles, J; for effects that do not provide it, the accumulated
   !> work.
   pure real(wp) function particle_work(self) result(work)
      class(balance_t), intent(in) :: self
      work = self%external_work - self%effects_apart - self%tools_apart
   end function particle_work

   !> Spurious energy (above 0) or missing energy, J.
   pure real(wp) function excess(self)
      class(balance_t), intent(in) :: self
      excess = self%now%energy() - self%start%energy() - self%external_work + self%damped + self%driven
   end function excess

   !> The same relative to the largest energy or work so far.
   pure real(wp) function error(self)
      class(balance_t), intent(in) :: self
      error = 0.0_wp
      if (self%largest > 0.0_wp) error = self%excess()/self%largest
   end function error

end module m_energy
