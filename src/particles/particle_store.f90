!> The particles of one block, as columns.
module m_particle_store
   use m_kinds, only: wp, i4, i8
   implicit none
   private
   public :: particle_store_t

   !> Values in a cache line. A capacity is an odd number of lines: with a power of two, the same rows of all
   !> columns would compete for the same cache sets.
   integer, parameter :: line = 8
   real(wp), parameter, public :: spare_room = 0.125_wp !< spare room of a store that grows, as a share of its
                                                        !< contents
   integer, parameter, public :: bytes_besides = 16 !< of a particle, in addition to its columns: id, body,
                                                    !< bin
   integer, parameter :: together = 4  !< columns that are sorted together
   integer, parameter :: stretch = 256 !< particles whose bodies are compared at once

   !> `column(p, c)` is component c (see m_field_table) of particle p; only the first `count` particles are
   !> alive.
   type :: particle_store_t
      integer :: count = 0
      real(wp), allocatable :: column(:, :)
      integer(i8), allocatable :: id(:)   !< unique over the scene
      integer(i4), allocatable :: body(:) !< number of the body in the scene
      integer(i8) :: generation = 0 !< rises when existing particles change, move to another place in the
                                    !< store or leave, not when one is added: derived data of the first
                                    !< particles are valid while it is the same
   contains
      procedure :: reserve
      procedure :: append
      procedure :: changed
      procedure :: state
      procedure :: remove
      procedure :: permute
      procedure :: run_end
      procedure :: bytes
   end type particle_store_t

contains

   !> Make room for at least `capacity` particles of `columns` columns; growing leaves some room to spare.
   subroutine reserve(self, capacity, columns)
      class(particle_store_t), intent(inout) :: self
      integer, intent(in) :: capacity, columns
      type(particle_store_t) :: larger
      integer :: room, n
      if (allocated(self%column)) then
         if (size(self%column, 1) >= capacity) return
      end if
      room = capacity
      if (self%count > 0) room = capacity + int(spare_room*capacity)
      room = line*(8*((max(room, 1) + 7*line - 1)/(8*line)) + 1) ! lines: one more than a multiple of 8
      allocate (larger%column(room, columns), larger%id(room), larger%body(room))
      n = self%count
      if (n > 0) then
         larger%column(:n, :) = self%column(:n, :)
         larger%id(:n) = self%id(:n)
         larger%body(:n) = self%body(:n)
      end if
      call move_alloc(larger%column, self%column)
      call move_alloc(larger%id, self%id)
      call move_alloc(larger%body, self%body)
   end subroutine reserve

   !> Add one particle at the end.
   subroutine append(self, values, id, body)
      class(particle_store_t), intent(inout) :: self
      real(wp), intent(in) :: values(:) !< one value a column
      integer(i8), intent(in) :: id
      integer(i4), intent(in) :: body
      call self%reserve(self%count + 1, size(values))
      self%count = self%count + 1
      self%column(self%count, :) = values
      self%id(self%count) = id
      self%body(self%count) = body
   end subroutine append

   !> To be called by any procedure that has changed columns, ids or bodies of particles, or their number.
   pure subroutine changed(self)
      class(particle_store_t), intent(inout) :: self
      self%generation = self%generation + 1
   end subroutine changed

   !> Generation and number of the particles: data derived from all of them are valid while both are the same.
   pure function state(self)
      class(particle_store_t), intent(in) :: self
      integer(i8) :: state(2)
      state = [self%generation, int(self%count, i8)]
   end function state

   !> Remove the particles of a rising list; the last ones move into the holes.
   subroutine remove(self, gone)
      class(particle_store_t), intent(inout) :: self
      integer(i4), intent(in) :: gone(:)
      integer :: g, p
      call self%changed()
      do g = size(gone), 1, -1
         p = gone(g)
         if (p < self%count) then
            self%column(p, :) = self%column(self%count, :)
            self%id(p) = self%id(self%count)
            self%body(p) = self%body(self%count)
         end if
         self%count = self%count - 1
      end do
   end subroutine remove

   !> Permute the first particles: the new p-th is the old order(p)-th. `work` holds at least that many values
   !> of `together` columns, so that the latency of a distant particle is paid once.
   subroutine permute(self, order, work)
      class(particle_store_t), intent(inout) :: self
      integer(i4), intent(in) :: order(:)
      real(wp), intent(inout), contiguous :: work(:, :)
      integer :: c, columns, n, p
      call self%changed()
      n = size(order)
      columns = size(self%column, 2)
      do c = 1, columns - together + 1, together
         call permute_columns(self%column(:, c:c + together - 1), order, work)
      end do
      do c = c, columns
         !GCC$ novector
         do p = 1, n
            work(p, 1) = self%column(order(p), c)
         end do
         self%column(:n, c) = work(:n, 1)
      end do
      call permute_ids(self%id, order, work(:, 1))
      work(:n, 1) = self%body(order)
      self%body(:n) = nint(work(:n, 1), i4)
   end subroutine permute

   !> Permute `together` columns.
   pure subroutine permute_columns(column, order, work)
      real(wp), intent(inout), contiguous :: column(:, :)
      integer(i4), intent(in) :: order(:)
      real(wp), intent(inout), contiguous :: work(:, :)
      integer :: c, p
      !$omp simd simdlen(4)
      do p = 1, size(order)
         work(p, 1) = column(order(p), 1)
         work(p, 2) = column(order(p), 2)
         work(p, 3) = column(order(p), 3)
         work(p, 4) = column(order(p), 4)
      end do
      do c = 1, together
         column(:size(order), c) = work(:size(order), c)
      end do
   end subroutine permute_columns

   !> Permute ids; their bits pass through the work array: nothing is allocated in a step.
   pure subroutine permute_ids(id, order, work)
      integer(i8), intent(inout), contiguous :: id(:)
      integer(i4), intent(in) :: order(:)
      real(wp), intent(inout), contiguous :: work(:)
      integer :: p
      !GCC$ novector
      do p = 1, size(order)
         work(p) = transfer(id(order(p)), work(p))
      end do
      do p = 1, size(order)
         id(p) = transfer(work(p), id(p))
      end do
   end subroutine permute_ids

   !> Last particle of the run of particles of one body that begins at `first`.
   pure integer function run_end(self, first)
      class(particle_store_t), intent(in) :: self
      integer, intent(in) :: first
      integer(i4) :: difference
      integer :: begin, last, p
      begin = first
      do while (begin < self%count) ! in vectorised stretches, up to the one in which the run ends
         last = min(begin + stretch, self%count)
         difference = 0
         do p = begin + 1, last
            difference = ior(difference, ieor(self%body(p), self%body(first)))
         end do
         if (difference /= 0) exit
         begin = last
      end do
      do run_end = begin, self%count - 1
         if (self%body(run_end + 1) /= self%body(first)) return
      end do
      run_end = self%count
   end function run_end

   !> Memory held (bytes).
   pure integer(i8) function bytes(self)
      class(particle_store_t), intent(in) :: self
      bytes = 0
      if (allocated(self%column)) bytes = 8_i8*size(self%column, kind=i8) + 12_i8*size(self%id, kind=i8)
   end function bytes

end module m_particle_store
