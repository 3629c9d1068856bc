!> Filling bodies with particles: a cubic lattice of particles, those whose centre lies in the shape.
module m_body
   use m_kinds, only: wp, i4, i8
   use m_constants, only: block_size
   use m_scene, only: body_spec_t, shape_box, shape_sphere, shape_cylinder
   use m_level, only: level_t
   use m_block, only: block_t
   implicit none
   private
   public :: fill_block, count_in_block, body_center

   !> The lattice of a body: particle (i,j,k) has its centre at anchor + (i + 1/2, ...) spacing, first <= i <= last.
   type :: lattice_t
      real(wp) :: anchor(3)
      real(wp) :: spacing
      integer(i8) :: first(3)
      integer(i8) :: last(3)
   end type lattice_t

contains

   !> Add the particles of a body that lie in a block.
   !> The id is id_base + the number of the lattice place, so that it does not depend on the blocks.
   subroutine fill_block(level, block, spec, body, density, id_base)
      type(level_t), intent(in) :: level
      type(block_t), intent(inout) :: block
      type(body_spec_t), intent(in) :: spec
      integer, intent(in) :: body         !< number of the body
      real(wp), intent(in) :: density     !< kg/m3
      integer(i8), intent(in) :: id_base
      type(lattice_t) :: lattice
      real(wp) :: values(level%table%columns), x(3)
      integer(i8) :: i, j, k, low(3), high(3), extent(3)
      lattice = body_lattice(spec, level%grid%cell)
      call range_in_block(level, block%place, lattice, low, high)
      extent = lattice%last - lattice%first + 1
      call block%reserve(block%particles%count + count_in_block(level, block%place, spec), size(values))
      do k = low(3), high(3)
         do j = low(2), high(2)
            do i = low(1), high(1)
               x = lattice%anchor + (real([i, j, k], wp) + 0.5_wp)*lattice%spacing
               if (.not. belongs(level, block%place, spec, x)) cycle
               call initial_values(level, spec, density, lattice%spacing, x, values)
               call block%particles%append(values, id_base + 1 + (i - lattice%first(1)) + extent(1)*((j - lattice%first(2)) &
                                           + extent(2)*(k - lattice%first(3))), int(body, i4))
            end do
         end do
      end do
   end subroutine fill_block

   !> How many particles of a body lie in the block at a place.
   pure integer function count_in_block(level, place, spec) result(n)
      type(level_t), intent(in) :: level
      integer, intent(in) :: place(3)
      type(body_spec_t), intent(in) :: spec
      type(lattice_t) :: lattice
      integer(i8) :: i, j, k, low(3), high(3)
      lattice = body_lattice(spec, level%grid%cell)
      call range_in_block(level, place, lattice, low, high)
      n = 0
      do k = low(3), high(3)
         do j = low(2), high(2)
            do i = low(1), high(1)
               if (belongs(level, place, spec, lattice%anchor + (real([i, j, k], wp) + 0.5_wp)*lattice%spacing)) n = n + 1
            end do
         end do
      end do
   end function count_in_block

   !> True when a place lies in the body and in the grid, and its nearest node in the block.
   pure logical function belongs(level, place, spec, x)
      type(level_t), intent(in) :: level
      integer, intent(in) :: place(3)
      type(body_spec_t), intent(in) :: spec
      real(wp), intent(in) :: x(3)
      belongs = .false.
      if (any(x < level%grid%lower) .or. any(x > level%grid%upper)) return ! a symmetry plane cuts the body
      if (any(level%grid%nearest_node(x)/block_size /= place)) return
      belongs = inside(spec, x)
   end function belongs

   !> What a new particle carries; fields of its law follow (material_t%initial).
   pure subroutine initial_values(level, spec, density, spacing, x, values)
      type(level_t), intent(in) :: level
      type(body_spec_t), intent(in) :: spec
      real(wp), intent(in) :: density, spacing, x(3)
      real(wp), intent(out) :: values(:)
      real(wp) :: arm(3)
      values = 0.0_wp
      arm = x - body_center(spec)
      associate (at => level%layout, w => spec%angular_velocity)
         values(at%position:at%position + 2) = x
         values(at%velocity:at%velocity + 2) = spec%velocity &
                          + [w(2)*arm(3) - w(3)*arm(2), w(3)*arm(1) - w(1)*arm(3), w(1)*arm(2) - w(2)*arm(1)]
         values(at%volume) = spacing**3
         values(at%mass) = density*spacing**3
         if (at%half_size > 0) values(at%half_size:at%half_size + merge(2, 0, at%half_sizes)) = 0.5_wp*spacing
         if (at%domain > 0) values(at%domain:at%domain + 8:4) = 0.5_wp*spacing
         if (at%gradient > 0) values(at%gradient:at%gradient + 8) = [0.0_wp, w(3), -w(2), -w(3), 0.0_wp, w(1), w(2), -w(1), 0.0_wp]
      end associate
   end subroutine initial_values

   !> The lattice of a body: n particles along a cell, from the lower corner of a box or the centre of a round body.
   pure type(lattice_t) function body_lattice(spec, cell) result(lattice)
      type(body_spec_t), intent(in) :: spec
      real(wp), intent(in) :: cell !< m
      real(wp) :: lower(3), upper(3)
      integer :: per_edge
      per_edge = nint(real(spec%particles_per_cell, wp)**(1.0_wp/3.0_wp))
      lattice%spacing = cell/per_edge
      call bounds(spec, lower, upper)
      lattice%anchor = merge(spec%lower, spec%center, spec%shape == shape_box)
      lattice%first = floor((lower - lattice%anchor)/lattice%spacing + 1.0e-6_wp, i8)
      lattice%last = ceiling((upper - lattice%anchor)/lattice%spacing - 1.0e-6_wp, i8) - 1
   end function body_lattice

   !> The part of a lattice whose centres may lie in a block.
   pure subroutine range_in_block(level, place, lattice, low, high)
      type(level_t), intent(in) :: level
      integer, intent(in) :: place(3)
      type(lattice_t), intent(in) :: lattice
      integer(i8), intent(out) :: low(3), high(3)
      real(wp) :: from(3), to(3)
      from = level%grid%block_origin(place) - 0.5_wp*level%grid%cell
      to = from + block_size*level%grid%cell
      low = max(lattice%first, floor((from - lattice%anchor)/lattice%spacing - 0.5_wp, i8))
      high = min(lattice%last, ceiling((to - lattice%anchor)/lattice%spacing - 0.5_wp, i8))
   end subroutine range_in_block

   !> Smallest box around a body.
   pure subroutine bounds(spec, lower, upper)
      type(body_spec_t), intent(in) :: spec
      real(wp), intent(out) :: lower(3), upper(3)
      real(wp) :: reach(3)
      select case (spec%shape)
      case (shape_sphere)
         lower = spec%center - spec%radius
         upper = spec%center + spec%radius
      case (shape_cylinder)
         reach = spec%radius*sqrt(max(0.0_wp, 1.0_wp - spec%axis**2))
         lower = spec%center + min(0.0_wp, spec%height*spec%axis) - reach
         upper = spec%center + max(0.0_wp, spec%height*spec%axis) + reach
      case default
         lower = spec%lower
         upper = spec%upper
      end select
   end subroutine bounds

   !> True when a place lies in the body.
   pure logical function inside(spec, x)
      type(body_spec_t), intent(in) :: spec
      real(wp), intent(in) :: x(3) !< m
      real(wp) :: along
      select case (spec%shape)
      case (shape_sphere)
         inside = sum((x - spec%center)**2) < spec%radius**2
      case (shape_cylinder)
         along = dot_product(x - spec%center, spec%axis)
         inside = along > 0.0_wp .and. along < spec%height .and. sum((x - spec%center)**2) - along**2 < spec%radius**2
      case default
         inside = all(x > spec%lower) .and. all(x < spec%upper)
      end select
   end function inside

   !> Centre of a body (m), about which it spins.
   pure function body_center(spec) result(center)
      type(body_spec_t), intent(in) :: spec
      real(wp) :: center(3)
      select case (spec%shape)
      case (shape_sphere); center = spec%center
      case (shape_cylinder); center = spec%center + 0.5_wp*spec%height*spec%axis
      case default; center = 0.5_wp*(spec%lower + spec%upper)
      end select
   end function body_center

end module m_body
