!> Faces that erosion uncovers: in a scene with contact groups the particles beside an eroded one get elements
!> of the surface there, so that contact goes on (theory.md, eq. uncovered).
module m_uncovered
   use mpi_f08
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_communicator, only: communicator_t
   use m_block, only: block_t
   use m_half_edges, only: half_edges
   use m_level, only: level_t
   use m_surface_fields, only: max_elements, area_name, arm_name
   use m_vectors, only: cross
   implicit none
   private

   integer, parameter :: face_reals = 10
   real(wp), parameter :: farthest = 1.4_wp !< half edges between the middle of the particle beside a face and
                                            !< where it would be on the lattice
   real(wp), parameter :: shallowest = 0.25_wp !< half edges from its middle to the face
   real(wp), parameter :: one_element = 0.7_wp !< cosine: faces whose normals differ less share an element

   !> The faces of the particles that this rank has removed in the present step. Each column of `faces`:
   !> velocity field; middle of the face, m; the middle that the particle beside it has on the lattice, m; its
   !> area, outward for that particle, m2.
   type, public :: uncovered_t
      private
      integer :: count = 0
      real(wp), allocatable :: faces(:, :)
   contains
      procedure :: clear
      procedure :: add
      procedure :: give
   end type uncovered_t

contains

   !> Forget all faces.
   pure subroutine clear(self)
      class(uncovered_t), intent(inout) :: self
      self%count = 0
   end subroutine clear

   !> Add the faces of a particle that is about to be removed.
   subroutine add(self, level, b, p)
      class(uncovered_t), intent(inout) :: self
      type(level_t), intent(in) :: level
      integer, intent(in) :: b, p !< numbers of the block and the particle
      real(wp) :: x(3), r(3, 3), area(3), out(3)
      integer :: k, side
      associate (values => level%blocks(b)%particles%column(p, :), at => level%layout, &
                 section => level%grid%section)
         x = values(at%position:at%position + 2)
         r = half_edges(values, at)
         do k = 1, 3, merge(2, 1, section%is_flat())
            area = 4.0_wp*cross(r(:, 1 + mod(k, 3)), r(:, 1 + mod(k + 1, 3)))
            if (dot_product(area, r(:, k)) < 0.0_wp) area = -area
            do side = -1, 1, 2
               out = side*r(:, k)
               if (.not. allocated(self%faces)) allocate (self%faces(face_reals, 64))
               if (self%count == size(self%faces, 2)) &
                  self%faces = reshape(self%faces, [face_reals, 2*self%count], pad=[0.0_wp])
               self%count = self%count + 1
               self%faces(:, self%count) = [real(level%blocks(b)%field, wp), x + out, x + 2.0_wp*out, &
                                            -side*area]
               if (section%is_flat()) & ! the length of its side times the whole extent
                  self%faces(8:10, self%count) = self%faces(8:10, self%count) &
                                                 *section%depth(x(1) + out(1))/(2.0_wp*norm2(r(:, 2)))
            end do
         end do
      end associate
   end subroutine add

   !> Collective: give the faces to the particles beside them, of all ranks, and forget them.
   subroutine give(self, communicator, levels)
      class(uncovered_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(inout) :: levels(:)
      real(wp), allocatable :: faces(:, :), closest(:, :)
      integer, allocatable :: owner(:, :)
      integer :: n
      call gather(self, communicator, faces)
      self%count = 0
      if (size(faces, 2) == 0) return
      allocate (closest(2, size(faces, 2)), owner(3, size(faces, 2)))
      call find_beside(levels, faces, closest(1, :), owner)
      closest(2, :) = communicator%rank
      call MPI_Allreduce(MPI_IN_PLACE, closest, size(faces, 2), MPI_2DOUBLE_PRECISION, MPI_MINLOC, &
                         communicator%comm)
      do n = 1, size(faces, 2)
         if (closest(1, n) >= huge(1.0_wp) .or. nint(closest(2, n)) /= communicator%rank) cycle
         associate (level => levels(owner(1, n)), p => owner(3, n), &
                    particles => levels(owner(1, n))%blocks(owner(2, n))%particles)
            call attach(particles%column, p, level, faces(2:4, n), faces(8:10, n))
            call particles%changed()
         end associate
      end do
   end subroutine give

   !> Collective: the faces of all ranks.
   subroutine gather(self, communicator, faces)
      type(uncovered_t), intent(in) :: self
      type(communicator_t), intent(in) :: communicator
      real(wp), allocatable, intent(out) :: faces(:, :)
      real(wp) :: own(face_reals*self%count)
      integer, dimension(communicator%ranks) :: counts, before
      integer :: r
      call MPI_Allgather(face_reals*self%count, 1, MPI_INTEGER, counts, 1, MPI_INTEGER, communicator%comm)
      before = [(sum(counts(:r - 1)), r=1, size(counts))]
      allocate (faces(face_reals, sum(counts)/face_reals))
      if (size(faces) == 0) return
      if (self%count > 0) own = reshape(self%faces(:, :self%count), [size(own)])
      call MPI_Allgatherv(own, size(own), MPI_DOUBLE_PRECISION, faces, counts, before, MPI_DOUBLE_PRECISION, &
                          communicator%comm)
   end subroutine gather

   !> This rank's particle beside each face: of the same velocity field, behind the face, and closest to where
   !> it would be on the lattice.
   subroutine find_beside(levels, faces, closest, owner)
      type(level_t), intent(in) :: levels(:)
      real(wp), intent(in) :: faces(:, :)
      real(wp), intent(out) :: closest(:) !< squared distance, m2; huge: there is none
      integer, intent(out) :: owner(:, :) !< level, block, particle
      real(wp) :: x(3), reach, distance
      integer :: b, l, n, p
      closest = huge(closest)
      owner = 0
      do l = 1, size(levels)
         do b = 1, size(levels(l)%blocks)
            associate (block => levels(l)%blocks(b), at => levels(l)%layout%position)
               do n = 1, size(faces, 2)
                  if (nint(faces(1, n)) /= block%field) cycle
                  reach = farthest*norm2(faces(5:7, n) - faces(2:4, n))
                  if (is_far(block, levels(l)%grid%cell, faces(5:7, n), reach)) cycle
                  do p = 1, block%particles%count
                     x = block%particles%column(p, at:at + 2)
                     distance = sum((x - faces(5:7, n))**2)
                     if (distance >= min(closest(n), reach**2)) cycle
                     if (dot_product(x - faces(2:4, n), faces(8:10, n)) >= 0.0_wp) cycle
                     closest(n) = distance
                     owner(:, n) = [l, b, p]
                  end do
               end do
            end associate
         end do
      end do
   end subroutine find_beside

   !> True when a block has no particles within a distance of a place.
   pure logical function is_far(block, cell, place, distance)
      type(block_t), intent(in) :: block
      real(wp), intent(in) :: cell, place(3), distance !< m
      is_far = any(place < block%origin - 0.5_wp*cell - distance) &
               .or. any(place > block%origin + (block_size - 0.5_wp)*cell + distance)
   end function is_far

   !> Add a face to a particle's elements: to one of nearly the same normal, else as a new one.
   subroutine attach(column, p, level, middle, area)
      real(wp), intent(inout) :: column(:, :)
      integer, intent(in) :: p
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: middle(3), area(3) !< m, m2
      real(wp) :: arm(3), normal(3), size_of
      integer :: a, e, r
      size_of = norm2(area)
      normal = area/size_of
      associate (x => column(p, level%layout%position:level%layout%position + 2))
         arm = max(dot_product(middle - x, normal), shallowest*norm2(middle - x))*normal
      end associate
      do e = 1, max_elements
         a = level%table%column(area_name(e))
         if (a == 0) return
         r = level%table%column(arm_name(e))
         associate (present_area => column(p, a:a + 2), present_arm => column(p, r:r + 2))
            if (.not. norm2(present_area) > 0.0_wp) then
               present_area = area
               present_arm = arm
               return
            else if (dot_product(present_area, normal) > one_element*norm2(present_area)) then
               present_arm = (norm2(present_area)*present_arm + size_of*arm)/(norm2(present_area) + size_of)
               present_area = present_area + area
               return
            end if
         end associate
      end do
   end subroutine attach

end module m_uncovered
