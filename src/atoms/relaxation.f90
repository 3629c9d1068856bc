!> Atoms that follow loads at rest: FIRE (theory.md, Atoms).
module m_relaxation
   use, intrinsic :: iso_c_binding, only: c_double, c_int
   use m_kinds, only: wp
   use m_potential_file, only: joule_per_ev
   implicit none
   private

   real(wp), parameter :: first_angle = 0.1_wp
   real(wp), parameter :: square_speed = 1.0e4_wp !< (angstrom/ps)^2 in (m/s)^2
   real(wp), parameter :: picosecond = 1.0e-12_wp !< s

   type, public :: relaxation_t
      real(wp) :: angle = first_angle !< how far velocities turn towards the forces
      real(wp) :: downhill = 0.0_wp   !< steps since forces did work against velocities
      real(wp) :: taken = 0.0_wp      !< energy, J
   contains
      procedure :: turn
   end type relaxation_t

contains

   !> Bitzek's FIRE with a given step: velocities turn towards the forces; all atoms stop when these do work
   !> against them. The velocities are those in the middle of a step: what is taken is the difference of
   !> kinetic energy at its end, after the forces have acted for half a step.
   subroutine turn(self, real_atoms, ids, mass, step, v, f, more)
      class(relaxation_t), intent(inout) :: self
      integer, intent(in) :: real_atoms             !< atoms of higher numbers are pads
      integer(c_int), intent(in) :: ids(:)
      real(wp), intent(in) :: mass, step            !< kg; s
      real(c_double), intent(inout) :: v(:, :)      !< (3, atoms) in LAMMPS's units and order
      real(c_double), intent(in) :: f(:, :), more(:, :) !< its forces, and what acts besides
      real(wp) :: one(3), power, speed, push, after, power_after
      integer :: n
      power = 0.0_wp
      speed = 0.0_wp
      push = 0.0_wp
      do n = 1, size(ids)
         if (ids(n) > real_atoms) cycle
         one = f(:, n) + more(:, n)
         power = power + dot_product(v(:, n), one)
         speed = speed + sum(v(:, n)**2)
         push = push + sum(one**2)
      end do
      self%downhill = merge(self%downhill + 1.0_wp, 0.0_wp, power > 0.0_wp)
      if (.not. power > 0.0_wp) self%angle = first_angle
      if (self%downhill > 5.5_wp) self%angle = 0.99_wp*self%angle
      after = 0.0_wp
      power_after = 0.0_wp
      do n = 1, size(ids)
         if (ids(n) > real_atoms) cycle
         one = f(:, n) + more(:, n)
         v(:, n) = merge((1.0_wp - self%angle)*v(:, n) + self%angle*sqrt(speed/max(push, tiny(push)))*one, &
                         0.0_wp, power > 0.0_wp)
         after = after + sum(v(:, n)**2)
         power_after = power_after + dot_product(v(:, n), one)
      end do
      self%taken = self%taken + 0.5_wp*(mass*(speed - after)*square_speed &
                                        + step/picosecond*joule_per_ev*(power - power_after))
   end subroutine turn

end module m_relaxation
