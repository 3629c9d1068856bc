!> Bonds that cross the faces of the box: their forces by the potential, and where they cross (theory.md,
!> eqs bond-force, bond-energy). Bonds between a real atom and a pad cross once; those between two pads that
!> cut an edge of the box cross twice. Which atoms are neighbours is settled at the start: up to the interface
!> the lattice stays whole.
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
      integer, allocatable :: across(:, :)  !< (2, m) the atoms of each crossing: one, and a pad
      real(wp), allocatable :: share(:)     !< (m) of the bond, from the first atom, at which it crosses
      integer, allocatable :: sense(:)      !< (m) 1: the bond leaves the box there; -1: it enters
      integer :: real_atoms = 0
      real(wp), allocatable :: first(:)     !< (m) length of the bond at the start, m
      real(wp), allocatable :: length(:)    !< (m) when forces were asked for the last time, m
      real(wp), allocatable :: slope(:)     !< (m) then: of the energy that `stored` accumulates, J/m
      real(wp) :: stored = 0.0_wp           !< in the parts of the bonds inside the box, less what the sum of
                                            !< the energies of real atoms has of them, since the start, J
      real(wp) :: near = 0.0_wp             !< that of the nearest neighbours, m
      real(wp), allocatable :: density(:)   !< (atoms) work
      logical, allocatable :: asked(:)      !< (atoms) whether its density is
      real(wp) :: worst = 0.0_wp            !< largest relative change of a near bond's length in this step
   contains
      procedure :: build
      procedure :: crossings
      procedure :: forces
      procedure :: is_broken
   end type bonds_t

contains

   !> The lists, from places (3, atoms) at the start. `lower` and `upper`: the box.
   subroutine build(self, places, real_atoms, potential, lower, upper, near)
      class(bonds_t), intent(inout) :: self
      real(wp), intent(in) :: places(:, :)   !< m
      integer, intent(in) :: real_atoms      !< the first ones; pads follow
      type(potential_t), intent(in) :: potential
      real(wp), intent(in) :: lower(3), upper(3), near
      integer, allocatable :: all(:, :)
      integer :: n, kept
      self%near = near
      self%real_atoms = real_atoms
      call near_pairs(places, longest*potential%cutoff, all)
      call find_crossings(self, places, all, lower, upper)
      allocate (self%asked(size(places, 2)), source=.false.)
      do n = 1, size(self%share)
         self%asked(self%across(:, n)) = .true.
      end do
      kept = 0
      if (potential%embeds) then
         do n = 1, size(all, 2)
            if (any(self%asked(all(:, n)))) kept = kept + 1
         end do
      end if
      allocate (self%pairs(2, kept))
      allocate (self%density(size(places, 2)))
      kept = 0
      do n = 1, size(all, 2)
         if (.not. (potential%embeds .and. any(self%asked(all(:, n))))) cycle
         kept = kept + 1
         self%pairs(:, kept) = all(:, n)
      end do
   end subroutine build

   !> All crossings of the pairs `all` with the faces of the box.
   subroutine find_crossings(self, places, all, lower, upper)
      class(bonds_t), intent(inout) :: self
      real(wp), intent(in) :: places(:, :), lower(3), upper(3)
      integer, intent(in) :: all(:, :)
      real(wp) :: enters, leaves, d(3)
      integer :: n, m, pass, pair(2)
      do pass = 1, 2
         m = 0
         do n = 1, size(all, 2)
            if (maxval(all(:, n)) <= self%real_atoms) cycle
            pair = [minval(all(:, n)), maxval(all(:, n))]
            d = places(:, pair(2)) - places(:, pair(1))
            call cut(places(:, pair(1)), d, lower, upper, enters, leaves)
            if (pair(1) <= self%real_atoms) then
               call put(max(leaves, 0.0_wp), 1)
            else if (enters < leaves .and. leaves > 0.0_wp .and. enters < 1.0_wp) then
               call put(enters, -1)
               call put(leaves, 1)
            end if
         end do
         if (pass == 1) then
            allocate (self%across(2, m), self%share(m), self%sense(m), self%first(m))
            allocate (self%length(m), self%slope(m), source=0.0_wp)
         end if
      end do
   contains
      subroutine put(share, sense)
         real(wp), intent(in) :: share
         integer, intent(in) :: sense
         m = m + 1
         if (pass == 1) return
         self%across(:, m) = pair
         self%share(m) = share
         self%sense(m) = sense
         self%first(m) = norm2(d)
      end subroutine put
   end subroutine find_crossings

   !> Where bonds between atoms at places (3, atoms) cross, (3, crossings), m.
   pure function crossings(self, x) result(places)
      class(bonds_t), intent(in) :: self
      real(wp), intent(in) :: x(:, :)
      real(wp), allocatable :: places(:, :)
      integer :: n
      allocate (places(3, size(self%share)))
      do n = 1, size(self%share)
         associate (i => self%across(1, n), j => self%across(2, n))
            places(:, n) = x(:, i) + self%share(n)*(x(:, j) - x(:, i))
         end associate
      end do
   end function crossings

   !> Where the way from p (0) to p + d (1) enters and leaves the box; it stays outside if it leaves before it
   !> enters.
   pure subroutine cut(p, d, lower, upper, enters, leaves)
      real(wp), intent(in) :: p(3), d(3), lower(3), upper(3)
      real(wp), intent(out) :: enters, leaves
      real(wp) :: one, two
      integer :: k
      enters = -huge(1.0_wp)
      leaves = huge(1.0_wp)
      do k = 1, 3
         if (abs(d(k)) > 0.0_wp) then
            one = (lower(k) - p(k))/d(k)
            two = (upper(k) - p(k))/d(k)
            enters = max(enters, min(one, two))
            leaves = min(leaves, max(one, two))
         else if (p(k) <= lower(k) .or. p(k) >= upper(k)) then
            leaves = -huge(1.0_wp)
         end if
      end do
   end subroutine cut

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

   !> Of each crossing: the force on the continuum (N), and where (m). `follows`: the atoms have moved here
   !> from where forces were asked for the last time, and `stored` accumulates what that does to the bonds.
   subroutine forces(self, potential, x, follows, force, place)
      class(bonds_t), intent(inout) :: self
      type(potential_t), intent(in) :: potential
      real(wp), intent(in) :: x(:, :)                      !< (3, atoms), m
      logical, intent(in) :: follows
      real(wp), intent(out) :: force(:, :), place(:, :)    !< (3, crossings)
      real(wp) :: d(3), r, tension, own, slope
      integer :: n
      if (potential%embeds) call fill_densities(self, potential, x)
      self%worst = 0.0_wp
      do n = 1, size(self%share)
         associate (i => self%across(1, n), j => self%across(2, n))
            d = x(:, j) - x(:, i)
            r = norm2(d)
            place(:, n) = x(:, i) + self%share(n)*d
            if (self%first(n) < 1.1_wp*self%near) self%worst = max(self%worst, abs(r/self%first(n) - 1.0_wp))
            call pull(self, potential, n, r, tension, own)
            force(:, n) = -self%sense(n)*tension/r*d ! under tension the atom pulls the continuum inwards
            slope = self%sense(n)*self%share(n)*tension - own
            if (follows) self%stored = self%stored + 0.5_wp*(slope + self%slope(n))*(r - self%length(n))
            self%length(n) = r
            self%slope(n) = slope
         end associate
      end do
   end subroutine forces

   !> Of the bond of a crossing of length r: the derivative of the energy of all by r (`tension`, N), and that
   !> of the energy of a real atom, as the sum over real atoms counts it (`own`).
   pure subroutine pull(self, potential, n, r, tension, own)
      type(bonds_t), intent(in) :: self
      type(potential_t), intent(in) :: potential
      integer, intent(in) :: n
      real(wp), intent(in) :: r
      real(wp), intent(out) :: tension, own
      real(wp) :: pair, density, density_slope
      tension = 0.0_wp
      own = 0.0_wp
      if (r >= potential%cutoff) return
      call potential%pair(r, pair, tension)
      associate (i => self%across(1, n), j => self%across(2, n))
         if (i <= self%real_atoms) own = 0.5_wp*tension
         if (.not. potential%embeds) return
         call potential%neighbour(r, density, density_slope)
         if (i <= self%real_atoms) own = own + self%density(i)*density_slope
         tension = tension + (self%density(i) + self%density(j))*density_slope
      end associate
   end subroutine pull

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
