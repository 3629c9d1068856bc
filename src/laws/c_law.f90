!> Interface to laws written in C: one procedure without structures, in a shared library
!> (doc/developer/vumat.md).
module m_c_law
   use, intrinsic :: iso_c_binding, only: c_int, c_double, c_funptr, c_f_procpointer
   use m_group_reader, only: group_reader_t
   use m_user_law, only: user_law_t, points_t
   use m_user_library, only: find_law
   implicit none
   private
   public :: c_law_t

   abstract interface
      !> Component c of particle p is at [c*points + p]. Tensors are xx yy zz xy yz xz, F is 11 22 33 12 23 31
      !> 21 32 13, as in points_t.
      pure subroutine c_law_interface(points, states, constants, constant, time, time_step, density, strain, &
                                      spin, deformation_old, deformation, stress_old, state_old, energy_old, &
                                      stress, state, energy, inelastic) bind(c)
         import :: c_int, c_double
         integer(c_int), intent(in), value :: points, states, constants
         real(c_double), intent(in) :: constant(*)
         real(c_double), intent(in), value :: time, time_step
         real(c_double), intent(in) :: density(*), strain(*), spin(*), deformation_old(*), deformation(*), &
                                       stress_old(*), state_old(*), energy_old(*)
         real(c_double), intent(inout) :: stress(*), state(*), energy(*), inelastic(*)
      end subroutine c_law_interface
   end interface

   type, extends(user_law_t) :: c_law_t
      procedure(c_law_interface), pointer, nopass, private :: law => null()
   contains
      procedure :: load
      procedure :: evaluate
      procedure :: tells_temperature
   end type c_law_t

contains

   !> Find `c_law`.
   subroutine load(self, group, found)
      class(c_law_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      logical, intent(out) :: found
      type(c_funptr) :: address
      procedure(c_law_interface), pointer :: law
      call find_law(self%library, self%checksum, group, 'c_law', 'mylaw.c', 'procedure c_law', address, found)
      if (.not. found) return
      call c_f_procpointer(address, law)
      self%law => law
   end subroutine load

   pure logical function tells_temperature(self)
      class(c_law_t), intent(in) :: self
      tells_temperature = .false.
   end function tells_temperature

   pure subroutine evaluate(self, points)
      class(c_law_t), intent(in) :: self
      type(points_t), intent(inout) :: points
      call self%law(points%count, self%states, size(self%constants), self%constants, points%time, &
                    points%time_step, points%density, points%strain, points%spin, points%deformation_old, &
                    points%deformation, points%stress_old, points%state_old, points%energy_old, &
                    points%stress, points%state, points%energy, points%inelastic)
   end subroutine evaluate

end module m_c_law
