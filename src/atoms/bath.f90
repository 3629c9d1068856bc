!> What takes energy from single atoms or gives it: a drag on all, and a thermostat (Langevin) on those of a
!> layer inside the interface (theory.md, Atoms). SI units but for what LAMMPS has.
module m_bath
   use, intrinsic :: iso_c_binding, only: c_double, c_int
   use m_kinds, only: wp
   use m_atoms, only: atoms_t
   use m_potential_file, only: joule_per_ev
   use m_shape, only: shape_t
   implicit none
   private
   public :: thermal_speeds

   real(wp), parameter :: boltzmann = 1.380649e-23_wp !< J/K
   real(wp), parameter :: angstrom = 1.0e-10_wp, metre_a_second = 1.0e-2_wp !< in m; in angstrom/ps
   integer, parameter :: dice = 64                    !< at least as many integers as RANDOM_SEED takes

   type, public :: bath_t
      real(wp), allocatable :: rate(:)     !< (real atoms) at which velocities decay, 1/s
      real(wp), allocatable :: warm(:)     !< (real atoms) temperature that they are kept at, K
      real(wp), allocatable :: last(:, :)  !< (3, real atoms) force when it was asked for the last time, N
      real(wp), allocatable :: place(:, :) !< (3, real atoms) then, m
      real(wp) :: taken = 0.0_wp           !< energy, J
      real(wp) :: rounds = 0.0_wp          !< steps of the grid: the seed of their random numbers
      integer :: seed = 1
   contains
      procedure :: build
      procedure :: acts
      procedure :: begin_round
      procedure :: push
   end type bath_t

contains

   !> `places`: of the real atoms (3, n), m; the layer is inside the faces of the box that have material of
   !> the body beyond them.
   subroutine build(self, spec, body, places, lower, upper)
      class(bath_t), intent(inout) :: self
      type(atoms_t), intent(in) :: spec
      class(shape_t), intent(in) :: body
      real(wp), intent(in) :: places(:, :), lower(3), upper(3)
      real(wp) :: low(3), high(3)
      integer :: n
      if (.not. (spec%drag > 0.0_wp .or. spec%temperature > 0.0_wp)) return
      self%seed = spec%seed
      allocate (self%rate(size(places, 2)), source=spec%drag)
      allocate (self%warm(size(places, 2)), source=0.0_wp)
      allocate (self%last(3, size(places, 2)), self%place(3, size(places, 2)), source=0.0_wp)
      if (.not. spec%temperature > 0.0_wp) return
      call body%bounding_box(low, high)
      do n = 1, size(places, 2)
         if (all((places(:, n) > lower + spec%thermostat_width .or. lower <= low) .and. &
                 (places(:, n) < upper - spec%thermostat_width .or. upper >= high))) cycle
         self%rate(n) = self%rate(n) + spec%thermostat_rate
         self%warm(n) = spec%temperature*spec%thermostat_rate/self%rate(n)
      end do
   end subroutine build

   pure logical function acts(self)
      class(bath_t), intent(in) :: self
      acts = allocated(self%rate)
   end function acts

   !> A step of the grid begins: its random numbers follow from its number alone, so that a run that is taken
   !> up again has the same.
   subroutine begin_round(self)
      class(bath_t), intent(inout) :: self
      integer :: seeds(dice), k
      if (.not. self%acts()) return
      self%rounds = self%rounds + 1.0_wp
      do k = 1, dice
         seeds(k) = ieor(7919*k, nint(mod(self%rounds, 1.0e9_wp)) + 104729*mod(self%seed, 20000))
      end do
      call random_seed(put=seeds)
   end subroutine begin_round

   !> Add the forces to those of all atoms, in LAMMPS's units and order. `moved`: the atoms have come here
   !> from where this was asked for the last time; what the forces did on that way is booked.
   subroutine push(self, x, ids, v, mass, step, moved, forces)
      class(bath_t), intent(inout) :: self
      real(wp), intent(in) :: x(:, :)            !< (3, atoms) by number, m
      integer(c_int), intent(in) :: ids(:)
      real(c_double), intent(in) :: v(:, :)
      real(wp), intent(in) :: mass, step         !< kg; s
      logical, intent(in) :: moved
      real(c_double), intent(inout) :: forces(:, :)
      real(wp), allocatable :: chance(:, :)
      real(wp) :: f(3)
      integer :: k, n
      allocate (chance(3, size(self%rate)), source=0.5_wp)
      if (any(self%warm > 0.0_wp)) call random_number(chance)
      do k = 1, size(ids)
         n = ids(k)
         if (n > size(self%rate)) cycle
         f = -mass*self%rate(n)*v(:, k)/metre_a_second &
             + sqrt(24.0_wp*mass*boltzmann*self%warm(n)*self%rate(n)/step)*(chance(:, n) - 0.5_wp)
         if (moved) self%taken = self%taken &
                                 - 0.5_wp*dot_product(f + self%last(:, n), x(:, n) - self%place(:, n))
         self%last(:, n) = f
         self%place(:, n) = x(:, n)
         forces(:, k) = forces(:, k) + f*(angstrom/joule_per_ev)
      end do
   end subroutine push

   !> Velocities (3, n) of atoms at a temperature without a motion of the whole, m/s.
   function thermal_speeds(count, mass, temperature, seed) result(v)
      integer, intent(in) :: count, seed
      real(wp), intent(in) :: mass, temperature !< kg; K
      real(wp), allocatable :: v(:, :)
      real(wp), parameter :: turn = 8.0_wp*atan(1.0_wp)
      real(wp) :: u(3, count)
      integer :: k
      call random_seed(put=[(ieor(7919*k, 104729*mod(seed, 20000)), k=1, dice)])
      allocate (v(3, count))
      call random_number(v)
      call random_number(u)
      v = sqrt(-2.0_wp*log(1.0_wp - v)*boltzmann*temperature/mass)*cos(turn*u)
      v = v - spread(sum(v, 2)/count, 2, count)
   end function thermal_speeds

end module m_bath
