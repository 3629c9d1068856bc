!> Implicit steps: the model advances from one equilibrium to the next, over any time, without inertia or with
!> it (theory.md, Quasi-static steps). Particles are changed only when the equilibrium of a step has been
!> found.
module m_quasi_static
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   use m_text, only: to_text, si
   use m_timers
   use m_group_reader, only: name_length
   use m_start_gap, only: touch_at_start
   use m_scene, only: scene_t, quasi_static_spec_t, preconditioner_gamg, preconditioner_bpx
   use m_field_table, only: layout_t
   use m_particle_store, only: particle_store_t
   use m_model, only: model_t, bounds_t
   use m_integrator, only: integrator_t
   use m_static_complaints, only: complain, reason, loose_text
   use m_static_motion, only: take_along
   use m_advance, only: migrate
   use m_trial_state, only: relaxation
   use m_equilibrium, only: equilibrium_t, found, too_far, called_off, not_held
   use m_static_loads, only: find_contact, accumulate_contact, accumulate_losses, any_friction
   use m_static_levels, only: longest_way, spread_aside
   use m_contact_complaints, only: forbid_contact
   use m_move_regions, only: forget_edge_stress
   use m_stop_times, only: next_stop
   use m_static_ways, only: farthest
   use m_called_off, only: called_off_t
   implicit none
   private
   public :: quasi_static_t

   type, extends(integrator_t) :: quasi_static_t
      private
      type(quasi_static_spec_t) :: spec
      type(equilibrium_t) :: equilibrium
      real(wp) :: smallest = 0.0_wp      !< smallest step to be tried, s
      real(wp) :: compliance = 0.01_wp   !< of contact points
      logical :: ahead = .true.          !< explicit steps do P2G of the next step early
      logical :: creeps = .false.        !< some material changes with time alone
      real(wp) :: way = 0.0_wp           !< largest displacement component of a particle or tool in the last
                                         !< step, relative to the allowed one
      integer :: farthest(3) = 0         !< level, block, particle of this rank with the largest displacement,
      real(wp) :: own_way = 0.0_wp       !< and its displacement
      logical :: failed_before = .false. !< the last step was halved
      character(len=:), allocatable :: bodies(:) !< names of the bodies
      character(len=:), allocatable :: run_log
      integer(i8) :: steps = 0, newton = 0, solves = 0, products = 0, halved = 0
   contains
      procedure :: start
      procedure :: next_step
      procedure :: look_ahead
      procedure :: step
      procedure :: end_by
      procedure :: was_called_off
      procedure :: keeps_state
      procedure :: messages
      procedure :: summary
      procedure :: counts
      procedure :: release
      procedure :: change
      procedure :: finish
      procedure, private :: attempt
      procedure, private :: is_in_vain
      procedure, private :: commit
      procedure, private :: choose_next
   end type quasi_static_t

   real(wp), parameter :: max_fraction_of_way = 0.98_wp !< of the allowed displacement of the finest level's
                                                        !< particles: for tools
   real(wp), parameter :: wished_way = 0.8_wp   !< of the allowed displacement: target of the next step
   real(wp), parameter :: growth = 1.5_wp, min_growth = 0.1_wp
   integer, parameter :: easy = 5              !< Newton iterations up to which the next step is lengthened;
   integer, parameter :: more = 2              !< additional ones with deflections below the cells, which lag
                                               !< behind
   real(wp), parameter :: smallest_share = 1.0e-3_wp !< smallest step, relative to the largest allowed
   integer, parameter :: loose_tries = 3       !< attempts of a step in which only contact holds the bodies in
                                               !< some direction

contains

   !> Collective: read the scene's settings when the model is built.
   subroutine start(self, scene, model)
      class(quasi_static_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      integer :: m
      self%spec = scene%quasi_static
      self%compliance = scene%contact%compliance
      if (.not. model%static_step > 0.0_wp) model%static_step = self%spec%step
      self%equilibrium%wants_log = self%spec%iterations
      self%run_log = ''
      allocate (character(len=name_length) :: self%bodies(size(scene%bodies)))
      do m = 1, size(scene%bodies)
         self%bodies(m) = scene%bodies(m)%name
      end do
      self%creeps = .false.
      do m = 1, size(model%materials%slots)
         self%creeps = self%creeps .or. model%materials%slots(m)%law%is_time_dependent()
         self%equilibrium%system%parts = max(self%equilibrium%system%parts, &
                                             model%materials%slots(m)%law%static_parts())
      end do
      self%equilibrium%system%ramp = self%spec%ramp
      self%equilibrium%linear%elements%wanted = self%spec%preconditioner == preconditioner_gamg
      self%equilibrium%linear%grids%wanted = self%spec%preconditioner == preconditioner_bpx
      if (self%spec%ramp > 0.0_wp) model%effect_step%follows_particles = .false. ! they do not include the
                                                                                 ! ramp
      self%ahead = model%works_ahead
      self%equilibrium%system%inertia%acts = self%spec%has_inertia()
      if (self%spec%has_inertia()) then
         self%equilibrium%system%inertia%share = self%spec%theta
         self%equilibrium%system%contact%share = self%spec%theta
         self%equilibrium%system%contact%over_step = .true.
         if (.not. self%spec%max_step > 0.0_wp) self%spec%max_step = self%spec%step
         ! the particles' work is that of the mean of a step's ends
         if (abs(self%spec%theta - 0.5_wp) > 0.0_wp) model%effect_step%follows_particles = .false.
      end if
      model%has_inertia = self%spec%has_inertia() .or. .not. self%spec%holds_at(model%time)
      if (model%step == 0) then
         do m = 1, size(model%contact%tools)
            call touch_at_start(scene, model%contact%tools(m), model%levels(size(model%levels)), &
                                model%materials, model%contact%candidates%carried &
                                + model%contact%candidates%slots(m))
         end do
      end if
      call self%change(model, scene%quasi_static%holds_at(model%time))
   end subroutine start

   !> Switch to implicit steps, or back. Particles start at rest when they get inertia.
   subroutine change(self, model, holds)
      class(quasi_static_t), intent(in) :: self
      type(model_t), intent(inout) :: model
      logical, intent(in) :: holds
      integer :: b, l
      model%effect_step%leads = .not. holds
      model%works_ahead = self%ahead .and. .not. holds
      do l = 1, size(model%levels)
         associate (level => model%levels(l))
            do b = 1, size(level%blocks)
               level%blocks(b)%deposited = 0
               level%blocks(b)%deposit_of = -1
               if (holds .or. model%has_inertia) cycle
               call put_at_rest(level%blocks(b)%particles, level%layout)
            end do
            level%sums_wait = .false.
         end associate
      end do
      if (holds .or. .not. model%has_inertia) call forget_edge_stress(model)
      model%has_inertia = self%spec%has_inertia() .or. .not. holds
   end subroutine change

   pure subroutine put_at_rest(particles, at)
      type(particle_store_t), intent(inout) :: particles
      type(layout_t), intent(in) :: at
      if (particles%count == 0) return
      particles%column(:particles%count, at%velocity:at%velocity + 2) = 0.0_wp
      if (at%gradient > 0) particles%column(:particles%count, at%gradient:at%gradient + 8) = 0.0_wp
      call particles%changed()
   end subroutine put_at_rest

   !> Collective: the step (s) to be taken now: by the previous ones, and such that times of changes and
   !> output are met.
   real(wp) function next_step(self, scene, model, share) result(time_step)
      class(quasi_static_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: share
      real(wp) :: most, speed, remaining
      integer :: t
      remaining = next_stop(scene, model) - model%time
      time_step = min(max(self%spec%step, model%static_step), remaining)
      if (self%spec%max_step > 0.0_wp) time_step = min(time_step, self%spec%max_step)
      if (self%creeps) time_step = time_step*creep_share(model, time_step, self%spec%creep_limit)
      do t = 1, size(model%contact%tools)
         speed = model%contact%tools(t)%fastest(model%time, model%time + time_step, &
                                                given=.true.)
         most = max_fraction_of_way*longest_way(model, size(model%levels))
         if (speed*time_step > most) time_step = most/speed
      end do
      self%smallest = smallest_share*min(self%spec%step, time_step)
      time_step = min(time_step, share*model%static_step)
      time_step = remaining/max(1_i8, ceiling(min(remaining/time_step - 1.0e-6_wp, 1.0e15_wp), i8))
   end function next_step

   !> Collective: creep of future stresses is unknown: steps no longer follow it. `longest`: what it allows at
   !> the present stresses, of a time, s.
   subroutine look_ahead(self, model, time, longest)
      class(quasi_static_t), intent(inout) :: self
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: time !< s
      real(wp), intent(out) :: longest
      longest = time
      if (self%creeps) longest = time*creep_share(model, time, self%spec%creep_limit)
      self%creeps = .false.
   end subroutine look_ahead

   !> Collective: the share of a step in which stress relaxes by at most the allowed amount.
   real(wp) function creep_share(model, time_step, most) result(share)
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: time_step !< s
      real(wp), intent(in) :: most      !< allowed change of stress, relative to the total
      real(wp) :: sizes(2), of_block(2)
      integer :: b, l, try
      share = 1.0_wp
      do try = 1, 60
         sizes = 0.0_wp
         do l = 1, size(model%levels)
            do b = 1, size(model%levels(l)%blocks)
               of_block = relaxation(model%levels(l)%blocks(b)%particles, model%materials, &
                                     model%levels(l)%layout, share*time_step)
               sizes = sizes + of_block
            end do
         end do
         sizes = [sqrt(model%communicator%sum_real(sizes(1))), sqrt(model%communicator%sum_real(sizes(2)))]
         if (.not. sizes(1) > most*sizes(2)) return
         share = share*max(min_growth, 0.95_wp*most*sizes(2)/sizes(1))
      end do
   end function creep_share

   !> Collective: one step, of the given length or, if that has no equilibrium, of a shorter one.
   subroutine step(self, model, time_step, error)
      class(quasi_static_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time_step
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: loose
      real(wp), allocatable :: load(:) !< of the last attempt, N
      real(wp) :: now
      integer :: tries
      logical :: done, in_vain
      now = time_step
      tries = 0
      self%failed_before = .false.
      call model%timers%on_level(1)
      do
         call self%attempt(model, now, done)
         if (done) exit
         if (self%was_called_off()) then
            model%requested_action = self%equilibrium%system%asked
            call model%timers%on_level(0)
            return
         end if
         self%failed_before = .true.
         tries = tries + 1
         loose = loose_text(self%equilibrium)
         in_vain = self%is_in_vain(load)
         if (self%equilibrium%outcome /= not_held) &
            self%run_log = self%run_log//'quasi      step '//to_text(model%step + 1)//' of '//si(now, 's')// &
                     ' has no equilibrium after '//to_text(self%equilibrium%newton)// &
                     ' Newton iterations ('//reason(self%equilibrium%outcome)// &
                     loose//'); it is halved'//new_line('a')
         self%halved = self%halved + 1
         if (0.5_wp*now < self%smallest .or. self%equilibrium%outcome == not_held &
             .or. (tries >= loose_tries .and. loose /= '') .or. in_vain) then
            call complain(self%equilibrium, model, now, self%way, self%farthest, self%own_way, self%bodies, &
                          in_vain, error)
            call model%timers%on_level(0)
            return
         end if
         now = 0.5_wp*now
         load = self%equilibrium%system%load
      end do
      call self%commit(model, now, error)
      call model%timers%on_level(0)
      call self%choose_next(model, now)
   end subroutine step

   !> Collective: search the equilibrium at the end of a step.
   subroutine attempt(self, model, time_step, done)
      class(quasi_static_t), intent(inout) :: self
      type(model_t), intent(inout), target :: model
      real(wp), intent(in) :: time_step !< s
      logical, intent(out) :: done
      call self%equilibrium%system%contact%tools%begin(model%contact%tools, model%time, time_step, &
                                                       self%spec%ramp)
      self%equilibrium%system%contact%is_frictional = any_friction(model)
      associate (system => self%equilibrium%system)
         system%is_time_dependent = self%spec%has_inertia() &
                                    .or. (system%contact%is_frictional .and. .not. self%failed_before)
      end associate
      call self%equilibrium%system%begin(model, model%time, time_step, self%spec%stabilisation)
      call find_contact(self%equilibrium%system%contact, model, self%compliance, time_step, &
                        again=self%failed_before)
      call self%equilibrium%solve(self%spec%tolerance)
      self%run_log = self%run_log//self%equilibrium%log
      self%newton = self%newton + self%equilibrium%newton
      self%solves = self%solves + self%equilibrium%linear%solves
      self%products = self%products + self%equilibrium%linear%products
      call self%equilibrium%system%set_motion(self%equilibrium%z)
      self%way = max(farthest(model, self%equilibrium%system%work, self%farthest, self%own_way), &
                     maxval(abs([0.0_wp, self%equilibrium%system%contact%tools%way])) &
                     /longest_way(model, size(model%levels)))
      if (self%equilibrium%outcome == found .and. self%way > 1.0_wp) self%equilibrium%outcome = too_far
      done = self%equilibrium%outcome == found
   end subroutine attempt

   !> Collective: true when a shorter step is the same problem: without inertia, tools and laws that depend on
   !> time or rates, under the same load as in the attempt before.
   logical function is_in_vain(self, load)
      class(quasi_static_t), intent(in) :: self
      real(wp), allocatable, intent(in) :: load(:) !< of that; not allocated in the first attempt
      real(wp) :: apart
      integer :: m
      is_in_vain = .false.
      associate (system => self%equilibrium%system)
         if (self%creeps .or. self%spec%has_inertia() .or. size(system%contact%tools%now) > 0) return
         if (.not. allocated(load)) return
         do m = 1, size(system%model%materials%slots)
            if (system%model%materials%slots(m)%law%may_flow()) return
         end do
         apart = 1.0_wp
         if (size(load) == size(system%load)) apart = maxval([0.0_wp, abs(load - system%load)])
         is_in_vain = .not. system%model%communicator%maximum(apart) > 0.0_wp
      end associate
   end function is_in_vain

   !> Collective: move the particles by the displacements, and the tools to their positions at the step's end.
   subroutine commit(self, model, time_step, error)
      class(quasi_static_t), intent(inout) :: self
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time_step !< s
      type(error_t), intent(inout) :: error
      integer :: l
      model%bounds = bounds_t()
      model%last_step = 0.0_wp ! positions and velocities are at the same time
      call accumulate_contact(self%equilibrium%system%contact, model, time_step, self%spec%has_inertia())
      call accumulate_losses(self%equilibrium%system, self%equilibrium%z)
      if (self%spec%has_inertia()) then
         associate (it => self%equilibrium)
            call spread_aside(it%system%levels, model, it%system%inertia%mean_acceleration(it%z, time_step))
            call it%system%set_motion(it%z)
         end associate
      end if
      do l = size(model%levels), 1, -1
         call model%timers%on_level(l)
         if (self%spec%has_inertia()) then
            call take_along(model, l, time_step, self%equilibrium%system%parts, &
                            self%equilibrium%system%levels(l), error, self%spec%theta)
         else
            call take_along(model, l, time_step, self%equilibrium%system%parts, &
                            self%equilibrium%system%levels(l), error)
         end if
         if (l < size(model%levels)) then
            call forbid_contact(model%contact%tools, model%levels(l), model%levels(size(model%levels)), error)
            if (model%contact%pairs%active()) &
               call model%contact%pairs%forbid(model%communicator, model%levels(l), &
                                               model%levels(size(model%levels)), error)
         end if
         call migrate(model, l, error)
         if (error%happened()) return
      end do
      model%time = model%time + time_step
      model%step = model%step + 1
      self%steps = self%steps + 1
      call model%timers%on_level(0)
      if (size(model%levels) == 1) return
      call model%timers%enter(model%levels_row)
      call model%prepare_blocks()
      call model%timers%leave()
   end subroutine commit

   !> Choose the next step: longer if this one converged easily, but not so long that particles move too far.
   !> A step shortened to meet a time, or for creep, does not shorten the following ones.
   subroutine choose_next(self, model, time_step)
      class(quasi_static_t), intent(in) :: self
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: time_step !< of the last step, s
      real(wp) :: factor, wished
      factor = 1.0_wp
      associate (deflects => self%equilibrium%system%contact%lag > 0.0_wp)
         if (.not. self%failed_before .and. self%equilibrium%newton <= easy + merge(more, 0, deflects)) &
            factor = growth
      end associate
      if (self%way > 0.0_wp) factor = min(factor, wished_way/self%way)
      wished = max(factor, min_growth)*time_step
      if (.not. self%failed_before .and. factor >= 1.0_wp) wished = max(wished, model%static_step)
      if (self%spec%max_step > 0.0_wp) wished = min(wished, self%spec%max_step)
      model%static_step = wished
   end subroutine choose_next

   subroutine end_by(self, called_off)
      class(quasi_static_t), intent(inout) :: self
      type(called_off_t), intent(in) :: called_off
      self%equilibrium%system%called_off = called_off
   end subroutine end_by

   pure logical function was_called_off(self)
      class(quasi_static_t), intent(in) :: self
      was_called_off = self%equilibrium%outcome == called_off
   end function was_called_off

   pure logical function keeps_state(self)
      class(quasi_static_t), intent(in) :: self
      keeps_state = self%equilibrium%outcome /= found
   end function keeps_state

   function messages(self) result(text)
      class(quasi_static_t), intent(inout) :: self
      character(len=:), allocatable :: text
      text = self%run_log
      self%run_log = ''
   end function messages

   pure function counts(self) result(values)
      class(quasi_static_t), intent(in) :: self
      integer(i8) :: values(5)
      values = [self%steps, self%newton, self%solves, self%products, self%halved]
   end function counts

   function summary(self) result(text)
      class(quasi_static_t), intent(in) :: self
      character(len=:), allocatable :: text
      associate (steps => real(max(1_i8, self%steps), wp))
         text = trim(merge('newmark:     ', 'quasi-static:', self%spec%has_inertia()))//' '// &
                to_text(self%steps)//' steps, '//to_text(self%newton/steps, 3)// &
                ' Newton iterations, '//to_text(self%solves/steps, 3)//' linear solves and '// &
                to_text(self%products/steps, 4)//' products a step; '//to_text(self%halved)//' times halved'
      end associate
   end function summary

   subroutine release(self)
      class(quasi_static_t), intent(inout) :: self
      call self%equilibrium%linear%krylov%dismiss()
      call self%equilibrium%linear%elements%dismiss()
   end subroutine release

   !> Collective: finalise PETSc, if this integrator initialised it, after all objects have been freed.
   subroutine finish(self)
      class(quasi_static_t), intent(inout) :: self
      call self%equilibrium%linear%krylov%finish()
   end subroutine finish

end module m_quasi_static
