!> Effects of contact forces between bodies in a step: on the particles of pressed elements, and on each pair
!> of contact groups, summed over the candidates of all ranks.
module m_pair_reactions
   use mpi_f08
   use m_kinds, only: wp
   use m_vectors, only: cross
   use m_scene, only: body_contact_spec_t
   use m_communicator, only: communicator_t
   use m_level, only: level_t
   use m_scene_materials, only: materials_t
   use m_surface_elements, only: surface_columns_t
   use m_pair_law, only: pressed_out, weaken
   use m_contact_point, only: candidate_t, partner_t, point_velocity, width_of, overlap_rate, &
                              sliding
   use m_candidates, only: candidates_t
   use m_contact_system, only: contact_system_t
   implicit none
   private
   public :: pair_state_t, state_reals, pair_of, find_slip, press_element, add_reaction, &
             close_rings, add_up_pairs

   !> Contact of two groups: in the last step, and since the start. Reals only, as they are summed over the
   !> ranks.
   type :: pair_state_t
      sequence
      real(wp) :: force(3) = 0.0_wp    !< on the first group, N
      real(wp) :: moment(3) = 0.0_wp   !< of it about the origin, N m
      real(wp) :: area = 0.0_wp        !< of the elements with closed gap, m2: half from each side
      real(wp) :: heat = 0.0_wp        !< friction heat since the start, J
      real(wp) :: work = 0.0_wp        !< spurious work of the condition itself since the start, J
      real(wp) :: parting = 0.0_wp     !< absorbed by adhesion as gaps opened, since the start, J
      real(wp) :: pressed = 0.0_wp     !< done as an overlap was removed, since the start, J
      real(wp) :: stored = 0.0_wp       !< elastic energy stored in the bodies below the cells, J:
      real(wp) :: stored_shear = 0.0_wp !< and the part of friction in it, J
      real(wp) :: relaxed = 0.0_wp      !< dissipated there since the start, by laws that relax, J
      real(wp) :: candidates = 0.0_wp  !< number of candidates
   end type pair_state_t

   integer, parameter :: state_reals = storage_size(pair_state_t())/storage_size(1.0_wp)

contains

   !> Number of the pair of two velocity fields.
   pure integer function pair_of(one, other)
      integer, intent(in) :: one, other
      associate (low => min(one, other), high => max(one, other))
         pair_of = (high - 1)*(high - 2)/2 + low
      end associate
   end function pair_of

   !> Collective: slip of the candidates between bodies, from `first` on, under the forces of the step. Nodes
   !> have not been moved yet.
   subroutine find_slip(candidates, first, system, level, time_step, forces)
      type(candidates_t), intent(inout) :: candidates
      integer, intent(in) :: first
      type(contact_system_t), intent(inout) :: system
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: time_step !< s
      real(wp), intent(in) :: forces(:) !< (rows), N
      real(wp), dimension(size(forces)) :: scaled, change
      integer :: c, k, r
      scaled = 0.0_wp
      associate (n => candidates%count, scale => system%scale(:size(forces)))
         where (scale > 0.0_wp) scaled = forces/scale
         call system%respond([1, system%rows], scaled, [1, system%rows], change)
         where (scale > 0.0_wp) change = change/scale
         do c = first, n
            associate (it => candidates%list(c))
               if (it%frictional == 0) cycle
               do k = 1, 2
                  r = n + 2*it%frictional - 2 + k
                  associate (partner => candidates%partners(it%partner))
                     partner%slip(k) = change(r) + dot_product(it%tangent(:, k), &
                        point_velocity(level, it) - it%opposite - partner%deflected/time_step)
                     ! of the surfaces: add the compliance below the cells; the nodes' part is included
                     if (system%has_subcell) &
                        partner%slip(k) = partner%slip(k) + system%subcell_rows(r)*forces(r)
                  end associate
               end do
            end associate
         end do
      end associate
   end subroutine find_slip

   !> Force of a candidate on its own body, friction and adhesion included, N.
   pure function force_of(c) result(force)
      type(candidate_t), intent(in) :: c
      real(wp) :: force(3)
      force = c%force*c%normal
      if (c%frictional > 0) force = force + matmul(c%tangent, c%tangential_force)
   end function force_of

   !> Friction heat of a candidate in a step, J. Sticking points are elastic: no heat.
   pure real(wp) function heat_of(c, partner, time_step) result(heat)
      type(candidate_t), intent(in) :: c
      type(partner_t), intent(in) :: partner
      real(wp), intent(in) :: time_step !< s
      heat = 0.0_wp
      if (c%frictional == 0) return
      if (norm2(c%tangential_force) < sliding*c%limit) return
      heat = -time_step*dot_product(c%tangential_force, partner%slip)
   end function heat_of

   !> Store in the particle of a candidate the results for its element: pressure, friction, the gap left by
   !> the nodes, the state of a bond; and its heat, for both bodies' elements have candidates.
   subroutine press_element(level, materials, at, spec, c, partner, time_step, pressure)
      type(level_t), intent(inout) :: level
      type(materials_t), intent(in) :: materials
      type(surface_columns_t), intent(in) :: at
      type(body_contact_spec_t), intent(in) :: spec !< of the pair
      type(candidate_t), intent(in) :: c
      type(partner_t), intent(in) :: partner
      real(wp), intent(in) :: time_step !< s
      integer, intent(in) :: pressure   !< column of the contact pressure
      associate (particles => level%blocks(c%block)%particles, p => c%particle, e => partner%element)
         associate (column => particles%column, own => at%pressure(e), friction => at%friction(e), &
                    bond => at%bond(e), gap => at%gap(e), below => at%deflection(e), &
                    law => materials%slots(materials%of_body(particles%body(p)))%law)
            column(p, own) = column(p, own) + c%force/c%area
            column(p, pressure) = column(p, pressure) + c%force/c%area
            if (abs(c%force) > 0.0_wp .or. c%carried .or. c%adhesive_tension > 0.0_wp) &
               column(p, gap:gap + 1) = [c%gap - c%allowed + time_step*c%opening, real(partner%field, wp)]
            if (below > 0) column(p, below:below + 3) = [c%deflection, c%shear_deflection]
            if (c%frictional > 0) then
               column(p, friction:friction + 2) = column(p, friction:friction + 2) &
                                                  + matmul(c%tangent, c%tangential_force)/c%area
               call law%take_heat(column(p, :), level%layout, heat_of(c, partner, time_step))
            end if
            if (c%adhesive_tension > 0.0_wp .and. bond > 0) &
               call weaken(column(p, bond:bond + 3), spec, c%gap + time_step*c%opening, &
                           time_step*matmul(c%tangent, partner%slip))
         end associate
      end associate
      if (c%force > 0.0_wp) level%blocks(c%block)%pressed = .true.
   end subroutine press_element

   !> Add a candidate's reaction to that of its pair.
   pure subroutine add_reaction(state, spec, own, c, partner, overlap, time, time_step)
      type(pair_state_t), intent(inout) :: state
      type(body_contact_spec_t), intent(in) :: spec !< of the pair
      integer, intent(in) :: own           !< velocity field of the candidate's body
      type(candidate_t), intent(in) :: c
      type(partner_t), intent(in) :: partner
      real(wp), intent(in) :: overlap      !< of its element at the start, m
      real(wp), intent(in) :: time, time_step !< beginning and length of the step, s
      real(wp) :: side
      side = merge(1.0_wp, -1.0_wp, own < partner%field)
      state%candidates = state%candidates + 1.0_wp
      state%force = state%force + side*force_of(c)
      state%moment = state%moment + side*cross(partner%point, force_of(c))
      state%heat = state%heat + heat_of(c, partner, time_step)
      state%work = state%work + time_step*(c%force + c%adhesive_tension)*c%opening
      state%parting = state%parting + time_step*c%adhesive_tension*c%opening
      state%stored = state%stored + 0.5_wp*c%force*c%deflection
      state%stored_shear = state%stored_shear + 0.5_wp*dot_product(force_of(c), c%shear_deflection)
      state%relaxed = state%relaxed + c%relaxed
      state%pressed = state%pressed + c%mean_force*overlap*pressed_out(spec, time, time_step)
      ! also for points without pressure between pressed ones
      if (c%gap + time_step*c%opening + c%deflection <= overlap_rate*width_of(c)) &
         state%area = state%area + 0.5_wp*c%area
   end subroutine add_reaction

   !> For a body of revolution moments vanish around the ring. The force along x remains the radial force,
   !> over the ring.
   pure subroutine close_rings(states)
      type(pair_state_t), intent(inout) :: states(:) !< (pairs)
      integer :: n
      do n = 1, size(states)
         states(n)%moment = 0.0_wp
      end do
   end subroutine close_rings

   !> Collective: sum the reactions of a step over all ranks and update the states of the pairs: accumulated
   !> values are added up. Also the largest overlaps and deflections.
   subroutine add_up_pairs(communicator, step, states, overlap, deflection)
      type(communicator_t), intent(in) :: communicator
      type(pair_state_t), intent(inout) :: step(:)   !< (pairs)
      type(pair_state_t), intent(inout) :: states(:) !< (pairs)
      real(wp), intent(inout) :: overlap(:), deflection(:) !< (pairs), m
      real(wp) :: both(size(overlap), 2)
      integer :: n
      both(:, 1) = overlap
      both(:, 2) = deflection
      call MPI_Allreduce(MPI_IN_PLACE, step, state_reals*size(step), MPI_DOUBLE_PRECISION, MPI_SUM, &
                         communicator%comm)
      call MPI_Allreduce(MPI_IN_PLACE, both, size(both), MPI_DOUBLE_PRECISION, MPI_MAX, communicator%comm)
      overlap = both(:, 1)
      deflection = both(:, 2)
      do n = 1, size(step)
         if (.not. any(abs(step(n)%force) > 0.0_wp)) step(n)%area = 0.0_wp ! contact without force
      end do
      step%heat = step%heat + states%heat
      step%work = step%work + states%work + (step%stored - states%stored) + step%relaxed
      step%relaxed = step%relaxed + states%relaxed
      step%parting = step%parting + states%parting
      step%pressed = step%pressed + states%pressed
      states = step
   end subroutine add_up_pairs

end module m_pair_reactions
