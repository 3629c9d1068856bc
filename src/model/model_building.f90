!> Building the model of a scene: materials, effects, contact, and the fields of particles.
submodule (m_model) m_model_building
   use m_body, only: number_ids
   use m_domain_kinds, only: domain_kinds
   use m_effect, only: hooks_t
   use m_field_table, only: layout_t
   use m_motion_fields, only: declare_motion
   use m_scene, only: update_usl, update_usf, update_musl
   use m_scene_effects, only: make_effects, add_effect
   use m_scene_materials, only: make_materials
   use m_surface, only: make_surface
   implicit none

contains

   module procedure build
      integer :: e, l
      self%communicator = communicator
      self%method = scene%time
      self%has_statics = scene%quasi_static%present
      self%has_inertia = scene%quasi_static%has_inertia() .or. .not. scene%quasi_static%holds_at(0.0_wp)
      self%materials = make_materials(scene)
      associate (materials => self%materials)
         self%stuff = [(stuff_t(materials%slots(materials%of_body(e))%law%density, &
                                materials%slots(materials%of_body(e))%law%p_wave_modulus()), e=1, &
                                size(materials%of_body))]
      end associate
      if (.not. allocated(self%effects)) call make_effects(scene, self%effects)
      call make_levels(self, scene)
      call check_nests(self, scene, error)
      if (error%happened()) return
      if (scene%fields() > 1) call add_effect(self%effects, make_surface(scene, some_erode(self%effects)))
      call self%timers%start(size(self%levels))
      if (size(self%levels) > 1) self%levels_row = self%timers%row_of('levels')
      do e = 1, size(self%effects)
         call self%effects(e)%effect%prepare(self%levels(1)%grid, self%materials)
      end do
      do l = 1, size(self%levels)
         call self%effect_step(l)%build(self%effects, self%levels(l)%grid%block_count(), self%timers)
      end do
      call self%place_layers()
      call self%contact%build(scene)
      self%contact%strains_apart = self%method%stress_update /= update_usl
      self%contact%strains_next = self%method%stress_update == update_usf
      self%contact%followed = self%contact%active() .and. (self%method%affine .or. self%method%stress_update &
                                                           == update_usl)
      allocate (self%lost_in_merging(blocks_before(self%levels, size(self%levels) + 1)), source=0.0_wp)
      call declare_fields(self, scene, error)
      if (.not. error%happened()) call set_budgets(self, scene, error)
      if (error%happened()) return
      do l = 1, size(self%levels)
         call self%migration(l)%prepare(communicator, self%levels(l)%table%columns)
      end do
      call populate(self, scene, error, empty)
   end procedure build

   !> True when some effect removes failed particles.
   pure logical function some_erode(effects)
      type(effect_slot_t), intent(in) :: effects(:)
      type(hooks_t) :: hooks
      integer :: e
      some_erode = .false.
      do e = 1, size(effects)
         hooks = effects(e)%effect%hooks()
         some_erode = some_erode .or. hooks%erodes
      end do
   end function some_erode

   !> Declare the fields that every scene has, and those of materials, effects and the numerical method.
   subroutine declare_fields(self, scene, error)
      class(model_t), intent(inout) :: self
      type(scene_t), intent(in) :: scene
      type(error_t), intent(inout) :: error
      integer, parameter :: of_domains = 6 !< splits that an id has room for, in addition to those for finer
                                           !< levels
      type(layout_t) :: layout
      integer :: l, m, splits
      associate (table => self%levels(1)%table, domain => domain_kinds(self%method%domain))
         call table%declare('position', 3, 'm', written=.true., by_mass=.true.)
         call table%declare('velocity', 3, 'm/s', written=.true., by_mass=.true.)
         call table%declare('mass', 1, 'kg', written=.true., extensive=.true.)
         call table%declare('volume', 1, 'm3', written=.true., extensive=.true.)
         call table%declare(trim(domain%field), domain%components, 'm', written=.true.)
         if (domain%deforms .or. size(self%levels) > 1) &
            call table%declare('generation', 1, '1', written=.false.)
         if (size(self%levels) > 1) call table%declare('refinement', 1, '1', written=.false.)
         if (size(self%levels) > 1 .and. self%method%subcycle .and. .not. self%mixes()) &
            call table%declare('edge_stress', 6, 'Pa', written=.false.)
         call table%declare('stress', 6, 'Pa', written=.true.)
         if (self%method%affine) call table%declare('velocity_gradient', 9, '1/s', written=.false.)
         if (self%method%stress_update == update_musl) &
            call table%declare('next_position', 3, 'm', written=.false.)
         if (self%contact%active()) call self%contact%declare(table)
         do m = 1, size(self%materials%slots)
            call self%materials%slots(m)%law%declare(table, self%contact%active())
         end do
         do m = 1, size(self%effects)
            self%effects(m)%columns = table%columns
            call self%effects(m)%effect%declare(table)
            self%effects(m)%columns = table%columns - self%effects(m)%columns
         end do
         if (self%contact%pairs%active()) call self%contact%pairs%declare(table)
         call declare_motion(table, scene%output, domain%deforms)
         splits = 3*(size(self%levels) - 1) + merge(of_domains, 0, domain%deforms)
         layout = table%layout(scene%grid%section)
         call number_ids(layout, scene%bodies, self%levels(1)%grid%cell, splits, error)
         do l = 1, size(self%levels)
            self%levels(l)%table = table
            self%levels(l)%layout = layout
         end do
      end associate
   end subroutine declare_fields

end submodule m_model_building
