!> The stiffness of a cell of a section, for the preconditioner of implicit steps (theory.md, Multigrid).
module m_section_element
   use m_kinds, only: wp
   use m_section, only: section_t
   implicit none
   private
   public :: section_stiffness, corners

   integer, parameter :: corners(4) = [0, 1, 4, 5] !< those in the plane, of a cell's eight, counted x fastest

contains

   !> Stiffness of a square with bilinear shape functions, times its depth, by four points: for the components
   !> x, y, z of its corners, N/m. There is no motion along y; around an axis a radial displacement is a
   !> strain.
   pure function section_stiffness(section, lame, shear, cell, radius) result(stiffness)
      type(section_t), intent(in) :: section
      real(wp), intent(in) :: lame, shear !< moduli, Pa
      real(wp), intent(in) :: cell        !< m
      real(wp), intent(in) :: radius      !< of its lower side, m
      real(wp) :: stiffness(12, 12)
      real(wp), parameter :: gauss = 0.5_wp/sqrt(3.0_wp)
      real(wp) :: strain(4, 12), stress(4, 12), x, z, at
      integer :: p
      stiffness = 0.0_wp
      do p = 0, 3
         x = 0.5_wp + gauss*(2*ibits(p, 0, 1) - 1)
         z = 0.5_wp + gauss*(2*ibits(p, 1, 1) - 1)
         at = radius + x*cell
         strain = strains(x, z, cell)
         if (.not. section%is_round()) strain(2, :) = 0.0_wp
         strain(2, :) = strain(2, :)/at
         stress = 2.0_wp*shear*strain
         stress(4, :) = shear*strain(4, :)
         stress(:3, :) = stress(:3, :) + lame*spread(sum(strain(:3, :), dim=1), 1, 3)
         stiffness = stiffness + 0.25_wp*cell**2*section%depth(at)*matmul(transpose(strain), stress)
      end do
   end function section_stiffness

   !> Strains xx, yy times the radius, zz (1/m) and the shear xz by the components of the corners.
   pure function strains(x, z, cell) result(strain)
      real(wp), intent(in) :: x, z !< in the cell, 0 to 1
      real(wp), intent(in) :: cell !< m
      real(wp) :: strain(4, 12)
      real(wp) :: along_x, along_z
      integer :: n
      strain = 0.0_wp
      do n = 0, 3
         along_x = merge(x, 1.0_wp - x, btest(n, 0))
         along_z = merge(z, 1.0_wp - z, btest(n, 1))
         strain(1, 3*n + 1) = merge(along_z, -along_z, btest(n, 0))/cell
         strain(2, 3*n + 1) = along_x*along_z
         strain(3, 3*n + 3) = merge(along_x, -along_x, btest(n, 1))/cell
         strain(4, 3*n + 1) = strain(3, 3*n + 3)
         strain(4, 3*n + 3) = strain(1, 3*n + 1)
      end do
   end function strains

end module m_section_element
