!> Interface to laws written for Abaqus/Explicit: the user subroutine VUMAT, in a shared library
!> (doc/developer/vumat.md).
module m_vumat
   use, intrinsic :: iso_c_binding, only: c_int, c_double, c_char, c_size_t, c_funptr, c_f_procpointer
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t
   use m_user_law, only: user_law_t, points_t
   use m_user_library, only: find_law, law_name, name_size
   implicit none
   private
   public :: vumat_t

   abstract interface
      !> As in its manual; the length of CMNAME comes last, as Fortran compilers pass it.
      pure subroutine vumat_interface(jblock, ndir, nshr, nstatev, nfieldv, nprops, jinfo, step_time, &
                                      total_time, dt, cmname, coord, char_length, props, density, &
                                      strain_inc, rel_spin_inc, temp_old, stretch_old, defgrad_old, &
                                      field_old, stress_old, state_old, ener_intern_old, ener_inelas_old, &
                                      temp_new, stretch_new, defgrad_new, field_new, stress_new, state_new, &
                                      ener_intern_new, ener_inelas_new, cmname_length) bind(c)
         import :: c_int, c_double, c_char, c_size_t
         integer(c_int), intent(in) :: jblock(*), ndir, nshr, nstatev, nfieldv, nprops, jinfo(*)
         real(c_double), intent(in) :: step_time, total_time, dt(*)
         character(kind=c_char), intent(in) :: cmname(*)
         real(c_double), intent(in) :: coord(*), char_length(*), props(*), density(*), strain_inc(*), &
                                       rel_spin_inc(*), temp_old(*), stretch_old(*), defgrad_old(*), &
                                       field_old(*), stress_old(*), state_old(*), ener_intern_old(*), &
                                       ener_inelas_old(*), temp_new(*), stretch_new(*), defgrad_new(*), &
                                       field_new(*)
         real(c_double), intent(inout) :: stress_new(*), state_new(*), ener_intern_new(*), ener_inelas_new(*)
         integer(c_size_t), intent(in), value :: cmname_length
      end subroutine vumat_interface
   end interface

   integer, parameter :: first_element = 7 !< jInfoArray(6): index of the first element number in it

   type, extends(user_law_t) :: vumat_t
      procedure(vumat_interface), pointer, nopass, private :: law => null()
   contains
      procedure :: load
      procedure :: evaluate
   end type vumat_t

contains

   !> Find `vumat_`, the symbol name of gfortran and Intel's compilers.
   subroutine load(self, group, found)
      class(vumat_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      logical, intent(out) :: found
      type(c_funptr) :: address
      procedure(vumat_interface), pointer :: law
      call find_law(self%library, self%checksum, group, 'vumat_', 'mylaw.f', 'SUBROUTINE VUMAT', address, &
                    found)
      if (.not. found) return
      call c_f_procpointer(address, law)
      self%law => law
   end subroutine load

   !> Call for a block of points of a solid: three direct and three shear components. There are no field
   !> variables. The arguments lAnneal and dt of older templates are the first elements of jInfoArray and
   !> dtArray.
   pure subroutine evaluate(self, points)
      class(vumat_t), intent(in) :: self
      type(points_t), intent(inout) :: points
      integer(c_int) :: jblock(4 + points%count), jinfo(first_element - 1 + points%count)
      real(c_double) :: nothing(max(1, points%count)), props(max(1, size(self%constants))), &
                        temperature(max(1, points%count)), dt(2*points%count + 1)
      integer :: i
      nothing = 0.0_wp
      props(:size(self%constants)) = self%constants
      ! laws that use the number of a point get its index in the block; layer and section point are 1
      jblock = [points%count, 1, 1, 1, (i, i=1, points%count)]
      ! no annealing, integration, layer and section point 1, no moduli requested; index of the element
      ! numbers, and these
      jinfo = [0, 1, 1, 1, 0, first_element, (i, i=1, points%count)]
      dt = 0.0_wp
      dt(1) = points%time_step
      temperature = self%temperature
      call self%law(jblock, 3, 3, self%states, 0, size(self%constants), jinfo, points%time, points%time, &
                    dt, law_name(self%label), points%place, points%size, props, &
                    points%density, points%strain, points%spin, temperature, points%stretch_old, &
                    points%deformation_old, nothing, points%stress_old, points%state_old, points%energy_old, &
                    points%inelastic_old, temperature, points%stretch, points%deformation, nothing, &
                    points%stress, points%state, points%energy, points%inelastic, int(name_size, c_size_t))
   end subroutine evaluate

end module m_vumat
