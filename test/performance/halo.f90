!> What an exchange of ghost nodes costs, for the scene on standard input: its model is built, and then its
!> coarsest level's tiles go from rank to rank again and again, with nothing to do in between. The time of one
!> is that of the slowest rank; what other programs take of the machine falls on some of them, so that the
!> least of many is the cost. Prints ranks, messages and bytes that all send in one, the least and the median
!> time (ns). usage: mpirun -n RANKS halo < scene
program halo
   use mpi_f08
   use m_kinds, only: wp, i8
   use m_errors, only: error_t
   use m_communicator, only: communicator_t
   use m_scene, only: scene_t
   use m_offer, only: catalogue_t
   use m_materials, only: known_materials
   use m_effects, only: known_effects
   use m_snapshot_formats, only: known_formats
   use m_scene_reader, only: read_scene
   use m_model, only: model_t
   use m_sorting, only: sorted_order
   implicit none
   integer, parameter :: rounds = 500
   type(communicator_t) :: communicator
   type(catalogue_t) :: catalogue
   type(scene_t) :: scene
   type(model_t) :: model
   type(error_t) :: error
   integer(i8) :: bytes, messages, took(rounds) !< ns
   call communicator%start()
   call known_materials(catalogue)
   call known_effects(catalogue)
   call known_formats(catalogue)
   call read_scene(communicator, catalogue, '', scene, error)
   if (.not. error%happened()) call model%build(communicator, scene, error)
   if (error%happened()) error stop 'the scene is not valid'
   call exchange_often()
   messages = communicator%sum_count(size(model%exchange(1)%ranks, kind=i8))
   bytes = communicator%sum_count(model%exchange(1)%bytes_each)
   took = took(sorted_order(took, took))
   if (communicator%is_root()) print '(*(i0,1x))', communicator%ranks, messages, bytes, took(1), &
      took(rounds/2)
   call model%release()
   call communicator%finish()

contains

   subroutine exchange_often()
      real(wp) :: begun
      integer :: r
      do r = 1, rounds
         call MPI_Barrier(communicator%comm)
         begun = MPI_Wtime()
         call model%exchange(1)%start(model%levels(1)%nodes)
         call model%exchange(1)%wait(model%levels(1)%nodes)
         took(r) = nint(1.0e9_wp*communicator%maximum(real(MPI_Wtime() - begun, wp)), i8)
      end do
   end subroutine exchange_often

end program halo
