!> Where the atoms of a box and its pads stand at the start.
module m_lattice_sites
   use m_kinds, only: wp
   use m_atoms, only: atoms_t
   use m_bravais, only: basis_of
   use m_shape, only: shape_t
   implicit none
   private
   public :: fill_lattice

contains

   !> Real atoms inside the box, then pads outside it as far as real atoms' neighbours have neighbours.
   subroutine fill_lattice(spec, body, lower, upper, places, real_atoms)
      type(atoms_t), intent(in) :: spec
      class(shape_t), intent(in) :: body
      real(wp), intent(in) :: lower(3), upper(3)
      real(wp), allocatable, intent(out) :: places(:, :)
      integer, intent(out) :: real_atoms
      real(wp), allocatable :: points(:, :)
      real(wp) :: a, x(3), pad, gap, normal(3), shift
      integer :: low(3), high(3), i, j, k, b, n, pass, kind
      points = basis_of(spec%crystal%lattice)
      a = spec%crystal%constant
      pad = spec%pad_width()
      shift = merge(0.5_wp, 0.25_wp, size(points, 2) == 1) ! planes of atoms stand midway between the faces
      low = floor(-pad*[1, 1, 1]/a) - 1
      high = ceiling((upper - lower + pad)/a) + 1
      do pass = 1, 2
         n = 0
         do kind = 1, 2
            do k = low(3), high(3)
               do j = low(2), high(2)
                  do i = low(1), high(1)
                     do b = 1, size(points, 2)
                        x = lower + a*(points(:, b) + shift + real([i, j, k], wp))
                        if (any(x < lower - pad) .or. any(x > upper + pad)) cycle
                        if (all(x > lower .and. x < upper) .neqv. kind == 1) cycle
                        if (kind == 1 .and. norm2(x - spec%void) < spec%void_radius) cycle
                        call body%distance_and_normal(x, gap, normal)
                        if (gap >= 0.0_wp) cycle
                        n = n + 1
                        if (pass == 2) places(:, n) = x
                     end do
                  end do
               end do
            end do
            if (kind == 1) real_atoms = n
         end do
         if (pass == 1) allocate (places(3, n))
      end do
   end subroutine fill_lattice

end module m_lattice_sites
