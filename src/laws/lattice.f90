!> Shared by laws of anisotropic elasticity: material axes that rotate with the material, moduli along these
!> axes, and the stress (theory.md, eqs lattice, lattice-stress). The state is the elastic stretch along the
!> axes and their orientation: a tensor and a rotation, each of which can be averaged when particles merge.
module m_lattice
   use m_kinds, only: wp
   use m_field_table, only: field_table_t, layout_t
   use m_group_reader, only: group_reader_t
   use m_material, only: material_t
   use m_polar, only: cofactors, determinant, polar
   use m_rotations, only: followed_by, matrix_of, quaternion_of
   use m_small_systems, only: invert_definite
   implicit none
   private
   public :: lattice_t, tensor_of, columns_of, gradient_of

   integer, parameter :: wave_steps = 200 !< of the search for the fastest wave, from each start

   type, abstract, extends(material_t) :: lattice_t
      real(wp) :: stiffness(6, 6) = 0.0_wp  !< along the axes, of strains with engineering shear; xx yy zz yz
                                            !< xz xy, Pa
      real(wp) :: compliance(6, 6) = 0.0_wp !< 1/Pa
      real(wp) :: fastest = 0.0_wp          !< modulus of the fastest plane wave, Pa
      integer :: elastic = 0                !< first column of the elastic stretch along the axes
      integer :: orientation = 0            !< first column of their orientation
   contains
      procedure :: set_stiffness
      procedure :: declare => declare_lattice
      procedure :: initial => initial_lattice
      procedure :: begin_stressed
      procedure :: update
      procedure :: settle
      procedure, private :: axes_of
      procedure :: p_wave_modulus
      procedure :: complementary_energy
      procedure :: energy_of_stress
      procedure :: strain_energy
      procedure :: stretch
      procedure :: for_large_strains
      procedure :: is_oriented
   end type lattice_t

contains

   pure logical function for_large_strains(self)
      class(lattice_t), intent(in) :: self
      for_large_strains = .true.
   end function for_large_strains

   pure logical function is_oriented(self)
      class(lattice_t), intent(in) :: self
      is_oriented = .true.
   end function is_oriented

   !> Set the moduli and derived data. A matrix that is not positive definite is an error of the named
   !> variable.
   subroutine set_stiffness(self, group, name, stiffness)
      class(lattice_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      character(len=*), intent(in) :: name
      real(wp), intent(in) :: stiffness(6, 6) !< Pa
      logical :: definite
      self%stiffness = stiffness
      call invert_definite(stiffness, self%compliance, definite)
      if (definite) then
         self%fastest = fastest_wave(stiffness)
      else
         call group%refuse(name, 'the elasticity matrix is not positive definite; '// &
                           'allowed: a positive definite elasticity')
      end if
   end subroutine set_stiffness

   !> Largest p.Gamma(n).p of unit vectors p and n, Gamma the acoustic tensor: alternating maximisation in p
   !> and n, from many starts.
   pure real(wp) function fastest_wave(stiffness) result(largest)
      real(wp), intent(in) :: stiffness(6, 6)
      real(wp) :: starts(3, 13), n(3), p(3), s(3, 3)
      integer :: i, j, k, a, b, t
      t = 0
      do k = 0, 1
         do j = -1, 1
            do i = -1, 1
               if (k == 0 .and. (j < 0 .or. (j == 0 .and. i <= 0))) cycle
               t = t + 1
               starts(:, t) = real([i, j, k], wp)/norm2(real([i, j, k], wp))
            end do
         end do
      end do
      largest = 0.0_wp
      do a = 1, 13
         do b = 1, 13
            n = starts(:, a)
            p = starts(:, b)
            do t = 1, wave_steps
               s = stress_of_dyad(p, n)
               p = matmul(s, n)
               if (.not. norm2(p) > 0.0_wp) exit
               p = p/norm2(p)
               s = stress_of_dyad(p, n)
               n = matmul(s, p)
               if (.not. norm2(n) > 0.0_wp) exit
               n = n/norm2(n)
            end do
            if (.not. (norm2(n) > 0.0_wp .and. norm2(p) > 0.0_wp)) cycle
            largest = max(largest, dot_product(p, matmul(stress_of_dyad(p, n), n)))
         end do
      end do
   contains
      pure function stress_of_dyad(p, n) result(s)
         real(wp), intent(in) :: p(3), n(3)
         real(wp) :: s(3, 3)
         s = tensor_of(matmul(stiffness, [p*n, p(2)*n(3) + p(3)*n(2), p(1)*n(3) + p(3)*n(1), &
                                          p(1)*n(2) + p(2)*n(1)]))
      end function stress_of_dyad
   end function fastest_wave

   pure real(wp) function p_wave_modulus(self)
      class(lattice_t), intent(in) :: self
      p_wave_modulus = self%fastest
   end function p_wave_modulus

   !> For a stress along the axes of the material.
   pure real(wp) function complementary_energy(self, stress) result(energy)
      class(lattice_t), intent(in) :: self
      real(wp), intent(in) :: stress(6)
      energy = 0.5_wp*dot_product(stress, matmul(self%compliance, stress))
   end function complementary_energy

   !> The matrix of a particle's orientation.
   pure function axes_of(self, values) result(r)
      class(lattice_t), intent(in) :: self
      real(wp), intent(in) :: values(:) !< the particle's columns
      real(wp) :: r(3, 3), q(4)
      q = values(self%orientation:self%orientation + 3)
      r = matrix_of(q/norm2(q))
   end function axes_of

   !> For a stress in a particle, along the grid's axes.
   pure real(wp) function energy_of_stress(self, values, layout, stress) result(energy)
      class(lattice_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: stress(6)
      real(wp) :: r(3, 3)
      r = self%axes_of(values)
      energy = self%complementary_energy(columns_of(matmul(transpose(r), matmul(tensor_of(stress), r))))
   end function energy_of_stress

   !> Elastic stretch and orientation.
   pure subroutine declare_lattice(self, table, has_tools)
      class(lattice_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      logical, intent(in) :: has_tools
      call table%declare('elastic_stretch', 6, '1', written=.false.)
      call table%declare('orientation', 4, '1', written=.true.)
      self%elastic = table%column('elastic_stretch')
      self%orientation = table%column('orientation')
   end subroutine declare_lattice

   !> Initially no stretch. The orientation is that of the body or its grain; if none was set, the axes are
   !> those of the grid.
   pure subroutine initial_lattice(self, column, layout, first, last)
      class(lattice_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      integer :: p
      column(first:last, self%elastic:self%elastic + 2) = 1.0_wp
      do p = first, last
         if (all(abs(column(p, self%orientation:self%orientation + 3)) <= 0.0_wp)) &
            column(p, self%orientation) = 1.0_wp
      end do
   end subroutine initial_lattice

   !> The elastic stretch of a given stress, by iterations with the linear law: they converge by a factor of
   !> about the strain each.
   pure subroutine begin_stressed(self, stress, column, layout, first, last)
      class(lattice_t), intent(in) :: self
      real(wp), intent(in) :: stress(6)
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      integer, parameter :: max_steps = 100
      real(wp) :: q(4), r(3, 3), u(3, 3), wanted(6), e(6), missing(6)
      integer :: p, step
      do p = first, last
         q = column(p, self%orientation:self%orientation + 3)
         r = matrix_of(q)
         wanted = columns_of(matmul(transpose(r), matmul(tensor_of(stress), r)))
         u = tensor_of(column(p, self%elastic:self%elastic + 5))
         do step = 1, max_steps
            missing = wanted - columns_of(stress_along_axes(self%stiffness, u))
            if (maxval(abs(missing)) <= 8.0_wp*epsilon(1.0_wp)*maxval(abs(wanted))) exit
            e = matmul(self%compliance, missing)
            e(4:6) = 0.5_wp*e(4:6)
            u = u + tensor_of(e)
         end do
         column(p, self%elastic:self%elastic + 5) = columns_of(u)
      end do
   end subroutine begin_stressed

   !> Cauchy stress along the axes for an elastic stretch, Pa.
   pure function stress_along_axes(stiffness, u) result(t)
      real(wp), intent(in) :: stiffness(6, 6), u(3, 3)
      real(wp) :: t(3, 3), inverse(3, 3), jacobian
      jacobian = determinant(u)
      inverse = cofactors(u)/jacobian
      t = tensor_of(lattice_stress(stiffness, u, inverse))
      t = (matmul(u, matmul(t, u)) + matmul(inverse, matmul(t, inverse)))/(2.0_wp*jacobian)
   end function stress_along_axes

   !> F <- (I + dt L) F, then F = R U and the stress.
   pure subroutine update(self, column, layout, gradient, time_step, first, last)
      class(lattice_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      real(wp) :: q(4), r(3, 3), u(3, 3)
      integer :: p
      do p = first, last
         q = column(p, self%orientation:self%orientation + 3)
         q = q/norm2(q) ! in merged particles it is a mean
         r = matrix_of(q)
         u = tensor_of(column(p, self%elastic:self%elastic + 5))
         u = u + time_step*matmul(matmul(transpose(r), matmul(gradient_of(gradient, p), r)), u)
         call self%settle(column, layout, p, q, u)
      end do
   end subroutine update

   !> Orientation, stretch and stress of particle p after a step, from its new elastic deformation gradient
   !> along the axes at the step's beginning.
   pure subroutine settle(self, column, layout, p, q, f)
      class(lattice_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: p
      real(wp), intent(in) :: q(4)    !< the orientation at the step's beginning
      real(wp), intent(in) :: f(3, 3)
      real(wp) :: turn(3, 3), u(3, 3), t(3, 3), r(3, 3), turned(4)
      call polar(f, turn, u)
      turned = followed_by(quaternion_of(turn), q)
      t = stress_along_axes(self%stiffness, u)
      r = matrix_of(turned)
      t = matmul(r, matmul(t, transpose(r)))
      column(p, self%orientation:self%orientation + 3) = turned
      column(p, self%elastic:self%elastic + 5) = columns_of(u)
      column(p, layout%stress:layout%stress + 5) = columns_of(t)
   end subroutine settle

   !> K : E with E = (U^2 - U^-2)/4, which differs from the logarithmic strain only in third order (Bazant
   !> 1998), as columns.
   pure function lattice_stress(stiffness, u, inverse) result(t)
      real(wp), intent(in) :: stiffness(6, 6), u(3, 3), inverse(3, 3)
      real(wp) :: t(6)
      t = matmul(stiffness, engineering_strain(u, inverse))
   end function lattice_stress

   !> That strain, with engineering shear.
   pure function engineering_strain(u, inverse) result(e)
      real(wp), intent(in) :: u(3, 3), inverse(3, 3)
      real(wp) :: e(6)
      e = 0.25_wp*columns_of(matmul(u, u) - matmul(inverse, inverse))
      e(4:6) = 2.0_wp*e(4:6)
   end function engineering_strain

   !> The velocity gradient of particle p as a matrix.
   pure function gradient_of(gradient, p) result(l)
      real(wp), intent(in), contiguous :: gradient(:, :)
      integer, intent(in) :: p
      real(wp) :: l(3, 3)
      integer :: i, j
      do j = 1, 3
         do i = 1, 3
            l(i, j) = gradient(p, 3*(j - 1) + i)
         end do
      end do
   end function gradient_of

   !> A symmetric tensor from its columns xx yy zz yz xz xy.
   pure function tensor_of(s) result(t)
      real(wp), intent(in) :: s(6)
      real(wp) :: t(3, 3)
      t(1, 1) = s(1); t(2, 1) = s(6); t(3, 1) = s(5)
      t(1, 2) = s(6); t(2, 2) = s(2); t(3, 2) = s(4)
      t(1, 3) = s(5); t(2, 3) = s(4); t(3, 3) = s(3)
   end function tensor_of

   !> The columns of a tensor's symmetric part.
   pure function columns_of(t) result(s)
      real(wp), intent(in) :: t(3, 3)
      real(wp) :: s(6)
      s = [t(1, 1), t(2, 2), t(3, 3), 0.5_wp*(t(2, 3) + t(3, 2)), 0.5_wp*(t(1, 3) + t(3, 1)), &
           0.5_wp*(t(1, 2) + t(2, 1))]
   end function columns_of

   !> Sum of V/J E : K : E / 2, J the elastic change of volume.
   pure real(wp) function strain_energy(self, column, layout, first, last) result(energy)
      class(lattice_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      real(wp) :: u(3, 3), e(6), jacobian
      integer :: p
      energy = 0.0_wp
      do p = first, last
         u = tensor_of(column(p, self%elastic:self%elastic + 5))
         jacobian = determinant(u)
         e = engineering_strain(u, cofactors(u)/jacobian)
         energy = energy + 0.5_wp*column(p, layout%volume)/jacobian*dot_product(e, matmul(self%stiffness, e))
      end do
   end function strain_energy

   !> |U R^T n|: of the elastic deformation, which is the total one without flow.
   pure real(wp) function stretch(self, values, layout, direction)
      class(lattice_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: direction(3)
      stretch = norm2(matmul(tensor_of(values(self%elastic:self%elastic + 5)), &
                             matmul(direction, self%axes_of(values))))
   end function stretch

end module m_lattice
