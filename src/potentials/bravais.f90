!> A crystal with one atom a lattice point, deformed homogeneously: energy and stress by its potential
!> (Cauchy-Born; theory.md, eqs cauchy-born), its constant at rest, its elastic moduli.
module m_bravais
   use m_kinds, only: wp
   use m_polar, only: determinant
   use m_potential, only: potential_t
   implicit none
   private
   public :: lattices, basis_of

   character(len=3), parameter :: lattices(3) = ['fcc', 'bcc', 'sc ']
   real(wp), parameter :: least_stretch = 0.6_wp !< neighbours are kept for stretches down to this

   type, public :: bravais_t
      integer :: lattice = 1              !< among `lattices`
      real(wp) :: constant = 0.0_wp       !< edge of the cube at rest, m
      real(wp) :: volume = 0.0_wp         !< of an atom at rest, m3
      real(wp) :: energy_at_rest = 0.0_wp !< of an atom, J
      real(wp) :: c11 = 0.0_wp, c12 = 0.0_wp, c44 = 0.0_wp !< Pa
      type(potential_t) :: potential
      real(wp), allocatable :: neighbours(:, :) !< (3, n) half of them, without those opposite, at rest, m
      real(wp), private :: rest(3, 3) = 0.0_wp  !< stress that rounding leaves at rest, Pa
   contains
      procedure :: find_rest
      procedure :: energy
      procedure :: stress
      procedure :: wave_modulus
      procedure :: surface_depth
      procedure :: structure
      procedure, private :: set_constant
      procedure, private :: raw_stress
      procedure, private :: set_moduli
   end type bravais_t

contains

   !> Lattice points in the cube of edge 1.
   pure function basis_of(lattice) result(points)
      integer, intent(in) :: lattice
      real(wp), allocatable :: points(:, :)
      real(wp), parameter :: h = 0.5_wp
      select case (lattice)
      case (1)
         points = reshape([0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, h, h, h, 0.0_wp, h, h, h, 0.0_wp], [3, 4])
      case (2)
         points = reshape([0.0_wp, 0.0_wp, 0.0_wp, h, h, h], [3, 2])
      case default
         points = reshape([0.0_wp, 0.0_wp, 0.0_wp], [3, 1])
      end select
   end function basis_of

   !> Half the spacing of the planes along an edge of the cube, m: so far below a surface the first stands.
   pure real(wp) function surface_depth(self)
      class(bravais_t), intent(in) :: self
      surface_depth = self%constant*merge(0.5_wp, 0.25_wp, trim(lattices(self%lattice)) == 'sc')
   end function surface_depth

   !> Class of its atoms by their common neighbours, as LAMMPS's compute cna/atom numbers them.
   pure integer function structure(self)
      class(bravais_t), intent(in) :: self
      integer, parameter :: classes(3) = [1, 3, 5]
      structure = classes(self%lattice)
   end function structure

   !> The constant near a given one at which the crystal bears no stress and has the least energy, and the
   !> moduli there. `found` is false where there is none within 15 %.
   subroutine find_rest(self, near, found)
      class(bravais_t), intent(inout) :: self
      real(wp), intent(in) :: near !< m
      logical, intent(out) :: found
      integer, parameter :: steps = 60
      real(wp) :: low, high, middle, unit(3, 3), p(0:steps)
      integer :: k, at
      unit = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
      self%rest = 0.0_wp
      at = -1
      do k = 0, steps
         call self%set_constant(near*(0.85_wp + 0.3_wp*k/steps))
         p(k) = trace(self%raw_stress(unit))
         if (k == 0) cycle
         if (p(k - 1) < 0.0_wp .and. p(k) >= 0.0_wp) then ! from compressed to stretched: stable
            if (at < 0 .or. abs(k - steps/2) < abs(at - steps/2)) at = k
         end if
      end do
      found = at > 0
      if (.not. found) return
      low = near*(0.85_wp + 0.3_wp*(at - 1)/steps)
      high = near*(0.85_wp + 0.3_wp*at/steps)
      do k = 1, 200
         middle = 0.5_wp*(low + high)
         if (.not. (middle > low .and. middle < high)) exit
         call self%set_constant(middle)
         if (trace(self%raw_stress(unit)) < 0.0_wp) then
            low = middle
         else
            high = middle
         end if
      end do
      call self%set_constant(middle)
      self%rest = self%raw_stress(unit)
      self%energy_at_rest = 0.0_wp
      self%energy_at_rest = self%energy(unit)
      call self%set_moduli()
      found = self%c11 > self%c12 .and. self%c11 > -2.0_wp*self%c12 .and. self%c44 > 0.0_wp
   end subroutine find_rest

   pure real(wp) function trace(a)
      real(wp), intent(in) :: a(3, 3)
      trace = a(1, 1) + a(2, 2) + a(3, 3)
   end function trace

   !> Neighbours for a constant.
   pure subroutine set_constant(self, constant)
      class(bravais_t), intent(inout) :: self
      real(wp), intent(in) :: constant
      real(wp), allocatable :: points(:, :)
      real(wp) :: r(3), reach
      integer :: cells, i, j, k, b, n, pass
      points = basis_of(self%lattice)
      self%constant = constant
      self%volume = constant**3/size(points, 2)
      reach = self%potential%cutoff/least_stretch
      cells = ceiling(reach/constant) + 1
      if (allocated(self%neighbours)) deallocate (self%neighbours)
      do pass = 1, 2
         n = 0
         do k = -cells, cells
            do j = -cells, cells
               do i = -cells, cells
                  do b = 1, size(points, 2)
                     r = constant*(points(:, b) + real([i, j, k], wp))
                     if (.not. is_upper(r) .or. norm2(r) >= reach) cycle
                     n = n + 1
                     if (pass == 2) self%neighbours(:, n) = r
                  end do
               end do
            end do
         end do
         if (pass == 1) allocate (self%neighbours(3, n))
      end do
   contains
      !> One of each vector and its opposite.
      pure logical function is_upper(v)
         real(wp), intent(in) :: v(3)
         real(wp), parameter :: none = 1.0e-6_wp
         real(wp) :: small
         small = none*constant
         is_upper = v(3) > small .or. (abs(v(3)) <= small .and. (v(2) > small .or. (abs(v(2)) <= small .and. &
                                                                                    v(1) > small)))
      end function is_upper
   end subroutine set_constant

   !> Energy of an atom under a deformation gradient F beyond that at rest, J.
   pure real(wp) function energy(self, f)
      class(bravais_t), intent(in) :: self
      real(wp), intent(in) :: f(3, 3)
      real(wp) :: x(3), r, value, slope, density, sum_pairs
      integer :: n
      density = 0.0_wp
      sum_pairs = 0.0_wp
      do n = 1, size(self%neighbours, 2)
         x = matmul(f, self%neighbours(:, n))
         r = norm2(x)
         if (r >= self%potential%cutoff) cycle
         call self%potential%pair(r, value, slope)
         sum_pairs = sum_pairs + value
         call self%potential%neighbour(r, value, slope)
         density = density + 2.0_wp*value
      end do
      call self%potential%embed(density, value, slope)
      energy = sum_pairs + value - self%energy_at_rest
   end function energy

   !> Cauchy's stress under F, Pa: no stress at rest, to the bit.
   pure function stress(self, f) result(s)
      class(bravais_t), intent(in) :: self
      real(wp), intent(in) :: f(3, 3)
      real(wp) :: s(3, 3)
      s = self%raw_stress(f) - self%rest
   end function stress

   !> (1/Omega) sum over half of the neighbours of (phi' + 2 F' f') r r/|r|.
   pure function raw_stress(self, f) result(s)
      class(bravais_t), intent(in) :: self
      real(wp), intent(in) :: f(3, 3)
      real(wp) :: s(3, 3), of_pairs(3, 3), of_density(3, 3), x(3), r, value, slope, density
      integer :: n, i
      of_pairs = 0.0_wp
      of_density = 0.0_wp
      density = 0.0_wp
      do n = 1, size(self%neighbours, 2)
         x = matmul(f, self%neighbours(:, n))
         r = norm2(x)
         if (r >= self%potential%cutoff) cycle
         call self%potential%pair(r, value, slope)
         do i = 1, 3
            of_pairs(:, i) = of_pairs(:, i) + slope/r*x(i)*x
         end do
         if (.not. self%potential%embeds) cycle
         call self%potential%neighbour(r, value, slope)
         density = density + 2.0_wp*value
         do i = 1, 3
            of_density(:, i) = of_density(:, i) + slope/r*x(i)*x
         end do
      end do
      call self%potential%embed(density, value, slope)
      s = (of_pairs + 2.0_wp*slope*of_density)/(self%volume*determinant(f))
   end function raw_stress

   !> By small strains: differences of fourth order.
   pure subroutine set_moduli(self)
      class(bravais_t), intent(inout) :: self
      real(wp) :: along(3, 3), shear(3, 3), s(3, 3)
      along = 0.0_wp
      along(1, 1) = 1.0_wp
      shear = 0.0_wp
      shear(2, 3) = 0.5_wp
      shear(3, 2) = 0.5_wp
      s = slope_of(self, along, 1.0_wp)
      self%c11 = s(1, 1)
      self%c12 = s(2, 2)
      s = slope_of(self, shear, 1.0_wp)
      self%c44 = s(2, 3)
   end subroutine set_moduli

   !> The derivative of the stress by a strain on top of a stretch that is the same in all directions.
   pure function slope_of(self, strain, stretch) result(slope)
      class(bravais_t), intent(in) :: self
      real(wp), intent(in) :: strain(3, 3), stretch
      real(wp), parameter :: h = 2.0e-4_wp
      real(wp) :: slope(3, 3)
      slope = (8.0_wp*(self%raw_stress(strained(h)) - self%raw_stress(strained(-h))) &
               - (self%raw_stress(strained(2.0_wp*h)) - self%raw_stress(strained(-2.0_wp*h))))/(12.0_wp*h)
   contains
      pure function strained(e) result(f)
         real(wp), intent(in) :: e
         real(wp) :: f(3, 3)
         integer :: i
         f = stretch*e*strain
         do i = 1, 3
            f(i, i) = f(i, i) + stretch
         end do
      end function strained
   end function slope_of

   !> Largest modulus of waves along the edge and the diagonals of the cube under a stretch that is the same
   !> in all directions, relative to the volume then, Pa.
   pure real(wp) function wave_modulus(self, stretch)
      class(bravais_t), intent(in) :: self
      real(wp), intent(in) :: stretch
      real(wp) :: n(3), s(3, 3)
      integer :: k
      wave_modulus = 0.0_wp
      do k = 1, 3
         n = [1.0_wp, merge(1.0_wp, 0.0_wp, k > 1), merge(1.0_wp, 0.0_wp, k > 2)]
         n = n/norm2(n)
         s = slope_of(self, spread(n, 2, 3)*spread(n, 1, 3), stretch)
         wave_modulus = max(wave_modulus, dot_product(n, matmul(s, n)))
      end do
   end function wave_modulus

end module m_bravais
