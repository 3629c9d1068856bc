!> The faces of particles that lie on the box of atoms, as a mesh that moves with the material. A bond pushes
!> the corners of the face that it crosses, by shares that stay as they are (theory.md, eq. bond-shares):
!> nodes get from bonds what the particles beside them give.
module m_interface_mesh
   use m_kinds, only: wp
   use m_node_patch, only: node_patch_t
   implicit none
   private

   real(wp), parameter :: reach = 0.5_wp !< of its edge: how far from its middle a face's forces are

   type, public :: interface_mesh_t
      real(wp), allocatable :: x(:, :)     !< (3, corners), m
      real(wp), allocatable :: v(:, :)     !< (3, corners) as the nodes move them, m/s
      integer, allocatable :: corner(:, :) !< (4, faces)
      integer, allocatable :: face(:)      !< (crossings)
      real(wp), allocatable :: share(:, :) !< (4, crossings) of each corner of the face
      real(wp) :: width = 0.0_wp           !< of a face, m
      real(wp), allocatable :: first(:, :)           !< (3, corners) at the start, m
      real(wp), allocatable :: rest_load(:, :)       !< (3, corners) of bonds at rest, N: the surface of the
                                                     !< continuum bears as much, which is not modelled
      real(wp), allocatable :: rest_moment(:, :, :)  !< (3, faces, 3), N m
   contains
      procedure :: build
      procedure :: settle
      procedure :: set_rest
      procedure :: rest_energy
      procedure :: add
   end type interface_mesh_t

contains

   !> The mesh of the box from `lower` to `upper`, which is whole numbers of faces of `width` wide.
   subroutine build(self, lower, upper, width)
      class(interface_mesh_t), intent(inout) :: self
      real(wp), intent(in) :: lower(3), upper(3), width !< m
      integer, allocatable :: number(:, :, :)
      integer :: counts(3), i, j, k, n
      counts = max(1, nint((upper - lower)/width))
      self%width = width
      allocate (number(0:counts(1), 0:counts(2), 0:counts(3)), source=0)
      allocate (self%x(3, product(counts + 1) - product(counts - 1)), source=0.0_wp)
      n = 0
      do k = 0, counts(3)
         do j = 0, counts(2)
            do i = 0, counts(1)
               if (all([i, j, k] > 0 .and. [i, j, k] < counts)) cycle
               n = n + 1
               number(i, j, k) = n
               self%x(:, n) = lower + (upper - lower)*[i, j, k]/real(counts, wp)
            end do
         end do
      end do
      call find_faces(self, counts, number)
   end subroutine build

   !> Faces axis by axis, those at `lower` first.
   subroutine find_faces(self, counts, number)
      type(interface_mesh_t), intent(inout) :: self
      integer, intent(in) :: counts(3), number(0:, 0:, 0:) !< faces along the edges; corners
      integer :: axis, side, p, q, i, j, n, faces, at(3)
      allocate (self%corner(4, 2*(counts(1)*counts(2) + counts(2)*counts(3) + counts(3)*counts(1))))
      faces = 0
      do axis = 1, 3
         p = mod(axis, 3) + 1
         q = mod(axis + 1, 3) + 1
         do side = 0, 1
            do j = 0, counts(q) - 1
               do i = 0, counts(p) - 1
                  faces = faces + 1
                  do n = 0, 3
                     at(axis) = side*counts(axis)
                     at(p) = i + mod(n, 2)
                     at(q) = j + n/2
                     self%corner(n + 1, faces) = number(at(1), at(2), at(3))
                  end do
               end do
            end do
         end do
      end do
   end subroutine find_faces

   !> Bonds cross at `places` (3, crossings), m, on the box from `lower` to `upper`. Faces that none
   !> crosses, as at the surface of the body, are left out.
   subroutine settle(self, places, lower, upper)
      class(interface_mesh_t), intent(inout) :: self
      real(wp), intent(in) :: places(:, :), lower(3), upper(3)
      integer :: counts(3), axis, side, p, q, n, at(3), first(4)
      real(wp) :: t(3)
      counts = max(1, nint((upper - lower)/self%width))
      first(1) = 0
      do axis = 1, 3
         first(axis + 1) = first(axis) + 2*counts(mod(axis, 3) + 1)*counts(mod(axis + 1, 3) + 1)
      end do
      allocate (self%face(size(places, 2)), self%share(4, size(places, 2)))
      do n = 1, size(places, 2)
         t = (places(:, n) - lower)/(upper - lower)
         axis = minloc(min(abs(t), abs(1.0_wp - t))*(upper - lower), 1)
         side = merge(1, 0, t(axis) > 0.5_wp)
         p = mod(axis, 3) + 1
         q = mod(axis + 1, 3) + 1
         at = max(0, min(counts - 1, floor(t*counts)))
         t = t*counts - at
         self%face(n) = first(axis) + side*counts(p)*counts(q) + at(p) + counts(p)*at(q) + 1
         self%share(:, n) = [(1.0_wp - t(p))*(1.0_wp - t(q)), t(p)*(1.0_wp - t(q)), (1.0_wp - t(p))*t(q), &
                             t(p)*t(q)]
      end do
      call keep_crossed(self)
   end subroutine settle

   !> Leave out faces without bonds, and corners without faces.
   subroutine keep_crossed(self)
      class(interface_mesh_t), intent(inout) :: self
      logical :: crossed(size(self%corner, 2)), used(size(self%x, 2))
      integer :: new(size(self%corner, 2)), number(size(self%x, 2)), n
      crossed = .false.
      crossed(self%face) = .true.
      used = .false.
      do n = 1, size(crossed)
         if (crossed(n)) used(self%corner(:, n)) = .true.
      end do
      new = unpack([(n, n=1, count(crossed))], crossed, 0)
      number = unpack([(n, n=1, count(used))], used, 0)
      self%face = new(self%face)
      self%corner = reshape(number(pack(self%corner, spread(crossed, 1, 4))), [4, count(crossed)])
      self%x = reshape(pack(self%x, spread(used, 1, 3)), [3, count(used)])
      self%v = 0.0_wp*self%x
      self%first = self%x
      self%rest_load = self%v
      allocate (self%rest_moment(3, size(self%corner, 2), 3), source=0.0_wp)
   end subroutine keep_crossed

   !> Bonds at `places` have these forces on the continuum at rest: from now on only what comes besides
   !> these pushes nodes. Their resultant, which is rounding, is taken off.
   subroutine set_rest(self, places, forces)
      class(interface_mesh_t), intent(inout) :: self
      real(wp), intent(in) :: places(:, :), forces(:, :) !< (3, crossings), m; N
      real(wp), allocatable :: load(:, :), moment(:, :, :)
      allocate (load, mold=self%rest_load)
      allocate (moment, mold=self%rest_moment)
      self%rest_load = 0.0_wp
      self%rest_moment = 0.0_wp
      call collect(self, places, forces, load, moment)
      self%rest_load = load - spread(sum(load, 2)/size(load, 2), 2, size(load, 2))
      self%rest_moment = moment
   end subroutine set_rest

   !> Energy of the forces at rest, which are taken off, since the start, J.
   pure real(wp) function rest_energy(self) result(energy)
      class(interface_mesh_t), intent(in) :: self
      energy = sum(self%rest_load*(self%x - self%first))
   end function rest_energy

   !> Of forces of bonds, without those at rest: the loads of corners, and the moments of faces that these
   !> miss.
   pure subroutine collect(self, places, forces, load, moment)
      class(interface_mesh_t), intent(in) :: self
      real(wp), intent(in) :: places(:, :), forces(:, :) !< (3, crossings), m; N
      real(wp), intent(out) :: load(:, :)                !< (3, corners), N
      real(wp), intent(out) :: moment(:, :, :)           !< (3, faces, 3): force, direction of its arm, N m
      real(wp) :: off(3)
      integer :: n, k
      load = -self%rest_load
      moment = -self%rest_moment
      do n = 1, size(self%face)
         associate (c => self%corner(:, self%face(n)), s => self%share(:, n))
            off = places(:, n) - (s(1)*self%x(:, c(1)) + s(2)*self%x(:, c(2)) + s(3)*self%x(:, c(3)) &
                                  + s(4)*self%x(:, c(4)))
            do k = 1, 4
               load(:, c(k)) = load(:, c(k)) + s(k)*forces(:, n)
            end do
            do k = 1, 3
               moment(:, self%face(n), k) = moment(:, self%face(n), k) + off(k)*forces(:, n)
            end do
         end associate
      end do
   end subroutine collect

   !> Give forces of bonds on the continuum that cross at `places`, times a factor, to the nodes. Each face
   !> adds up the moments that the corners miss, for these are not quite on the lines of the bonds; forces
   !> on both sides of its middle make them up. `missed` counts places that no node with mass is near to.
   subroutine add(self, patch, places, forces, factor, missed)
      class(interface_mesh_t), intent(in) :: self
      type(node_patch_t), intent(inout) :: patch
      real(wp), intent(in) :: places(:, :), forces(:, :), factor !< (3, crossings), m; N
      integer, intent(inout) :: missed
      real(wp), allocatable :: load(:, :), moment(:, :, :), middle(:, :)
      real(wp) :: way(3)
      integer :: k
      allocate (load, mold=self%rest_load)
      allocate (moment, mold=self%rest_moment)
      call collect(self, places, forces, load, moment)
      call patch%add(self%x, load, factor, missed)
      middle = 0.25_wp*(self%x(:, self%corner(1, :)) + self%x(:, self%corner(2, :)) &
                        + self%x(:, self%corner(3, :)) + self%x(:, self%corner(4, :)))
      do k = 1, 3
         way = 0.0_wp
         way(k) = reach*self%width
         call patch%add(middle + spread(way, 2, size(middle, 2)), moment(:, :, k), 0.5_wp*factor/way(k), &
                        missed)
         call patch%add(middle - spread(way, 2, size(middle, 2)), moment(:, :, k), -0.5_wp*factor/way(k), &
                        missed)
      end do
   end subroutine add

end module m_interface_mesh
