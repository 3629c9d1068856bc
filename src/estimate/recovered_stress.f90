!> The recovered stress of all particles (theory.md, eq. recovered), separately for each body.
module m_recovered_stress
   use m_kinds, only: wp, i8
   use m_constants, only: block_size
   use m_node_values, only: tile_last
   use m_side_kinds, only: boundary_roller, side_kinds
   use m_grid_level, only: grid_level_t
   use m_model, only: model_t
   use m_level, only: level_t, tile_bytes
   use m_block, only: block_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: bin_place
   use m_migration, only: frame_of
   use m_node_exchange, only: sum_tiles
   use m_boundary, only: fold_symmetry, mirror_means, motion_parity, stress_parity
   use m_stress_recovery, only: give_stress, take_stress, make_means, mix_means
   use m_node_filling, only: even_share
   use m_composite_means, only: add_from_finer, take_from_coarser
   implicit none
   private
   public :: block_stress_t, level_stress_t, recover_stress, give, take, members_of, chosen, &
             mirrors_of, make_mixed_means, recovery_bytes

   !> The recovered stress of the particles of a block.
   type :: block_stress_t
      real(wp), allocatable :: of(:, :) !< (6, particles), Pa; xx yy zz yz xz xy
   end type block_stress_t

   !> The same for the blocks of a level.
   type :: level_stress_t
      type(block_stress_t), allocatable :: blocks(:)
   end type level_stress_t

   !> The tiles of a level.
   type :: pool_t
      real(wp), allocatable :: tiles(:, :, :, :, :)
   end type pool_t

contains

   !> Memory (bytes) of the tiles that recover_stress uses on this rank: four for each block.
   pure integer(i8) function recovery_bytes(model)
      type(model_t), intent(in) :: model
      integer :: l
      recovery_bytes = sum([(4*tile_bytes*size(model%levels(l)%extent, 3), l=1, size(model%levels))])
   end function recovery_bytes

   !> Collective: the recovered stress of this rank's particles of all levels. The model is not changed.
   subroutine recover_stress(model, recovered)
      type(model_t), intent(inout) :: model
      type(level_stress_t), allocatable, intent(out) :: recovered(:) !< by level
      type(pool_t), dimension(size(model%levels)) :: places, stresses
      type(pool_t), dimension(size(model%levels)) :: even_places, even_stresses !< with even weights
      integer :: b, body, l
      allocate (recovered(size(model%levels)))
      do l = 1, size(model%levels)
         associate (level => model%levels(l))
            allocate (recovered(l)%blocks(size(level%blocks)))
            do b = 1, size(level%blocks)
               allocate (recovered(l)%blocks(b)%of(6, level%blocks(b)%particles%count), source=0.0_wp)
            end do
            allocate (places(l)%tiles, stresses(l)%tiles, even_places(l)%tiles, even_stresses(l)%tiles, &
                      mold=level%nodes)
         end associate
      end do
      do body = 1, size(model%materials%of_body)
         call sum_up(model, body, places, stresses)
         call sum_up(model, body, even_places, even_stresses, places)
         do l = 1, size(model%levels)
            call set_means(model, l, motion_parity, even_places, places)
            call set_means(model, l, stress_parity, even_stresses, stresses)
            do b = 1, size(model%levels(l)%blocks)
               call take(model%levels(l), b, members_of(model%levels(l)%blocks(b), body), &
                         places(l)%tiles(:, :, :, :, b), stresses(l)%tiles(:, :, :, :, b), &
                         recovered(l)%blocks(b)%of)
            end do
         end do
      end do
   end subroutine recover_stress

   !> Collective: sums over the particles of a body on the nodes of all levels, in all tiles, the finest level
   !> first: each restricts the sums of its constrained nodes to the next. With `filled`, the sums with the
   !> weights of the step: those with even weights, on nodes that need them (m_node_filling).
   subroutine sum_up(model, body, places, stresses, filled)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: body
      type(pool_t), intent(inout) :: places(:), stresses(:)
      type(pool_t), intent(in), optional :: filled(:)
      type(cell_list_t) :: members
      type(grid_level_t) :: mirrors
      integer :: b, l
      do l = size(model%levels), 1, -1
         mirrors = mirrors_of(model, l)
         associate (level => model%levels(l))
            do b = 1, size(level%blocks)
               associate (block => level%blocks(b))
                  if (present(filled)) then
                     members = members_near(block, body, needing(level, mirrors, block%place, &
                                                                 filled(l)%tiles(1, :, :, :, b)))
                  else
                     members = members_of(block, body)
                  end if
               end associate
               call give(level, mirrors, b, members, present(filled), places(l)%tiles(:, :, :, :, b), &
                         stresses(l)%tiles(:, :, :, :, b))
            end do
            if (l < size(model%levels)) then
               associate (composite => model%composite(l + 1), finer => model%levels(l + 1))
                  call add_from_finer(composite, model%communicator, finer, places(l + 1)%tiles, &
                                      finer%grid%cell, places(l)%tiles)
                  call add_from_finer(composite, model%communicator, finer, stresses(l + 1)%tiles, 0.0_wp, &
                                      stresses(l)%tiles)
               end associate
            end if
            call add_up(places(l)%tiles)
            call add_up(stresses(l)%tiles)
         end associate
      end do
   contains
      !> Sum over blocks and ranks.
      subroutine add_up(tiles)
         real(wp), intent(inout), contiguous, asynchronous :: tiles(:, :, :, :, :)
         call model%exchange(l)%start(tiles)
         call model%exchange(l)%wait(tiles)
         call sum_tiles(model%levels(l)%blocks, model%levels(l)%interior_first, tiles)
      end subroutine add_up
   end subroutine sum_up

   !> Collective: convert a level's sums to means, with even weights where nodes need them; constrained nodes
   !> get those of the coarser level.
   subroutine set_means(model, l, parity, evens, pools)
      type(model_t), intent(inout) :: model
      integer, intent(in) :: l
      real(wp), intent(in) :: parity(:, :)
      type(pool_t), intent(inout) :: evens(:) !< sums with even weights
      type(pool_t), intent(inout) :: pools(:) !< of all levels: those of coarser levels contain means
      type(grid_level_t) :: mirrors
      integer :: b
      mirrors = mirrors_of(model, l)
      associate (level => model%levels(l), tiles => pools(l)%tiles, even => evens(l)%tiles)
         do b = 1, size(level%blocks)
            call make_mixed_means(mirrors, level%blocks(b)%place, even(:, :, :, :, b), &
                                  tiles(:, :, :, :, b))
         end do
         if (l > 1) call take_from_coarser(model%composite(l), model%communicator, pools(l - 1)%tiles, tiles)
         do b = 1, size(level%blocks)
            call mirror_means(mirrors, level%blocks(b)%place, tiles(:, :, :, :, b), parity)
         end do
      end associate
   end subroutine set_means

   !> Convert sums in a block's tiles to means, with even weights where nodes need them.
   subroutine make_mixed_means(mirrors, place, even, tile)
      type(grid_level_t), intent(in) :: mirrors !< mirrors_of the level
      integer, intent(in) :: place(3)           !< of the block
      real(wp), intent(inout), contiguous :: even(:, :, :, :), tile(:, :, :, :)
      call make_means(even)
      call make_means(tile)
      call mix_means(even_share(mirrors, place, tile(1, :, :, :)), even, tile)
   end subroutine make_mixed_means

   !> A level's grid with the mirrors valid for the stress: where gravity acts across a plane of symmetry, it
   !> is a floor and not a mirror.
   pure function mirrors_of(model, l) result(grid)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l
      type(grid_level_t) :: grid
      integer :: axis, e
      real(wp) :: field(3)
      grid = model%levels(l)%grid
      do e = 1, size(model%effects)
         field = model%effects(e)%effect%uniform_acceleration()
         do axis = 1, 3
            if (.not. abs(field(axis)) > 0.0_wp) cycle
            where (side_kinds(grid%boundary(:, axis))%mirrors) grid%boundary(:, axis) = boundary_roller
         end do
      end do
   end function mirrors_of

   !> Add the contributions of a block's members to its own tiles, mirrored at symmetry planes.
   subroutine give(level, mirrors, b, members, even, places, stresses)
      type(level_t), intent(in) :: level
      type(grid_level_t), intent(in) :: mirrors !< mirrors_of the level
      integer, intent(in) :: b
      type(cell_list_t), intent(in) :: members
      logical, intent(in) :: even !< with even weights in place of those of the step
      real(wp), intent(inout), contiguous :: places(:, :, :, :), stresses(:, :, :, :)
      integer :: axis, side, sides(2, 3)
      associate (block => level%blocks(b))
         sides = -1
         do axis = 1, 3
            do side = 1, 2
               if (.not. side_kinds(mirrors%boundary(side, axis))%mirrors) &
                  sides(side, axis) = mirrors%plane(block%place, side, axis)
            end do
         end do
         call give_stress(members, block%particles%column, level%layout, frame_of(level, block), sides, &
                          even, places, stresses)
         call fold_symmetry(mirrors, block%place, places, motion_parity)
         call fold_symmetry(mirrors, block%place, stresses, stress_parity)
      end associate
   end subroutine give

   !> Evaluate the means in a block's tiles at its members.
   subroutine take(level, b, members, places, stresses, stress)
      type(level_t), intent(in) :: level
      integer, intent(in) :: b
      type(cell_list_t), intent(in) :: members
      real(wp), intent(in), contiguous :: places(:, :, :, :), stresses(:, :, :, :)
      real(wp), intent(inout) :: stress(:, :) !< (6, particles), Pa
      associate (block => level%blocks(b))
         call take_stress(members, block%particles%column, level%layout, frame_of(level, block), places, &
                          stresses, stress)
      end associate
   end subroutine take

   !> The particles of a body in a block; optionally only those that share nodes with a range.
   pure function members_of(block, body, low, high) result(members)
      type(block_t), intent(in) :: block
      integer, intent(in) :: body
      integer, intent(in), optional :: low(3), high(3) !< first and last of the nodes, in the level's indices
      type(cell_list_t) :: members
      integer :: n, p, found(block%particles%count)
      n = 0
      do p = 1, block%particles%count
         if (block%particles%body(p) /= body) cycle
         if (present(low)) then
            associate (middle => block_size*block%place + bin_place(int(block%cells%bin(p))))
               if (any(middle + 1 < low .or. middle - 1 > high)) cycle
            end associate
         end if
         n = n + 1
         found(n) = p
      end do
      members = chosen(block%cells, found(:n))
   end function members_of

   !> The particles of a body in a block of whose 27 nodes at least one is wanted.
   pure function members_near(block, body, wanted) result(members)
      type(block_t), intent(in) :: block
      integer, intent(in) :: body
      logical, intent(in) :: wanted(0:, 0:, 0:) !< nodes of the tile
      type(cell_list_t) :: members
      logical :: near(0:block_size - 1, 0:block_size - 1, 0:block_size - 1)
      integer :: bin(3), i, j, k, n, p, found(block%particles%count)
      do k = 0, block_size - 1
         do j = 0, block_size - 1
            do i = 0, block_size - 1
               near(i, j, k) = any(wanted(i:i + 2, j:j + 2, k:k + 2))
            end do
         end do
      end do
      n = 0
      do p = 1, block%particles%count
         bin = bin_place(int(block%cells%bin(p)))
         if (block%particles%body(p) /= body .or. .not. near(bin(1), bin(2), bin(3))) cycle
         n = n + 1
         found(n) = p
      end do
      members = chosen(block%cells, found(:n))
   end function members_near

   !> The nodes of a block's tile that need sums with even weights, or hand them to a coarser level.
   pure function needing(level, mirrors, place, volume) result(nodes)
      type(level_t), intent(in) :: level
      type(grid_level_t), intent(in) :: mirrors !< mirrors_of the level
      integer, intent(in) :: place(3)           !< of the block
      real(wp), intent(in) :: volume(0:, 0:, 0:) !< sums over all particles, m3
      logical :: nodes(0:tile_last, 0:tile_last, 0:tile_last)
      integer :: first(3), i, j, k
      nodes = even_share(mirrors, place, volume) > 0.0_wp
      first = block_size*place - 1
      if (level%number == 1 .or. .not. level%region%any_outer(first, first + tile_last)) return
      do k = 0, tile_last
         do j = 0, tile_last
            do i = 0, tile_last
               if (.not. level%region%is_inner(first + [i, j, k])) nodes(i, j, k) = .true.
            end do
         end do
      end do
   end function needing

   !> Some particles of a block as a list to traverse.
   pure function chosen(cells, numbers) result(members)
      type(cell_list_t), intent(in) :: cells
      integer, intent(in) :: numbers(:)
      type(cell_list_t) :: members
      members%bin = cells%bin
      members%order = numbers
      members%count = size(numbers)
      members%chosen = .true.
   end function chosen

end module m_recovered_stress
