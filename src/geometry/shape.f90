!> Interface of a shape of a body or of a tool. A shape is one file that extends shape_t, and one line in
!> shapes.f90.
!>
!> The signed distance is that to the surface, negative inside. It may grow by no more than the distance
!> between two points; outside it is exact. The shape of a body is placed where the body is. That of a tool
!> has its foremost point (the tip) in the origin, and points along its axis.
module m_shape
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_offer, only: offer_t
   use m_section, only: section_t
   use m_vectors, only: cross
   implicit none
   private
   public :: shape_t, convex_t, why_not_round, why_not_along, runs_along

   type, abstract, extends(offer_t) :: shape_t
      logical :: of_tool = .false. !< positioned by the tool
      real(wp) :: axis(3) = [0.0_wp, 0.0_wp, 1.0_wp] !< unit vector; of a tool the direction in which it
                                                     !< points
   contains
      procedure(distance_interface), deferred :: distance_and_normal
      procedure :: prepare
      procedure :: load
      procedure :: file_name
      procedure :: is_convex
      procedure :: bounding_box
      procedure :: reach
      procedure :: distance
      procedure :: distance_within
      procedure :: sheets
      procedure :: sheet_within
      procedure :: distance_of_sheet
      procedure :: min_distance
      procedure :: max_distance
      procedure :: is_searched
      procedure :: inside
      procedure :: volume
      procedure :: knows_volume
      procedure :: area
      procedure :: centre
      procedure :: lattice_origin
      procedure :: is_lattice
      procedure :: thinnest
      procedure :: place_name
      procedure :: take_section
      procedure :: end_radius
   end type shape_t

   !> A shape whose distance is a convex function of position: the smallest distance of two of them is then
   !> found exactly (overlap.f90).
   type, abstract, extends(shape_t) :: convex_t
   contains
      procedure :: is_convex => is_convex_here
   end type convex_t

   abstract interface
      !> Signed distance (m) of a point (m) from the surface, and the outward unit normal of the surface at
      !> its nearest point.
      pure subroutine distance_interface(self, place, distance, normal)
         import :: shape_t, wp
         class(shape_t), intent(in) :: self
         real(wp), intent(in) :: place(3)
         real(wp), intent(out) :: distance, normal(3)
      end subroutine distance_interface
   end interface

contains

   !> Set the tool's axis, and precompute what the distance needs from it.
   pure subroutine prepare(self, axis)
      class(shape_t), intent(inout) :: self
      real(wp), intent(in) :: axis(3) !< unit vector
      self%axis = axis
   end subroutine prepare

   !> Collective: read the shape's data from its file, if it has one. `fault` describes an error in the file,
   !> the same on every rank; empty: none.
   subroutine load(self, communicator, fault)
      class(shape_t), intent(inout) :: self
      type(communicator_t), intent(in) :: communicator
      character(len=:), allocatable, intent(inout) :: fault
      fault = ''
   end subroutine load

   !> The file of the shape; empty: none.
   pure function file_name(self) result(name)
      class(shape_t), intent(in) :: self
      character(len=:), allocatable :: name
      name = ''
   end function file_name

   !> True where the distance is known to be a convex function of position.
   pure logical function is_convex(self)
      class(shape_t), intent(in) :: self
      is_convex = .false.
   end function is_convex

   pure logical function is_convex_here(self) result(is_convex)
      class(convex_t), intent(in) :: self
      is_convex = .true.
   end function is_convex_here

   !> Axis-aligned bounding box of the shape, m. Not needed for tools.
   pure subroutine bounding_box(self, lower, upper)
      class(shape_t), intent(in) :: self
      real(wp), intent(out) :: lower(3), upper(3)
      lower = -huge(lower)
      upper = huge(upper)
   end subroutine bounding_box

   !> Radius of a flat end with a sharp rim across the axis, of a tool, m; 0: none.
   pure real(wp) function end_radius(self)
      class(shape_t), intent(in) :: self
      end_radius = 0.0_wp
   end function end_radius

   !> Upper bound of the distance of the surface from a point (m), or from an axis through it, m; huge where
   !> unknown.
   pure real(wp) function reach(self, place, axis)
      class(shape_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(in), optional :: axis(3) !< unit vector
      real(wp) :: lower(3), upper(3), way(3)
      integer :: corner
      call self%bounding_box(lower, upper)
      reach = huge(1.0_wp)
      if (any(upper >= huge(1.0_wp)) .or. any(lower <= -huge(1.0_wp))) return
      reach = 0.0_wp
      do corner = 0, 7
         way = merge(upper, lower, [btest(corner, 0), btest(corner, 1), btest(corner, 2)]) - place
         if (present(axis)) way = way - dot_product(way, axis)*axis
         reach = max(reach, norm2(way))
      end do
   end function reach

   !> Signed distance of a point from the surface, m.
   pure real(wp) function distance(self, place)
      class(shape_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp) :: normal(3)
      call self%distance_and_normal(place, distance, normal)
   end function distance

   !> Signed distance and normal of a point nearer to the surface than `limit` (m); else the distance may be a
   !> bound of the same sign, not below the limit in size, and the normal is undefined.
   pure subroutine distance_within(self, place, limit, distance, normal)
      class(shape_t), intent(in) :: self
      real(wp), intent(in) :: place(3), limit
      real(wp), intent(out) :: distance, normal(3)
      call self%distance_and_normal(place, distance, normal)
   end subroutine distance_within

   !> Number of its sheets: above 1 where faces meet at a sharp concave edge; a body there touches several.
   pure integer function sheets(self)
      class(shape_t), intent(in) :: self
      sheets = 1
   end function sheets

   !> As distance_within, for a face of a sheet that a point is in front of; at least `limit` if there is
   !> none.
   pure subroutine sheet_within(self, place, limit, sheet, distance, normal)
      class(shape_t), intent(in) :: self
      real(wp), intent(in) :: place(3), limit
      integer, intent(in) :: sheet
      real(wp), intent(out) :: distance, normal(3)
      call self%distance_within(place, limit, distance, normal)
   end subroutine sheet_within

   !> As distance_and_normal, of a sheet, whose faces go on beside their ends.
   pure subroutine distance_of_sheet(self, place, sheet, distance, normal)
      class(shape_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      integer, intent(in) :: sheet
      real(wp), intent(out) :: distance, normal(3)
      call self%distance_and_normal(place, distance, normal)
   end subroutine distance_of_sheet

   !> Lower bound of the signed distance of a point, m; to be used first where is_searched.
   pure real(wp) function min_distance(self, place)
      class(shape_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      min_distance = self%distance(place)
   end function min_distance

   !> Upper bound of the signed distance of a point, m; as min_distance.
   pure real(wp) function max_distance(self, place)
      class(shape_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      max_distance = self%distance(place)
   end function max_distance

   !> True where a distance requires a search, and its bounds are much cheaper.
   pure logical function is_searched(self)
      class(shape_t), intent(in) :: self
      is_searched = .false.
   end function is_searched

   !> True when a point lies inside.
   pure logical function inside(self, place)
      class(shape_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      inside = self%distance(place) < 0.0_wp
   end function inside

   !> m3; that of the bounding box where the shape does not provide it.
   pure real(wp) function volume(self)
      class(shape_t), intent(in) :: self
      real(wp) :: lower(3), upper(3)
      call self%bounding_box(lower, upper)
      volume = product(upper - lower)
   end function volume

   !> False where `volume` is only a bound.
   pure logical function knows_volume(self)
      class(shape_t), intent(in) :: self
      knows_volume = .true.
   end function knows_volume

   !> Area of the surface, m2; 0 where the shape does not provide it.
   pure real(wp) function area(self)
      class(shape_t), intent(in) :: self
      area = 0.0_wp
   end function area

   !> Centre of a body (m), about which it spins.
   pure function centre(self)
      class(shape_t), intent(in) :: self
      real(wp) :: centre(3), lower(3), upper(3)
      call self%bounding_box(lower, upper)
      centre = 0.5_wp*(lower + upper)
   end function centre

   !> A point (m) where corners of particles meet: the origin of the lattice of a body's particles.
   pure function lattice_origin(self) result(origin)
      class(shape_t), intent(in) :: self
      real(wp) :: origin(3)
      origin = self%centre()
   end function lattice_origin

   !> True when particles fill the shape exactly: its edges must be whole numbers of particles, and no
   !> symmetry plane may cut it.
   pure logical function is_lattice(self)
      class(shape_t), intent(in) :: self
      is_lattice = .false.
   end function is_lattice

   !> Smallest thickness of a body (m), and the variable that sets it.
   pure subroutine thinnest(self, thickness, variable)
      class(shape_t), intent(in) :: self
      real(wp), intent(out) :: thickness
      character(len=:), allocatable, intent(out) :: variable
      real(wp) :: lower(3), upper(3)
      call self%bounding_box(lower, upper)
      thickness = minval(upper - lower)
      variable = 'shape'
   end subroutine thinnest

   !> The default is a shape that is neither a body of revolution nor uniform along y.
   subroutine take_section(self, section, why)
      class(shape_t), intent(inout) :: self
      type(section_t), intent(in) :: section
      character(len=:), allocatable, intent(out) :: why
      why = 'extends along y without end'
      if (section%is_round()) why = 'is a body of revolution about x = y = 0'
      why = 'is no shape that '//why//'; allowed in 3D'
   end subroutine take_section

   !> Check of a shape of revolution about an axis through a point: the error if that is not the section's
   !> axis; empty: none.
   pure function why_not_round(section, place, axis) result(why)
      type(section_t), intent(in) :: section
      real(wp), intent(in) :: place(3)
      real(wp), intent(in), optional :: axis(3) !< unit vector; absent: any
      character(len=:), allocatable :: why
      why = ''
      if (.not. section%is_round()) then
         why = 'does not extend along y; allowed in 3D or axisymmetric'
      else if (any(abs(place(1:2)) > 0.0_wp)) then
         why = 'must have its centre at x = y = 0, the axis'
      else if (present(axis)) then
         if (.not. runs_along(axis, 3)) why = 'must have axis=0,0,1 or 0,0,-1'
      end if
   end function why_not_round

   !> The same for a shape that is uniform along a direction, which must be y.
   pure function why_not_along(section, direction) result(why)
      type(section_t), intent(in) :: section
      real(wp), intent(in) :: direction(3) !< unit vector
      character(len=:), allocatable :: why
      why = ''
      if (section%is_round()) then
         why = 'is no body of revolution about x = y = 0; allowed in 3D or plane_strain'
      else if (.not. runs_along(direction, 2)) then
         why = 'must extend along y, across the section'
      end if
   end function why_not_along

   !> True when a direction (unit vector) is along an axis of the grid.
   pure logical function runs_along(direction, axis)
      real(wp), intent(in) :: direction(3)
      integer, intent(in) :: axis
      real(wp), parameter :: square = 1.0e-9_wp
      real(wp) :: unit(3)
      unit = 0.0_wp
      unit(axis) = 1.0_wp
      runs_along = norm2(cross(direction, unit)) <= square
   end function runs_along

   !> The variable that sets the position of a body, or its lower end.
   pure function place_name(self, down) result(name)
      class(shape_t), intent(in) :: self
      logical, intent(in) :: down
      character(len=:), allocatable :: name
      name = 'center'
   end function place_name

end module m_shape
