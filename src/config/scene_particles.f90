!> Defaults for filling bodies and for the domains of their particles (theory.md, Bodies that the lattice does
!> not fit; doc/user/input.md, Fill and domains).
module m_scene_particles
   use m_kinds, only: wp
   use m_scene, only: scene_t, body_spec_t, tool_spec_t, fill_by_shape, fill_share, fill_whole, &
                      because_law, because_surface, because_single
   use m_domain_kinds, only: domain_by_law, domain_fixed, domain_stretch, domain_corners
   implicit none
   private
   public :: choose_fill, choose_domain

   integer, parameter :: around = 2          !< cells around the point that a tool touches first, within which
                                             !< a face must be flat,
   real(wp), parameter :: soon = 0.5_wp      !< and further out where the tool follows within so many cells
   real(wp), parameter :: on_surface = 1.0e-6_wp !< tolerance in cells, and for components of a normal

contains

   !> Set the fill of bodies for which the scene gives none, after carving: particles fill boxes along the
   !> grid without cuts, all others are cut by the surface.
   pure subroutine choose_fill(scene)
      type(scene_t), intent(inout) :: scene
      integer :: b
      do b = 1, size(scene%bodies)
         associate (body => scene%bodies(b))
            if (body%fill == fill_by_shape) body%fill = merge(fill_whole, fill_share, body%shape%is_lattice())
         end associate
      end do
   end subroutine choose_fill

   !> Default of domains: they follow the deformation if a law is for large strains, if a surface that cuts
   !> particles may be pressed, or if a tool moves more than a cell into material with one particle a cell.
   pure subroutine choose_domain(scene)
      type(scene_t), intent(inout) :: scene
      integer :: m, t
      scene%chose_domain = 0
      if (scene%time%domain /= domain_by_law) return
      scene%time%domain = domain_fixed
      do t = 1, size(scene%tools)
         if (any(scene%bodies%particles_per_cell == 1) .and. goes_deep(scene, scene%tools(t))) &
            scene%chose_domain = because_single
      end do
      if (may_press_cuts(scene)) scene%chose_domain = because_surface
      do m = 1, size(scene%materials)
         if (scene%materials(m)%law%for_large_strains()) scene%chose_domain = because_law
      end do
      if (scene%chose_domain > 0) &
         scene%time%domain = merge(domain_stretch, domain_corners, scene%quasi_static%present)
   end subroutine choose_domain

   !> True when tools, other bodies or pressures may press on particles cut by a surface.
   pure logical function may_press_cuts(scene) result(may)
      type(scene_t), intent(in) :: scene
      integer :: e, t
      may = .false.
      if (.not. any(scene%bodies%fill == fill_share)) return
      may = scene%fields() > 1
      do e = 1, size(scene%effects)
         may = may .or. scene%effects(e)%it%name == 'pressure'
      end do
      do t = 1, size(scene%tools)
         may = may .or. .not. meets_a_face(scene, scene%tools(t))
      end do
   end function may_press_cuts

   !> True when a tool certainly meets a face along the grid on which layers of whole particles end: seen from
   !> its tip along its axis, within some cells around the point of first contact.
   pure logical function meets_a_face(scene, tool) result(meets)
      type(scene_t), intent(in) :: scene
      type(tool_spec_t), intent(in) :: tool
      real(wp) :: place(3), way, farthest, gap
      integer :: b, first
      meets = allocated(tool%motions)
      if (meets) meets = size(tool%motions) > 0
      meets = .not. meets .and. maxval(abs(tool%axis)) > 1.0_wp - on_surface
      if (.not. meets) return
      place = tool%tip
      farthest = norm2(scene%grid%upper - scene%grid%lower)
      way = 0.0_wp
      associate (near => on_surface*scene%grid%cell_size)
         do while (way <= farthest)
            first = 0
            gap = huge(gap)
            do b = 1, size(scene%bodies)
               associate (distance => scene%bodies(b)%shape%distance(place))
                  if (distance < gap) then
                     gap = distance
                     first = b
                  end if
               end associate
            end do
            if (gap < near) exit
            way = way + gap
            place = place + gap*tool%axis
         end do
         meets = way <= farthest
      end associate
      if (meets) meets = is_face(scene%bodies(first), scene%grid%cell_size, tool, place)
   end function meets_a_face

   !> True when the surface of a body around a point on it is a face normal to a tool's axis, with whole
   !> particles behind it. Where particles are cut at its rim, the tool must not reach the rim either.
   pure logical function is_face(body, cell, tool, place)
      type(body_spec_t), intent(in) :: body
      real(wp), intent(in) :: cell     !< of the coarsest level, m
      type(tool_spec_t), intent(in) :: tool
      real(wp), intent(in) :: place(3) !< at which the tool touches first, m
      real(wp) :: there(3), distance, normal(3), origin(3), spacing, layers
      integer :: axis, n, other, side
      is_face = .true.
      axis = maxloc(abs(tool%axis), dim=1)
      if (body%fill == fill_share) then
         origin = body%shape%lattice_origin()
         spacing = cell/nint(real(body%particles_per_cell, wp)**(1.0_wp/3.0_wp))
         layers = (place(axis) - origin(axis))/spacing
         is_face = abs(layers - nint(layers)) < 1.0e-3_wp
      end if
      do other = 1, 3
         if (other == axis) cycle
         do side = -1, 1, 2
            n = around
            do while (is_face)
               there = place
               there(other) = there(other) + side*n*cell
               if (n > around) then
                  if (body%fill /= fill_share) exit
                  if (tool%shape%distance(tool%tip + (there - place)) > soon*cell) exit
               end if
               call body%shape%distance_and_normal(there, distance, normal)
               is_face = abs(distance) < 10.0_wp*on_surface*cell &
                         .and. abs(normal(axis)) > 1.0_wp - on_surface
               n = n + 1
            end do
         end do
      end do
   end function is_face

   !> True when a tool may move further than a cell of the finest level: by its given speeds, or driven by
   !> loads, for which nothing is known.
   pure logical function goes_deep(scene, tool)
      type(scene_t), intent(in) :: scene
      type(tool_spec_t), intent(in) :: tool
      real(wp) :: from, to, speed(2), way
      integer :: n
      goes_deep = allocated(tool%loads)
      if (goes_deep .or. tool%stands) return
      way = abs(tool%speeds(1))*max(0.0_wp, tool%times(1))
      do n = 1, size(tool%times)
         from = tool%times(n)
         to = scene%end_time
         speed = tool%speeds(n)
         if (n < size(tool%times)) then
            to = tool%times(n + 1)
            speed(2) = tool%speeds(n + 1)
         end if
         way = way + 0.5_wp*sum(abs(speed))*max(0.0_wp, to - from)
      end do
      goes_deep = way > scene%grid%cell_size/2.0_wp**(scene%depth() - 1)
   end function goes_deep

end module m_scene_particles
