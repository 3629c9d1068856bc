!> The contact problem of one step: its rows (a contact point and a direction), and the operator from contact
!> forces to velocities, through the nodes of the rows and through load-driven tools (theory.md, eq.
!> contact-operator). It is distributed over the ranks. Products use only the active rows: those of the normal
!> forces, those of friction, or both; or the free ones of the normal forces.
module m_contact_system
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_communicator, only: communicator_t
   use m_petsc_operator, only: petsc_operator_t
   use m_cell_rows, only: cell_rows_t, cell_nodes, width
   use m_contact_nodes, only: contact_nodes_t, nodal_forces_t
   implicit none
   private
   public :: contact_system_t

   type, extends(petsc_operator_t) :: contact_system_t
      type(communicator_t) :: communicator
      integer :: rows = 0
      integer :: parts = 0 !< number of parts: the effect of a row's force on the nodes of one velocity field.
                           !< One per row for a tool, one per body between bodies; in the order of the rows
      integer :: first = 1, last = 0 !< the active rows: of the normal forces, of friction, or both
      integer :: normal = 0                      !< rows of normal forces; those of friction follow
      type(contact_nodes_t) :: nodes             !< of all rows
      logical :: gives_way = .false.             !< at least one tool is load-driven
      integer(i8) :: products = 0                !< number of applications of the operator during the run
      integer, allocatable :: row(:)             !< (parts): row of each part
      integer, allocatable :: begins(:) !< (parts + 1): first entry of each part; an entry is one of its nodes
      integer, allocatable :: place(:, :, :) !< (0:2, 3, parts): nodes in the grid along each axis, from -1;
                                             !< of a cell's 0:1 count
      integer, allocatable :: field(:)           !< (parts): velocity field of the nodes
      integer, allocatable :: node(:)            !< (entries): local numbers, x fastest
      real(wp), allocatable :: weight(:)         !< (entries): of the contact point on the node
      real(wp), allocatable :: direction(:, :)   !< (4, parts): in which a force acts; the last is 0
      type(cell_rows_t) :: normal_rows, friction_rows !< as products take them, for unknowns that are scaled
                                                      !< forces
      type(cell_rows_t) :: free_rows             !< those of the normal forces that are free
      logical, allocatable :: free(:)            !< (rows of normal forces)
      integer, allocatable :: tool(:)            !< (rows)
      integer, allocatable :: first_freedom(:) !< (tools + 1): first load-driven freedom of each tool
      real(wp), allocatable :: along(:, :) !< (largest number of freedoms of a tool, rows): generalised load
                                           !< per unit force, 1 or m
      real(wp), allocatable :: freedom_mobility(:) !< (freedoms): s/kg or s/(kg m2)
      real(wp), allocatable :: freedom_push(:) !< (freedoms): work array: forces and moments, then the
                                               !< resulting speeds
      real(wp), allocatable :: mobility(:, :)    !< (4, nodes): dt/m, 0 for fixed components, s/kg
      real(wp), allocatable :: force(:, :) !< (4, nodes): work array: forces, then the resulting velocities
      real(wp), allocatable :: scale(:)          !< (rows): scales the diagonal to 1
      real(wp), allocatable :: softness(:)       !< (rows): part of the diagonal due to the compliance
      logical :: has_subcell = .false.           !< includes the compliance of the half-space below a cell
                                                 !< (eq. subcell):
      real(wp), allocatable :: subcell_rows(:)   !< (rows): c h/(E* A dt), s/kg, on the diagonal; and
      real(wp), allocatable :: subcell_nodes(:, :) !< (4, nodes): c h/(E* a dt), s/kg, subtracted from
                                                   !< mobilities; 0 for fixed components
   contains
      procedure :: begin
      procedure :: activate
      procedure :: add_row
      procedure :: add_part
      procedure :: number_nodes
      procedure :: group_rows
      procedure :: multiply
      procedure :: set_free
      procedure :: multiply_free
      procedure :: respond
      procedure :: nodal_forces
      procedure :: set_scale
      procedure :: pair_scales
      procedure, private :: make_room
      procedure, private :: spread
      procedure, private :: push_tools
      procedure, private :: share
      procedure, private :: set_in_motion
      procedure, private :: collect
      procedure, private :: add_tools
   end type contact_system_t

contains

   !> Start an empty system.
   subroutine begin(self, communicator, cells, fields, freedoms, mobility)
      class(contact_system_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      integer, intent(in) :: cells(3)          !< of the grid
      integer, intent(in) :: fields            !< velocity fields
      integer, intent(in) :: freedoms(:)       !< (tools): number of load-driven freedoms of each
      real(wp), intent(in) :: mobility(:)      !< of these, tool by tool, s/kg or s/(kg m2); the same on all
                                               !< ranks
      integer :: t
      self%communicator = communicator
      self%rows = 0
      self%parts = 0
      self%nodes%extent = [cells + 3, fields]
      if (.not. allocated(self%first_freedom)) allocate (self%first_freedom(0:size(freedoms) + 1))
      self%first_freedom(0) = 1 ! rows between bodies have the tool 0
      self%first_freedom(1:) = [(1 + sum(freedoms(:t)), t=0, size(freedoms))]
      self%freedom_mobility = mobility
      self%freedom_push = 0.0_wp*mobility
      self%gives_way = any(mobility > 0.0_wp)
      if (.not. allocated(self%place)) &
         allocate (self%place(0:2, 3, 64), self%weight(512), self%begins(65), self%direction(width, 64), &
                   self%tool(64), self%along(maxval([0, freedoms]), 64), self%row(64), self%field(64))
      self%begins(1) = 1
   end subroutine begin

   !> Add a row: the grid coordinates of the nodes of its contact point along each axis, their weights, the
   !> direction of its force; the tool that the reaction acts on, and the generalised loads on its load-driven
   !> freedoms.
   subroutine add_row(self, last, place, weight, direction, field, tool, along)
      class(contact_system_t), intent(inout) :: self
      integer, intent(in) :: last !< nodes along each axis are from 0 to here: 1 in a cell, 2 around a bin
      integer, intent(in) :: place(0:2, 3)            !< (nodes, axes), from -1
      integer, intent(in) :: field                    !< velocity field of the nodes
      integer, intent(in) :: tool                     !< 0: none, another body
      real(wp), intent(in) :: weight(0:2, 0:2, 0:2), direction(3)
      real(wp), intent(in), optional :: along(:) !< required for rows with tools if any tool is load-driven
      self%rows = self%rows + 1
      call self%add_part(last, place, weight, direction, field)
      self%tool(self%rows) = tool
      if (present(along)) self%along(:size(along), self%rows) = along
   end subroutine add_row

   !> Add to the last row the effect of its force on another velocity field.
   subroutine add_part(self, last, place, weight, direction, field)
      class(contact_system_t), intent(inout) :: self
      integer, intent(in) :: last, place(0:2, 3), field !< as in add_row
      real(wp), intent(in) :: weight(0:2, 0:2, 0:2), direction(3)
      integer :: j, k, n, s
      n = self%parts + 1
      s = self%begins(n)
      self%parts = n
      self%begins(n + 1) = s + (last + 1)**3
      call self%make_room(n, self%begins(n + 1) - 1)
      self%row(n) = self%rows
      self%field(n) = field
      self%place(:, :, n) = place
      do k = 0, last
         do j = 0, last
            self%weight(s:s + last) = weight(:last, j, k)
            s = s + last + 1
         end do
      end do
      self%direction(:, n) = [direction, 0.0_wp]
   end subroutine add_part

   !> Provide room for a number of parts, at least as many as rows, and entries, and one more begin of a part.
   subroutine make_room(self, parts, entries)
      class(contact_system_t), intent(inout) :: self
      integer, intent(in) :: parts, entries
      integer, allocatable :: more_places(:, :, :), more_begins(:), more_tools(:), more_rows(:), &
                              more_fields(:)
      real(wp), allocatable :: more_weights(:), more_directions(:, :), more_along(:, :)
      integer :: n
      n = size(self%weight)
      if (entries > n) then
         allocate (more_weights(2*n + entries))
         more_weights(:n) = self%weight
         call move_alloc(more_weights, self%weight)
      end if
      n = size(self%tool)
      if (parts >= n) then
         allocate (more_places(0:2, 3, 2*n), more_begins(2*n + 1), more_directions(width, 2*n), &
                   more_tools(2*n), more_along(size(self%along, 1), 2*n), more_rows(2*n), more_fields(2*n))
         more_places(:, :, :n) = self%place
         more_begins(:n + 1) = self%begins
         more_directions(:, :n) = self%direction
         more_rows(:n) = self%row
         more_fields(:n) = self%field
         more_tools(:n) = self%tool
         more_along(:, :n) = self%along
         call move_alloc(more_places, self%place)
         call move_alloc(more_begins, self%begins)
         call move_alloc(more_directions, self%direction)
         call move_alloc(more_rows, self%row)
         call move_alloc(more_fields, self%field)
         call move_alloc(more_tools, self%tool)
         call move_alloc(more_along, self%along)
      end if
   end subroutine make_room

   !> Choose the rows that products use: those of the normal forces, those of friction, or all.
   pure subroutine activate(self, first, last)
      class(contact_system_t), intent(inout) :: self
      integer, intent(in) :: first, last
      self%first = first
      self%last = last
   end subroutine activate

   !> Number the nodes after all rows have been added.
   subroutine number_nodes(self, normal)
      class(contact_system_t), intent(inout) :: self
      integer, intent(in) :: normal !< rows of normal forces, the first ones
      integer :: last(self%parts)
      self%normal = normal
      associate (entries => self%begins(2:self%parts + 1) - self%begins(:self%parts))
         last = merge(1, 2, entries == cell_nodes)
      end associate
      if (allocated(self%node)) then
         if (size(self%node) < self%begins(self%parts + 1) - 1) deallocate (self%node)
      end if
      if (.not. allocated(self%node)) allocate (self%node(size(self%weight)))
      call self%nodes%number_all(self%place(:, :, :self%parts), last, self%field(:self%parts), self%node)
      if (allocated(self%force)) then
         if (size(self%force, 2) >= self%nodes%count) return
         deallocate (self%force, self%mobility, self%subcell_nodes)
      end if
      associate (room => self%nodes%count + self%nodes%count/2)
         allocate (self%force(width, room), self%mobility(width, room), self%subcell_nodes(width, room), &
                   source=0.0_wp)
      end associate
   end subroutine number_nodes

   !> Group the rows by cells; needs numbers and scales.
   subroutine group_rows(self)
      class(contact_system_t), intent(inout) :: self
      real(wp) :: direction(width, self%parts)
      integer :: c
      do c = 1, self%parts
         direction(:, c) = self%scale(self%row(c))*self%direction(:, c)
      end do
      associate (n => count(self%row(:self%parts) <= self%normal))
         call self%normal_rows%sort(self%nodes%count, self%row(:n), self%begins(:n + 1), self%node, &
                                    self%weight, direction(:, :n))
         call self%friction_rows%sort(self%nodes%count, self%row(n + 1:self%parts) - self%normal, &
                                      self%begins(n + 1:self%parts + 1), self%node, self%weight, &
                                      direction(:, n + 1:))
      end associate
   end subroutine group_rows

   !> to = M from: velocities of the active rows under their forces, both scaled so that the diagonal of M is
   !> 1. Values beyond them are idle and copied.
   subroutine multiply(self, from, to)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: from(:)
      real(wp), intent(out), contiguous :: to(:)
      integer :: n
      n = self%last - self%first + 1
      self%products = self%products + 1
      call self%spread(from(:n))
      call self%share()
      call self%set_in_motion()
      call self%collect(to(:n))
      to(:n) = to(:n) + self%softness(self%first:self%last)*from(:n)
      to(n + 1:) = from(n + 1:)
   end subroutine multiply

   !> Set the rows that multiply_free uses: normal forces, or all.
   subroutine set_free(self, free)
      class(contact_system_t), intent(inout) :: self
      logical, intent(in) :: free(:)
      self%free = free(:self%last)
      if (self%last > self%normal) return ! rarely used: no separate rows for it
      call self%free_rows%choose(self%normal_rows, self%free)
   end subroutine set_free

   !> The same as `multiply`, restricted to the free rows. The other entries are 0.
   subroutine multiply_free(self, from, to)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: from(:)
      real(wp), intent(out), contiguous :: to(:)
      if (self%last > self%normal) then
         call self%multiply(from, to)
         to(:self%last) = merge(to(:self%last), 0.0_wp, self%free)
         return
      end if
      self%products = self%products + 1
      self%force(:, :self%nodes%count) = 0.0_wp
      call self%free_rows%spread(from, self%force)
      if (self%gives_way) call self%push_tools(from(:self%normal))
      call self%share()
      call self%set_in_motion()
      to = 0.0_wp
      call self%free_rows%collect(self%force, to)
      associate (some => to(:self%normal))
         if (self%gives_way) then
            call self%add_tools(some)
            some = merge(some, 0.0_wp, self%free)
         end if
         some = some + self%softness(:self%normal)*from(:self%normal)
      end associate
   end subroutine multiply_free

   !> Collective: velocities of some rows due to the forces of others, both scaled. The active rows do not
   !> change.
   subroutine respond(self, pushed, from, asked, to)
      class(contact_system_t), intent(inout) :: self
      integer, intent(in) :: pushed(2), asked(2) !< first and last row
      real(wp), intent(in), contiguous :: from(:)
      real(wp), intent(out), contiguous :: to(:)
      self%products = self%products + 1
      call self%activate(pushed(1), pushed(2))
      call self%spread(from)
      call self%share()
      call self%set_in_motion()
      call self%activate(asked(1), asked(2))
      call self%collect(to)
   end subroutine respond

   !> Apply the scaled contact forces of this rank's active rows to their nodes and tools.
   subroutine spread(self, forces)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: forces(:) !< (active rows)
      self%force(:, :self%nodes%count) = 0.0_wp
      if (self%first <= self%normal) call self%normal_rows%spread(forces, self%force)
      if (self%last > self%normal) &
         call self%friction_rows%spread(forces(self%normal - self%first + 2:), self%force)
      if (self%gives_way) call self%push_tools(forces)
   end subroutine spread

   !> The same for the freedoms of tools.
   subroutine push_tools(self, forces)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: forces(:) !< (active rows)
      integer :: c, k
      self%freedom_push = 0.0_wp
      do c = self%first, self%last
         associate (first => self%first_freedom(self%tool(c)))
            do k = first, self%first_freedom(self%tool(c) + 1) - 1
               self%freedom_push(k) = self%freedom_push(k) + self%along(k - first + 1, c)*self%scale(c) &
                                      *forces(c - self%first + 1)
            end do
         end associate
      end do
   end subroutine push_tools

   !> Collective among neighbours: the active rows' forces (N) on nodes, a part for each neighbour rank and
   !> this one, by rising rank, so that all ranks that share a node add up its force in the same order.
   subroutine nodal_forces(self, forces, parts)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: forces(:) !< (active rows), N
      type(nodal_forces_t), allocatable, intent(out) :: parts(:)
      real(wp) :: scaled(size(forces))
      associate (scale => self%scale(self%first:self%last))
         scaled = 0.0_wp
         where (scale > 0.0_wp) scaled = forces/scale
      end associate
      call self%spread(scaled)
      call self%nodes%exchange(self%force, parts)
   end subroutine nodal_forces

   !> Collective: add to the forces of this rank's rows those of all other ranks' rows on these nodes and on
   !> load-driven tools.
   subroutine share(self)
      class(contact_system_t), intent(inout) :: self
      if (self%gives_way) &
         call MPI_Allreduce(MPI_IN_PLACE, self%freedom_push, size(self%freedom_push), MPI_DOUBLE_PRECISION, &
                            MPI_SUM, self%communicator%comm)
      call self%nodes%add_up(self%force)
   end subroutine share

   !> Convert forces on nodes and tools to the velocities that they cause in a step.
   pure subroutine set_in_motion(self)
      class(contact_system_t), intent(inout) :: self
      call multiply_each(width*self%nodes%count, self%mobility, self%force)
      if (self%gives_way) self%freedom_push = self%freedom_push*self%freedom_mobility
   end subroutine set_in_motion

   !> Multiply values by factors, one by one.
   pure subroutine multiply_each(count, factors, values)
      integer, intent(in) :: count
      real(wp), intent(in) :: factors(count)
      real(wp), intent(inout) :: values(count)
      values = factors*values
   end subroutine multiply_each

   !> Velocities of the active rows from those of their nodes, and relative to tools that give way, scaled.
   subroutine collect(self, y)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(inout), contiguous :: y(:) !< (active rows)
      y = 0.0_wp
      if (self%first <= self%normal) call self%normal_rows%collect(self%force, y)
      if (self%last > self%normal) &
         call self%friction_rows%collect(self%force, y(self%normal - self%first + 2:))
      if (self%gives_way) call self%add_tools(y)
   end subroutine collect

   !> Add the velocities of load-driven freedoms to the active rows, scaled.
   pure subroutine add_tools(self, y)
      class(contact_system_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: y(:) !< (active rows)
      integer :: c, k
      do c = self%first, self%last
         associate (first => self%first_freedom(self%tool(c)), at => c - self%first + 1)
            do k = first, self%first_freedom(self%tool(c) + 1) - 1
               y(at) = y(at) + self%along(k - first + 1, c)*self%freedom_push(k)*self%scale(c)
            end do
         end associate
      end do
   end subroutine add_tools

   !> Scale unknowns so that the diagonal without compliance is 1; needs numbers and mobilities.
   subroutine set_scale(self, compliance, below)
      class(contact_system_t), intent(inout) :: self
      real(wp), intent(in) :: compliance(:) !< (rows): of each contact point, s/kg
      real(wp), intent(in) :: below(:)      !< (rows): contribution of the half-space below the cells, s/kg;
                                            !< less than 0: the row takes no part
      real(wp) :: diagonal(self%rows)
      integer :: c, k, n, s
      if (allocated(self%scale)) then
         if (size(self%scale) < self%rows) deallocate (self%scale, self%softness)
      end if
      if (.not. allocated(self%scale)) allocate (self%scale(2*self%rows + 8), self%softness(2*self%rows + 8))
      diagonal = 0.0_wp
      do n = 1, self%parts
         c = self%row(n)
         do s = self%begins(n), self%begins(n + 1) - 1
            diagonal(c) = diagonal(c) + self%weight(s)**2*sum(self%direction(:, n)**2*self%mobility(:, &
                  self%node(s)))
         end do
      end do
      do c = 1, self%rows
         associate (first => self%first_freedom(self%tool(c)), beyond => self%first_freedom(self%tool(c) + 1))
            do k = first, beyond - 1
               diagonal(c) = diagonal(c) + self%along(k - first + 1, c)**2*self%freedom_mobility(k)
            end do
         end associate
         self%scale(c) = 0.0_wp
         if (diagonal(c) > 0.0_wp .and. below(c) >= 0.0_wp) &
            self%scale(c) = 1.0_wp/sqrt(diagonal(c) + below(c))
         self%softness(c) = compliance(c)*self%scale(c)**2
      end do
      if (.not. self%has_subcell) return
      associate (last => self%nodes%count)
         self%mobility(:, :last) = self%mobility(:, :last) - self%subcell_nodes(:, :last)
      end associate
   end subroutine set_scale

   !> Give each pair of rows from `first` on the same scale, so that discs stay round.
   pure subroutine pair_scales(self, first)
      class(contact_system_t), intent(inout) :: self
      integer, intent(in) :: first
      integer :: r
      do r = first, self%rows - 1, 2
         associate (scale => self%scale(r:r + 1), softness => self%softness(r:r + 1))
            if (all(scale > 0.0_wp)) then ! a direction with all components fixed has scale 0
               softness = minval(softness)
               scale = minval(scale)
            else
               softness = maxval(softness)
               scale = maxval(scale)
            end if
         end associate
      end do
   end subroutine pair_scales

end module m_contact_system
