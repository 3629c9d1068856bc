!> Distances of particle faces from a tool, by their positions and shapes alone (theory.md, eq. contact-gap),
!> and the particles that may be near.
module m_face_gap
   use m_kinds, only: wp
   use m_constants, only: block_size
   use m_scene, only: safety_allowed
   use m_tool, only: tool_t
   use m_field_table, only: layout_t
   use m_split, only: longest
   use m_material, only: material_t
   use m_scene_materials, only: materials_t
   use m_block, only: block_t
   use m_cell_list, only: bins
   use m_stencil, only: bin_place
   use m_level, only: level_t
   implicit none
   private
   public :: find_gap, find_thickness, near_tool, list_near, deform, thickest, fastest

   real(wp), parameter :: fastest = maxval(safety_allowed) !< upper bound of the approach of a contact point
                                                           !< per step, in cells
   real(wp), parameter :: longest_thickness = 2.0_wp*sqrt(3.0_wp)*longest !< of domains that deform, in cells

contains

   !> The gap of a particle's contact point: its centre moved towards the tool by penetration_factor of its
   !> thickness along the normal. For a particle certainly further away than `reach` any gap beyond it.
   subroutine find_gap(tool, level, materials, b, p, reach, gap, normal, edge, thickness, sheet)
      type(tool_t), intent(in) :: tool
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      integer, intent(in) :: b, p            !< numbers of the block and the particle
      real(wp), intent(in) :: reach          !< m
      real(wp), intent(out) :: gap           !< m
      real(wp), intent(out) :: normal(3)     !< outward from the tool
      real(wp), intent(out) :: edge, thickness !< of the particle, m
      integer, intent(in), optional :: sheet   !< of the tool's surface; 0 or absent: all of it
      integer :: part
      real(wp) :: limit !< of gaps of centres, m
      part = 0
      if (present(sheet)) part = sheet
      associate (block => level%blocks(b), column => level%blocks(b)%particles%column, at => level%layout)
         if (tool%spec%shape%is_searched()) then
            associate (law => materials%slots(materials%of_body(block%particles%body(p)))%law)
               limit = reach + farthest_face(tool, level, law, column(p, :))
            end associate
            if (part > 0) then
               call tool%sheet_within(column(p, at%position:at%position + 2), limit, part, gap, normal)
            else
               call tool%gap_within(column(p, at%position:at%position + 2), limit, gap, normal)
            end if
            if (gap >= limit) return
            if (gap <= -limit .and. part == 0) &
               call tool%gap_and_normal(column(p, at%position:at%position + 2), gap, normal)
         else
            call tool%gap_and_normal(column(p, at%position:at%position + 2), gap, normal)
         end if
         if (.not. deform(level)) then
            if (gap > 2.0_wp*column(p, at%half_size) + reach) return
         end if
         call find_thickness(level, materials, b, p, normal, edge, thickness)
         gap = gap - tool%spec%penetration_factor*thickness
      end associate
   end subroutine find_gap

   !> Thickness of a particle along a normal, and the edge of a cube of its volume, or its own edge.
   pure subroutine find_thickness(level, materials, b, p, normal, edge, thickness)
      type(level_t), intent(in) :: level
      type(materials_t), intent(in) :: materials
      integer, intent(in) :: b, p     !< numbers of the block and the particle
      real(wp), intent(in) :: normal(3)
      real(wp), intent(out) :: edge, thickness !< m
      associate (block => level%blocks(b), column => level%blocks(b)%particles%column, at => level%layout)
         associate (law => materials%slots(materials%of_body(block%particles%body(p)))%law)
            if (at%half_sizes) then
               edge = level%edge(column(p, :))
               thickness = box_thickness(law, column(p, :), at, normal)
            else if (deform(level)) then
               edge = level%edge(column(p, :))
               thickness = level%thickness(column(p, :), normal)
            else
               edge = 2.0_wp*column(p, at%half_size)
               thickness = edge*law%stretch(column(p, :), at, normal)
            end if
         end associate
      end associate
   end subroutine find_thickness

   !> Upper bound of the distance of a particle's contact point from its centre in all directions, m.
   pure real(wp) function farthest_face(tool, level, law, values) result(way)
      type(tool_t), intent(in) :: tool
      type(level_t), intent(in) :: level
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: values(:) !< the particle's columns
      if (level%layout%half_sizes) then
         way = thickest(level)
      else if (deform(level)) then
         way = level%max_thickness(values)
      else
         way = 2.0_wp*values(level%layout%half_size)
         way = min(way/max(tool%spec%penetration_factor, 0.1_wp), way*law%max_stretch(values, level%layout))
      end if
      way = tool%spec%penetration_factor*way
   end function farthest_face

   !> Thickness (m) along a normal of a box that stretches along its axes: its edges do not include shear,
   !> which the material's own stretch does; along an axis it is the edge (theory.md, eq. box-thickness).
   pure real(wp) function box_thickness(law, values, at, normal) result(thickness)
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: values(:) !< the particle's columns
      type(layout_t), intent(in) :: at
      real(wp), intent(in) :: normal(3)
      real(wp) :: axis(3), undeformed(3)
      integer :: k
      do k = 1, 3
         axis = 0.0_wp
         axis(k) = 1.0_wp
         undeformed(k) = values(at%half_size + k - 1)/law%stretch(values, at, axis)
      end do
      thickness = 2.0_wp*norm2(undeformed*normal)*law%stretch(values, at, normal)
   end function box_thickness

   !> True when contact points of a block's particles may be within `reach` (m) of a tool, by the distance of
   !> the block's middle.
   pure logical function near_tool(tool, level, block, reach)
      type(tool_t), intent(in) :: tool
      type(level_t), intent(in) :: level
      type(block_t), intent(in) :: block
      real(wp), intent(in) :: reach
      near_tool = tool%min_gap(block%origin + 0.5_wp*(block_size - 1)*level%grid%cell) &
                  <= 0.5_wp*block_size*sqrt(3.0_wp)*level%grid%cell + reach + thickest(level)
   end function near_tool

   !> The particles of a block whose contact points may be within a reach (m) of a tool.
   subroutine list_near(tool, level, b, reach, near)
      type(tool_t), intent(in) :: tool
      type(level_t), intent(inout) :: level !< its lists of cells are updated
      integer, intent(in) :: b              !< number of the block
      real(wp), intent(in) :: reach
      integer, allocatable, intent(out) :: near(:)
      associate (block => level%blocks(b))
         if (block%particles%count == 0 .or. .not. near_tool(tool, level, block, reach)) then
            allocate (near(0))
            return
         end if
         call block%cells%link(block%particles%count)
         near = particles_near(tool, level, block, thickest(level) + reach)
      end associate
   end subroutine list_near

   !> The particles of those bins of a block that cannot be excluded by the tool's distance from their middle.
   pure function particles_near(tool, level, block, farthest) result(near)
      type(tool_t), intent(in) :: tool
      type(level_t), intent(in) :: level
      type(block_t), intent(in) :: block !< whose lists of cells are up to date
      real(wp), intent(in) :: farthest !< of the centres of relevant particles, m
      integer, allocatable :: near(:)
      integer :: cell, n, p, group(3)
      logical :: is_far(0:block_size/2 - 1, 0:block_size/2 - 1, 0:block_size/2 - 1)
      allocate (near(block%particles%count))
      do n = 0, size(is_far) - 1 ! eight bins together
         group = [mod(n, block_size/2), mod(n/(block_size/2), block_size/2), n/(block_size/2)**2]
         if (level%grid%section%is_flat() .and. group(2) > 0) cycle ! there is one layer of bins
         is_far(group(1), group(2), group(3)) &
            = tool%min_gap(block%origin + (2*group + 0.5_wp)*level%grid%cell) &
              > farthest + sqrt(3.0_wp)*level%grid%cell
      end do
      n = 0
      do cell = 1, bins
         p = block%cells%first(cell)
         if (p == 0) cycle
         group = bin_place(cell)/2
         if (is_far(group(1), group(2), group(3))) cycle
         if (tool%min_gap(block%origin + bin_place(cell)*level%grid%cell) &
             > farthest + 0.5_wp*sqrt(3.0_wp)*level%grid%cell) cycle ! false for NaN
         do while (p > 0)
            n = n + 1
            near(n) = p
            p = block%cells%next(p)
         end do
      end do
      near = near(:n)
   end function particles_near

   !> True when domains have edges of their own; else they are cubes.
   pure logical function deform(level)
      type(level_t), intent(in) :: level
      deform = level%layout%domain > 0 .or. level%layout%half_sizes
   end function deform

   !> Upper bound of the thickness of particles in all directions, m: a cell, the limit for the weights, or,
   !> where domains deform, the length at which they are split.
   pure real(wp) function thickest(level)
      type(level_t), intent(in) :: level
      thickest = level%grid%cell
      if (deform(level)) thickest = longest_thickness*level%grid%cell
   end function thickest

end module m_face_gap
