!> One law at points: a law read from the text of its group, particles of it, and steps that are driven by
!> strain or, along some axes, by stress.
module m_point
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_namelist_text, only: namelist_text_t
   use m_group_reader, only: group_reader_t
   use m_field_table, only: field_table_t, layout_t
   use m_material, only: material_t
   use m_materials, only: known_materials
   use m_offer, only: catalogue_t, offered
   use m_deform, only: advance_volume
   implicit none
   private
   public :: point_t, law_of, identity, rotation, tensor

   !> Particles of 1 m3 and 1 kg of one law.
   type :: point_t
      class(material_t), allocatable :: law
      type(field_table_t) :: table
      type(layout_t) :: layout
      real(wp), allocatable :: column(:, :), gradient(:, :)
      real(wp) :: last(5) = [-0.4_wp, -0.4_wp, 0.0_wp, 0.0_wp, 0.0_wp] !< of `pull`: what it found, per strain
   contains
      procedure :: ready
      procedure :: strain_by
      procedure :: each_by
      procedure :: stress_of
      procedure :: pull
   end type point_t

contains

   !> The law with this name and what its group says.
   function law_of(model, variables) result(law)
      character(len=*), intent(in) :: model, variables
      class(material_t), allocatable :: law
      type(catalogue_t) :: catalogue
      type(namelist_text_t) :: text
      type(group_reader_t) :: group
      type(error_t) :: error
      call known_materials(catalogue)
      select type (known => catalogue%models(offered(catalogue%models, model))%it)
      class is (material_t)
         allocate (law, source=known)
      end select
      call text%parse('&material '//variables//' /', error)
      call group%begin(text%groups(1))
      call law%variables(group)
      call group%finish(error)
      if (error%happened()) print '(a)', 'law_of: '//error%message
      law%density = 1.0_wp
   end function law_of

   !> n particles, not strained; their orientations, where given, are quaternions (4, n).
   subroutine ready(self, law, n, orientations, has_tools)
      class(point_t), intent(inout) :: self
      class(material_t), intent(in) :: law
      integer, intent(in) :: n
      real(wp), intent(in), optional :: orientations(:, :)
      logical, intent(in), optional :: has_tools
      logical :: tools
      if (allocated(self%law)) deallocate (self%law)
      allocate (self%law, source=law)
      tools = .false.
      if (present(has_tools)) tools = has_tools
      self%table = field_table_t()
      call self%table%declare('mass', 1, 'kg', .true.)
      call self%table%declare('volume', 1, 'm3', .true.)
      call self%table%declare('stress', 6, 'Pa', .true.)
      call self%law%declare(self%table, tools)
      self%layout = self%table%layout()
      if (allocated(self%column)) deallocate (self%column, self%gradient)
      allocate (self%column(n, self%table%columns), self%gradient(n, 9), source=0.0_wp)
      self%column(:, self%layout%volume) = 1.0_wp
      self%column(:, self%layout%mass) = 1.0_wp
      if (present(orientations)) then
         associate (o => self%table%column('orientation'))
            self%column(:, o:o + 3) = transpose(orientations)
         end associate
      end if
      self%last = [-0.4_wp, -0.4_wp, 0.0_wp, 0.0_wp, 0.0_wp]
      call self%law%initial(self%column, self%layout, 1, n)
   end subroutine ready

   !> A step of all particles by what stands in `gradient`.
   subroutine each_by(self, dt)
      class(point_t), intent(inout) :: self
      real(wp), intent(in) :: dt
      real(wp) :: smallest
      integer :: n
      n = size(self%column, 1)
      call self%law%update(self%column, self%layout, self%gradient, dt, 1, n)
      call advance_volume(n, self%gradient, dt, self%column(:, self%layout%volume), smallest)
   end subroutine each_by

   !> A step of all particles with the deformation gradient I + increment.
   subroutine strain_by(self, increment, dt)
      class(point_t), intent(inout) :: self
      real(wp), intent(in) :: increment(3, 3), dt
      integer :: p
      do p = 1, size(self%column, 1)
         self%gradient(p, :) = reshape(increment/dt, [9])
      end do
      call self%each_by(dt)
   end subroutine strain_by

   function stress_of(self, p) result(s)
      class(point_t), intent(in) :: self
      integer, intent(in) :: p
      real(wp) :: s(3, 3)
      s = tensor(self%column(p, self%layout%stress:self%layout%stress + 5))
   end function stress_of

   !> A step of the only particle in which the fibre along x grows by `strain` and keeps its direction, and no
   !> other component of the stress is left than xx: what grips that are far apart do. Newton's method by
   !> differences; `left` is the largest of the others over xx.
   subroutine pull(self, strain, dt, left)
      class(point_t), intent(inout) :: self
      real(wp), intent(in) :: strain, dt
      real(wp), intent(out) :: left
      real(wp) :: start(size(self%column, 1), size(self%column, 2)), x(5), f(5), g(5), matrix(5, 5), h, &
         change(5), share
      integer :: n, k
      start = self%column
      x = strain*self%last
      h = 1.0e-5_wp*abs(strain)
      call attempt(x, f)
      do n = 1, 60
         left = maxval(abs(f))/max(abs(self%column(1, self%layout%stress)), 1.0_wp)
         if (left < 1.0e-7_wp) exit
         do k = 1, 5
            x(k) = x(k) + h
            call attempt(x, g)
            x(k) = x(k) - h
            matrix(:, k) = (g - f)/h
         end do
         change = solution(matrix, f)
         share = 1.0_wp
         do k = 1, 20
            call attempt(x - share*change, g)
            if (norm2(g) < (1.0_wp - 0.1_wp*share)*norm2(f)) exit
            share = 0.5_wp*share
         end do
         x = x - share*change
         f = g
      end do
      self%last = x/strain
   contains
      subroutine attempt(x, f)
         real(wp), intent(in) :: x(5)
         real(wp), intent(out) :: f(5)
         real(wp) :: increment(3, 3)
         increment = 0.0_wp
         increment(1, 1) = strain
         increment(2, 2) = x(1)
         increment(3, 3) = x(2)
         increment(2, 3) = x(3); increment(3, 2) = x(3)
         increment(1, 2) = x(4)
         increment(1, 3) = x(5)
         self%column = start
         call self%strain_by(increment, dt)
         f = self%column(1, self%layout%stress + 1:self%layout%stress + 5)
      end subroutine attempt
   end subroutine pull

   !> Five unknowns by elimination with pivots.
   function solution(matrix, right) result(x)
      real(wp), intent(in) :: matrix(5, 5), right(5)
      real(wp) :: x(5), a(5, 6), row(6)
      integer :: i, j, at
      a(:, :5) = matrix
      a(:, 6) = right
      do i = 1, 5
         at = i - 1 + maxloc(abs(a(i:, i)), dim=1)
         row = a(i, :)
         a(i, :) = a(at, :)
         a(at, :) = row
         a(i, :) = a(i, :)/a(i, i)
         do j = 1, 5
            if (j /= i) a(j, :) = a(j, :) - a(j, i)*a(i, :)
         end do
      end do
      x = a(:, 6)
   end function solution

   pure function tensor(s) result(t)
      real(wp), intent(in) :: s(6)
      real(wp) :: t(3, 3)
      t = reshape([s(1), s(6), s(5), s(6), s(2), s(4), s(5), s(4), s(3)], [3, 3])
   end function tensor

   pure function identity()
      real(wp) :: identity(3, 3)
      identity = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
   end function identity

   !> Rotation about an axis (Rodrigues), radians.
   pure function rotation(axis, angle) result(r)
      real(wp), intent(in) :: axis(3), angle
      real(wp) :: r(3, 3), u(3), w(3, 3)
      u = axis/norm2(axis)
      w = reshape([0.0_wp, u(3), -u(2), -u(3), 0.0_wp, u(1), u(2), -u(1), 0.0_wp], [3, 3])
      r = identity() + sin(angle)*w + 2.0_wp*sin(0.5_wp*angle)**2*matmul(w, w)
   end function rotation

end module m_point
