!test: ranks 1 2 4
!> The ranks that solve the contact problem: those whose tiles hold a node of a box, by looking at all nodes; what they do among
!> themselves waits for no other rank; a tool that is pressed into one end of a beam concerns the ranks there, until blocks are
!> placed anew, and gives what one rank gives.
program partners
   use mpi_f08
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_constants, only: block_size
   use m_communicator, only: communicator_t
   use m_box, only: box_t
   use m_sphere, only: sphere_t
   use m_scene, only: scene_t, grid_spec_t, tool_spec_t
   use m_grid_level, only: make_grid_level
   use m_level, only: level_t
   use m_partners, only: partners_t, owners_of
   use m_materials, only: material_of
   use m_model, only: model_t
   use m_advance, only: advance
   use m_chance, only: chance_t
   use m_wandering, only: alone
   use m_assertions, only: assertions_t
   implicit none
   type(communicator_t) :: comm
   type(assertions_t) :: test
   call comm%start()
   call test%start(comm, 'partners')
   call boxes()
   call among_themselves()
   call end_of_a_beam()
   call test%finish()

contains

   !> Random owners and boxes: who is needed, by going through the nodes of every block's tile.
   subroutine boxes()
      integer, parameter :: ranks = 7
      type(level_t) :: level
      type(chance_t) :: chance
      integer :: box(3, 2, 2), i, j, k, n, t, wrong, met(0:ranks)
      logical :: needed(0:ranks - 1)
      level%grid = make_grid_level(grid_spec_t(upper=[40.0_wp, 32.0_wp, 27.0_wp], cell_size=1.0_wp, cells=[40, 32, 27]))
      allocate (level%owner(0:level%grid%blocks(1) - 1, 0:level%grid%blocks(2) - 1, 0:level%grid%blocks(3) - 1))
      wrong = 0
      met = 0
      do n = 1, 2000
         do k = 0, level%grid%blocks(3) - 1
            do j = 0, level%grid%blocks(2) - 1
               do i = 0, level%grid%blocks(1) - 1
                  level%owner(i, j, k) = floor(chance%between(-3.0_wp, real(ranks, wp)))
                  level%owner(i, j, k) = max(-1, level%owner(i, j, k))
               end do
            end do
         end do
         do t = 1, 2
            do i = 1, 3
               box(i, 1, t) = floor(chance%between(-1.0_wp, level%grid%cells(i) + 2.0_wp))
               box(i, 2, t) = min(level%grid%cells(i) + 1, box(i, 1, t) + floor(chance%between(0.0_wp, 6.0_wp)))
            end do
         end do
         if (mod(n, 2) == 0) box(:, :, 2) = reshape([1, 1, 1, 0, 0, 0], [3, 2]) ! empty
         needed = .false.
         do k = 0, level%grid%blocks(3) - 1
            do j = 0, level%grid%blocks(2) - 1
               do i = 0, level%grid%blocks(1) - 1
                  if (level%owner(i, j, k) < 0) cycle
                  do t = 1, 2
                     if (holds_some(block_size*[i, j, k], box(:, :, t))) needed(level%owner(i, j, k)) = .true.
                  end do
               end do
            end do
         end do
         met(count(needed)) = met(count(needed)) + 1
         if (any(needed .neqv. owners_of(level, ranks, box(:, 1, :), box(:, 2, :)))) wrong = wrong + 1
      end do
      call test%check_equal(wrong, 0, 'boxes for which other ranks are called than have their nodes')
      call test%check(all(met(1:4) > 20), 'there were boxes of one, two, three and four ranks')
   end subroutine boxes

   !> True when the tile of a block, whose first node is given, holds a node of a box.
   pure logical function holds_some(origin, box)
      integer, intent(in) :: origin(3), box(3, 2)
      integer :: axis, node
      logical :: along(3)
      along = .false.
      do axis = 1, 3
         do node = box(axis, 1), box(axis, 2)
            along(axis) = along(axis) .or. (node >= origin(axis) - 1 .and. node <= origin(axis) + block_size)
         end do
      end do
      holds_some = all(along)
   end function holds_some

   !> All but the first rank, or that alone: a sum among them while the others only come to the end.
   subroutine among_themselves()
      type(partners_t) :: group
      logical :: member(0:comm%ranks - 1)
      integer :: r, total, turn
      do turn = 1, 2
         member = .true.
         member(0) = turn == 2 .or. comm%ranks == 1
         if (turn == 2) member(1:) = .false.
         call group%form(comm, member)
         call test%check(all([(group%has(r), r=0, comm%ranks - 1)] .eqv. member), 'members are known')
         call test%check(size(group%numbered([(r, r=0, comm%ranks - 1)])) == count(member), 'members among ranks')
         if (member(comm%rank)) then
            total = 1
            call MPI_Allreduce(MPI_IN_PLACE, total, 1, MPI_INTEGER, MPI_SUM, group%communicator%comm)
            call test%check_equal(total, count(member), 'members add up')
            call test%check_equal(group%communicator%ranks, count(member), 'members')
            call test%check(all(group%numbered([comm%rank]) == group%communicator%rank), 'a member by its number')
         end if
         call group%dissolve()
         call test%check(.not. group%has(comm%rank), 'no members')
      end do
   end subroutine among_themselves

   !> A beam of 8 x 1 x 1 blocks, its blocks on the ranks in turn along it, and a sphere pressed into one end.
   subroutine end_of_a_beam()
      type(scene_t) :: scene
      type(model_t) :: model, single
      type(error_t) :: error
      integer :: step, most
      real(wp) :: apart
      call make_scene(scene)
      call model%build(comm, scene, error)
      call single%build(alone(), scene, error)
      call test%check(.not. error%happened(), 'the beam is there')
      if (error%happened()) return
      most = 0
      apart = 0.0_wp
      do step = 1, 40
         call advance(model, 0.5e-12_wp, error)
         call advance(single, 0.5e-12_wp, error)
         if (error%happened()) exit
         if (allocated(model%contact%partners%member)) most = max(most, count(model%contact%partners%member))
         apart = max(apart, norm2(model%contact%states(1)%load - single%contact%states(1)%load))
      end do
      call test%check(.not. error%happened(), 'forty steps')
      if (error%happened()) return
      if (comm%is_root()) print '(3x,a,i0,a,es9.2,a)', 'ranks that solve: ', most, '; load on the tool ', &
         model%contact%states(1)%load(3), ' N'
      call test%check(model%contact%states(1)%load(3) > 0.0_wp, 'the tool is pressed')
      call test%check(most >= 1 .and. (most < comm%ranks .or. comm%ranks == 1), 'some ranks solve, and not all')
      call test%check(apart <= 1.0e-6_wp*norm2(single%contact%states(1)%load), 'loads are those of one rank')
      call test%check(model%contact%solves == single%contact%solves .and. model%contact%solves > 10, &
                      'every rank knows how many problems there were')
      call test%check(model%contact%handled == single%contact%handled, 'and of how many candidates')
      call model%rebalance(error, 500)
      if (comm%ranks > 1) call test%check(.not. any(model%contact%partners%member), 'whoever is needed is called anew')
      do step = 1, 5
         call advance(model, 0.5e-12_wp, error)
         call advance(single, 0.5e-12_wp, error)
      end do
      call test%check(.not. error%happened(), 'steps after that')
      call test%check(norm2(model%contact%states(1)%load - single%contact%states(1)%load) <= &
                      1.0e-6_wp*norm2(single%contact%states(1)%load), 'loads are those of one rank again')
      call single%release()
      call model%release()
   end subroutine end_of_a_beam

   subroutine make_scene(scene)
      type(scene_t), intent(out) :: scene
      real(wp), parameter :: h = 64.0e-9_wp
      scene%grid = grid_spec_t(upper=[72*h, 16*h, 16*h], cell_size=h, cells=[72, 16, 16])
      scene%end_time = 1.0_wp
      allocate (scene%materials(1), scene%bodies(1), scene%probes(0))
      scene%materials(1) = material_of('aluminium', 'elastic', 2710.0_wp, 70.0e9_wp, 0.33_wp)
      scene%bodies(1)%name = 'beam'
      scene%bodies(1)%material = 1
      scene%bodies(1)%shape = box_t(upper=[64*h, 8*h, 8*h])
      scene%tools = [tool_spec_t(name='ball', tip=[4*h, 4*h, 8*h], axis=[0.0_wp, 0.0_wp, -1.0_wp], &
                                 times=[0.0_wp], &
                                 speeds=[500.0_wp])]
      scene%tools(1)%shape = sphere_t(radius=6*h)
   end subroutine make_scene

end program partners
