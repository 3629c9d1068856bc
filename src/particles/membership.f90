!> On which of two levels a particle lives (theory.md, Where a particle lives): on the finer one if its domain
!> reaches into the region of that level.
!>
!> Where means over cells are taken, all particles of a cell must live on one level, for no sum extends across
!> levels. So a layer of one coarser cell around the region belongs to the finer level too, for particles
!> small enough for its weights: in this layer the weights are the same as on the coarser level (theory.md,
!> Cells of anti-locking at an edge).
module m_membership
   use m_kinds, only: wp
   use m_level, only: level_t
   use m_region, only: make_region
   use m_split, only: longest
   implicit none
   private
   public :: set_layers, lives_on, may_live_on, clip_to_home

contains

   !> Give each level but the first the layer around its region, or remove it. To be called when regions have
   !> been set.
   subroutine set_layers(levels, wanted)
      type(level_t), intent(inout) :: levels(:) !< all, the coarsest first
      logical, intent(in) :: wanted
      logical, allocatable :: chosen(:, :, :)
      integer :: low(3), high(3), cell(3), i, j, k, l
      do l = 2, size(levels)
         if (allocated(levels(l)%layer)) deallocate (levels(l)%layer)
         if (.not. wanted) cycle
         associate (region => levels(l)%region, above => levels(l - 1)%region)
            call region%node_box(low, high)
            low = max(low/2 - 1, 0)
            high = min(high/2 + 1, levels(l)%grid%cells/2)
            allocate (chosen(high(1) - low(1), high(2) - low(2), high(3) - low(3)))
            do k = 1, size(chosen, 3)
               do j = 1, size(chosen, 2)
                  do i = 1, size(chosen, 1)
                     cell = low + [i, j, k] - 1
                     chosen(i, j, k) = region%has_some(cell - 1, cell + 1)
                     ! particles there reach nodes one cell further, which must be unknowns of the level above
                     if (chosen(i, j, k)) chosen(i, j, k) = region%has_all(cell, cell) &
                           .or. .not. above%any_outer(cell - 1, cell + 2)
                  end do
               end do
            end do
            levels(l)%layer = make_region(levels(l)%grid, 2*low, chosen)
            deallocate (chosen)
         end associate
      end do
   end subroutine set_layers

   !> True when a particle lives on a level rather than on the one above. A particle on the level stays until
   !> it is `margin` (m) further away.
   pure logical function lives_on(level, x, extents, half, margin)
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: x(3)       !< its centre, m
      real(wp), intent(in) :: extents(3) !< half of its domain's size along the axes, m
      real(wp), intent(in) :: half       !< its longest half edge, m
      real(wp), intent(in) :: margin     !< m
      lives_on = level%region%overlaps(x - extents - margin, x + extents + margin)
      if (lives_on .or. .not. allocated(level%layer)) return
      if (half <= longest*level%grid%cell) lives_on = level%layer%overlaps(x - margin, x + margin)
   end function lives_on

   !> True when particles whose domains lie in a box may live on a level.
   pure logical function may_live_on(level, low, high)
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: low(3), high(3) !< m
      if (allocated(level%layer)) then
         may_live_on = level%layer%overlaps(low, high)
      else
         may_live_on = level%region%overlaps(low, high)
      end if
   end function may_live_on

   !> Clip a box to the points less than `margin` away from where the particles of a level live.
   pure subroutine clip_to_home(level, margin, low, high)
      type(level_t), intent(in) :: level
      real(wp), intent(in) :: margin             !< m
      real(wp), intent(inout) :: low(3), high(3) !< m
      if (allocated(level%layer)) then
         call level%layer%clip(margin, low, high)
      else
         call level%region%clip(margin, low, high)
      end if
   end subroutine clip_to_home

end module m_membership
