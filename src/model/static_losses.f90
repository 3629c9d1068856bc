!> Energy dissipated by implicit steps, other than by contact and effects (theory.md, Quasi-static steps,
!> Balance of energy).
module m_static_losses
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use mpi_f08
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_node_values, only: tile_last
   use m_level, only: level_t
   implicit none
   private

   integer, parameter, public :: face_reals = 9 !< level, number of its block, axis, node in the tile (3),
                                                !< force (3, N)

   !> Sums since the start, J.
   type, public :: static_losses_t
      real(wp) :: ghost_penalty = 0.0_wp !< dissipated by the ghost penalty,
      real(wp) :: theta = 0.0_wp         !< by a theta above one half,
      real(wp) :: impact = 0.0_wp        !< by points that come into contact within a step with inertia
      real(wp) :: uncertainty = 0.0_wp   !< of the balance, as loads count with the mean of a step's ends and
                                         !< may act at once in the first
      real(wp) :: in_flow = 0.0_wp       !< not dissipated, but work of loads beyond that mean where material
                                         !< flows
      real(wp), allocatable :: faces(:, :) !< the ghost penalty's forces in the last step without inertia:
                                           !< (face_reals, faces of this rank's blocks)
   contains
      procedure :: total
      procedure :: all_faces
      procedure :: keep_own
      procedure :: follow_blocks
   end type static_losses_t

contains

   !> Total dissipation, J.
   pure real(wp) function total(self)
      class(static_losses_t), intent(in) :: self
      total = self%ghost_penalty + self%theta + self%impact
   end function total

   !> Collective: `faces` of all ranks, one rank after the other.
   function all_faces(self, communicator) result(rows)
      class(static_losses_t), intent(in) :: self
      type(communicator_t), intent(in) :: communicator
      real(wp), allocatable :: rows(:, :)
      real(wp), allocatable :: own(:, :)
      integer :: before(communicator%ranks), counts(communicator%ranks), r
      allocate (own(face_reals, 0))
      if (allocated(self%faces)) own = self%faces
      call MPI_Allgather(size(own), 1, MPI_INTEGER, counts, 1, MPI_INTEGER, communicator%comm)
      before = [(sum(counts(:r - 1)), r=1, communicator%ranks)]
      allocate (rows(face_reals, sum(counts)/face_reals))
      call MPI_Allgatherv(own, size(own), MPI_DOUBLE_PRECISION, rows, counts, before, MPI_DOUBLE_PRECISION, &
                          communicator%comm)
   end function all_faces

   !> Keep of the faces of all ranks those of this rank's blocks. `good` is false if some do not belong to
   !> these levels.
   subroutine keep_own(self, rows, levels, rank, good)
      class(static_losses_t), intent(inout) :: self
      real(wp), intent(in) :: rows(:, :)
      type(level_t), intent(in) :: levels(:)
      integer, intent(in) :: rank
      logical, intent(out) :: good
      logical :: own(size(rows, 2))
      integer :: n
      good = .true.
      own = .false.
      do n = 1, size(rows, 2)
         associate (row => rows(:, n))
            good = row(1) >= 1.0_wp .and. row(1) <= size(levels) .and. row(2) >= 1.0_wp &
                   .and. row(3) >= 1.0_wp .and. row(3) <= 3.0_wp &
                   .and. all(row(4:6) >= 0.0_wp) .and. all(row(4:6) <= tile_last) &
                   .and. all(ieee_is_finite(row(7:)))
            if (good) good = row(2) <= size(levels(nint(row(1)))%owner)
            if (good) good = row(3 + nint(row(3))) >= 1.0_wp .and. row(3 + nint(row(3))) <= tile_last - 1
            if (.not. good) return
            own(n) = levels(nint(row(1)))%owner(nint(row(2))) == rank
         end associate
      end do
      self%faces = reshape(pack(rows, spread(own, 1, face_reals)), [face_reals, count(own)])
   end subroutine keep_own

   !> Collective: redistribute after blocks have changed owner.
   subroutine follow_blocks(self, levels, communicator)
      class(static_losses_t), intent(inout) :: self
      type(level_t), intent(in) :: levels(:)
      type(communicator_t), intent(in) :: communicator
      logical :: good
      call self%keep_own(self%all_faces(communicator), levels, communicator%rank, good)
   end subroutine follow_blocks

end module m_static_losses
