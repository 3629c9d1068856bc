!> Elasticity of a crystal by the potential between its atoms: energy and stress of the deformed lattice cell
!> (theory.md, eq. cauchy-born), with axes that rotate with the material.
module m_cauchy_born
   use m_kinds, only: wp
   use m_bravais, only: bravais_t, lattices
   use m_field_table, only: layout_t
   use m_group_reader, only: group_reader_t
   use m_lattice, only: columns_of, lattice_t, tensor_of
   use m_polar, only: determinant, polar
   use m_rotations, only: followed_by, matrix_of, quaternion_of
   use m_text, only: si
   use m_value_range, only: above
   implicit none
   private
   public :: cauchy_born_t

   integer, parameter :: moduli = 40                              !< of the table over the volume
   real(wp), parameter :: least = 0.7_wp, spacing = 0.015_wp !< stretches of the table

   type, extends(lattice_t) :: cauchy_born_t
      type(bravais_t) :: crystal
      real(wp) :: constant = 0.0_wp !< start value for the lattice constant at rest, m; 0: that of the
                                    !< potential
      real(wp) :: modulus(0:moduli - 1) = 0.0_wp !< of the fastest wave over the stretch, Pa
   contains
      procedure :: variables
      procedure :: settle
      procedure :: begin_stressed
      procedure :: strain_energy
      procedure :: squared_speed
   end type cauchy_born_t

contains

   subroutine variables(self, group)
      class(cauchy_born_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      real(wp) :: near, stiffness(6, 6)
      logical :: found
      integer :: i
      call self%crystal%potential%variables(group)
      call group%get_choice('lattice', self%crystal%lattice, lattices)
      call group%get('constant', self%constant, above(0.0_wp, 'm'), used=self%constant > 0.0_wp .or. &
                     .not. group%is_writing())
      if (.not. group%is_reading() .or. .not. self%crystal%potential%good) return
      if (self%crystal%lattice < 1) return
      near = self%constant
      if (.not. near > 0.0_wp) near = self%crystal%potential%nominal
      if (.not. near > 0.0_wp) then
         call group%refuse('constant', 'missing: the potential does not give the lattice constant of '// &
                           'the lattice it is at rest; allowed: a number above 0, in m')
         return
      end if
      call self%crystal%find_rest(near, found)
      if (.not. found) then
         call group%refuse('constant', 'has no stress-free lattice within 15 % of '//si(near, 'm')//', '// &
            'or one that is not stable; allowed: a constant near one at which '// &
                           trim(lattices(self%crystal%lattice))//' is free of stress')
         return
      end if
      stiffness = 0.0_wp
      stiffness(:3, :3) = self%crystal%c12
      do i = 1, 3
         stiffness(i, i) = self%crystal%c11
         stiffness(i + 3, i + 3) = self%crystal%c44
      end do
      call self%set_stiffness(group, 'potential', stiffness)
      do i = 0, moduli - 1
         self%modulus(i) = max(self%fastest, self%crystal%wave_modulus(least + spacing*i))
      end do
   end subroutine variables

   !> As the lattice's own procedure, with the stress of the potential.
   pure subroutine settle(self, column, layout, p, q, f)
      class(cauchy_born_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: p
      real(wp), intent(in) :: q(4), f(3, 3)
      real(wp) :: turn(3, 3), u(3, 3), r(3, 3), turned(4)
      call polar(f, turn, u)
      turned = followed_by(quaternion_of(turn), q)
      r = matrix_of(turned)
      column(p, self%orientation:self%orientation + 3) = turned
      column(p, self%elastic:self%elastic + 5) = columns_of(u)
      column(p, layout%stress:layout%stress + 5) = columns_of(matmul(r, matmul(self%crystal%stress(u), &
                                                                               transpose(r))))
   end subroutine settle

   !> The stretch of a given stress, by iterations with the linear law.
   pure subroutine begin_stressed(self, stress, column, layout, first, last)
      class(cauchy_born_t), intent(in) :: self
      real(wp), intent(in) :: stress(6)
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      integer, parameter :: max_steps = 100
      real(wp) :: r(3, 3), u(3, 3), wanted(6), missing(6), e(6)
      integer :: p, step
      do p = first, last
         r = matrix_of(column(p, self%orientation:self%orientation + 3))
         wanted = columns_of(matmul(transpose(r), matmul(tensor_of(stress), r)))
         u = tensor_of(column(p, self%elastic:self%elastic + 5))
         do step = 1, max_steps
            missing = wanted - columns_of(self%crystal%stress(u))
            if (maxval(abs(missing)) <= 1.0e-14_wp*self%stiffness(1, 1)) exit
            e = matmul(self%compliance, missing)
            e(4:6) = 0.5_wp*e(4:6)
            u = u + tensor_of(e)
         end do
         column(p, self%elastic:self%elastic + 5) = columns_of(u)
      end do
   end subroutine begin_stressed

   !> Sum of V/J times the energy of an atom over its volume, J.
   pure real(wp) function strain_energy(self, column, layout, first, last) result(energy)
      class(cauchy_born_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      real(wp) :: u(3, 3)
      integer :: p
      energy = 0.0_wp
      do p = first, last
         u = tensor_of(column(p, self%elastic:self%elastic + 5))
         energy = energy + column(p, layout%volume)/determinant(u)*self%crystal%energy(u)/self%crystal%volume
      end do
   end function strain_energy

   !> By moduli from the table, each by the particle's compression.
   pure real(wp) function squared_speed(self, column, layout, first, last, specific_volume) result(squared)
      class(cauchy_born_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      real(wp), intent(in) :: specific_volume
      real(wp) :: shortest
      integer :: p, at
      squared = 0.0_wp
      do p = first, last
         shortest = min(1.0_wp, minval(column(p, self%elastic:self%elastic + 2)))
         at = max(0, min(moduli - 1, floor((shortest - least)/spacing)))
         squared = max(squared, self%modulus(at)*column(p, layout%volume)/column(p, layout%mass))
      end do
   end function squared_speed

end module m_cauchy_born
