!> Surface elements of bodies that may come into contact: those of this rank's particles and those received
!> from near ranks, sorted into bins (theory.md, eqs surface-element, element-force).
module m_surface_elements
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_constants, only: block_size
   use m_block, only: block_t, directions
   use m_communicator, only: communicator_t
   use m_field_table, only: field_table_t
   use m_level, only: level_t
   use m_grid_level, only: grid_level_t
   use m_side_kinds, only: side_kinds
   use m_half_edges, only: fitted_edges
   use m_face_gap, only: deform
   use m_face_weights, only: find_face, cube_span, flattening
   use m_carried_face, only: list_faces
   use m_surface_fields, only: max_elements, area_name, arm_name
   implicit none
   private
   public :: element_t, surface_elements_t, surface_columns_t, find_columns, share_at

   !> One element: reals only, so that it can be sent directly.
   type :: element_t
      sequence
      real(wp) :: field = 0.0_wp       !< velocity field of its body
      real(wp) :: face(3) = 0.0_wp     !< middle of the material's surface, m
      real(wp) :: point(3) = 0.0_wp    !< where forces act: the face of the particle's domain, m
      real(wp) :: centre(3) = 0.0_wp   !< of the particle, m
      real(wp) :: normal(3) = 0.0_wp   !< outward
      real(wp) :: area = 0.0_wp        !< m2; of a section its length times the particle's edge
      real(wp) :: edge = 0.0_wp        !< of the particle, m
      real(wp) :: mass = 0.0_wp        !< of the particle, kg
      real(wp) :: velocity(3) = 0.0_wp !< of the particle, m/s
   end type element_t

   integer, parameter :: element_reals = storage_size(element_t())/storage_size(1.0_wp)
   real(wp), parameter :: flat_enough = 0.003_wp !< of a force: tolerated share beyond the face of a flattened
                                                 !< particle: at small strains a cell's nodes are enough

   !> Columns of the elements that a particle carries.
   type :: surface_columns_t
      integer :: elements = 0 !< maximum number per particle
      integer, dimension(max_elements) :: area = 0, arm = 0, pressure = 0, friction = 0
      integer, dimension(max_elements) :: gap = 0     !< gap after the last step, and the field that it
                                                       !< belongs to
      integer, dimension(max_elements) :: deflection = 0 !< below the cells: along the normal; a vector across
      integer, dimension(max_elements) :: overlap = 0 !< at the start
      integer, dimension(max_elements) :: offset = 0  !< exact gap at the start minus the fitted one
      integer, dimension(max_elements) :: bond = 0    !< remaining share of its strength; then its
                                                       !< slip so far, a vector
   end type surface_columns_t

   type :: surface_elements_t
      integer :: own = 0    !< number of this rank's elements; those of other ranks follow
      integer :: count = 0
      type(element_t), allocatable :: list(:)
      integer, allocatable :: block(:), particle(:), element(:) !< (own)
      real(wp), allocatable :: span(:, :, :) !< (3, 3, own): of the domain's face, m
      real(wp), allocatable :: last(:, :) !< (10, own): from the last step pressure and friction, Pa; gap, m;
                                          !< its field; deflections, m
      real(wp) :: longest = 0.0_wp !< largest edge of a particle, over all ranks, m
      real(wp), allocatable :: low(:, :), high(:, :) !< (3, fields): bounds of the faces, m
      real(wp), private :: bin = 1.0_wp              !< edge of the bins, m
      integer, allocatable :: field(:)               !< (count): velocity fields, in sorted order
      integer, allocatable, private :: place(:, :)   !< (3, count): bins
      integer, allocatable, private :: first(:), next(:) !< lists by hash of the bin
   contains
      procedure :: gather
      procedure :: exchange
      procedure :: mirror
      procedure :: sort
      procedure :: near
      procedure :: has_company
      procedure, private :: add
   end type surface_elements_t

contains

   !> Columns in which particles carry their elements.
   type(surface_columns_t) function find_columns(table) result(at)
      type(field_table_t), intent(in) :: table
      integer :: e
      do e = 1, max_elements
         if (table%column(area_name(e)) == 0) exit
         at%elements = e
         at%area(e) = table%column(area_name(e))
         at%arm(e) = table%column(arm_name(e))
      end do
   end function find_columns

   !> Collective: collect the elements of this rank's particles that others of another field may be near: in
   !> blocks next to that field's blocks, within two reaches of its faces. The elements within one reach may
   !> meet it, and these need their own surface around them. Pressures are taken out of the columns.
   subroutine gather(self, communicator, level, at, reach)
      class(surface_elements_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: level
      type(surface_columns_t), intent(in) :: at
      real(wp), intent(in) :: reach !< of weights, in edges of the longest particle
      real(wp) :: far, last(10)
      integer :: b, e, found, n, p
      if (.not. allocated(self%list)) allocate (self%list(64), self%block(64), self%particle(64), &
                                                self%element(64), self%span(3, 3, 64), self%last(10, 64))
      call find_all(self, communicator, level, at, found)
      far = 2.0_wp*reach*self%longest
      self%own = 0
      do n = 1, found
         b = self%block(n)
         p = self%particle(n)
         e = self%element(n)
         call take_last(level%blocks(b)%particles%column, at, p, e, last)
         if (.not. self%has_company(level%blocks(b)%field, self%list(n)%face, far)) cycle
         call self%add(level, at, b, p, e)
         self%last(:, self%own) = last
      end do
      self%count = self%own
   end subroutine gather

   !> Collective: blocks, particles and faces of all elements beside blocks of other fields; of all ranks the
   !> bounds of each field's faces and the longest particle.
   subroutine find_all(self, communicator, level, at, found)
      type(surface_elements_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      type(surface_columns_t), intent(in) :: at
      integer, intent(out) :: found
      real(wp) :: bounds(3, 0:2*level%grid%fields) ! sizes; then each field's low sides, negative, and high
      integer, allocatable :: of(:)
      integer :: b, e, faces, n, p
      bounds = -huge(bounds)
      found = 0
      do b = 1, size(level%blocks)
         if (.not. meets_others(level, level%blocks(b))) cycle
         associate (particles => level%blocks(b)%particles, x => level%layout%position, &
                    low => bounds(:, 2*level%blocks(b)%field - 1), high => bounds(:, 2*level%blocks(b)%field))
            if (allocated(of)) deallocate (of)
            allocate (of(particles%count))
            do e = 1, at%elements
               call list_faces(particles%column, particles%count, at%area(e), of, faces)
               call make_room(self, found + faces)
               do n = 1, faces
                  p = of(n)
                  found = found + 1
                  self%block(found) = b
                  self%particle(found) = p
                  self%element(found) = e
                  associate (face => self%list(found)%face)
                     face = particles%column(p, x:x + 2) + particles%column(p, at%arm(e):at%arm(e) + 2)
                     low = max(low, -face)
                     high = max(high, face)
                  end associate
                  bounds(:, 0) = max(bounds(:, 0), size_of(level, particles%column(p, :)))
               end do
            end do
         end associate
      end do
      call MPI_Allreduce(MPI_IN_PLACE, bounds, size(bounds), MPI_DOUBLE_PRECISION, MPI_MAX, &
                         communicator%comm)
      self%low = -bounds(:, 1::2)
      self%high = bounds(:, 2::2)
      self%longest = edge_of(level, max(0.0_wp, bounds(1, 0)))
   end subroutine find_all

   !> Volume of a particle, m3, or its area in a section, m2.
   pure real(wp) function size_of(level, values)
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: values(:) !< columns of the particle
      size_of = values(level%layout%volume)
      if (.not. level%grid%section%is_flat()) return
      size_of = size_of/level%grid%section%depth(values(level%layout%position))
   end function size_of

   !> The edge (m) of a particle of that size.
   pure real(wp) function edge_of(level, extent)
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: extent !< m3, or m2 in a section
      if (level%grid%section%is_flat()) then
         edge_of = sqrt(extent)
      else
         edge_of = extent**(1.0_wp/3.0_wp)
      end if
   end function edge_of

   !> True when faces of another field may be within a distance of a face.
   pure logical function has_company(self, field, face, distance)
      class(surface_elements_t), intent(in) :: self
      integer, intent(in) :: field
      real(wp), intent(in) :: face(3), distance !< m
      integer :: other
      has_company = .false.
      do other = 1, size(self%low, 2)
         if (other == field .or. has_company) cycle
         has_company = all(face > self%low(:, other) - distance &
                           .and. face < self%high(:, other) + distance)
      end do
   end function has_company

   !> Take the results of the last step at an element out of its particle's columns.
   pure subroutine take_last(column, at, p, e, last)
      real(wp), intent(inout), contiguous :: column(:, :)
      type(surface_columns_t), intent(in) :: at
      integer, intent(in) :: p, e !< particle and element
      real(wp), intent(out) :: last(10) !< as in surface_elements_t
      last = 0.0_wp
      if (at%pressure(e) == 0) return
      call take(column(p, at%pressure(e)), last(1))
      call take(column(p, at%gap(e):at%gap(e) + 1), last(5:6))
      if (at%deflection(e) > 0) call take(column(p, at%deflection(e):at%deflection(e) + 3), last(7:10))
      if (at%friction(e) > 0) call take(column(p, at%friction(e):at%friction(e) + 2), last(2:4))
   end subroutine take_last

   elemental subroutine take(value, last)
      real(wp), intent(inout) :: value
      real(wp), intent(out) :: last
      last = value
      value = 0.0_wp
   end subroutine take

   !> True when another field has a block at the place of a block or next to it.
   pure logical function meets_others(level, block) result(meets)
      type(level_t), intent(in) :: level
      type(block_t), intent(in) :: block
      integer :: field, n
      meets = .false.
      do field = 1, level%grid%fields
         if (field == block%field) cycle
         do n = 1, 27
            meets = level%owner_at(block%place + directions(:, n), field) >= 0
            if (meets) return
         end do
      end do
   end function meets_others

   !> Append the element of a particle. The force acts at the face of its domain, which determines the
   !> weights: on the line to the material's surface, within the domain.
   subroutine add(self, level, at, b, p, e)
      class(surface_elements_t), intent(inout) :: self
      type(level_t), intent(inout) :: level
      type(surface_columns_t), intent(in) :: at
      integer, intent(in) :: b, p, e !< numbers of the block, the particle and the element
      real(wp) :: along(3), to_face, to_point, half
      call make_room(self, self%own + 1)
      self%own = self%own + 1
      associate (it => self%list(self%own), layout => level%layout, span => self%span(:, :, self%own), &
                 column => level%blocks(b)%particles%column)
         self%block(self%own) = b
         self%particle(self%own) = p
         self%element(self%own) = e
         it%field = level%blocks(b)%field
         it%mass = column(p, layout%mass)
         it%velocity = column(p, layout%velocity:layout%velocity + 2)
         it%edge = edge_of(level, size_of(level, column(p, :)))
         it%area = norm2(column(p, at%area(e):at%area(e) + 2))
         it%normal = column(p, at%area(e):at%area(e) + 2)/it%area
         if (level%grid%section%is_flat()) & ! as a side of its square in 3D
            it%area = it%area*it%edge/level%grid%section%depth(column(p, layout%position) &
                                                              + column(p, at%arm(e)))
         associate (x => column(p, layout%position:layout%position + 2), &
                    arm => column(p, at%arm(e):at%arm(e) + 2))
            it%centre = x
            it%face = x + arm
            to_face = norm2(arm)
            along = arm/to_face
            if (deform(level)) then
               call find_face(fitted_edges(column(p, :), layout, level%grid%cell), along, to_face, to_point, &
                              span)
            else
               half = column(p, layout%half_size)
               to_point = min(to_face + flattening*half, half/maxval(abs(along)))
               span = cube_span(half, along)
            end if
            it%point = x + to_point*along
         end associate
      end associate
   end subroutine add

   !> Share of an element's force at its point, such that with the rest at the particle's centre the centre of
   !> the force is on the face, by the distances (m) of face and point from the centre.
   pure real(wp) function share_at(to_face, to_point) result(share)
      real(wp), intent(in) :: to_face, to_point
      share = 1.0_wp
      if (to_face < to_point) share = min(1.0_wp, max(0.0_wp, to_face/to_point) + flat_enough)
   end function share_at

   !> Provide room for a number of elements.
   subroutine make_room(self, wanted)
      type(surface_elements_t), intent(inout) :: self
      integer, intent(in) :: wanted
      type(element_t), allocatable :: more(:)
      if (wanted <= size(self%list)) return
      allocate (more(2*wanted))
      more(:size(self%list)) = self%list
      call move_alloc(more, self%list)
      self%block = reshape(self%block, [2*wanted], pad=[0])
      self%particle = reshape(self%particle, [2*wanted], pad=[0])
      self%element = reshape(self%element, [2*wanted], pad=[0])
      self%span = reshape(self%span, [3, 3, 2*wanted], pad=[0.0_wp])
      self%last = reshape(self%last, [10, 2*wanted], pad=[0.0_wp])
   end subroutine make_room

   !> Collective among near ranks: each receives the elements within `reach` of its blocks.
   subroutine exchange(self, level, reach)
      class(surface_elements_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: reach !< m, less than a block
      integer, dimension(size(level%near%ranks)) :: given, taken
      type(element_t), allocatable :: sent(:)
      real(wp), allocatable :: numbers(:)
      integer :: r
      allocate (sent(0))
      do r = 1, size(given)
         associate (some => pack(self%list(:self%own), is_near(level%near%ranks(r))))
            sent = [sent, some]
            given(r) = size(some)
         end associate
      end do
      call level%near%swap_counts(given, taken)
      call make_room(self, self%count + sum(taken))
      allocate (numbers(element_reals*sum(taken)))
      call level%near%swap_reals(transfer(sent, numbers), element_reals*given, numbers, element_reals*taken)
      self%list(self%count + 1:self%count + sum(taken)) = transfer(numbers, self%list, sum(taken))
      self%count = self%count + sum(taken)
   contains
      !> The own elements to be sent to a rank.
      function is_near(rank)
         integer, intent(in) :: rank
         logical :: is_near(self%own)
         integer :: e, field, last, n
         logical :: around(27)
         last = 0
         do e = 1, self%own
            associate (block => level%blocks(self%block(e)))
               if (self%block(e) /= last) then
                  last = self%block(e)
                  around = .false.
                  do n = 1, 27
                     do field = 1, level%grid%fields
                        around(n) = around(n) &
                                    .or. level%owner_at(block%place + directions(:, n), field) == rank
                     end do
                  end do
               end if
               is_near(e) = .false.
               do n = 1, 27
                  if (.not. around(n)) cycle
                  associate (low => block%origin + (block_size*directions(:, n) - 0.5_wp)*level%grid%cell)
                     is_near(e) = all(self%list(e)%face > low - reach .and. self%list(e)%face &
                                      < low + block_size*level%grid%cell + reach)
                  end associate
                  if (is_near(e)) exit
               end do
            end associate
         end do
      end function is_near
   end subroutine exchange

   !> Add the mirror images of elements near symmetry planes, beyond which the surface continues.
   subroutine mirror(self, grid, reach)
      class(surface_elements_t), intent(inout) :: self
      type(grid_level_t), intent(in) :: grid
      real(wp), intent(in) :: reach !< from the plane, m
      real(wp) :: plane
      integer :: axis, e, side
      do axis = 1, 3, merge(2, 1, grid%section%is_flat()) ! nothing lies beside a section
         do side = 1, 2
            if (.not. side_kinds(grid%boundary(side, axis))%mirrors) cycle
            plane = merge(grid%lower(axis), grid%upper(axis), side == 1)
            do e = 1, self%count
               if (abs(self%list(e)%face(axis) - plane) > reach) cycle
               call make_room(self, self%count + 1)
               self%count = self%count + 1
               associate (image => self%list(self%count))
                  image = self%list(e)
                  image%face(axis) = 2.0_wp*plane - image%face(axis)
                  image%point(axis) = 2.0_wp*plane - image%point(axis)
                  image%centre(axis) = 2.0_wp*plane - image%centre(axis)
                  image%normal(axis) = -image%normal(axis)
                  image%velocity(axis) = -image%velocity(axis)
               end associate
            end do
         end do
      end do
   end subroutine mirror

   !> Sort the elements into bins of an edge, and find the bounds of each field's.
   subroutine sort(self, fields, edge)
      class(surface_elements_t), intent(inout) :: self
      integer, intent(in) :: fields
      real(wp), intent(in) :: edge !< m
      integer :: bucket, e, field
      self%bin = edge
      self%low = spread(spread(huge(1.0_wp), 1, 3), 2, fields)
      self%high = -self%low
      if (allocated(self%place)) deallocate (self%place, self%next, self%first)
      self%field = nint(self%list(:self%count)%field)
      allocate (self%place(3, self%count), self%next(self%count), self%first(0:2*self%count), source=0)
      do e = self%count, 1, -1
         associate (it => self%list(e))
            field = self%field(e)
            self%low(:, field) = min(self%low(:, field), it%face)
            self%high(:, field) = max(self%high(:, field), it%face)
            self%place(:, e) = floor(it%face/edge)
         end associate
         bucket = hash(self%place(:, e), size(self%first))
         self%next(e) = self%first(bucket)
         self%first(bucket) = e
      end do
   end subroutine sort

   !> Numbers of the elements in the bins around that of an element: all within one bin edge of it, and
   !> others. A result for an element of the same bin is reused.
   pure subroutine near(self, element, middle, found, numbers)
      class(surface_elements_t), intent(in) :: self
      integer, intent(in) :: element
      integer, intent(inout) :: middle(3) !< bin of the last request; on return that of the element
      integer, intent(inout) :: found
      integer, allocatable, intent(inout) :: numbers(:)
      integer, allocatable :: more(:)
      integer :: bin(3), e, n
      if (found > 0 .and. all(self%place(:, element) == middle)) return
      middle = self%place(:, element)
      found = 0
      if (.not. allocated(numbers)) allocate (numbers(256))
      do n = 1, 27
         bin = middle + directions(:, n)
         e = self%first(hash(bin, size(self%first)))
         do while (e > 0)
            if (all(self%place(:, e) == bin)) then
               if (found == size(numbers)) then
                  allocate (more(2*found))
                  more(:found) = numbers
                  call move_alloc(more, numbers)
               end if
               found = found + 1
               numbers(found) = e
            end if
            e = self%next(e)
         end do
      end do
   end subroutine near

   !> Bucket of a bin, from 0.
   pure integer function hash(bin, buckets)
      integer, intent(in) :: bin(3), buckets
      integer(i8), parameter :: primes(3) = [92821_i8, 689287_i8, 283923_i8]
      hash = int(modulo(ieor(ieor(bin(1)*primes(1), bin(2)*primes(2)), bin(3)*primes(3)), int(buckets, i8)))
   end function hash

end module m_surface_elements
