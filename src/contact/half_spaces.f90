!> The elastic modulus of the half-space below a contact point, and its compliance for pressures that vary
!> within a cell (theory.md, eqs subcell, half-space).
module m_half_spaces
   use m_kinds, only: wp
   use m_scene, only: scene_t
   use m_communicator, only: communicator_t
   use m_material, only: material_t
   use m_scene_materials, only: materials_t
   use m_level, only: level_t
   implicit none
   private
   public :: half_spaces_t, young_modulus

   !> The half-spaces below the contact points of a scene.
   type :: half_spaces_t
      real(wp) :: factor = 0.0_wp !< of the compliance below a cell (&contact subcell); 0: none
      real(wp), allocatable :: resolved(:) !< (bodies): share of the term, by the faces at the start
      real(wp), allocatable :: modulus(:)  !< (materials): E/(1 - nu^2), Pa
      real(wp), allocatable :: last(:)     !< (materials): the same in the last step; 0 in the first
   contains
      procedure :: build
      procedure :: renew
      procedure :: end_step
      procedure :: compliance
      procedure :: compliance_of
      procedure :: modulus_of
      procedure :: relaxing
   end type half_spaces_t

   real(wp), parameter :: narrow_face = 0.6_wp  !< faces up to this width, in cells, get the full term
   real(wp), parameter :: wide_face = 0.9_wp    !< wider faces get none: one point a cell does not resolve
                                                !< variations within it

contains

   !> Young's modulus of a law along x, Pa.
   pure real(wp) function young_modulus(law)
      class(material_t), intent(in) :: law
      young_modulus = 0.5_wp/law%complementary_energy([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
   end function young_modulus

   !> E/(1 - nu^2) of a half-space, from the moduli of plane waves and of shear, Pa; 0 for materials without
   !> shear stiffness, and for those that may flow: the compliance of the flowing layer is unknown, and one
   !> that vanishes under load would create energy.
   pure real(wp) function half_space_modulus(law) result(modulus)
      class(material_t), intent(in) :: law
      real(wp) :: shear, shear_energy, stress(6), wave
      integer :: k
      shear_energy = 0.0_wp
      do k = 4, 6
         stress = 0.0_wp
         stress(k) = 1.0_wp
         shear_energy = shear_energy + law%complementary_energy(stress)/3.0_wp
      end do
      modulus = 0.0_wp
      if (law%may_flow() .or. .not. shear_energy > 0.0_wp) return
      shear = 0.5_wp/shear_energy
      wave = law%p_wave_modulus()
      if (wave > shear) modulus = 4.0_wp*shear*(wave - shear)/wave
   end function half_space_modulus

   !> What a scene says of them.
   subroutine build(self, scene)
      class(half_spaces_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      self%factor = scene%contact%subcell
      associate (widths => real(scene%bodies%particles_per_cell, wp)**(-1.0_wp/3.0_wp))
         self%resolved = max(0.0_wp, min(1.0_wp, (wide_face - widths)/(wide_face - narrow_face)))
      end associate
      allocate (self%modulus(size(scene%materials)), self%last(size(scene%materials)), source=0.0_wp)
   end subroutine build

   !> Collective: the moduli of all materials in this step; of those that relax, as far as the stress of the
   !> particles that were pressed in the last step has not (theory.md, eq. subcell-relaxed). One share for all
   !> of a material: by particle it would jump from step to step where a stress is small.
   subroutine renew(self, communicator, level, materials, pressure)
      class(half_spaces_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      integer, intent(in) :: pressure !< column of the contact pressure
      real(wp) :: parts(2), share
      integer :: b, m, p
      do m = 1, size(materials%slots)
         associate (law => materials%slots(m)%law)
            self%modulus(m) = half_space_modulus(law)
            if (.not. law%long_term_share() < 1.0_wp) cycle
            parts = 0.0_wp
            do b = 1, size(level%blocks)
               if (.not. level%blocks(b)%pressed) cycle
               associate (particles => level%blocks(b)%particles)
                  do p = 1, particles%count
                     if (.not. particles%column(p, pressure) > 0.0_wp) cycle
                     if (materials%of_body(particles%body(p)) /= m) cycle
                     parts = parts + law%unrelaxed_parts(particles%column, level%layout, p)
                  end do
               end associate
            end do
            parts = [communicator%sum_real(parts(1)), communicator%sum_real(parts(2))]
            share = 1.0_wp
            if (parts(2) > 0.0_wp) share = max(law%long_term_share(), min(1.0_wp, parts(1)/parts(2)))
            self%modulus(m) = share*self%modulus(m)
         end associate
      end do
   end subroutine renew

   !> After a step: its moduli become those of the last one.
   pure subroutine end_step(self)
      class(half_spaces_t), intent(inout) :: self
      self%last = self%modulus
   end subroutine end_step

   !> The share of a deflection that came by relaxation in this step, at an unchanged force; below 0 where the
   !> material became stiffer. Half of force times it is dissipated (theory.md, eq. relaxed-below). Between
   !> bodies it is that of both, by how much each gives way.
   pure real(wp) function relaxing(self, level, materials, b, p, field) result(share)
      class(half_spaces_t), intent(in) :: self
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      integer, intent(in) :: b, p  !< numbers of the block and the particle
      integer, intent(in) :: field !< velocity field of the body that presses; 0: a tool
      real(wp) :: now, before      !< of both together, 1/Pa
      integer :: body, m, own, sides, softest
      share = 0.0_wp
      if (.not. self%factor > 0.0_wp) return
      if (.not. any(abs(self%modulus - self%last) > 0.0_wp)) return
      own = materials%of_body(level%blocks(b)%particles%body(p))
      softest = 0
      do body = 1, merge(size(materials%of_body), 0, field > 0)
         m = materials%of_body(body)
         if (level%field_of_body(body) /= field .or. .not. self%modulus(m) > 0.0_wp) cycle
         if (softest == 0) softest = m
         if (self%modulus(m) < self%modulus(softest)) softest = m
      end do
      now = 0.0_wp
      before = 0.0_wp
      do m = 1, size(self%modulus)
         if (.not. min(self%modulus(m), self%last(m)) > 0.0_wp) cycle
         sides = merge(1, 0, m == softest) + merge(1, 0, m == own)
         now = now + sides/self%modulus(m)
         before = before + sides/self%last(m)
      end do
      if (before > 0.0_wp) share = 1.0_wp - before/now
   end function relaxing

   !> What the half-space below a point of a particle gives way by, m/Pa: deflection per unit of pressure that
   !> varies within a cell.
   pure real(wp) function compliance_of(self, level, materials, b, p) result(compliance)
      class(half_spaces_t), intent(in) :: self
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      integer, intent(in) :: b, p !< numbers of the block and the particle
      compliance = self%compliance(level, materials, level%blocks(b)%particles%body(p))
   end function compliance_of

   !> E/(1 - nu^2) below a point of a particle that has a compliance below a cell, Pa; else 0.
   pure real(wp) function modulus_of(self, level, materials, b, p) result(modulus)
      class(half_spaces_t), intent(in) :: self
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      integer, intent(in) :: b, p !< numbers of the block and the particle
      modulus = 0.0_wp
      if (self%compliance_of(level, materials, b, p) > 0.0_wp) &
         modulus = self%modulus(materials%of_body(level%blocks(b)%particles%body(p)))
   end function modulus_of

   !> The compliance of a body: the cell over the modulus; less or none with one particle a cell at the start.
   !> It does not depend on the present width of faces: one that vanishes under load creates energy.
   pure real(wp) function compliance(self, level, materials, body)
      class(half_spaces_t), intent(in) :: self
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      integer, intent(in) :: body !< its number
      compliance = 0.0_wp
      if (.not. self%factor > 0.0_wp) return
      associate (modulus => self%modulus(materials%of_body(body)))
         if (modulus > 0.0_wp) compliance = self%factor*self%resolved(body)*level%grid%cell/modulus
      end associate
   end function compliance

end module m_half_spaces
