!test: check
!test: ranks 1 2
!test: limit 120
!> What the guard keeps in memory is what a checkpoint keeps, for one procedure describes both: every number
!> that it names is the same after a copy has been given back, and so is what blocks keep. Numbers that no
!> other step would have changed are changed by hand. Without contact the steps from the copy on have the same
!> bits as those that were given up. A control: what the description does not name is not given back.
module m_listing
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   use m_state_store, only: state_store_t
   implicit none
   private
   public :: listing_t

   !> All that is described, with the name of the table it stands in.
   type, extends(state_store_t) :: listing_t
      real(wp), allocatable :: values(:)
      character(len=32), allocatable :: names(:)
   contains
      procedure :: reals_table
      procedure :: longs_table
   end type listing_t

contains

   subroutine reals_table(self, name, values, error)
      class(listing_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: values(:, :)
      type(error_t), intent(inout) :: error
      self%values = [self%values, reshape(values, [size(values)])]
      call append(self%names, name, size(values))
   end subroutine reals_table

   subroutine longs_table(self, name, values, error)
      class(listing_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer(i8), intent(inout) :: values(:, :)
      type(error_t), intent(inout) :: error
      self%values = [self%values, real(reshape(values, [size(values)]), wp)]
      call append(self%names, name, size(values))
   end subroutine longs_table

   !> Append `count` copies of a name.
   subroutine append(names, name, count)
      character(len=32), allocatable, intent(inout) :: names(:)
      character(len=*), intent(in) :: name
      integer, intent(in) :: count
      character(len=32), allocatable :: more(:)
      allocate (more(size(names) + count))
      more(:size(names)) = names
      more(size(names) + 1:) = name
      call move_alloc(more, names)
   end subroutine append

end module m_listing

program state
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_offer, only: catalogue_t
   use m_materials, only: known_materials
   use m_effects, only: known_effects
   use m_snapshot_formats, only: known_formats
   use m_scene, only: scene_t
   use m_scene_reader, only: interpret_scene
   use m_model, only: model_t
   use m_speed_bounds, only: bound_speeds
   use m_integrator, only: integrator_t
   use m_advance, only: explicit_t
   use m_move_regions, only: move_regions
   use m_changing, only: changing_t
   use m_energy, only: balance_t
   use m_state, only: describe_state, block_state
   use m_saved_state, only: saved_state_t
   use m_listing, only: listing_t
   use m_assertions, only: assertions_t
   implicit none

   character(len=*), parameter :: rubber = ', cell_size=1e-6, boundary=''symmetry'',''free'',''symmetry'',' &
                                           //'''free'',''roller'',''free'' / &material name=''r'', ' &
                                           //'model=''elastic'', density=1000, ' &
                                           //'young=1e6, poisson=0.3 /'
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(catalogue_t) :: catalogue
   call comm%start()
   call test%start(comm, 'state')
   call known_materials(catalogue)
   call known_effects(catalogue)
   call known_formats(catalogue)
   call keep('moving levels', '&scene end_time=1 / &grid lower=0,0,0, upper=40e-6,16e-6,16e-6'//rubber// &
             ' &level shape=''box'', lower=8e-6,0,0, upper=20e-6,16e-6,16e-6, follow=''ball'' / ' &
             //'&body name=''ball'', material=''r'', shape=''sphere'', center=14e-6,8e-6,8e-6, radius=3e-6,' &
             //' velocity=8,0,0, contact_group=''ball'' / &body material=''r'', shape=''box'', ' &
             //'lower=30e-6,4e-6,4e-6, upper=34e-6,12e-6,12e-6, contact_group=''wall'' / ' &
             //'&gravity acceleration=0,0,-1e5 / &damping kind=''local'', coefficient=0.1 /', 40, .true.)
   call keep('tool', '&scene end_time=1 / &grid lower=0,0,0, upper=12e-6,12e-6,12e-6'//rubber// &
             ' &body material=''r'', shape=''box'', lower=0,0,0, upper=10e-6,10e-6,8e-6 / &tool ' &
             //'name=''t'', shape=''sphere'', radius=6e-6, tip=0,0,8e-6, times=0, speeds=1, friction=0.3 / ' &
             //'&motion tool=''t'', kind=''slide'', axis=1,0,0, times=0, speeds=0.5 / ' &
             //'&motion tool=''t'', kind=''turn'', axis=0,0,1, point=0,0,8e-6, times=0, speeds=1e3 /', &
             20, .false.)
   call keep('quasi-static', '&scene end_time=1 / &grid lower=0,0,0, upper=8e-6,8e-6,8e-6'//rubber// &
             ' &body material=''r'', shape=''box'', lower=0,0,0, upper=6e-6,6e-6,6e-6 / ' &
             //'&gravity acceleration=0,0,-1e5 / &quasi_static step=0.01 /', 2, .false.)
   call test%finish()

contains

   subroutine keep(name, text, steps, same_bits)
      character(len=*), intent(in) :: name, text
      integer, intent(in) :: steps
      logical, intent(in) :: same_bits !< a run goes on from a copy with the same bits
      type(scene_t) :: scene
      type(model_t) :: model
      type(balance_t) :: balance
      type(saved_state_t) :: saved
      type(error_t) :: error
      class(integrator_t), allocatable :: integrator
      type(listing_t) :: kept, given_up, back
      real(wp), allocatable :: blocks(:), blocks_back(:)
      character(len=:), allocatable :: words
      integer :: n
      words = text
      call interpret_scene(comm, catalogue, words, scene, error)
      call test%check(.not. error%happened(), name//': the scene', error%message)
      if (error%happened()) return
      call model%build(comm, scene, error)
      call bound_speeds(model)
      allocate (explicit_t :: integrator)
      if (scene%quasi_static%present) then
         deallocate (integrator)
         allocate (changing_t :: integrator)
      end if
      call integrator%start(scene, model)
      call balance%begin(model)
      call go(integrator, scene, model, balance, steps, error)
      call saved%take(model, balance)
      call list(kept, model, balance, error)
      blocks = states_of_blocks(model)
      call go(integrator, scene, model, balance, steps, error)
      call list(given_up, model, balance, error)
      call test%check(.not. error%happened(), name//': steps are taken', error%message)
      call test%check(any(abs(given_up%values - kept%values) > 0.0_wp), name//': steps change the state')
      call spoil(model)
      call saved%give_back(model, balance)
      call list(back, model, balance, error)
      do n = 1, size(kept%values)
         call test%check(.not. abs(back%values(n) - kept%values(n)) > 0.0_wp, name//': '//trim(kept%names(n)))
      end do
      blocks_back = states_of_blocks(model)
      call test%check_equal(size(blocks_back), size(blocks), name//': blocks')
      call test%check_close(blocks_back, blocks, 0.0_wp, name//': what blocks keep')
      call test%check(model%null_space_share > 1.0_wp, &
                      name//': control: what is not described is not given back')
      if (same_bits) then
         call go(integrator, scene, model, balance, steps, error)
         call list(back, model, balance, error)
         call test%check(.not. any(abs(back%values - given_up%values) > 0.0_wp), &
                         name//': the same steps again')
         call test%check(model%moves > 0, name//': the level has moved')
      end if
      call test%check(.not. error%happened(), name//': to the end', error%message)
      call integrator%release()
      call model%release()
   end subroutine keep

   subroutine go(integrator, scene, model, balance, steps, error)
      class(integrator_t), intent(inout) :: integrator
      type(scene_t), intent(in) :: scene
      type(model_t), intent(inout) :: model
      type(balance_t), intent(inout) :: balance
      integer, intent(in) :: steps
      type(error_t), intent(inout) :: error
      integer :: n
      do n = 1, steps
         call integrator%step(model, integrator%next_step(scene, model, 1.0_wp), error)
         call move_regions(model, error)
      end do
      call balance%follow(model)
   end subroutine go

   !> Change what few steps leave alone.
   subroutine spoil(model)
      type(model_t), intent(inout) :: model
      integer :: b, l
      model%static_step = 17.0_wp
      model%null_space_share = 17.0_wp
      model%merges = model%merges + 17
      model%lost = 17.0_wp
      model%contact%unsolved_in_row = 17
      model%contact%worst_bridge = 17.0_wp
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            model%levels(l)%blocks(b)%mean_breaks = 17.0_wp
            model%levels(l)%blocks(b)%disorder = 17.0_wp
         end do
      end do
   end subroutine spoil

   subroutine list(listing, model, balance, error)
      type(listing_t), intent(out) :: listing
      type(model_t), intent(inout) :: model
      type(balance_t), intent(inout) :: balance
      type(error_t), intent(inout) :: error
      listing%writes = .true.
      listing%values = [real(wp) ::]
      allocate (listing%names(0))
      call describe_state(listing, model, balance, error)
   end subroutine list

   function states_of_blocks(model) result(values)
      type(model_t), intent(in) :: model
      real(wp), allocatable :: values(:)
      integer :: b, l
      values = [real(wp) ::]
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            values = [values, block_state(model, l, b)]
         end do
      end do
      where (abs(values) > 1.0e30_wp) values = 0.0_wp ! bounds of blocks without particles
   end function states_of_blocks

end program state
