!> The list of shapes: one line a shape.
module m_shapes
   use m_offer, only: offer, offer_slot_t
   use m_shape, only: shape_t
   implicit none
   private
   public :: known_shapes

contains

   !> The shapes of bodies and tools, by name. One line a shape, with its own `use`.
   subroutine known_shapes(bodies, tools)
      type(offer_slot_t), allocatable, intent(out) :: bodies(:), tools(:)
      block; use m_box, only: box_t; call body('box', box_t()); end block
      block; use m_sphere, only: sphere_t; call body('sphere', sphere_t()); call tool('sphere', &
         sphere_t()); end block
      block; use m_cylinder, only: cylinder_t; call body('cylinder', cylinder_t()); end block
      block; use m_cone, only: cone_t; call tool('cone', cone_t()); end block
      block; use m_capped, only: capped_cone_t, capped_pyramid_t; call body('cone', capped_cone_t()); &
         call body('pyramid', capped_pyramid_t()); end block
      block; use m_flat, only: flat_t; call tool('flat', flat_t()); end block
      block; use m_berkovich, only: berkovich_t; call tool('berkovich', berkovich_t()); end block
      block; use m_regular_pyramid, only: regular_pyramid_t; call tool('pyramid', &
         regular_pyramid_t()); end block
      block; use m_roller, only: roller_t; call tool('cylinder', roller_t()); end block
      block; use m_file_shape, only: file_shape_t; call body('surface', file_shape_t())
         call tool('surface', file_shape_t()); end block
      block; use m_profile, only: profile_t; call tool('profile', profile_t()); end block
      block; use m_wedge, only: wedge_t; call tool('wedge', wedge_t()); end block
   contains
      subroutine body(name, shape)
         character(len=*), intent(in) :: name
         class(shape_t), intent(in) :: shape
         call offer(bodies, name, shape)
      end subroutine body
      subroutine tool(name, shape)
         character(len=*), intent(in) :: name
         class(shape_t), intent(in) :: shape
         class(shape_t), allocatable :: copy
         allocate (copy, source=shape)
         copy%of_tool = .true.
         call offer(tools, name, copy)
      end subroutine tool
   end subroutine known_shapes

end module m_shapes
