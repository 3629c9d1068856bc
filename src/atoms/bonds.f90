!> Bonds between real atoms and pads: their forces by the potential, and where they cross the box (theory.md,
!> eqs bond-force, bond-crossing). Who is a neighbour of whom is settled at the start: up to the interface the
!> lattice stays whole.
module m_bonds
   use m_kinds, only: wp
   use m_potential, only: potential_t
   implicit none
   private

   real(wp), parameter :: longest = 1.1_wp !< of a bond at the start, in cutoffs: those that may become one
   real(wp), parameter :: slipped = 0.25_wp !< relative change of a near bond's length at which the lattice is
                                            !< whole no more

   type, public :: bonds_t
      integer, allocatable :: pairs(:, :)   !< (2, n) of whose atoms one has its density asked for
      integer, allocatable :: across(:, :)  !< (2, m): real atom, pad
      real(wp), allocatable :: share(:)     !< (m) of the bond, from the real atom, at which it leaves the box
      real(wp), allocatable :: first(:)     !< (m) its length at the start, m
      real(wp) :: near = 0.0_wp             !< that of the nearest neighbours, m
      real(wp), allocatable :: density(:)   !< (atoms) work
      logical, allocatable :: asked(:)      !< (atoms) whether its density is
      real(wp) :: worst = 0.0_wp            !< largest relative change of a near bond's length in this step
   contains
      procedure :: build
      procedure :: forces
      procedure :: is_broken
   end type bonds_t

contains

   !> The lists, from places (3, atoms) at the start. `lower` and `upper`: the box; `free`: sides of the box
   !> that no bond crosses, for there is nothing beyond.
   subroutine build(self, places, real_atoms, potential, lower, upper, near)
      class(bonds_t), intent(inout) :: self
      real(wp), intent(in) :: places(:, :)   !< m
      integer, intent(in) :: real_atoms      !< the first ones; pads follow
      type(potential_t), intent(in) :: potential
      real(wp), intent(in) :: lower(3), upper(3), near
      integer, allocatable :: all(:, :)
      real(wp) :: d(3)
      integer :: n, kept, crossing
      self%near = near
      call near_pairs(places, longest*potential%cutoff, all)
      allocate (self%asked(size(places, 2)), source=.false.)
      crossing = 0
      do n = 1, size(all, 2)
         if ((all(1, n) <= real_atoms) .eqv. (all(2, n) <= real_atoms)) cycle
         self%asked(all(:, n)) = .true.
         crossing = crossing + 1
      end do
      kept = 0
      if (potential%embeds) then
         do n = 1, size(all, 2)
            if (any(self%asked(all(:, n)))) kept = kept + 1
         end do
      end if
      allocate (self%pairs(2, kept), self%across(2, crossing), self%share(crossing), self%first(crossing))
      allocate (self%density(size(places, 2)))
      kept = 0
      crossing = 0
      do n = 1, size(all, 2)
         if (potential%embeds .and. any(self%asked(all(:, n)))) then
            kept = kept + 1
            self%pairs(:, kept) = all(:, n)
         end if
         if ((all(1, n) <= real_atoms) .eqv. (all(2, n) <= real_atoms)) cycle
         crossing = crossing + 1
         self%across(:, crossing) = [minval(all(:, n)), maxval(all(:, n))]
         associate (p => places(:, self%across(1, crossing)))
            d = places(:, self%across(2, crossing)) - p
            self%first(crossing) = norm2(d)
            self%share(crossing) = way_out(p, d, lower, upper)
         end associate
      end do
   end subroutine build

   !> Where, from p (0) to p + d (1), the box is left.
   pure real(wp) function way_out(p, d, lower, upper) result(share)
      real(wp), intent(in) :: p(3), d(3), lower(3), upper(3)
      integer :: k
      share = 1.0_wp
      do k = 1, 3
         if (d(k) > 0.0_wp) share = min(share, (upper(k) - p(k))/d(k))
         if (d(k) < 0.0_wp) share = min(share, (lower(k) - p(k))/d(k))
      end do
      share = max(share, 0.0_wp)
   end function way_out

   !> All pairs nearer than `reach`, by cells of that size.
   subroutine near_pairs(places, reach, pairs)
      real(wp), intent(in) :: places(:, :), reach
      integer, allocatable, intent(out) :: pairs(:, :)
      integer, allocatable :: first(:, :, :), next(:)
      real(wp) :: low(3)
      integer :: cells(3), at(3), to(3), n, m, k, pass, found
      low = minval(places, 2)
      cells = max(1, int((maxval(places, 2) - low)/reach) + 1)
      allocate (first(cells(1), cells(2), cells(3)), source=0)
      allocate (next(size(places, 2)))
      do n = 1, size(places, 2)
         at = min(int((places(:, n) - low)/reach) + 1, cells)
         next(n) = first(at(1), at(2), at(3))
         first(at(1), at(2), at(3)) = n
      end do
      do pass = 1, 2
         found = 0
         do n = 1, size(places, 2)
            at = min(int((places(:, n) - low)/reach) + 1, cells)
            do k = 0, 26
               to = at + [mod(k, 3), mod(k/3, 3), k/9] - 1
               if (any(to < 1) .or. any(to > cells)) cycle
               m = first(to(1), to(2), to(3))
               do while (m > 0)
                  if (m > n) then
                     if (sum((places(:, m) - places(:, n))**2) < reach**2) then
                        found = found + 1
                        if (pass == 2) pairs(:, found) = [n, m]
                     end if
                  end if
                  m = next(m)
               end do
            end do
         end do
         if (pass == 1) allocate (pairs(2, found))
      end do
   end subroutine near_pairs

   !> Of each bond across the interface: the force on the continuum (N), and where (m).
   subroutine forces(self, potential, x, force, place)
      class(bonds_t), intent(inout) :: self
      type(potential_t), intent(in) :: potential
      real(wp), intent(in) :: x(:, :)                      !< (3, atoms), m
      real(wp), intent(out) :: force(:, :), place(:, :)    !< (3, bonds)
      real(wp) :: d(3), r, pair, pair_slope, density, density_slope
      integer :: n
      if (potential%embeds) call fill_densities(self, potential, x)
      self%worst = 0.0_wp
      do n = 1, size(self%share)
         associate (i => self%across(1, n), j => self%across(2, n))
            d = x(:, j) - x(:, i)
            r = norm2(d)
            place(:, n) = x(:, i) + self%share(n)*d
            force(:, n) = 0.0_wp
            if (self%first(n) < 1.1_wp*self%near) self%worst = max(self%worst, abs(r/self%first(n) - 1.0_wp))
            if (r >= potential%cutoff) cycle
            call potential%pair(r, pair, pair_slope)
            if (potential%embeds) then
               call potential%neighbour(r, density, density_slope)
               pair_slope = pair_slope + (self%density(i) + self%density(j))*density_slope
            end if
            force(:, n) = -pair_slope/r*d ! under tension the atom pulls the continuum inwards
         end associate
      end do
   end subroutine forces

   !> F' of the densities at all atoms that are asked for.
   subroutine fill_densities(self, potential, x)
      class(bonds_t), intent(inout) :: self
      type(potential_t), intent(in) :: potential
      real(wp), intent(in) :: x(:, :)
      real(wp) :: square, value, slope
      integer :: n
      self%density = 0.0_wp
      do n = 1, size(self%pairs, 2)
         associate (i => self%pairs(1, n), j => self%pairs(2, n))
            square = (x(1, j) - x(1, i))**2 + (x(2, j) - x(2, i))**2 + (x(3, j) - x(3, i))**2
            if (square >= potential%cutoff**2) cycle
            call potential%neighbour(sqrt(square), value, slope)
            self%density(i) = self%density(i) + value
            self%density(j) = self%density(j) + value
         end associate
      end do
      do n = 1, size(self%density)
         if (.not. self%asked(n)) cycle
         call potential%embed(self%density(n), value, slope)
         self%density(n) = slope
      end do
   end subroutine fill_densities

   !> True when the lattice at the interface is not what it was: a defect has come there.
   pure logical function is_broken(self)
      class(bonds_t), intent(in) :: self
      is_broken = self%worst > slipped
   end function is_broken

end module m_bonds
