!> What bonds do at rest where a box of atoms reaches out of its body: atoms at the surface relax and pull at
!> the rim (surface stress). Around the box the surface would bear that; the continuum has no such surface.
module m_surface_rest
   use m_kinds, only: wp
   use m_atoms, only: atoms_t
   use m_dynamics, only: dynamics_t
   use m_interface_mesh, only: interface_mesh_t
   use m_shape, only: shape_t
   implicit none
   private
   public :: find_surface_rest

contains

   !> Give the mesh the forces of bonds of the box without void, relaxed among pads that stand still.
   subroutine find_surface_rest(mesh, spec, body, lower, upper, width, complaint)
      type(interface_mesh_t), intent(inout) :: mesh
      type(atoms_t), intent(in) :: spec
      class(shape_t), intent(in) :: body         !< with nothing cut out of it
      real(wp), intent(in) :: lower(3), upper(3) !< of the box, within the body, m
      real(wp), intent(in) :: width              !< of the particles around it, m
      character(len=:), allocatable, intent(out) :: complaint
      type(dynamics_t), pointer :: whole
      type(atoms_t) :: without
      real(wp) :: low(3), high(3)
      complaint = ''
      call body%bounding_box(low, high)
      if (.not. any(lower <= low .or. upper >= high)) return
      without = spec
      without%void_radius = 0.0_wp
      allocate (whole)
      call whole%create(without, body, lower, upper, width, complaint)
      if (complaint == '') then
         call whole%lammps%command('min_style cg')
         call whole%lammps%command('minimize 0 1e-7 1000 3000')
         call whole%lammps%command('run 0 post no')
         complaint = whole%lammps%fault
         call mesh%set_rest(whole%place, whole%force)
         call whole%lammps%finish()
      end if
      deallocate (whole)
   end subroutine find_surface_rest

end module m_surface_rest
