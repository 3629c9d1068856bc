!> Error messages on an implicit step without equilibrium.
module m_static_complaints
   use m_kinds, only: wp
   use m_constants, only: exit_numerical
   use m_errors, only: error_t, fail
   use m_text, only: to_text, si
   use m_model, only: model_t
   use m_complaints, only: particle_text
   use m_equilibrium, only: equilibrium_t, no_convergence, turned, too_far, too_long, not_held
   use m_static_levels, only: longest_way
   use m_static_ways, only: rigid_motion_t
   use m_static_system, only: static_system_t
   implicit none
   private
   public :: complain, reason, loose_text

   character(len=*), parameter :: advice = '; try a smaller step, loads that come on more slowly (ramp), '// &
                                           'smaller cells, or boundaries and tools that hold the body; '// &
                                           'a load above the plastic limit load has no equilibrium'
   character(len=*), parameter :: constant_advice = '; a shorter step has the same load: let it come on '// &
                                                    'slowly (ramp), or lower it'
   character(len=*), parameter :: loose_advice = '; hold them by a side of the grid or by friction, or '// &
                                                 'give steps inertia (mode=''newmark'')'

   real(wp), parameter :: no_stiffness = 1.0e-8_wp !< of the diagonal's stiffness
contains

   !> The reason why a step has no equilibrium.
   pure function reason(outcome) result(text)
      integer, intent(in) :: outcome
      character(len=:), allocatable :: text
      select case (outcome)
      case (too_far); text = 'the displacement of a particle is too large'
      case (turned); text = 'the strain of a particle is too large'
      case (too_long); text = 'a law asks for a smaller step'
      case (not_held); text = 'a body is unconstrained'
      case default; text = 'no convergence'
      end select
   end function reason

   !> Collective: report why there is no equilibrium with a last step (s), and where.
   subroutine complain(equilibrium, model, last, way, farthest, own_way, bodies, in_vain, error)
      type(equilibrium_t), intent(inout) :: equilibrium
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: last
      real(wp), intent(in) :: way        !< largest displacement of all particles, relative to the allowed one
      integer, intent(in) :: farthest(3) !< level, block, particle of this rank with the largest displacement,
      real(wp), intent(in) :: own_way    !< and its displacement
      character(len=*), intent(in) :: bodies(:) !< names
      logical, intent(in) :: in_vain            !< a shorter step is the same problem
      type(error_t), intent(inout) :: error
      character(len=:), allocatable :: steps, loose, try
      real(wp) :: worst
      logical :: mine
      integer :: at(3), tool
      if (equilibrium%outcome == not_held) then
         call fail(error, exit_numerical, not_held_text(equilibrium%system%unheld, bodies))
         return
      end if
      loose = loose_text(equilibrium)
      steps = 'no equilibrium with steps down to '//si(last, 's')//': '//reason(equilibrium%outcome)//loose
      try = advice
      if (in_vain) try = constant_advice
      if (loose /= '') try = loose_advice
      call find_cause(equilibrium, model, way, farthest, own_way, worst, at, tool)
      mine = worst >= model%communicator%maximum(worst)
      if (mine .and. tool > 0) then
         call fail(error, exit_numerical, 'tool '//equilibrium%system%contact%tools%name_of(tool)// &
                   ': no equilibrium under its load: nothing holds it, or the bodies cannot bear the '// &
                   'load; move it into contact with a body, lower the load, or give it speeds')
      else if (mine .and. at(3) > 0) then
         call fail(error, exit_numerical, particle_text(model, at(1), at(2), at(3))//': '//steps//try)
      end if
      call model%communicator%agree(error)
      if (.not. error%happened()) &
         call fail(error, exit_numerical, 'step '//to_text(model%step + 1)//': '//steps//try)
   end subroutine complain

   !> The cause on this rank, and its severity: a particle (level, block, particle; 0: none), or an
   !> unconstrained tool. A law's request for a smaller step is not attributed to a particle.
   subroutine find_cause(equilibrium, model, way, farthest, own_way, worst, at, tool)
      type(equilibrium_t), intent(in) :: equilibrium
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: way
      integer, intent(in) :: farthest(3)
      real(wp), intent(in) :: own_way
      real(wp), intent(out) :: worst
      integer, intent(out) :: at(3), tool
      integer :: n
      at = 0
      tool = 0
      associate (it => equilibrium, nodal => equilibrium%system%nodal)
         select case (it%outcome)
         case (turned)
            worst = -it%trial_status%smallest
            at = [it%trial_status%level, it%trial_status%block, it%trial_status%particle]
         case (too_far)
            worst = own_way
            at = farthest
            associate (ways => abs(it%system%contact%tools%way))
               ! the same on all ranks
               if (maxval([0.0_wp, ways]) >= way*longest_way(model, size(model%levels))) &
                  tool = maxloc(ways, dim=1)
            end associate
         case (too_long)
            worst = 0.0_wp
         case default
            worst = maxval([-1.0_wp, abs(it%left)])
            if (size(it%left) == 0) return
            n = maxloc(abs(it%left), dim=1)
            tool = max(0, n - nodal)
            if (tool > 0) return
            at(1) = findloc(n > it%system%levels%before, .true., dim=1, back=.true.)
            associate (node => it%system%levels(at(1))%unknowns%at(:, n - it%system%levels(at(1))%before))
               at(2) = node(5)
               at(3) = nearest_to(model, at(1), at(2), node(2:4))
            end associate
         end select
      end associate
   end subroutine find_cause

   !> Collective: the axes along which only contact supports all bodies together, if any: a tip on a flat body
   !> hardly resists tangential displacements.
   function loose_text(equilibrium) result(text)
      type(equilibrium_t), intent(inout) :: equilibrium
      character(len=:), allocatable :: text
      text = ''
      if (equilibrium%outcome /= no_convergence .or. equilibrium%newton == 0) return
      if (.not. equilibrium%system%inertia%acts) text = loose_axes(equilibrium%system)
      if (text /= '') text = '; contact alone constrains the bodies along'//text
   end function loose_text

   !> Collective: names of these axes.
   function loose_axes(system) result(text)
      type(static_system_t), intent(inout) :: system
      character(len=:), allocatable :: text
      real(wp), dimension(system%size()) :: way, force
      real(wp) :: pressing(system%contact%count)
      character(len=*), parameter :: names = 'xyz'
      integer :: axis, l, n
      text = ''
      pressing = system%contact%list(:system%contact%count)%force
      system%contact%list(:system%contact%count)%force = 0.0_wp
      system%presses = .false.
      do axis = 1, 3
         way = 0.0_wp
         do l = 1, size(system%levels)
            do n = 1, system%levels(l)%unknowns%count
               if (system%levels(l)%unknowns%at(1, n) == axis) way(system%levels(l)%before + n) = 1.0_wp
            end do
         end do
         if (.not. system%dot(way, way) > 0.0_wp) cycle ! every node is held along it, as in sections
         call system%multiply(way, force)
         if (system%dot(way, force) > no_stiffness*system%dot(way, system%bare*way)) cycle
         if (text /= '') text = text//' and'
         text = text//' '//names(axis:axis)
      end do
      system%contact%list(:system%contact%count)%force = pressing
   end function loose_axes

   !> Message on an unconstrained body.
   function not_held_text(motion, bodies) result(text)
      type(rigid_motion_t), intent(in) :: motion
      character(len=*), intent(in) :: bodies(:)
      character(len=:), allocatable :: text
      text = 'body '//to_text(motion%body)
      if (bodies(motion%body) /= '') text = 'body '//trim(bodies(motion%body))
      if (norm2(motion%about) > 0.0_wp) then
         text = text//': the loads rotate it about '//direction(motion%about)
      else
         text = text//': the loads push it along '//direction(motion%along)
      end if
      text = text//', and it is unconstrained; constrain it by a side of the grid, a tool, friction or '// &
         'another body, or add inertia (mode=''newmark'')'
   end function not_held_text

   !> Name of an axis, or a unit vector.
   pure function direction(vector) result(text)
      real(wp), intent(in) :: vector(3)
      character(len=:), allocatable :: text
      integer :: k
      k = maxloc(abs(vector), dim=1)
      text = 'xyz'
      text = text(k:k)
      if (abs(vector(k)) < 0.999_wp) text = '('//to_text(vector(1), 3)//', '//to_text(vector(2), 3)//', '// &
                                            to_text(vector(3), 3)//')'
   end function direction

   !> The particle of block b nearest to a node of its tile; 0 if there is none.
   pure integer function nearest_to(model, l, b, at) result(p)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b, at(3)
      real(wp) :: place(3)
      integer :: q
      associate (level => model%levels(l), particles => model%levels(l)%blocks(b)%particles, &
                 x => model%levels(l)%layout%position)
         place = level%blocks(b)%origin + (at - 1)*level%grid%cell
         p = 0
         if (particles%count == 0) return
         p = minloc([(sum((particles%column(q, x:x + 2) - place)**2), q=1, particles%count)], dim=1)
      end associate
   end function nearest_to

end module m_static_complaints
