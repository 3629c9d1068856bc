!> Reactions of the tools: the contact forces on them in a step, summed over the candidates of all ranks, and
!> their work.
module m_tool_reactions
   use mpi_f08
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_tool, only: tool_t
   use m_level, only: level_t
   use m_vectors, only: cross
   use m_contact_point, only: candidate_t, drift_of, place_of, point_velocity, tool_velocity
   use m_candidates, only: candidates_t
   use m_section, only: section_t
   implicit none
   private
   public :: tool_state_t, reaction_t, accumulate_reactions, close_ring, add_particle_work, add_up

   !> Contact of one tool, over all ranks: in the last step, and since the start.
   type :: tool_state_t
      real(wp) :: load(3) = 0.0_wp      !< on the tool, N, for the modelled part of the body
      real(wp) :: moment(3) = 0.0_wp    !< on the tool about its point, N m, for the same part
      real(wp) :: overlap = 0.0_wp !< largest depth of a contact point inside the tool at the start of the
                                   !< step, m
      real(wp) :: work = 0.0_wp         !< done by the tool since the start, J
      real(wp) :: heat = 0.0_wp         !< friction heat since the start, J
      real(wp) :: constraint_work = 0.0_wp !< spurious work of the condition itself on the bodies, beyond the
                                           !< tool's own, since the start, J
      real(wp) :: particle_work = 0.0_wp !< work on the particles by their own motion since the start, J: work
                                         !< minus heat
      real(wp) :: impulse(3) = 0.0_wp   !< given to the bodies since the start, N s
      real(wp) :: stored = 0.0_wp       !< elastic energy stored in the bodies below the cells under it, J:
      real(wp) :: stored_shear = 0.0_wp !< and the part of friction in it, J
      real(wp) :: relaxed = 0.0_wp      !< dissipated there since the start, by laws that relax, J
   contains
      procedure :: accumulate
      procedure :: count_mean_motion
   end type tool_state_t

   !> Reactions of the candidates of a step on one tool: reals only, as they are summed over the ranks.
   type :: reaction_t
      sequence
      real(wp) :: load(3) = 0.0_wp         !< on the tool, N
      real(wp) :: moment(3) = 0.0_wp       !< on the tool about its point, N m
      real(wp) :: friction_force(3) = 0.0_wp          !< friction on the body, N
      real(wp) :: rub_moment(3) = 0.0_wp   !< the same about the tool's point, N m
      real(wp) :: heat = 0.0_wp            !< J
      real(wp) :: particle_work = 0.0_wp   !< J
      real(wp) :: constraint_work = 0.0_wp !< J
      real(wp) :: stored = 0.0_wp          !< J
      real(wp) :: stored_shear = 0.0_wp    !< J
      real(wp) :: relaxed = 0.0_wp         !< J
      real(wp) :: candidates = 0.0_wp      !< number of candidates
   end type reaction_t

   integer, parameter :: reaction_reals = storage_size(reaction_t())/storage_size(1.0_wp)

contains

   !> Reactions of the tools to this rank's candidates, and the friction heat by the slip of the contact
   !> points at the step's end, before load-driven tools are updated.
   pure subroutine accumulate_reactions(reactions, candidates, tools, level, time_step)
      type(reaction_t), intent(out) :: reactions(:) !< (tools)
      type(candidates_t), intent(in) :: candidates
      type(tool_t), intent(in) :: tools(:)
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: time_step !< s
      real(wp) :: tangential(3), arm(3)
      integer :: c
      do c = 1, candidates%count
         if (candidates%list(c)%tool == 0) cycle
         associate (it => candidates%list(c), sums => reactions(candidates%list(c)%tool))
            arm = place_of(it) - tools(it%tool)%point
            sums%load = sums%load - it%force*it%normal
            sums%moment = sums%moment - it%force*cross(arm, it%normal)
            sums%candidates = sums%candidates + 1.0_wp
            sums%constraint_work = sums%constraint_work + time_step*it%force*it%opening
            sums%stored = sums%stored + 0.5_wp*it%force*it%deflection
            sums%relaxed = sums%relaxed + it%relaxed
            if (it%frictional == 0) cycle
            tangential = matmul(it%tangent, it%tangential_force)
            sums%load = sums%load - tangential
            sums%friction_force = sums%friction_force + tangential
            sums%rub_moment = sums%rub_moment + cross(arm, tangential)
            sums%stored_shear = sums%stored_shear + 0.5_wp*dot_product(tangential, it%shear_deflection)
            sums%moment = sums%moment - cross(arm, tangential)
            sums%heat = sums%heat - time_step*dot_product(tangential, point_velocity(level, it) &
                                                          - tool_velocity(tools, it)) &
                        - 0.5_wp*it%relaxing*dot_product(tangential, it%shear_deflection)
         end associate
      end do
      call close_ring(reactions, level%grid%section)
   end subroutine accumulate_reactions

   !> For a body of revolution only the axial components remain around the ring.
   pure subroutine close_ring(reactions, section)
      type(reaction_t), intent(inout) :: reactions(:) !< (tools)
      type(section_t), intent(in) :: section
      integer :: t
      if (.not. section%is_round()) return
      do t = 1, size(reactions)
         reactions(t)%load(:2) = 0.0_wp
         reactions(t)%moment = 0.0_wp
         reactions(t)%friction_force(:2) = 0.0_wp
         reactions(t)%rub_moment = 0.0_wp
      end do
   end subroutine close_ring

   !> What the forces of the step do on pressed particles of one block by the motion that these have just
   !> made: that of the centre, dt L arm, and the drift that is taken out. Of a drift that is more than is
   !> taken out in a step only what this step adds counts: the rest may be an overlap that a point was met
   !> with, as after a split, and that is no way of the force.
   pure subroutine add_particle_work(reactions, list, column, gradient, way_to, time_step)
      type(reaction_t), intent(inout) :: reactions(:) !< (tools)
      type(candidate_t), intent(in) :: list(:)        !< of the block
      real(wp), intent(in), contiguous :: column(:, :), gradient(:, :) !< of its particles; (:, 9), 1/s: L
      integer, intent(in) :: way_to     !< first column of the centres at the end of the step
      real(wp), intent(in) :: time_step !< s
      real(wp) :: added, drift, force(3), way(3)
      integer :: c
      do c = 1, size(list)
         associate (it => list(c), work => reactions(list(c)%tool)%particle_work)
            force = it%force*it%normal
            if (it%frictional > 0) force = force + matmul(it%tangent, it%tangential_force)
            way = column(it%particle, way_to:way_to + 2) - it%from &
                  + time_step*matmul(reshape(gradient(it%particle, :), [3, 3]), it%arm)
            drift = drift_of(it)
            if (abs(it%drift) > abs(drift)) then
               added = time_step*(it%opening + dot_product(it%opposite, it%normal)) &
                       - dot_product(way, it%normal)
               drift = sign(min(abs(drift), max(0.0_wp, sign(added, added*drift))), drift)
            end if
            work = work + dot_product(force, way + drift*it%normal)
         end associate
      end do
   end subroutine add_particle_work

   !> Collective: reactions of all ranks, the deepest overlaps, and the largest deflections below the cells.
   subroutine add_up(communicator, reactions, overlap, deepest)
      type(communicator_t), intent(in) :: communicator
      type(reaction_t), intent(inout), contiguous :: reactions(:) !< (tools)
      real(wp), intent(inout) :: overlap(:), deepest(:) !< (tools), m
      real(wp) :: both(size(overlap), 2)
      call MPI_Allreduce(MPI_IN_PLACE, reactions, reaction_reals*size(reactions), MPI_DOUBLE_PRECISION, &
                         MPI_SUM, communicator%comm)
      both(:, 1) = overlap
      both(:, 2) = deepest
      call MPI_Allreduce(MPI_IN_PLACE, both, size(both), MPI_DOUBLE_PRECISION, MPI_MAX, communicator%comm)
      overlap = both(:, 1)
      deepest = both(:, 2)
   end subroutine add_up

   !> Accumulate the reaction of a step, of all ranks, on a tool after its update.
   pure subroutine accumulate(self, reaction, tool, velocity_change, spin_change, time_step)
      class(tool_state_t), intent(inout) :: self
      type(reaction_t), intent(in) :: reaction
      type(tool_t), intent(in) :: tool
      real(wp), intent(in) :: velocity_change(3), spin_change(3) !< change of the tool's motion, m/s and rad/s
      real(wp), intent(in) :: time_step   !< s
      self%load = reaction%load
      self%moment = reaction%moment
      self%heat = self%heat + reaction%heat &
                  + time_step*(dot_product(reaction%friction_force, velocity_change) &
                               + dot_product(reaction%rub_moment, spin_change))
      self%particle_work = self%particle_work + reaction%particle_work
      self%constraint_work = self%constraint_work + reaction%constraint_work + reaction%relaxed &
                             + (reaction%stored - self%stored)
      self%heat = self%heat - (reaction%stored_shear - self%stored_shear)
      self%relaxed = self%relaxed + reaction%relaxed
      self%stored = reaction%stored
      self%stored_shear = reaction%stored_shear
      self%work = self%work - time_step*dot_product(self%load, tool%velocity)
      if (tool%pivot > 0) self%work = self%work - time_step*dot_product(self%moment, tool%spin)
      self%impulse = self%impulse - time_step*self%load
   end subroutine accumulate

   !> Count the work of a load-driven tool in the last step, and that on the particles that go with it, by the
   !> mean of its motion before and after the step: with the load's work and the tool's kinetic energy this is
   !> exact (theory.md, eq. mean-motion).
   pure subroutine count_mean_motion(self, tool, before, time_step)
      class(tool_state_t), intent(inout) :: self
      type(tool_t), intent(in) :: tool
      real(wp), intent(in) :: before(6) !< velocity, m/s, and spin, rad/s
      real(wp), intent(in) :: time_step !< s
      real(wp) :: change
      change = 0.5_wp*time_step*dot_product(self%load, tool%velocity - before(:3))
      if (tool%pivot > 0) &
         change = change + 0.5_wp*time_step*dot_product(self%moment, tool%spin - before(4:))
      self%work = self%work + change
      self%particle_work = self%particle_work + change
   end subroutine count_mean_motion

end module m_tool_reactions
