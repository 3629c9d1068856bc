!> Scenes given by a section, the plane y = 0 (theory.md, Sections): of a body of revolution about the axis x
!> = y = 0, or of one that is uniform along y. Particles are positioned on the section; their masses and
!> volumes are those of the whole ring or slice.
module m_section
   use m_kinds, only: wp
   use m_constants, only: pi
   implicit none
   private
   public :: section_t

   integer, parameter, public :: geometry_3d = 1, geometry_axisymmetric = 2, geometry_plane_strain = 3
   character(len=*), parameter, public :: geometry_words(3) = [character(len=12) :: '3d', 'axisymmetric', &
                                                               'plane_strain']

   type :: section_t
      integer :: geometry = geometry_3d
   contains
      procedure :: is_flat
      procedure :: is_round
      procedure :: depth
      procedure :: word
   end type section_t

contains

   !> True if there is a section: one layer of particles, on the node plane y = 0.
   pure logical function is_flat(self)
      class(section_t), intent(in) :: self
      is_flat = self%geometry /= geometry_3d
   end function is_flat

   !> True if x is the radius and z the axis of a body of revolution.
   pure logical function is_round(self)
      class(section_t), intent(in) :: self
      is_round = self%geometry == geometry_axisymmetric
   end function is_round

   !> Extent normal to the section at a radius: once around, or one metre, m.
   pure elemental real(wp) function depth(self, radius)
      class(section_t), intent(in) :: self
      real(wp), intent(in) :: radius !< m
      depth = 1.0_wp
      if (self%is_round()) depth = 2.0_wp*pi*radius
   end function depth

   !> The word of the section in a scene.
   pure function word(self)
      class(section_t), intent(in) :: self
      character(len=:), allocatable :: word
      word = trim(geometry_words(self%geometry))
   end function word

end module m_section
