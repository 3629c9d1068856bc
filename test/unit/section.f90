!> One layer of particles that stand for rings: linear fields, uniform pressure, forces and gradients as each
!> other's adjoints, for all domains; rings that are split and merged (theory.md, Sections).
program section
   use m_kinds, only: wp
   use m_constants, only: block_size, pi
   use m_communicator, only: communicator_t
   use m_field_table, only: field_table_t, layout_t, shares_t
   use m_cell_list, only: cell_list_t
   use m_stencil, only: frame_t, gimp_weights
   use m_locate, only: bin_of
   use m_particle_transfer, only: p2g, g2p
   use m_g2p_boxes, only: motion_t
   use m_section, only: geometry_axisymmetric, geometry_plane_strain
   use m_split, only: split_in_eight, octants_of
   use m_assertions, only: assertions_t
   implicit none
   integer, parameter :: last = block_size + 1, per_cell = 2, n = (2*block_size - 3)*(2*block_size - 6)
   character(len=*), parameter :: kinds(3) = [character(len=7) :: 'cubes', 'boxes', 'corners']
   real(wp), parameter :: h = 0.37_wp, a = 0.7_wp, b = -0.4_wp, shear = 0.3_wp
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(field_table_t) :: table
   type(layout_t) :: layout
   type(frame_t) :: frame
   type(cell_list_t) :: cells
   real(wp), allocatable :: column(:, :), gradient(:, :)
   real(wp) :: tile(8, 0:last, 0:last, 0:last)
   real(wp) :: strained !< factor of radii; cubes that do not follow overlap then, as in 3D
   integer :: kind
   call comm%start()
   call test%start(comm, 'section')
   do kind = 1, 3
      call make_particles(kind, geometry_axisymmetric)
      call linear_field(trim(kinds(kind)))
      call uniform_pressure(trim(kinds(kind)))
      call adjoint(trim(kinds(kind)))
      call make_particles(kind, geometry_plane_strain)
      call plane(trim(kinds(kind)))
   end do
   call make_particles(3, geometry_axisymmetric)
   call parts()
   call test%finish()

contains

   !> A lattice from the axis on whose radii have been strained, domains that follow or cubes that do not.
   subroutine make_particles(kind, geometry)
      integer, intent(in) :: kind, geometry
      real(wp) :: x(3), half
      integer :: i, k, p
      if (allocated(column)) deallocate (column, gradient)
      table = field_table_t()
      call table%declare('position', 3, 'm', .true., by_mass=.true.)
      call table%declare('velocity', 3, 'm/s', .true., by_mass=.true.)
      call table%declare('mass', 1, 'kg', .true., extensive=.true.)
      call table%declare('volume', 1, 'm3', .true., extensive=.true.)
      if (kind == 1) call table%declare('half_size', 1, 'm', .true.)
      if (kind == 2) call table%declare('half_size', 3, 'm', .true.)
      if (kind == 3) call table%declare('domain', 9, 'm', .true.)
      call table%declare('stress', 6, 'Pa', .true.)
      call table%declare('velocity_gradient', 9, '1/s', .false.)
      call table%declare('generation', 1, '1', .false.)
      call table%declare('refinement', 1, '1', .false.)
      layout = table%layout()
      layout%section%geometry = geometry
      frame = frame_t([0.0_wp, 0.0_wp, 0.0_wp], h, 1.0_wp/h)
      allocate (column(n + 5, table%columns), gradient(n + 5, 9), source=0.0_wp)
      call cells%reserve(n + 5)
      strained = merge(1.0_wp, 0.83_wp, kind == 1)
      half = 0.5_wp*h/per_cell
      p = 0
      do k = 1, 2*block_size - 6
         do i = 1, 2*block_size - 3
            p = p + 1
            x = [(2*i - 1)*half*strained, 0.0_wp, (2*k + 3)*half]
            column(p, layout%position:layout%position + 2) = x
            column(p, layout%volume) = 4.0_wp*half**2*strained*layout%section%depth(x(1))
            column(p, layout%mass) = 3.0_wp*column(p, layout%volume)
            if (kind == 1) column(p, layout%half_size) = half
            if (kind == 2) column(p, layout%half_size:layout%half_size + 2) = half*[strained, 1.0_wp, 1.0_wp]
            if (kind == 3) column(p, layout%domain:layout%domain + 8:4) = half*[strained, 1.0_wp, 1.0_wp]
            cells%bin(p) = bin_of(x, frame)
         end do
      end do
      call cells%update_statistics(n)
      call cells%go_through(1, n)
   end subroutine make_particles

   !> v = (a r, 0, b z + shear r): the gradient and the hoop's rate are exact; and so is what P2G makes of it.
   subroutine linear_field(name)
      character(len=*), intent(in) :: name
      real(wp) :: exact(9), worst, x(3)
      integer :: i, k, p
      tile = 0.0_wp
      do k = 0, last
         do i = 0, last
            tile(2:4, i, 1, k) = [a*(i - 1)*h, 0.0_wp, b*(k - 1)*h + shear*(i - 1)*h]
         end do
      end do
      call g2p(cells, tile, layout, frame, motion_t(0.0_wp, 1.0_wp, layout%position), column, gradient)
      exact = [a, 0.0_wp, shear, 0.0_wp, a, 0.0_wp, 0.0_wp, 0.0_wp, b]
      worst = maxval(abs(gradient(:n, :) - spread(exact, 1, n)))
      call test%check(worst < 1.0e-12_wp, name//': gradient and hoop of a linear field')
      do p = 1, n
         x = column(p, layout%position:layout%position + 2)
         column(p, layout%velocity:layout%velocity + 2) = [a*x(1), 0.0_wp, b*x(3) + shear*x(1)]
         column(p, layout%gradient:layout%gradient + 8) = exact
      end do
      tile = 0.0_wp
      call p2g(cells, column, layout, frame, tile)
      worst = 0.0_wp
      do k = 0, last
         do i = 1, last
            if (.not. tile(1, i, 1, k) > 1.0e-9_wp) cycle
            worst = max(worst, maxval(abs(tile(2:4, i, 1, k)/tile(1, i, 1, k) &
                                          - [a*(i - 1)*h, 0.0_wp, b*(k - 1)*h + shear*(i - 1)*h])))
         end do
      end do
      call test%check(worst < 1.0e-12_wp, name//': nodes get a linear field back')
      call test%check(all(abs(tile(:, :, [0, 2], :)) <= 0.0_wp), name//': nothing beside the plane')
   end subroutine linear_field

   !> A uniform pressure makes no force where material is all around, nor on the axis. Without the ring's part
   !> of the slope it does: the control.
   subroutine uniform_pressure(name)
      character(len=*), intent(in) :: name
      real(wp) :: worst, plain(0:last), w(3), s(3), r
      integer :: i, k, p
      do i = 0, 2
         column(:, layout%stress + i) = -1.0_wp
      end do
      column(:, layout%velocity:layout%velocity + 2) = 0.0_wp
      column(:, layout%gradient:layout%gradient + 8) = 0.0_wp
      tile = 0.0_wp
      call p2g(cells, column, layout, frame, tile)
      tile(5, 2, 1, :) = tile(5, 2, 1, :) - tile(5, 0, 1, :) ! the axis is a mirror
      worst = maxval(abs(tile(5, 2:block_size - 3, 1, 3:block_size - 1)))/(2.0_wp*pi*h**2)
      worst = max(worst, maxval(abs(tile(7, 1:block_size - 3, 1, 4:block_size - 2)))/(2.0_wp*pi*h**2))
      ! boxes are drawn in by 1e-9 (short_of)
      call test%check(worst < merge(1.0e-8_wp, 1.0e-12_wp, name == 'boxes'), &
                      name//': no force of a uniform pressure')
      if (name /= 'boxes') return
      plain = 0.0_wp
      do p = 1, n
         r = column(p, layout%position)
         i = nint(r/h)
         call gimp_weights(r/h - i, column(p, layout%half_size)/h, w(1), w(2), w(3), s(1), s(3))
         s(2) = -(s(1) + s(3))
         do k = 1, 3
            if (i + k - 1 < 0) cycle
            plain(i + k - 1) = plain(i + k - 1) + column(p, layout%volume)*(s(k)/h + w(k)/r)
         end do
      end do
      call test%check(maxval(abs(plain(2:block_size - 4)))/(2.0_wp*pi*h**2) > 1.0e-2_wp, &
                      'control: plain slopes make a force of it')
   end subroutine uniform_pressure

   !> The power of the nodes' forces is that of the stress, the hoop's among it.
   subroutine adjoint(name)
      character(len=*), intent(in) :: name
      real(wp) :: forces(3, 0:last, 0:last), power(2)
      integer :: i, k, p
      do p = 1, n
         column(p, layout%stress:layout%stress + 5) &
            = [sin(1.0_wp*p), cos(2.0_wp*p), sin(3.0_wp*p), 0.0_wp, cos(5.0_wp*p), 0.0_wp]
      end do
      tile = 0.0_wp
      call p2g(cells, column, layout, frame, tile)
      forces = tile(5:7, :, 1, :)
      call test%check(abs(sum(forces(3, :, :))) < 1.0e-12_wp*sum(abs(forces(3, :, :))), &
                      name//': forces along the axis are in balance')
      tile = 0.0_wp
      do k = 0, last
         do i = 0, last
            tile(2:4:2, i, 1, k) = [sin(i + 3.0_wp*k), cos(2.0_wp*i + k)]
         end do
      end do
      call g2p(cells, tile, layout, frame, motion_t(0.0_wp, 1.0_wp, layout%position), column, gradient)
      power(1) = sum(forces*tile(2:4, :, 1, :))
      power(2) = 0.0_wp
      do p = 1, n
         associate (s => column(p, layout%stress:layout%stress + 5), l => gradient(p, :))
            power(2) = power(2) - column(p, layout%volume)*(s(1)*l(1) + s(2)*l(5) + s(3)*l(9) &
                                                            + s(5)*(l(3) + l(7)))
         end associate
      end do
      call test%check(abs(power(1) - power(2)) < 1.0e-12_wp*abs(power(2)), &
                      name//': power of forces and stress')
   end subroutine adjoint

   !> Plane strain: nothing along y.
   subroutine plane(name)
      character(len=*), intent(in) :: name
      real(wp) :: exact(9)
      integer :: i, k
      tile = 0.0_wp
      do k = 0, last
         do i = 0, last
            tile(2:4, i, 1, k) = [a*(i - 1)*h, 0.0_wp, b*(k - 1)*h]
         end do
      end do
      call g2p(cells, tile, layout, frame, motion_t(0.0_wp, 1.0_wp, layout%position), column, gradient)
      exact = [a, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, b]
      call test%check(maxval(abs(gradient(:n, :) - spread(exact, 1, n))) < 1.0e-12_wp, name//': plane strain')
      call test%check(abs(sum(column(:n, layout%volume)) - n*(h/per_cell)**2*strained) < 1.0e-12_wp, &
                      name//': volumes of one metre')
   end subroutine plane

   !> Four parts of a ring have its mass, its volume and its momentum along the axis, and are rings.
   subroutine parts()
      type(shares_t) :: shares
      real(wp) :: part(table%columns, 0:7), whole(table%columns), area
      integer, allocatable :: which(:)
      integer :: m, p
      shares = table%shares()
      which = octants_of(layout%section)
      call test%check(size(which) == 4, 'four parts')
      do p = 1, 4
         whole = column(p, :)
         whole(layout%velocity:layout%velocity + 2) = [0.3_wp, 0.0_wp, -0.8_wp]
         whole(layout%gradient:layout%gradient + 8) = [a, 0.0_wp, shear, 0.0_wp, a, 0.0_wp, 0.1_wp, 0.0_wp, b]
         whole(layout%domain + 6) = 0.1_wp*whole(layout%domain)
         call split_in_eight(whole, layout, shares, part)
         associate (m_ => layout%mass, v => layout%volume, x => layout%position, u => layout%velocity + 2)
            call test%check(abs(sum(part(m_, which)) - whole(m_)) < 1.0e-14_wp*whole(m_), 'mass of parts')
            call test%check(abs(sum(part(v, which)) - whole(v)) < 1.0e-14_wp*whole(v), 'volume of parts')
            call test%check(abs(sum(part(m_, which)*part(u, which)) - whole(m_)*whole(u)) &
                            < 1.0e-14_wp*abs(whole(m_)*whole(u)), 'momentum of parts along the axis')
            area = whole(v)/(2.0_wp*pi*whole(x))
            do m = 1, 4
               call test%check(abs(part(v, which(m))/(2.0_wp*pi*part(x, which(m))) - 0.25_wp*area) &
                               < 1.0e-14_wp*area, 'parts are rings')
               call test%check(abs(part(x + 1, which(m))) <= 0.0_wp, 'parts are in the section')
            end do
         end associate
      end do
   end subroutine parts

end program section
