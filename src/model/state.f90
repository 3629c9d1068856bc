!> The state of a run, described once. Checkpoints and the guard's copy contain exactly what is named here,
!> and the particles' columns. Data that a step reads and cannot recompute must be added to their type and
!> here (doc/developer/files.md has the tables), and `state_format` raised.
!>
!> Not part of the state: counters and timers of a run, which a roll-back does not reset.
module m_state
   use m_kinds, only: wp, i8
   use m_constants, only: exit_files
   use m_errors, only: error_t, fail
   use m_decomposition, only: blocks_before
   use m_region, only: unpack_region
   use m_tool, only: tool_t
   use m_tool_reactions, only: tool_state_t
   use m_body_pairs, only: body_pairs_t
   use m_pair_reactions, only: state_reals
   use m_static_losses, only: face_reals
   use m_model, only: model_t
   use m_energy, only: balance_t, sums_t
   use m_state_store, only: state_store_t
   implicit none
   private
   public :: describe_state, block_state, set_block_state, regions_of, set_regions

   integer, parameter, public :: state_format = 15 !< of checkpoints
   integer, parameter, public :: block_reals = 13  !< per block
   integer, parameter :: sums = 12
   integer(i8), parameter :: max_faces = 2_i8**25 !< of the ghost penalty, of all ranks

contains

   !> Collective: transfer everything except particles and blocks to or from the store. All ranks have the
   !> same values.
   subroutine describe_state(store, model, balance, error)
      class(state_store_t), intent(inout) :: store
      type(model_t), intent(inout) :: model
      type(balance_t), intent(inout) :: balance
      type(error_t), intent(inout) :: error
      integer(i8) :: counts(5)
      real(wp) :: clock(5)
      real(wp), allocatable :: works(:, :)
      associate (comm => model%communicator)
         counts = [model%step, model%moves, comm%sum_count(model%merges), comm%sum_count(model%splits), &
                   model%contact%unsolved_in_row]
         call store%longs('/state/counts', counts, error)
         model%step = counts(1)
         model%moves = counts(2)
         model%merges = merge(counts(3), 0_i8, comm%is_root())
         model%splits = merge(counts(4), 0_i8, comm%is_root())
         model%contact%unsolved_in_row = counts(5)
      end associate
      clock = [model%time, model%bounds%wave_speed, model%bounds%particle_speed, model%lost, model%last_step]
      call store%reals('/state/clock', clock, error)
      model%time = clock(1)
      model%bounds%wave_speed = clock(2)
      model%bounds%particle_speed = clock(3)
      model%lost = clock(4)
      model%last_step = clock(5)
      if (model%has_statics) call describe_statics(store, model, error)
      call describe_balance(store, balance, error)
      allocate (works(4, size(model%levels)))
      works(1, :) = model%effect_step%external_work
      works(2, :) = model%effect_step%damped
      works(3, :) = model%effect_step%particle_work
      works(4, :) = model%effect_step%ahead_work
      call store%reals('/state/effects', works, error)
      model%effect_step%external_work = works(1, :)
      model%effect_step%damped = works(2, :)
      model%effect_step%particle_work = works(3, :)
      model%effect_step%ahead_work = works(4, :)
      if (model%follows_groups()) then
         if (.not. allocated(model%first_centres)) &
            allocate (model%first_centres(3, model%levels(1)%grid%fields))
         call store%reals('/state/centres', model%first_centres, error)
      end if
      if (model%contact%active()) call describe_contact(store, model, error)
      if (allocated(model%atoms)) call describe_atoms(store, model, error)
   end subroutine describe_state

   !> Data of implicit steps: the length of the next one, sums of energy, and the forces of the ghost penalty
   !> of all ranks, of which each rank takes those of its blocks.
   subroutine describe_statics(store, model, error)
      class(state_store_t), intent(inout) :: store
      type(model_t), intent(inout) :: model
      type(error_t), intent(inout) :: error
      integer(i8) :: count(1)
      logical :: good
      real(wp) :: next(6)
      real(wp), allocatable :: faces(:, :)
      associate (losses => model%static_losses)
         next = [model%static_step, losses%uncertainty, losses%ghost_penalty, losses%theta, losses%impact, &
                 losses%in_flow]
         call store%reals('/state/static_step', next, error)
         model%static_step = next(1)
         losses%uncertainty = next(2)
         losses%ghost_penalty = next(3)
         losses%theta = next(4)
         losses%impact = next(5)
         losses%in_flow = next(6)
         if (store%writes) faces = losses%all_faces(model%communicator)
         count = 0
         if (store%writes) count = size(faces, 2)
         call store%longs('/state/ghost_faces', count, error)
         if (.not. store%writes) allocate (faces(face_reals, max(0_i8, min(count(1), max_faces))))
         if (count(1) > 0) call store%reals('/state/ghost_forces', faces, error)
         if (store%writes .or. error%happened()) return
         call losses%keep_own(faces, model%levels, model%communicator%rank, good)
         if (.not. good) call fail(error, exit_files, 'its ghost penalty does not match its scene')
      end associate
   end subroutine describe_statics

   !> A box of atoms: positions and velocities in LAMMPS's units, to the bit; those of the mesh of its
   !> interface follow them.
   subroutine describe_atoms(store, model, error)
      class(state_store_t), intent(inout) :: store
      type(model_t), intent(inout) :: model
      type(error_t), intent(inout) :: error
      real(wp), allocatable :: x(:, :), v(:, :), pushes(:, :), books(:)
      call model%atoms%get_state(x, v, pushes, books)
      call store%reals('/state/atoms_places', x, error)
      call store%reals('/state/atoms_velocities', v, error)
      call store%reals('/state/atoms_pushes', pushes, error)
      call store%reals('/state/atoms_books', books, error)
      if (.not. store%writes .and. .not. error%happened()) call model%atoms%set_state(x, v, pushes, books)
   end subroutine describe_atoms

   subroutine describe_balance(store, balance, error)
      class(state_store_t), intent(inout) :: store
      type(balance_t), intent(inout) :: balance
      type(error_t), intent(inout) :: error
      real(wp) :: start(sums), now(sums), rest(9)
      start = plain(balance%start)
      now = plain(balance%now)
      rest = [balance%external_work, balance%damped, balance%driven, balance%largest, balance%worst, &
              balance%effects_apart, balance%tools_apart, balance%worst_of_effects, balance%worst_of_tools]
      call store%reals('/state/balance_start', start, error)
      call store%reals('/state/balance_now', now, error)
      call store%reals('/state/balance', rest, error)
      balance = balance_t(start=sums_from(start), now=sums_from(now), external_work=rest(1), damped=rest(2), &
                          driven=rest(3), largest=rest(4), worst=rest(5), effects_apart=rest(6), &
                          tools_apart=rest(7), worst_of_effects=rest(8), worst_of_tools=rest(9))
   end subroutine describe_balance

   pure function plain(of) result(values)
      type(sums_t), intent(in) :: of
      real(wp) :: values(sums)
      values = [of%mass, of%kinetic, of%strain, of%plastic, of%momentum, of%angular_momentum, &
                of%dissipated, of%potential]
   end function plain

   pure type(sums_t) function sums_from(v)
      real(wp), intent(in) :: v(sums)
      sums_from = sums_t(mass=v(1), kinetic=v(2), strain=v(3), plastic=v(4), momentum=v(5:7), &
                         angular_momentum=v(8:10), dissipated=v(11), potential=v(12))
   end function sums_from

   !> Data of contact from step to step, in addition to its particle fields.
   subroutine describe_contact(store, model, error)
      class(state_store_t), intent(inout) :: store
      type(model_t), intent(inout) :: model
      type(error_t), intent(inout) :: error
      real(wp) :: worst(5)
      associate (contact => model%contact)
         call describe_tools(store, contact%tools, contact%states, contact%candidates%deepest, error)
         call describe_freedoms(store, contact%tools, error)
         call describe_pairs(store, contact%pairs, error)
         call store%reals('/state/half_spaces', contact%candidates%half_spaces%last, error)
         worst = [contact%worst_residual, contact%worst_overlap, &
                  model%communicator%maximum(contact%worst_bridge), contact%friction%steepest, &
                  model%communicator%maximum(contact%candidates%drift)]
         call store%reals('/state/contact', worst, error)
         contact%worst_residual = worst(1)
         contact%worst_overlap = worst(2)
         contact%worst_bridge = worst(3)
         contact%friction%steepest = worst(4)
         contact%candidates%drift = worst(5)
      end associate
   end subroutine describe_contact

   subroutine describe_tools(store, tools, states, deepest, error)
      class(state_store_t), intent(inout) :: store
      type(tool_t), intent(inout) :: tools(:)
      type(tool_state_t), intent(inout) :: states(:)
      real(wp), intent(inout) :: deepest(:) !< (tools): deflections below the cells, m
      type(error_t), intent(inout) :: error
      real(wp) :: values(20, max(1, size(tools))) ! a row even for contact between bodies only
      integer :: t
      values = 0.0_wp
      do t = 1, size(tools)
         associate (freedom => tools(t)%freedoms(1), state => states(t))
            values(:, t) = [freedom%travel, freedom%speed, state%load, state%moment, state%overlap, &
                            state%work, state%heat, state%constraint_work, state%particle_work, &
                            state%impulse, state%stored, state%stored_shear, state%relaxed, deepest(t)]
         end associate
      end do
      call store%reals('/state/tools', values, error)
      do t = 1, size(tools)
         associate (freedom => tools(t)%freedoms(1), v => values(:, t))
            freedom%travel = v(1)
            freedom%speed = v(2)
            states(t) = tool_state_t(load=v(3:5), moment=v(6:8), overlap=v(9), work=v(10), heat=v(11), &
                                     constraint_work=v(12), particle_work=v(13), impulse=v(14:16), &
                                     stored=v(17), stored_shear=v(18), relaxed=v(19))
            deepest(t) = v(20)
         end associate
      end do
   end subroutine describe_tools

   !> The degrees of freedom of tools by &motion, and their rotations so far. Without &motion there are no
   !> rows of these.
   subroutine describe_freedoms(store, tools, error)
      class(state_store_t), intent(inout) :: store
      type(tool_t), intent(inout) :: tools(:)
      type(error_t), intent(inout) :: error
      real(wp), allocatable :: turned(:, :), freedoms(:, :)
      integer :: k, n, t
      n = sum([(size(tools(t)%freedoms) - 1, t=1, size(tools))])
      if (n > 0) then
         allocate (turned(7, size(tools)), freedoms(5, n))
         n = 0
         do t = 1, size(tools)
            turned(:, t) = [tools(t)%aside, tools(t)%orientation]
            do k = 2, size(tools(t)%freedoms)
               n = n + 1
               associate (freedom => tools(t)%freedoms(k))
                  freedoms(:, n) = [freedom%travel, freedom%speed, freedom%aside]
               end associate
            end do
         end do
         call store%reals('/state/tools_turned', turned, error)
         call store%reals('/state/tools_freedoms', freedoms, error)
         n = 0
         do t = 1, size(tools)
            tools(t)%aside = turned(:3, t)
            tools(t)%orientation = turned(4:, t)
            do k = 2, size(tools(t)%freedoms)
               n = n + 1
               associate (freedom => tools(t)%freedoms(k))
                  freedom%travel = freedoms(1, n)
                  freedom%speed = freedoms(2, n)
                  freedom%aside = freedoms(3:, n)
               end associate
            end do
         end do
      end if
      if (store%writes) return
      do t = 1, size(tools)
         call tools(t)%settle()
      end do
   end subroutine describe_freedoms

   !> The sums of each pair of contact groups, and its largest overlap. Without groups there are no rows of
   !> these.
   subroutine describe_pairs(store, pairs, error)
      class(state_store_t), intent(inout) :: store
      type(body_pairs_t), intent(inout) :: pairs
      type(error_t), intent(inout) :: error
      real(wp) :: values(state_reals + 1, size(pairs%states))
      if (.not. pairs%active()) return
      values(:state_reals, :) = reshape(transfer(pairs%states, [0.0_wp]), [state_reals, size(pairs%states)])
      values(state_reals + 1, :) = pairs%overlap
      call store%reals('/state/pairs', values, error)
      pairs%states = transfer(values(:state_reals, :), pairs%states)
      pairs%overlap = values(state_reals + 1, :)
   end subroutine describe_pairs

   !> Data of a block other than its particles: lowest and highest position of their centres, m; accumulated
   !> work by kinds, accumulated loss, J; run breaks on average and of the last step; disorder.
   pure function block_state(model, l, b) result(values)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b !< level, own block
      real(wp) :: values(block_reals)
      associate (block => model%levels(l)%blocks(b))
         values = [block%lowest, block%highest, model%effect_step(l)%accumulated(block%index), &
                   model%lost_in_merging(blocks_before(model%levels, l) + block%index), &
                   block%mean_breaks, real(block%run_breaks, wp), block%disorder]
      end associate
   end function block_state

   subroutine set_block_state(model, l, b, values)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l, b !< level, own block
      real(wp), intent(in) :: values(block_reals)
      associate (block => model%levels(l)%blocks(b))
         block%lowest = values(1:3)
         block%highest = values(4:6)
         call model%effect_step(l)%accumulate(block%index, values(7:9))
         model%lost_in_merging(blocks_before(model%levels, l) + block%index) = values(10)
         block%mean_breaks = values(11)
         block%run_breaks = -1 ! unknown, not from this run
         if (abs(values(12)) <= huge(1)) block%run_breaks = nint(values(12))
         block%disorder = values(13)
      end associate
   end subroutine set_block_state

   !> The regions of levels 2 and on, packed, one after the other.
   pure function regions_of(model) result(regions)
      type(model_t), intent(in) :: model
      integer(i8), allocatable :: regions(:)
      integer :: l
      allocate (regions(0))
      do l = 2, size(model%levels)
         regions = [regions, model%levels(l)%region%packed()]
      end do
   end function regions_of

   !> Set the levels' regions; `good` is false if they do not fit these grids.
   subroutine set_regions(model, regions, good)
      type(model_t), intent(inout) :: model
      integer(i8), intent(in) :: regions(:)
      logical, intent(out) :: good
      integer :: l, next
      next = 1
      good = .true.
      do l = 2, size(model%levels)
         if (good) call unpack_region(model%levels(l)%grid, regions, next, model%levels(l)%region, good)
      end do
      good = good .and. next > size(regions)
   end subroutine set_regions

end module m_state
