!> A shape from which others have been subtracted: holes, tubes.
module m_carved
   use m_kinds, only: wp
   use m_shape, only: shape_t
   use m_group_reader, only: group_reader_t
   implicit none
   private
   public :: carved_t, carve, uncarve

   !> Shapes are shared with copies of this one and never changed.
   type :: shape_pointer_t
      class(shape_t), pointer :: it => null()
   end type shape_pointer_t

   type, extends(shape_t) :: carved_t
      class(shape_t), pointer :: whole => null()      !< before the subtraction
      type(shape_pointer_t), allocatable :: cuts(:) !< shapes subtracted
   contains
      procedure :: variables
      procedure :: distance_and_normal
      procedure :: bounding_box
      procedure :: min_distance
      procedure :: max_distance
      procedure :: is_searched
      procedure :: inside
      procedure :: volume
      procedure :: knows_volume
      procedure :: centre
      procedure :: lattice_origin
      procedure :: thinnest
      procedure :: place_name
   end type carved_t

contains

   !> Subtract a shape from another, which becomes a carved one.
   subroutine carve(shape, cut)
      class(shape_t), allocatable, intent(inout) :: shape
      class(shape_t), intent(in) :: cut
      type(carved_t) :: carved
      type(shape_pointer_t) :: more
      select type (shape)
      type is (carved_t)
         carved = shape
      class default
         allocate (carved%whole, source=shape)
         allocate (carved%cuts(0))
      end select
      allocate (more%it, source=cut)
      carved%cuts = [carved%cuts, more]
      deallocate (shape)
      allocate (shape, source=carved)
   end subroutine carve

   !> The shape before the subtraction.
   subroutine uncarve(shape)
      class(shape_t), allocatable, intent(inout) :: shape
      class(shape_t), allocatable :: whole
      select type (shape)
      type is (carved_t)
         allocate (whole, source=shape%whole)
      end select
      if (allocated(whole)) call move_alloc(whole, shape)
   end subroutine uncarve

   !> It has no variables: its shapes have been read.
   subroutine variables(self, group)
      class(carved_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
   end subroutine variables

   !> Inside the whole and outside all cuts. Near edges the distance is too small.
   pure subroutine distance_and_normal(self, place, distance, normal)
      class(carved_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      real(wp), intent(out) :: distance, normal(3)
      real(wp) :: other, outwards(3)
      integer :: c
      distance = -huge(distance)
      do c = 1, size(self%cuts)
         if (self%cuts(c)%it%is_searched() .and. distance > -huge(distance)) then
            if (-self%cuts(c)%it%min_distance(place) <= distance) cycle
         end if
         call self%cuts(c)%it%distance_and_normal(place, other, outwards)
         if (-other <= distance) cycle
         distance = -other
         normal = -outwards
      end do
      if (self%whole%is_searched()) then
         if (self%whole%max_distance(place) <= distance) return
      end if
      call self%whole%distance_and_normal(place, other, outwards)
      if (other <= distance) return
      distance = other
      normal = outwards
   end subroutine distance_and_normal

   pure subroutine bounding_box(self, lower, upper)
      class(carved_t), intent(in) :: self
      real(wp), intent(out) :: lower(3), upper(3)
      call self%whole%bounding_box(lower, upper)
   end subroutine bounding_box

   pure real(wp) function min_distance(self, place)
      class(carved_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      integer :: c
      min_distance = self%whole%min_distance(place)
      do c = 1, size(self%cuts)
         min_distance = max(min_distance, -self%cuts(c)%it%max_distance(place))
      end do
   end function min_distance

   pure real(wp) function max_distance(self, place)
      class(carved_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      integer :: c
      max_distance = self%whole%max_distance(place)
      do c = 1, size(self%cuts)
         max_distance = max(max_distance, -self%cuts(c)%it%min_distance(place))
      end do
   end function max_distance

   pure logical function is_searched(self)
      class(carved_t), intent(in) :: self
      integer :: c
      is_searched = self%whole%is_searched()
      do c = 1, size(self%cuts)
         is_searched = is_searched .or. self%cuts(c)%it%is_searched()
      end do
   end function is_searched

   pure logical function inside(self, place)
      class(carved_t), intent(in) :: self
      real(wp), intent(in) :: place(3)
      integer :: c
      inside = self%whole%inside(place)
      do c = 1, size(self%cuts)
         if (inside) inside = .not. self%cuts(c)%it%inside(place)
      end do
   end function inside

   !> Volume of the whole, an upper bound.
   pure real(wp) function volume(self)
      class(carved_t), intent(in) :: self
      volume = self%whole%volume()
   end function volume

   pure logical function knows_volume(self)
      class(carved_t), intent(in) :: self
      knows_volume = .false.
   end function knows_volume

   pure function centre(self)
      class(carved_t), intent(in) :: self
      real(wp) :: centre(3)
      centre = self%whole%centre()
   end function centre

   pure function lattice_origin(self) result(origin)
      class(carved_t), intent(in) :: self
      real(wp) :: origin(3)
      origin = self%whole%lattice_origin()
   end function lattice_origin

   pure subroutine thinnest(self, thickness, variable)
      class(carved_t), intent(in) :: self
      real(wp), intent(out) :: thickness
      character(len=:), allocatable, intent(out) :: variable
      call self%whole%thinnest(thickness, variable)
   end subroutine thinnest

   pure function place_name(self, down) result(name)
      class(carved_t), intent(in) :: self
      logical, intent(in) :: down
      character(len=:), allocatable :: name
      name = self%whole%place_name(down)
   end function place_name

end module m_carved
