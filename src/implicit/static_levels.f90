!> The unknowns of an equilibrium on all levels, as one space: nodes constrained by a coarser level are no
!> unknowns, move with it, and their forces are restricted to it (theory.md, eq. static-levels).
module m_static_levels
   use m_kinds, only: wp
   use m_node_values, only: mass_, v_x, v_z, f_x
   use m_boundary, only: apply_boundary
   use m_static_edges, only: prolong_to, set_hanging, restrict_to, take_up
   use m_level, only: level_t
   use m_model, only: model_t
   use m_complaints, only: max_cells_a_step
   use m_cell_mean, only: cells_of
   use m_migration, only: frame_of
   use m_static_nodes, only: static_nodes_t
   use m_static_tiles, only: fold_all, sum_up
   use m_trial_state, only: trial_block_t
   use m_ghost_penalty, only: ghost_penalty_t, mark_cells
   use m_follower_loads, only: follower_loads_t
   implicit none
   private
   public :: static_level_t, fit_levels, number_levels, spread, spread_aside, collect, gather_all, &
             find_ghost, find_followers, longest_way

   !> Unknowns of a level, stored in one vector after those of the coarser levels.
   type :: static_level_t
      type(static_nodes_t) :: unknowns
      integer :: before = 0                          !< unknowns of the coarser levels, on this rank
      integer :: rows(2) = 0                         !< of the level's grid
      type(trial_block_t), allocatable :: trial(:)   !< (own blocks)
      type(ghost_penalty_t) :: ghost
      type(follower_loads_t), allocatable :: followers(:) !< (own blocks)
      real(wp), allocatable :: forces(:, :, :, :, :) !< tiles as the level's
      real(wp), allocatable :: sums(:, :, :, :, :)   !< likewise for cells; where means over them are taken
   contains
      procedure :: first, last
      procedure :: clear_forces
   end type static_level_t

   real(wp), parameter :: max_move = 0.44_wp !< limit of displacements, of a cell of the coarsest level in a
                                             !< step, with
                                               !< finer levels: blocks are created that far ahead
   real(wp), parameter :: towards_each_other = 0.5_wp !< of that, where bodies may come into contact: their
                                                      !< surfaces find each other over a good half of a cell

contains

   !> Allocate data for the particles and tiles of the model; `largest`: particles of a block.
   subroutine fit_levels(levels, model, parts, largest)
      type(static_level_t), allocatable, intent(inout) :: levels(:)
      type(model_t), intent(in) :: model
      integer, intent(in) :: parts !< number of parts of a step for the laws
      integer, intent(out) :: largest
      integer :: b, l
      if (.not. allocated(levels)) allocate (levels(size(model%levels)))
      largest = 1
      do l = 1, size(levels)
         associate (level => model%levels(l), mine => levels(l))
            if (allocated(mine%trial)) then
               if (size(mine%trial) /= size(level%blocks)) deallocate (mine%trial, mine%followers)
            end if
            if (.not. allocated(mine%trial)) allocate (mine%trial(size(level%blocks)), &
                                                       mine%followers(size(level%blocks)))
            do b = 1, size(level%blocks)
               mine%trial(b)%parts = parts
               mine%trial(b)%flat = level%grid%section%is_flat()
               call mine%trial(b)%fit(level%blocks(b)%particles%count, tangents=.true.)
               largest = max(largest, level%blocks(b)%particles%count)
            end do
            if (allocated(mine%forces)) then
               if (size(mine%forces, 5) /= size(level%nodes, 5)) deallocate (mine%forces)
            end if
            if (.not. allocated(mine%forces)) allocate (mine%forces, mold=level%nodes)
            mine%forces = 0.0_wp
            mine%rows = level%grid%rows
            call fit_cells(mine, model, l)
         end associate
      end do
   end subroutine fit_levels

   !> Allocate data for means over cells, if an effect needs them, and the cells of the particles.
   subroutine fit_cells(mine, model, l)
      type(static_level_t), intent(inout) :: mine
      type(model_t), intent(in) :: model
      integer, intent(in) :: l
      integer :: b, n
      if (size(model%effect_step(l)%on_cells) == 0) return
      if (allocated(mine%sums)) deallocate (mine%sums)
      allocate (mine%sums, mold=mine%forces)
      mine%sums = 0.0_wp
      associate (level => model%levels(l))
         do b = 1, size(level%blocks)
            associate (trial => mine%trial(b), block => level%blocks(b))
               n = block%particles%count
               if (allocated(trial%cell)) deallocate (trial%cell, trial%value)
               allocate (trial%cell(n), trial%value(n))
               if (n > 0) call cells_of(n, block%cells%bin, block%particles%column, level%layout, &
                                        frame_of(level, block), trial%cell, block%cells%standing)
            end associate
         end do
      end associate
   end subroutine fit_cells

   !> List the loads that follow surfaces, after the loads of effects at the step's end.
   subroutine find_followers(levels, model, time, share)
      type(static_level_t), intent(inout) :: levels(:)
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: time  !< s: of the step's end
      real(wp), intent(in) :: share !< of the loads that acts then
      integer :: b, l
      do l = 1, size(levels)
         do b = 1, size(model%levels(l)%blocks)
            call levels(l)%followers(b)%find(model%effects, model%effect_step(l), model%levels(l), b, time, &
                                             share)
         end do
      end do
   end subroutine find_followers

   !> Number the unknowns of this rank; the nodes hold the sums of P2G.
   integer function number_levels(levels, model) result(count)
      type(static_level_t), intent(inout) :: levels(:)
      type(model_t), intent(in) :: model
      real(wp) :: most
      integer :: l
      count = 0
      do l = 1, size(levels)
         most = model%communicator%maximum(heaviest(model%levels(l)))
         if (l < size(levels)) then
            call levels(l)%unknowns%number(model%levels(l), levels(l)%ghost%filled, most, model%levels(l + 1))
         else
            call levels(l)%unknowns%number(model%levels(l), levels(l)%ghost%filled, most)
         end if
         levels(l)%before = count
         count = count + levels(l)%unknowns%count
      end do
   end function number_levels

   !> Largest mass of a node on this rank, kg.
   pure real(wp) function heaviest(level)
      type(level_t), intent(in) :: level
      heaviest = maxval([0.0_wp, level%nodes(mass_, :, :, :, :size(level%blocks))])
   end function heaviest

   !> Index of the first unknown of a level in the vector of all levels.
   pure integer function first(self)
      class(static_level_t), intent(in) :: self
      first = self%before + 1
   end function first

   !> And of the last one.
   pure integer function last(self)
      class(static_level_t), intent(in) :: self
      last = self%before + self%unknowns%count
   end function last

   pure subroutine clear_forces(self)
      class(static_level_t), intent(inout) :: self
      self%forces(:, :, self%rows(1):self%rows(2), :, :size(self%trial)) = 0.0_wp
   end subroutine clear_forces

   !> Collective: set the displacements of all nodes of all levels from the unknowns, fixed, mirrored and
   !> constrained ones included.
   subroutine spread(levels, model, z)
      type(static_level_t), intent(in) :: levels(:)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: z(:) !< m
      integer :: b, l
      do l = 1, size(levels)
         associate (level => model%levels(l), mine => levels(l))
            level%nodes(:, :, level%grid%rows(1):level%grid%rows(2), :, :size(level%blocks)) = 0.0_wp
            call mine%unknowns%scatter(z(mine%first():mine%last()), v_x, level%nodes)
            call sum_up(model, l, level%nodes)
            if (l > 1) call set_hanging(model%composite(l), level%nodes)
            do b = 1, size(level%blocks)
               call apply_boundary(level%grid, level%blocks(b)%place, level%nodes(:, :, :, :, b))
            end do
            if (l < size(levels)) call prolong_to(model%composite(l + 1), model%communicator, level%nodes)
         end associate
      end do
   end subroutine spread

   !> Collective: the same for other values, stored in place of velocities in the levels' `forces`. The old
   !> values of the nodes are overwritten.
   subroutine spread_aside(levels, model, values)
      type(static_level_t), intent(inout) :: levels(:)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: values(:)
      integer :: l
      call spread(levels, model, values)
      do l = 1, size(levels)
         associate (own => size(model%levels(l)%blocks), r => model%levels(l)%grid%rows)
            levels(l)%forces(v_x:v_z, :, r(1):r(2), :, :own) = &
               model%levels(l)%nodes(v_x:v_z, :, r(1):r(2), :, :own)
         end associate
      end do
   end subroutine spread_aside

   !> Collective: collect forces at the unknowns from all tiles with contributions of their blocks.
   !> `diagonal`: they are a diagonal of the stiffness.
   subroutine collect(levels, model, parity, values, diagonal)
      type(static_level_t), intent(inout) :: levels(:)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: parity(:, :) !< of mirror images
      real(wp), intent(inout) :: values(:)
      logical, intent(in), optional :: diagonal
      integer :: l
      do l = size(levels), 1, -1
         associate (mine => levels(l))
            call fold_all(model%levels(l), parity, mine%forces)
            if (l < size(levels)) call take_up(model%composite(l + 1), mine%forces)
            call sum_up(model, l, mine%forces)
            if (l > 1) &
               call restrict_to(model%composite(l), model%communicator, mine%forces, present(diagonal))
            call mine%unknowns%gather(f_x, mine%forces, values(mine%first():mine%last()))
         end associate
      end do
   end subroutine collect

   !> Values of the nodes of all levels at the unknowns; `place`: index of the first of three values of a
   !> node.
   pure subroutine gather_all(levels, model, place, values)
      type(static_level_t), intent(in) :: levels(:)
      type(model_t), intent(in) :: model
      integer, intent(in) :: place
      real(wp), intent(inout) :: values(:)
      integer :: l
      do l = 1, size(levels)
         associate (mine => levels(l))
            call mine%unknowns%gather(place, model%levels(l)%nodes, values(mine%first():mine%last()))
         end associate
      end do
   end subroutine gather_all

   !> Collective: find the faces of the ghost penalty.
   subroutine find_ghost(levels, model, share, time_step)
      type(static_level_t), intent(inout) :: levels(:)
      type(model_t), intent(inout) :: model
      real(wp), intent(in) :: share     !< of the secant modulus
      real(wp), intent(in) :: time_step !< s
      integer :: b, l
      do l = 1, size(levels)
         associate (level => model%levels(l), mine => levels(l))
            call mine%clear_forces()
            do b = 1, size(level%blocks)
               call mark_cells(level, model%materials, b, time_step, mine%forces(:, :, :, :, b))
            end do
            call sum_up(model, l, mine%forces)
            if (l < size(levels)) then
               call mine%ghost%find_edges(level, mine%forces, model%levels(l + 1))
            else
               call mine%ghost%find_edges(level, mine%forces)
            end if
            call sum_up(model, l, mine%forces)
            call mine%ghost%find_faces(level, mine%forces, share)
         end associate
      end do
   end subroutine find_ghost

   !> Allowed displacement of a level's particles in a step, m.
   pure real(wp) function longest_way(model, l) result(way)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l
      way = max_cells_a_step*model%levels(l)%grid%cell
      if (size(model%levels) > 1) way = min(way, max_move*model%levels(1)%grid%cell)
      if (model%contact%pairs%active()) way = towards_each_other*way
   end function longest_way

end module m_static_levels
