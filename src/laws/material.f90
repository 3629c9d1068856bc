!> Interface of a material law. A law is one file that extends material_t, or isotropic_t, and one line in
!> materials.f90.
module m_material
   use m_kinds, only: wp
   use m_field_table, only: field_table_t, layout_t
   use m_offer, only: offer_t
   implicit none
   private
   public :: material_t

   !> Properties of a law that failure (&damage) needs.
   type, public :: failure_t
      logical :: acts = .false.      !< the law retains a modified stress: it supports failure
      logical :: by_volume = .false. !< its pressure follows from its volume: removed tension need not be
                                     !< recovered
      logical :: warms = .false.     !< it has a temperature
      real(wp) :: lame = 0.0_wp, shear = 0.0_wp !< moduli for the energy of a stress, Pa
      real(wp) :: room = 0.0_wp, melting = 1.0_wp !< K
      real(wp), allocatable :: back(:) !< moduli of its back stresses, Pa; absent: it has none
   end type failure_t

   type, abstract, extends(offer_t) :: material_t
      real(wp) :: density = 0.0_wp !< of the undeformed material, kg/m3
   contains
      procedure :: declare
      procedure :: initial
      procedure :: begin_stressed
      procedure :: is_at_rest
      procedure :: plastic_energy
      procedure :: equivalent_plastic_strain
      procedure :: may_flow
      procedure :: von_mises_modulus
      procedure :: squared_speed
      procedure :: energy_of_stress
      procedure :: fault_text
      procedure :: take_heat
      procedure :: stress_tangent
      procedure :: requests_cutback
      procedure :: is_time_dependent
      procedure :: unrelaxed_parts
      procedure :: long_term_share
      procedure :: static_parts
      procedure :: failure
      procedure(modulus_interface), deferred :: p_wave_modulus
      procedure(stress_interface), deferred :: complementary_energy
      procedure(update_interface), deferred :: update
      procedure(energy_interface), deferred :: strain_energy
      procedure(stretch_interface), deferred :: stretch
      procedure :: max_stretch
      procedure, non_overridable :: cubic_constants
   end type material_t

   abstract interface
      !> Largest modulus of a plane wave relative to the current volume, Pa: c = sqrt(p_wave_modulus V/m).
      pure real(wp) function modulus_interface(self)
         import :: material_t, wp
         class(material_t), intent(in) :: self
      end function modulus_interface

      !> Elastic energy per volume of a stress, sigma : C^-1 : sigma / 2, J/m3.
      pure real(wp) function stress_interface(self, stress)
         import :: material_t, wp
         class(material_t), intent(in) :: self
         real(wp), intent(in) :: stress(6) !< xx yy zz yz xz xy, Pa
      end function stress_interface

      !> Update the stress of particles first..last (all of this material) by dt times their velocity
      !> gradient. gradient(:, 9), 1/s: d v_i / d x_j at 3 (j-1) + i. The volume has not been updated yet.
      pure subroutine update_interface(self, column, layout, gradient, time_step, first, last)
         import :: material_t, layout_t, wp
         class(material_t), intent(in) :: self
         real(wp), intent(inout), contiguous :: column(:, :)
         type(layout_t), intent(in) :: layout
         real(wp), intent(in), contiguous :: gradient(:, :)
         real(wp), intent(in) :: time_step
         integer, intent(in) :: first, last
      end subroutine update_interface

      !> Strain energy of particles first..last together (all of this material), J.
      pure real(wp) function energy_interface(self, column, layout, first, last)
         import :: material_t, layout_t, wp
         class(material_t), intent(in) :: self
         real(wp), intent(in), contiguous :: column(:, :)
         type(layout_t), intent(in) :: layout
         integer, intent(in) :: first, last
      end function energy_interface

      !> Stretch of a particle's thickness normal to a face: current over initial thickness. Huge where the
      !> particle's columns do not give it, which is allowed in scenes without tools.
      pure real(wp) function stretch_interface(self, values, layout, direction)
         import :: material_t, layout_t, wp
         class(material_t), intent(in) :: self
         real(wp), intent(in) :: values(:)    !< the particle's columns
         type(layout_t), intent(in) :: layout
         real(wp), intent(in) :: direction(3) !< unit vector
      end function stretch_interface
   end interface

contains

   !> c11, c12 and c44 (Pa) of a law of cubic symmetry, by the energies of three stresses of 1 Pa along its
   !> axes.
   pure function cubic_constants(self) result(constants)
      class(material_t), intent(in) :: self
      real(wp) :: constants(3)
      real(wp) :: s11, s12, s44 ! compliances, 1/Pa
      s11 = 2.0_wp*self%complementary_energy([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
      s12 = self%complementary_energy([1.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp]) - s11
      s44 = 2.0_wp*self%complementary_energy([0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp])
      constants = [s11 + s12, -s12, (s11 - s12)*(s11 + 2.0_wp*s12)/s44]/((s11 - s12)*(s11 + 2.0_wp*s12))
   end function cubic_constants

   !> Number of parts of a quasi-static step for the law; more where the stress changes much with time alone.
   pure integer function static_parts(self)
      class(material_t), intent(in) :: self
      static_parts = 1
   end function static_parts

   !> The law's behaviour on failure; by default it does not support failure.
   pure type(failure_t) function failure(self)
      class(material_t), intent(in) :: self
      failure = failure_t()
   end function failure

   !> Upper bound of a particle's `stretch` in all directions; huge if the law gives none. A small bound
   !> shortens the search for contact.
   pure real(wp) function max_stretch(self, values, layout)
      class(material_t), intent(in) :: self
      real(wp), intent(in) :: values(:) !< the particle's columns
      type(layout_t), intent(in) :: layout
      max_stretch = huge(1.0_wp)
   end function max_stretch

   !> Declare the fields that the law needs beyond stress, and store their columns; most laws need none. The
   !> particles of all bodies of a scene carry them.
   pure subroutine declare(self, table, has_tools)
      class(material_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      logical, intent(in) :: has_tools !< the scene has tools: `stretch` will be used
   end subroutine declare

   !> Initial values of the law's own fields for the new particles first..last; not needed for fields that
   !> start at zero.
   pure subroutine initial(self, column, layout, first, last)
      class(material_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
   end subroutine initial

   !> Set the law's own fields so that the new particles first..last are in the state of their initial stress;
   !> after `initial`. Not needed for a law that updates the stress itself.
   pure subroutine begin_stressed(self, stress, column, layout, first, last)
      class(material_t), intent(in) :: self
      real(wp), intent(in) :: stress(6) !< xx yy zz yz xz xy, Pa; already the particles' stress
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
   end subroutine begin_stressed

   !> True when particles first..last (all of this material), which bear no stress, do not change by a bit as
   !> long as they do not move. A law with fields that evolve with time returns false until these are at rest.
   pure logical function is_at_rest(self, column, layout, first, last)
      class(material_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      is_at_rest = .true.
   end function is_at_rest

   !> Plastic work of particles first..last since the start (all of this material), J; a law without plastic
   !> flow has none.
   pure real(wp) function plastic_energy(self, column, first, last)
      class(material_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: first, last
      plastic_energy = 0.0_wp
   end function plastic_energy

   !> Add heat (J) to a particle; ignored by a law without temperature.
   pure subroutine take_heat(self, values, layout, heat)
      class(material_t), intent(in) :: self
      real(wp), intent(inout) :: values(:) !< the particle's columns
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: heat         !< J
   end subroutine take_heat

   !> True for a law with plastic flow.
   pure logical function may_flow(self)
      class(material_t), intent(in) :: self
      may_flow = .false.
   end function may_flow

   !> Of a particle; 0 for a law without plastic flow.
   pure real(wp) function equivalent_plastic_strain(self, values) result(strain)
      class(material_t), intent(in) :: self
      real(wp), intent(in) :: values(:) !< the particle's columns
      strain = 0.0_wp
   end function equivalent_plastic_strain

   !> The derivative of the stress of particles 1..count after a step by the displacement gradient A of the
   !> step, for laws with a closed form: d c/d kl at 6 (kl-1) + c, Pa. `column`: at the step's beginning.
   pure subroutine stress_tangent(self, column, layout, gradient, parts, time_step, count, slope, known)
      class(material_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :) !< (count, 9): A, not a rate
      integer, intent(in) :: parts !< number of parts of the step
      integer, intent(in) :: count
      real(wp), intent(in) :: time_step !< of all parts together, s
      real(wp), intent(inout), contiguous :: slope(:, :) !< (count, 54)
      logical, intent(out) :: known !< false: finite differences of the stress must be used
      known = .false.
   end subroutine stress_tangent

   !> True where the law requests a smaller step than the one just taken by particles first..last.
   pure logical function requests_cutback(self, column, first, last)
      class(material_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: first, last
      requests_cutback = .false.
   end function requests_cutback

   !> True for a law whose stress may change with time alone, as by creep.
   pure logical function is_time_dependent(self)
      class(material_t), intent(in) :: self
      is_time_dependent = .false.
   end function is_time_dependent

   !> Of the stress of particle p and the one that its strains would give at once: sigma : sigma_0 and
   !> sigma_0 : sigma_0 times its volume, whose ratio is the present stiffness over that of the moduli; of a
   !> law that relaxes.
   pure function unrelaxed_parts(self, column, layout, p) result(parts)
      class(material_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: p
      real(wp) :: parts(2)
      parts = 0.0_wp
   end function unrelaxed_parts

   !> What the ratio of unrelaxed_parts is never below; 1 for a law that does not relax.
   pure real(wp) function long_term_share(self)
      class(material_t), intent(in) :: self
      long_term_share = 1.0_wp
   end function long_term_share

   !> The reason for a NaN stress set by the law, as the end of a message; empty: the law never does this.
   pure function fault_text(self) result(text)
      class(material_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = ''
   end function fault_text

   !> The complementary energy of a stress in a particle, J/m3: overridden by laws with direction-dependent
   !> moduli.
   pure real(wp) function energy_of_stress(self, values, layout, stress) result(energy)
      class(material_t), intent(in) :: self
      real(wp), intent(in) :: values(:) !< the particle's columns
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: stress(6) !< xx yy zz yz xz xy, Pa
      energy = self%complementary_energy(stress)
   end function energy_of_stress

   !> Von Mises stress over equivalent elastic strain, Pa; by default that of shear in the plane of y and z.
   pure real(wp) function von_mises_modulus(self) result(modulus)
      class(material_t), intent(in) :: self
      modulus = 0.5_wp/self%complementary_energy([0.0_wp, 0.0_wp, 0.0_wp, sqrt(1.0_wp/3.0_wp), 0.0_wp, &
                                                 0.0_wp])
   end function von_mises_modulus

   !> Largest squared speed of a plane wave in the present state of particles first..last (all of this
   !> material), m2/s2. Laws that stiffen override it, by the modulus and the volume of each particle.
   pure real(wp) function squared_speed(self, column, layout, first, last, specific_volume) result(squared)
      class(material_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      real(wp), intent(in) :: specific_volume !< largest of these particles, m3/kg
      squared = self%p_wave_modulus()*specific_volume
   end function squared_speed

end module m_material
