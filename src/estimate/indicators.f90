!> Error estimate of a state: the recovered-stress estimate of the discretisation error (theory.md, eq.
!> recovered).
module m_indicators
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_model, only: model_t
   use m_material, only: material_t
   use m_recovered_stress, only: level_stress_t, recover_stress
   implicit none
   private
   public :: stress_error_t, estimate_stress_error

   real(wp), parameter :: edge_width = 2.0_wp !< distance in cells up to which particles are beside an edge
                                              !< between levels

   !> The estimate, over all ranks.
   type :: stress_error_t
      real(wp) :: energy = 0.0_wp !< half the sum of V sigma : C^-1 : sigma over the particles included, J
      real(wp) :: squares = 0.0_wp    !< the same for the difference to the recovered stress, J
      real(wp) :: beside = 0.0_wp     !< part of that in particles beside edges between levels, J
      real(wp) :: largest = 0.0_wp    !< largest difference: uniaxial stress of the same energy, Pa
      real(wp) :: stress = 0.0_wp     !< largest stress, as uniaxial stress of the same energy, Pa
      real(wp) :: place(3) = 0.0_wp   !< of the particle with the largest difference, m
      integer(i8) :: id = 0           !< of that particle
      integer :: level = 0            !< level of that particle
   contains
      procedure :: share
   end type stress_error_t

contains

   !> The estimate relative to the energy norm of the state.
   pure real(wp) function share(self)
      class(stress_error_t), intent(in) :: self
      share = 0.0_wp
      if (self%energy > 0.0_wp) share = sqrt(self%squares/self%energy)
   end function share

   !> Collective: the estimate for the model at the end of a step.
   subroutine estimate_stress_error(model, error)
      type(model_t), intent(inout) :: model
      type(stress_error_t), intent(out) :: error
      type(level_stress_t), allocatable :: recovered(:)
      real(wp) :: sums(3), largest(2), found(5)
      integer :: b, l, owner
      integer(i8) :: id
      call recover_stress(model, recovered)
      do l = 1, size(model%levels)
         do b = 1, size(model%levels(l)%blocks)
            call compare(model, l, b, recovered(l)%blocks(b)%of, error)
         end do
      end do
      sums = [error%energy, error%squares, error%beside]
      largest = [error%largest, error%stress]
      call MPI_Allreduce(MPI_IN_PLACE, sums, 3, MPI_DOUBLE_PRECISION, MPI_SUM, model%communicator%comm)
      call MPI_Allreduce(MPI_IN_PLACE, largest, 2, MPI_DOUBLE_PRECISION, MPI_MAX, model%communicator%comm)
      owner = model%communicator%ranks
      if (error%largest >= largest(1)) owner = model%communicator%rank
      call MPI_Allreduce(MPI_IN_PLACE, owner, 1, MPI_INTEGER, MPI_MIN, model%communicator%comm)
      found = [error%place, real(error%level, wp), 0.0_wp]
      id = error%id
      call MPI_Bcast(found, 5, MPI_DOUBLE_PRECISION, owner, model%communicator%comm)
      call MPI_Bcast(id, 1, MPI_INTEGER8, owner, model%communicator%comm)
      error = stress_error_t(sums(1), sums(2), sums(3), largest(1), largest(2), found(:3), id, nint(found(4)))
   end subroutine estimate_stress_error

   !> Add one block's particles to the estimate.
   subroutine compare(model, l, b, recovered, error)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l, b
      real(wp), intent(in) :: recovered(:, :) !< stress, (6, particles), Pa
      type(stress_error_t), intent(inout) :: error
      real(wp) :: own(6), difference, energy
      integer :: p
      associate (level => model%levels(l), block => model%levels(l)%blocks(b), at => model%levels(l)%layout)
         do p = 1, block%particles%count
            associate (law => model%materials%slots(model%materials%of_body(block%particles%body(p)))%law, &
                       volume => block%particles%column(p, at%volume), column => block%particles%column)
               own = column(p, at%stress:at%stress + 5)
               energy = law%energy_of_stress(column(p, :), at, own)
               difference = law%energy_of_stress(column(p, :), at, recovered(:, p) - own)
               if (next_to_edge(model, l, column(p, at%position:at%position + 2))) &
                  error%beside = error%beside + volume*difference
               error%energy = error%energy + volume*energy
               error%squares = error%squares + volume*difference
               error%stress = max(error%stress, as_pull(law, energy))
               if (as_pull(law, difference) <= error%largest .and. error%id > 0) cycle
               error%largest = as_pull(law, difference)
               error%place = column(p, at%position:at%position + 2)
               error%id = block%particles%id(p)
               error%level = l
            end associate
         end do
      end associate
   end subroutine compare

   !> The uniaxial stress (Pa) along x with this energy (J/m3).
   pure real(wp) function as_pull(law, energy)
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: energy
      as_pull = sqrt(energy/law%complementary_energy([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]))
   end function as_pull

   !> True beside an edge between levels.
   pure logical function next_to_edge(model, l, place) result(near)
      type(model_t), intent(in) :: model
      integer, intent(in) :: l
      real(wp), intent(in) :: place(3) !< m
      real(wp) :: width
      width = edge_width*model%levels(l)%grid%cell
      near = .false.
      if (l > 1) near = .not. model%levels(l)%region%holds_box(place, place, width)
      if (l < size(model%levels)) near = near .or. model%levels(l + 1)%region%overlaps(place - width, place &
            + width)
   end function next_to_edge

end module m_indicators
