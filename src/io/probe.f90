!> Probes: the particle nearest to a point at the start, tracked as it moves, also when it is split or merged
!> with others (doc/developer/design.md, Ids).
module m_probe
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_model, only: model_t
   use m_recovered_at, only: recover_stress_at
   use m_motion_fields, only: motion_columns, motion_of
   implicit none
   private
   public :: probe_t, choose_particle, read_probe, kinship

   !> A probed particle, identified by its id.
   type :: probe_t
      integer(i8) :: id = 0
   end type probe_t

contains

   !> Collective: the particle nearest to a point (m); of equally near ones that with the smallest id.
   type(probe_t) function choose_particle(model, position) result(probe)
      type(model_t), intent(in) :: model
      real(wp), intent(in) :: position(3)
      real(wp) :: distance, nearest
      integer(i8) :: id
      integer :: b, l, p, pass
      nearest = huge(nearest)
      id = huge(id)
      do pass = 1, 2
         do l = 1, size(model%levels)
            do b = 1, size(model%levels(l)%blocks)
               associate (particles => model%levels(l)%blocks(b)%particles, &
                          x => model%levels(l)%layout%position)
                  do p = 1, particles%count
                     distance = sum((particles%column(p, x:x + 2) - position)**2)
                     if (pass == 1) nearest = min(nearest, distance)
                     if (pass == 2 .and. distance <= nearest) id = min(id, particles%id(p))
                  end do
               end associate
            end do
         end do
         if (pass == 1) nearest = model%communicator%minimum(nearest)*(1.0_wp + 1.0e-9_wp)
      end do
      call MPI_Allreduce(MPI_IN_PLACE, id, 1, MPI_INTEGER8, MPI_MIN, model%communicator%comm)
      probe%id = id
   end function choose_particle

   !> Collective: position (m), stress (Pa; xx yy zz yz xz xy), equivalent plastic strain and recovered stress
   !> (Pa) of the probed particle, and its motion as requested by the scene (motion_columns); strain is 0 when
   !> its law has no plastic flow, all are 0 when the particle no longer exists.
   subroutine read_probe(model, probe, position, stress, plastic_strain, recovered, motion, exists)
      type(model_t), intent(in) :: model
      type(probe_t), intent(in) :: probe
      real(wp), intent(out) :: position(3), stress(6), plastic_strain, recovered(6)
      real(wp), allocatable, intent(out), optional :: motion(:)
      logical, intent(out), optional :: exists !< false when the particle has been eroded
      real(wp) :: found(34)
      real(wp), allocatable :: moved(:)
      integer(i8) :: id
      integer :: b, l, p, where(3)
      found = 0.0_wp
      where = 0
      id = heir(model, probe%id)
      if (present(exists)) exists = id >= 0
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (particles => model%levels(l)%blocks(b)%particles, at => model%levels(l)%layout)
               p = findloc(particles%id(:particles%count), id, dim=1)
               if (p == 0) cycle
               where = [l, b, p]
               found(:9) = [particles%column(p, at%position:at%position + 2), &
                           particles%column(p, at%stress:at%stress + 5)]
               associate (law => model%materials%slots(model%materials%of_body(particles%body(p)))%law)
                  moved = motion_of(particles%column(p, :), at)
                  found(17:16 + size(moved)) = moved
                  found(10) = law%equivalent_plastic_strain(particles%column(p, :))
               end associate
            end associate
         end do
      end do
      call recover_stress_at(model, where, found(11:16))
      call MPI_Allreduce(MPI_IN_PLACE, found, size(found), MPI_DOUBLE_PRECISION, MPI_SUM, &
                         model%communicator%comm)
      position = found(1:3)
      stress = found(4:9)
      plastic_strain = found(10)
      recovered = found(11:16)
      if (present(motion)) motion = found(17:16 + size(motion_columns(model%levels(1)%layout)))
   end subroutine read_probe

   !> Collective: id of the particle that continues a probed one: itself or its lowest part, which have its
   !> id, or the one it was merged into: of all parts of its original particle the one that shares most splits
   !> with it. -1 if there is none.
   integer(i8) function heir(model, id)
      type(model_t), intent(in) :: model
      integer(i8), intent(in) :: id
      integer(i8) :: closest
      integer :: b, id_bits, l, p
      id_bits = model%levels(1)%layout%id_bits
      closest = -1
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            associate (particles => model%levels(l)%blocks(b)%particles)
               do p = 1, particles%count
                  closest = max(closest, kinship(particles%id(p), id, id_bits))
               end do
            end associate
         end do
      end do
      call MPI_Allreduce(MPI_IN_PLACE, closest, 1, MPI_INTEGER8, MPI_MAX, model%communicator%comm)
      heir = -1
      if (closest < 0) return
      heir = ior(ibits(id, 0, id_bits), ishft(iand(not(closest), last_way(id_bits)), id_bits))
   end function heir

   !> Kinship of a particle with a probed one; -1: not of the same original particle. The bits above those of
   !> the path: the number of splits with the same choice, all bits if the ids are equal; those below: larger
   !> for the smaller id, to break ties.
   pure integer(i8) function kinship(id, probed, id_bits)
      integer(i8), intent(in) :: id, probed
      integer, intent(in) :: id_bits !< of the layout
      integer(i8) :: way, common
      kinship = -1
      if (ibits(ieor(id, probed), 0, id_bits) /= 0) return
      way = ishft(id, -id_bits)
      common = min(way_bits(id_bits), trailz(ieor(way, ishft(probed, -id_bits))))
      kinship = ior(ishft(common, way_bits(id_bits)), last_way(id_bits) - way)
   end function kinship

   !> Number of bits of the path through the splits.
   pure integer function way_bits(id_bits)
      integer, intent(in) :: id_bits
      way_bits = 62 - id_bits
   end function way_bits

   pure integer(i8) function last_way(id_bits)
      integer, intent(in) :: id_bits
      last_way = 2_i8**way_bits(id_bits) - 1_i8
   end function last_way

end module m_probe
