!> A preconditioner for the stiffness of implicit steps on one level: multigrid on trilinear elements in the
!> cells that particles reach, with the masses of inertia and the points that press (theory.md, Multigrid).
module m_static_elements
   use mpi_f08
   use m_kinds, only: wp
   use m_node_values, only: tile_last, f_x
   use m_multigrid, only: multigrid_t
   use m_krylov, only: krylov_preconditioner_t
   use m_model, only: model_t
   use m_static_nodes, only: is_own_node, tile_node
   use m_static_tiles, only: sum_up
   use m_static_system, only: static_system_t
   use m_section, only: section_t
   implicit none
   private
   public :: static_elements_t

   type, extends(krylov_preconditioner_t) :: static_elements_t
      private
      type(multigrid_t) :: multigrid
      type(model_t), pointer :: model => null()
      integer :: row = 0                     !< of the timers
      logical, public :: wanted = .false.
      integer, allocatable :: place(:)       !< index of the nodal unknowns among the values of this rank's
                                             !< nodes
      real(wp), allocatable :: diagonal(:)   !< of the stiffness, for unknowns that are not nodal
      real(wp), allocatable :: from(:), to(:)
   contains
      procedure :: make
      procedure :: apply
      procedure :: dismiss
      procedure, private :: number_nodes
      procedure, private :: add_cells
      procedure, private :: add_points
      procedure, private :: add_diagonal
   end type static_elements_t

   integer, parameter :: corners(4) = [0, 1, 4, 5] !< those in the plane, of a cell's eight, counted x fastest
   real(wp), parameter :: loose = 1.0e-8_wp !< of the largest stiffness: given to nodes without filled cells

contains

   !> Collective: build it for the points pressed at present, and the renewed diagonal of the system.
   subroutine make(self, system)
      class(static_elements_t), intent(inout) :: self
      type(static_system_t), intent(inout) :: system
      real(wp), allocatable :: tiles(:, :, :, :, :), places(:, :)
      integer, allocatable :: at(:, :)
      integer :: n
      associate (model => system%model, comm => system%model%communicator%comm%MPI_VAL)
         self%model => system%model
         self%row = model%timers%row_of('multigrid')
         call model%timers%enter(self%row)
         allocate (tiles, mold=system%levels(1)%forces)
         call self%number_nodes(system, tiles, at)
         call self%multigrid%begin(comm, size(at, 2))
         call self%add_cells(system, tiles)
         call self%add_points(system, tiles)
         call self%add_diagonal(system, tiles)
         allocate (places(3, size(at, 2)))
         do n = 1, size(at, 2)
            places(:, n) = model%levels(1)%grid%cell*tile_node(model%levels(1), at(4, n), at(:3, n))
         end do
         call self%multigrid%set_up(comm, places)
      end associate
   end subroutine make

   !> Collective: number the nodes with unknowns: the first of three rows of each, from 1, in f_x of all
   !> tiles, and flags of the three components with an unknown in the first three values.
   subroutine number_nodes(self, system, tiles, at)
      class(static_elements_t), intent(inout) :: self
      type(static_system_t), intent(inout) :: system
      real(wp), intent(out), contiguous :: tiles(:, 0:, 0:, 0:, :)
      integer, allocatable, intent(out) :: at(:, :) !< (4, nodes): in the tile of a block
      integer :: before, n, nodes
      associate (unknowns => system%levels(1)%unknowns, model => system%model)
         if (allocated(self%place)) deallocate (self%place, self%from, self%to)
         allocate (self%place(unknowns%count), at(4, unknowns%count))
         nodes = 0
         do n = 1, unknowns%count ! those of a node are consecutive
            if (n == 1) then
               nodes = 1
            else if (any(unknowns%at(2:, n) /= unknowns%at(2:, n - 1))) then
               nodes = nodes + 1
            end if
            at(:, nodes) = unknowns%at(2:, n)
            self%place(n) = 3*(nodes - 1) + unknowns%at(1, n)
         end do
         at = at(:, :nodes)
         allocate (self%from(3*nodes), self%to(3*nodes), source=0.0_wp)
         before = 0
         call MPI_Exscan(nodes, before, 1, MPI_INTEGER, MPI_SUM, model%communicator%comm)
         if (model%communicator%is_root()) before = 0
         tiles = 0.0_wp
         do n = 1, unknowns%count
            associate (a => unknowns%at(:, n))
               tiles(f_x, a(2), a(3), a(4), a(5)) = real(3*before + 3*((self%place(n) - 1)/3) + 1, wp)
               tiles(a(1), a(2), a(3), a(4), a(5)) = 1.0_wp
            end associate
         end do
         call sum_up(model, 1, tiles)
      end associate
   end subroutine number_nodes

   !> Rows of a node, from 0; -1 if it has none.
   pure function rows_of(node) result(rows)
      real(wp), intent(in) :: node(:)
      integer :: rows(3), a
      do a = 1, 3
         rows(a) = nint(node(f_x)) + a - 2
         if (.not. node(a) > 0.5_wp) rows(a) = -1
      end do
   end function rows_of

   !> Add the elements of the cells that particles reach, each from one block, with the moduli of their
   !> material at rest.
   subroutine add_cells(self, system, tiles)
      class(static_elements_t), intent(inout) :: self
      type(static_system_t), intent(in) :: system
      real(wp), intent(in), contiguous :: tiles(:, 0:, 0:, 0:, :)
      real(wp) :: poisson, lame, shear, element(24, 24), bulk_part(24, 24), shear_part(24, 24)
      integer :: b, c, i, j, k, rows(24), cell(3)
      call unit_elements(bulk_part, shear_part)
      poisson = poisson_of(system%model)
      associate (level => system%model%levels(1), ghost => system%levels(1)%ghost)
         do b = 1, size(level%blocks)
            do k = 0, tile_last - 1
               do j = 0, tile_last - 1
                  do i = 0, tile_last - 1
                     if (.not. ghost%filled(i, j, k, b)) cycle
                     if (.not. is_own_node(level, b, [i, j, k])) cycle
                     cell = tile_node(level, b, [i, j, k])
                     if (any(cell < 0 .or. cell >= level%grid%cells)) cycle
                     do c = 0, 7
                        rows(3*c + 1:3*c + 3) = rows_of(tiles(:, i + ibits(c, 0, 1), j + ibits(c, 1, 1), &
                                                              k + ibits(c, 2, 1), b))
                     end do
                     call moduli(ghost%young(i, j, k, b), poisson, lame, shear)
                     if (level%grid%section%is_flat()) then
                        call self%multigrid%add([(rows(3*corners(c) + 1:3*corners(c) + 3), c=1, 4)], &
                           section_stiffness(level%grid%section, lame, shear, level%grid%cell, &
                                             level%grid%lower(1) + cell(1)*level%grid%cell))
                        cycle
                     end if
                     element = level%grid%cell*(lame*bulk_part + shear*shear_part)
                     call self%multigrid%add(rows, element)
                  end do
               end do
            end do
         end do
      end associate
   end subroutine add_cells

   !> The largest Poisson's ratio of the materials, from the moduli for uniaxial stress and strain.
   real(wp) function poisson_of(model) result(poisson)
      type(model_t), intent(in) :: model
      real(wp) :: ratio
      integer :: m
      poisson = 0.0_wp
      do m = 1, size(model%materials%slots)
         associate (law => model%materials%slots(m)%law)
            ratio = law%p_wave_modulus()*2.0_wp*law%complementary_energy( &
                    [1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 0.0_wp])
         end associate
         if (.not. ratio > 1.0_wp) cycle
         poisson = max(poisson, min(0.499_wp, (1.0_wp - ratio &
                                    + sqrt((ratio - 1.0_wp)*(9.0_wp*ratio - 1.0_wp)))/(4.0_wp*ratio)))
      end do
   end function poisson_of

   pure subroutine moduli(young, poisson, lame, shear)
      real(wp), intent(in) :: young, poisson
      real(wp), intent(out) :: lame, shear
      lame = young*poisson/((1.0_wp + poisson)*(1.0_wp - 2.0_wp*poisson))
      shear = 0.5_wp*young/(1.0_wp + poisson)
   end subroutine moduli

   !> The stiffness of a trilinear cube with edges of 1 for Lame's two moduli of 1, integrated exactly.
   pure subroutine unit_elements(bulk_part, shear_part)
      real(wp), intent(out) :: bulk_part(24, 24), shear_part(24, 24)
      integer :: a, b, c, n, m
      bulk_part = 0.0_wp
      shear_part = 0.0_wp
      do m = 0, 7
         do n = 0, 7
            do b = 1, 3
               do a = 1, 3
                  bulk_part(3*n + a, 3*m + b) = stress_tangent(n, m, a, b)
                  shear_part(3*n + a, 3*m + b) = stress_tangent(n, m, b, a)
                  if (a /= b) cycle
                  do c = 1, 3
                     shear_part(3*n + a, 3*m + b) = shear_part(3*n + a, 3*m + b) + stress_tangent(n, m, c, c)
                  end do
               end do
            end do
         end do
      end do
   end subroutine unit_elements

   !> Integral of the derivative of hat function n along a times that of m along b.
   pure real(wp) function stress_tangent(n, m, a, b) result(integral)
      integer, intent(in) :: n, m, a, b
      real(wp) :: of_n, of_m
      integer :: c
      integral = 1.0_wp
      do c = 1, 3
         of_n = real(2*ibits(n, c - 1, 1) - 1, wp)
         of_m = real(2*ibits(m, c - 1, 1) - 1, wp)
         if (c == a .and. c == b) then
            integral = integral*of_n*of_m
         else if (c == a) then
            integral = 0.5_wp*integral*of_n
         else if (c == b) then
            integral = 0.5_wp*integral*of_m
         else
            integral = integral*merge(1.0_wp/3.0_wp, 1.0_wp/6.0_wp, of_n*of_m > 0.0_wp)
         end if
      end do
   end function stress_tangent

   !> Add the stiffness of pressed points in the linear problem.
   subroutine add_points(self, system, tiles)
      class(static_elements_t), intent(inout) :: self
      type(static_system_t), intent(in) :: system
      real(wp), intent(in), contiguous :: tiles(:, 0:, 0:, 0:, :)
      real(wp) :: own(3, 3), axis(3)
      real(wp), allocatable :: all_weights(:), block(:, :)
      integer, allocatable :: rows(:)
      integer :: a, i, j, k, m, n, of, at(3)
      do n = 1, system%contact%count
         associate (it => system%contact%list(n), c => system%contact%list(n)%point)
            if (.not. it%pressed) cycle
            do a = 1, 3
               axis = 0.0_wp
               axis(a) = 1.0_wp
               own(:, a) = c%reflection*system%contact%list(n)%resist(c%reflection*axis)
            end do
            allocate (all_weights(0), rows(0))
            do k = 0, c%face%last
               do j = 0, c%face%last
                  do i = 0, c%face%last
                     at = c%face%corner + 1 + [i, j, k]
                     if (.not. c%face%weight(i, j, k) > 0.0_wp) cycle
                     all_weights = [all_weights, c%face%weight(i, j, k)]
                     rows = [rows, rows_of(tiles(:, at(1), at(2), at(3), c%block))]
                  end do
               end do
            end do
            allocate (block(size(rows), size(rows)))
            do m = 1, size(all_weights)
               do of = 1, size(all_weights)
                  block(3*of - 2:3*of, 3*m - 2:3*m) = all_weights(of)*all_weights(m)*own
               end do
            end do
            call self%multigrid%add(rows, block)
            deallocate (all_weights, rows, block)
         end associate
      end do
   end subroutine add_points

   !> Add masses; rows without unknowns; and nodes with so little material that no cell counts as reached.
   subroutine add_diagonal(self, system, tiles)
      class(static_elements_t), intent(inout) :: self
      type(static_system_t), intent(in) :: system
      real(wp), intent(in), contiguous :: tiles(:, 0:, 0:, 0:, :)
      logical :: is_unknown(size(self%from))
      real(wp) :: largest
      integer :: n, first
      self%diagonal = system%diagonal
      largest = maxval([0.0_wp, system%diagonal])
      is_unknown = .false.
      associate (unknowns => system%levels(1)%unknowns)
         first = 0
         do n = 1, unknowns%count
            associate (a => unknowns%at(:, n))
               first = nint(tiles(f_x, a(2), a(3), a(4), a(5))) - 1
               is_unknown(self%place(n)) = .true.
               call self%multigrid%add([first + a(1) - 1], reshape([loose*largest + mass_of(n)], [1, 1]))
            end associate
         end do
         if (unknowns%count == 0) return
         first = first - 3*((self%place(unknowns%count) - 1)/3) ! index of this rank's first node
      end associate
      do n = 1, size(is_unknown)
         if (.not. is_unknown(n)) call self%multigrid%add([first + n - 1], reshape([largest], [1, 1]))
      end do
   contains
      pure real(wp) function mass_of(n)
         integer, intent(in) :: n
         mass_of = 0.0_wp
         if (system%inertia%acts) mass_of = system%inertia%stiffness(n)
      end function mass_of
   end subroutine add_diagonal

   !> Collective: apply the approximate inverse of the stiffness: a cycle, and the diagonal for unknowns that
   !> are not nodal.
   subroutine apply(self, from, to)
      class(static_elements_t), intent(inout) :: self
      real(wp), intent(in), contiguous :: from(:)
      real(wp), intent(out), contiguous :: to(:)
      integer :: n, nodal
      call self%model%timers%enter(self%row)
      nodal = size(self%place)
      self%from = 0.0_wp
      do n = 1, nodal
         self%from(self%place(n)) = from(n)
      end do
      call self%multigrid%apply(self%from, self%to)
      do n = 1, nodal
         to(n) = self%to(self%place(n))
      end do
      to(nodal + 1:) = from(nodal + 1:)/self%diagonal(nodal + 1:)
   end subroutine apply

   !> Collective: free PETSc objects.
   subroutine dismiss(self)
      class(static_elements_t), intent(inout) :: self
      call self%multigrid%dismiss()
   end subroutine dismiss

   !> Stiffness of a square with bilinear shape functions, times its depth, by four points: for the components
   !> x, y, z of its corners, N/m. There is no motion along y; around an axis a radial displacement is a
   !> strain.
   pure function section_stiffness(section, lame, shear, cell, radius) result(stiffness)
      type(section_t), intent(in) :: section
      real(wp), intent(in) :: lame, shear !< moduli, Pa
      real(wp), intent(in) :: cell        !< m
      real(wp), intent(in) :: radius      !< of its lower side, m
      real(wp) :: stiffness(12, 12)
      real(wp), parameter :: gauss = 0.5_wp/sqrt(3.0_wp)
      real(wp) :: strain(4, 12), stress(4, 12), x, z, at
      integer :: p
      stiffness = 0.0_wp
      do p = 0, 3
         x = 0.5_wp + gauss*(2*ibits(p, 0, 1) - 1)
         z = 0.5_wp + gauss*(2*ibits(p, 1, 1) - 1)
         at = radius + x*cell
         strain = strains(x, z, cell)
         if (.not. section%is_round()) strain(2, :) = 0.0_wp
         strain(2, :) = strain(2, :)/at
         stress = 2.0_wp*shear*strain
         stress(4, :) = shear*strain(4, :)
         stress(:3, :) = stress(:3, :) + lame*spread(sum(strain(:3, :), dim=1), 1, 3)
         stiffness = stiffness + 0.25_wp*cell**2*section%depth(at)*matmul(transpose(strain), stress)
      end do
   end function section_stiffness

   !> Strains xx, yy times the radius, zz (1/m) and the shear xz by the components of the corners.
   pure function strains(x, z, cell) result(strain)
      real(wp), intent(in) :: x, z !< in the cell, 0 to 1
      real(wp), intent(in) :: cell !< m
      real(wp) :: strain(4, 12)
      real(wp) :: along_x, along_z
      integer :: n
      strain = 0.0_wp
      do n = 0, 3
         along_x = merge(x, 1.0_wp - x, btest(n, 0))
         along_z = merge(z, 1.0_wp - z, btest(n, 1))
         strain(1, 3*n + 1) = merge(along_z, -along_z, btest(n, 0))/cell
         strain(2, 3*n + 1) = along_x*along_z
         strain(3, 3*n + 3) = merge(along_x, -along_x, btest(n, 1))/cell
         strain(4, 3*n + 1) = strain(3, 3*n + 3)
         strain(4, 3*n + 3) = strain(1, 3*n + 1)
      end do
   end function strains

end module m_static_elements
