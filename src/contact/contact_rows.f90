!> What the candidates of a step are to the contact system: rows, weights, mobilities of nodes (theory.md, eq. contact-operator).
module m_contact_rows
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_communicator, only: communicator_t
   use m_tool, only: tool_t
   use m_level, only: level_t
   use m_boundary, only: held_components
   use m_candidates, only: candidate_t, candidates_t
   use m_contact_system, only: contact_system_t
   use m_cell_rows, only: bin_nodes
   implicit none
   private
   public :: assemble, touched_nodes

   real(wp), parameter :: give = 10.0_wp !< compliance of sticking points, in that of the normal forces; only changes give

contains

   !> For each tool the box of the nodes that candidates of this rank touch, as largest places, negative and as they are, for a
   !> reduction by maxima; -huge where there are none.
   pure subroutine touched_nodes(candidates, level, bounds)
      type(candidates_t), intent(in) :: candidates
      type(level_t), intent(in) :: level
      integer, intent(out) :: bounds(:, :, :) !< (3, 2, tools)
      integer :: at(3), c, place(3), side
      logical :: held(3)
      bounds = -huge(bounds)
      do c = 1, candidates%count
         associate (it => candidates%list(c), bound => bounds(:, :, candidates%list(c)%tool))
            do side = 0, it%face%last ! what is beyond a plane along an axis is so for all nodes with that place along it
               call image_node(level, it, [side, side, side], place, at, held)
               bound = max(bound, reshape([-place, place], [3, 2]))
            end do
         end associate
      end do
   end subroutine touched_nodes

   !> Collective among neighbours: the operator of a step's candidates: a row for each normal force, then two for each friction.
   subroutine assemble(system, communicator, neighbours, tools, candidates, level, softness, time_step)
      type(contact_system_t), intent(inout) :: system
      type(communicator_t), intent(in) :: communicator !< of the ranks that solve
      integer, intent(in) :: neighbours(:)             !< of them, rising
      type(tool_t), intent(in) :: tools(:)
      type(candidates_t), intent(in) :: candidates
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: softness                 !< of the normal forces, in the mobilities of particles
      real(wp), intent(in) :: time_step                !< s
      real(wp) :: compliance(candidates%count + 2*candidates%rubbing)
      integer :: c, n, place(3, bin_nodes), t
      real(wp) :: weight(bin_nodes)
      logical, allocatable :: done(:)
      associate (list => candidates%list(:candidates%count))
         call system%begin(communicator, level%grid%cells, [(tools(t)%mobility(time_step), t=1, size(tools))])
         do c = 1, size(list)
            call nodes_of(level, list(c), n, place, weight)
            call system%add_row(place(:, :n), weight(:n), list(c)%facing, list(c)%tool, &
                                dot_product(list(c)%normal, tools(list(c)%tool)%spec%axis))
         end do
         compliance(:size(list)) = softness*time_step/list%mass
         do c = 1, size(list)
            if (list(c)%rubbing == 0) cycle
            call nodes_of(level, list(c), n, place, weight)
            do t = 1, 2
               call system%add_row(place(:, :n), weight(:n), list(c)%mirror*list(c)%tangent(:, t), list(c)%tool, &
                                   dot_product(list(c)%tangent(:, t), tools(list(c)%tool)%spec%axis))
               compliance(system%rows) = give*compliance(c)
            end do
         end do
         call system%number_nodes(size(list))
         done = [(.false., n=1, system%nodes)]
         do c = 1, size(list)
            call set_mobility(system, level, list(c), c, time_step, done)
         end do
      end associate
      call system%connect(neighbours)
      call system%set_scale(compliance)
      call system%pair_scales(candidates%count + 1)
   end subroutine assemble

   !> Nodes of a candidate in the grid and their weights.
   pure subroutine nodes_of(level, c, n, place, weight)
      type(level_t), intent(in) :: level
      type(candidate_t), intent(in) :: c
      integer, intent(out) :: n                   !< 8 or 27
      integer, intent(inout) :: place(3, bin_nodes)
      real(wp), intent(inout) :: weight(bin_nodes)
      integer :: i, j, k, at(3)
      logical :: held(3)
      n = 0
      do k = 0, c%face%last
         do j = 0, c%face%last
            do i = 0, c%face%last
               n = n + 1
               call image_node(level, c, [i, j, k], place(:, n), at, held)
               weight(n) = c%face%weight(i, j, k)
            end do
         end do
      end do
   end subroutine nodes_of

   !> Mobilities of the nodes of a candidate, which has a row of the system, where they are not there yet.
   pure subroutine set_mobility(system, level, c, row, time_step, done)
      type(contact_system_t), intent(inout) :: system
      type(level_t), intent(in) :: level
      type(candidate_t), intent(in) :: c
      integer, intent(in) :: row
      real(wp), intent(in) :: time_step
      logical, intent(inout) :: done(:) !< (nodes)
      integer :: i, j, k, n, s, place(3), at(3)
      real(wp) :: mass
      logical :: held(3)
      s = system%begins(row) - 1
      do k = 0, c%face%last
         do j = 0, c%face%last
            do i = 0, c%face%last
               s = s + 1
               n = system%node(s)
               if (done(n)) cycle
               done(n) = .true.
               call image_node(level, c, [i, j, k], place, at, held)
               mass = level%solved(1, at(1), at(2), at(3), c%block)
               system%mobility(:, n) = 0.0_wp
               if (mass > 0.0_wp) system%mobility(:3, n) = merge(0.0_wp, time_step/mass, held)
            end do
         end do
      end do
   end subroutine set_mobility

   !> The node that stands for a candidate's node: itself, or its mirror inside a symmetry plane, beyond which nodes have no
   !> weight. `image` is its place in the grid (from -1 to cells + 1), `at` that in the block's
   !> tile.
   pure subroutine image_node(level, c, offset, image, at, held)
      type(level_t), intent(in) :: level
      type(candidate_t), intent(in) :: c
      integer, intent(in) :: offset(3)
      integer, intent(out) :: image(3), at(3)
      logical, intent(out) :: held(3)
      integer :: place(3)
      logical :: turned(3)
      place = block_size*level%blocks(c%block)%place + c%face%corner + offset
      call held_components(level%grid, place, held, turned, image)
      at = image - block_size*level%blocks(c%block)%place + 1
   end subroutine image_node

end module m_contact_rows
