!> A material point: a law by itself, strained or stressed as a test asks, and what every law must do.
module m_material_point
   use m_kinds, only: wp
   use m_errors, only: error_t
   use m_field_table, only: field_table_t, layout_t
   use m_namelist_text, only: namelist_text_t
   use m_group_reader, only: group_reader_t
   use m_material, only: material_t
   use m_deform, only: advance_volume
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t, keep_worst, say
   implicit none
   private
   public :: material_point_t, read_law, identity, about_axis

   !> n particles of 1 m3 of one law.
   type :: material_point_t
      type(field_table_t) :: table
      type(layout_t) :: layout
      real(wp), allocatable :: column(:, :), gradient(:, :)
      real(wp) :: time = 0.0_wp, axial = 0.0_wp, lateral = 0.0_wp !< s, logarithmic strains of `stress_to` and
                                                                  !< `pull`
      real(wp) :: work = 0.0_wp !< of the stress of particle 1 since the start, J
   contains
      procedure :: ready
      procedure :: strain_by
      procedure :: stretch_by
      procedure :: stress_to
      procedure :: pull
      procedure :: stress
      procedure :: field
      procedure :: mises
      procedure :: follows_turns
      procedure :: dissipates
      procedure, private :: advance
      procedure, private :: squeezed
   end type material_point_t

contains

   !> The law of a group of a scene; `complaint` is empty where it is good.
   subroutine read_law(law, text, complaint)
      class(material_t), intent(inout) :: law
      character(len=*), intent(in) :: text
      character(len=:), allocatable, intent(out) :: complaint
      type(namelist_text_t) :: parsed
      type(group_reader_t) :: group
      type(error_t) :: error
      call parsed%parse('&material '//text//' /'//new_line('a'), error)
      call group%begin(parsed%groups(1))
      call law%variables(group)
      call group%finish(error)
      complaint = ''
      if (error%happened()) complaint = error%message
   end subroutine read_law

   subroutine ready(self, law, density, n)
      class(material_point_t), intent(out) :: self
      class(material_t), intent(inout) :: law
      real(wp), intent(in) :: density
      integer, intent(in), optional :: n !< 1
      integer :: count
      count = 1
      if (present(n)) count = n
      law%density = density
      call self%table%declare('mass', 1, 'kg', .true.)
      call self%table%declare('volume', 1, 'm3', .true.)
      call self%table%declare('stress', 6, 'Pa', .true.)
      call law%declare(self%table, has_tools=.true.)
      self%layout = self%table%layout()
      allocate (self%column(count, self%table%columns), self%gradient(count, 9), source=0.0_wp)
      self%column(:, self%layout%volume) = 1.0_wp
      self%column(:, self%layout%mass) = density
      call law%initial(self%column, self%layout, 1, count)
   end subroutine ready

   !> One step with what stands in `gradient`.
   subroutine advance(self, law, dt)
      class(material_point_t), intent(inout) :: self
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: dt
      real(wp) :: smallest, before(3, 3), l(3, 3), old_volume
      integer :: n
      n = size(self%column, 1)
      before = self%stress()
      old_volume = self%column(1, self%layout%volume)
      call law%update(self%column, self%layout, self%gradient, dt, 1, n)
      call advance_volume(n, self%gradient, dt, self%column(:, self%layout%volume), smallest)
      l = dt*reshape(self%gradient(1, :), [3, 3])
      l = l - 0.5_wp*matmul(l, l)
      self%work = self%work + 0.25_wp*(old_volume + self%column(1, self%layout%volume)) &
                  *sum((before + self%stress())*l)
      self%time = self%time + dt
   end subroutine advance

   !> One step of all particles with the deformation gradient I + increment.
   subroutine strain_by(self, law, increment, dt)
      class(material_point_t), intent(inout) :: self
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: increment(3, 3), dt
      integer :: p
      do p = 1, size(self%column, 1)
         self%gradient(p, :) = reshape(increment/dt, [9])
      end do
      call self%advance(law, dt)
   end subroutine strain_by

   !> `steps` steps that add up to the logarithmic strains e along x, y, z in `duration` seconds.
   subroutine stretch_by(self, law, e, steps, duration)
      class(material_point_t), intent(inout) :: self
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: e(3), duration
      integer, intent(in) :: steps
      real(wp) :: increment(3, 3)
      integer :: i, t
      increment = 0.0_wp
      do i = 1, 3
         increment(i, i) = exp(e(i)/steps) - 1.0_wp
      end do
      do t = 1, steps
         call self%strain_by(law, increment, duration/steps)
      end do
   end subroutine stretch_by

   !> Axial and lateral stress (Pa) after a step with these increments of logarithmic strain.
   subroutine squeezed(self, law, e, dt, answer)
      class(material_point_t), intent(inout) :: self
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: e(2), dt
      real(wp), intent(out) :: answer(2)
      call self%stretch_by(law, [e(1), e(2), e(2)], 1, dt)
      answer = [self%column(1, self%layout%stress), self%column(1, self%layout%stress + 1)]
   end subroutine squeezed

   !> One step to an axial stress (Pa) along x with nothing across, by Newton's iteration on the two strains.
   subroutine stress_to(self, law, stress, dt)
      class(material_point_t), intent(inout) :: self
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: stress, dt
      type(material_point_t) :: start
      real(wp) :: e(2), answer(2), moved(2), j(2, 2), off(2), h
      integer :: iteration, k
      call copy(self, start)
      e = 0.0_wp
      h = 1.0e-8_wp
      do iteration = 1, 60
         call copy(start, self)
         call self%squeezed(law, e, dt, answer)
         off = answer - [stress, 0.0_wp]
         if (maxval(abs(off)) <= 1.0e-9_wp*max(abs(stress), 1.0_wp)) exit
         do k = 1, 2
            call copy(start, self)
            moved = e
            moved(k) = moved(k) + h
            call self%squeezed(law, moved, dt, j(:, k))
            j(:, k) = (j(:, k) - answer)/h
         end do
         e = e - [j(2, 2)*off(1) - j(1, 2)*off(2), j(1, 1)*off(2) - j(2, 1)*off(1)] &
             /(j(1, 1)*j(2, 2) - j(1, 2)*j(2, 1))
      end do
      call copy(start, self)
      call self%squeezed(law, e, dt, answer)
      self%axial = self%axial + e(1)
      self%lateral = self%lateral + e(2)
   end subroutine stress_to

   !> One step of axial logarithmic strain with nothing across.
   subroutine pull(self, law, strain, dt)
      class(material_point_t), intent(inout) :: self
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: strain, dt
      type(material_point_t) :: start
      real(wp) :: across, answer(2), moved(2), h
      integer :: iteration
      call copy(self, start)
      across = -0.4_wp*strain
      h = 1.0e-8_wp
      do iteration = 1, 60
         call copy(start, self)
         call self%squeezed(law, [strain, across], dt, answer)
         if (abs(answer(2)) <= 1.0e-10_wp*max(abs(answer(1)), 1.0_wp)) exit
         call copy(start, self)
         call self%squeezed(law, [strain, across + h], dt, moved)
         across = across - answer(2)*h/(moved(2) - answer(2))
      end do
      call copy(start, self)
      call self%squeezed(law, [strain, across], dt, answer)
      self%axial = self%axial + strain
      self%lateral = self%lateral + across
   end subroutine pull

   subroutine copy(from, to)
      type(material_point_t), intent(in) :: from
      class(material_point_t), intent(inout) :: to
      to%column = from%column
      to%gradient = from%gradient
      to%layout = from%layout
      to%table = from%table
      to%time = from%time
      to%axial = from%axial
      to%lateral = from%lateral
      to%work = from%work
   end subroutine copy

   !> Of particle 1, Pa.
   pure function stress(self) result(m)
      class(material_point_t), intent(in) :: self
      real(wp) :: m(3, 3), a(6)
      a = self%column(1, self%layout%stress:self%layout%stress + 5)
      m = reshape([a(1), a(6), a(5), a(6), a(2), a(4), a(5), a(4), a(3)], [3, 3])
   end function stress

   !> The first component of a field of particle 1.
   pure real(wp) function field(self, name)
      class(material_point_t), intent(in) :: self
      character(len=*), intent(in) :: name
      field = self%column(1, self%table%column(name))
   end function field

   !> Von Mises stress of a particle, Pa.
   pure real(wp) function mises(self, p)
      class(material_point_t), intent(in) :: self
      integer, intent(in) :: p
      associate (s => self%layout%stress)
         mises = sqrt(1.5_wp*sum((self%column(p, s:s + 2) - sum(self%column(p, s:s + 2))/3.0_wp)**2) &
                      + 3.0_wp*sum(self%column(p, s + 3:s + 5)**2))
      end associate
   end function mises

   !> A path with a rigid turn of one radian on top gives the stress of the path, turned; what is off falls
   !> with the step.
   subroutine follows_turns(self, law, density, size_of_path, duration, name, test)
      class(material_point_t), intent(inout) :: self
      class(material_t), intent(inout) :: law
      real(wp), intent(in) :: density, size_of_path, duration !< strain; s
      character(len=*), intent(in) :: name
      type(assertions_t), intent(inout) :: test
      real(wp) :: path(3, 3), before(3, 3), after(3, 3), still(3, 3), off(2)
      integer :: half, k, steps, turned
      do half = 1, 2
         steps = 400*half
         path = size_of_path*reshape([2.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, -0.5_wp, 0.0_wp, 0.0_wp, 0.0_wp, &
                                      -1.0_wp], [3, 3])/steps
         do turned = 0, 1
            call self%ready(law, density)
            do k = 1, steps
               before = about_axis(1.0_wp*turned*(k - 1)/steps)
               after = about_axis(1.0_wp*turned*k/steps)
               call self%strain_by(law, matmul(after, matmul(identity() + path, transpose(before))) &
                                   - identity(), duration/steps)
            end do
            if (turned == 0) still = self%stress()
         end do
         off(half) = maxval(abs(matmul(transpose(after), matmul(self%stress(), after)) - still)) &
                     /maxval(abs(still))
      end do
      call say(name//', turned by 1 rad in 400 steps: stress off, relative', off(1))
      call test%check(off(2) < 0.6_wp*off(1) .and. off(1) < 0.02_wp, name//': a turn on top turns the stress')
   end subroutine follows_turns

   !> Random paths of `n` particles: nothing gives back what it has dissipated, and no value is undefined.
   subroutine dissipates(self, law, density, n, duration, name, test)
      class(material_point_t), intent(inout) :: self
      class(material_t), intent(inout) :: law
      real(wp), intent(in) :: density, duration !< of a step, s
      integer, intent(in) :: n
      character(len=*), intent(in) :: name
      type(assertions_t), intent(inout) :: test
      type(chance_t) :: chance
      real(wp), allocatable :: before(:)
      real(wp) :: least, most, fell
      integer :: p, t
      call self%ready(law, density, n)
      allocate (before(n), source=0.0_wp)
      fell = 0.0_wp
      do t = 1, 40
         do p = 1, n
            self%gradient(p, :) = chance%several(9, -1.0_wp, 1.0_wp)*10.0_wp**chance%between(-5.0_wp, &
               -2.0_wp)/duration
         end do
         call self%advance(law, duration)
         do p = 1, n
            least = law%plastic_energy(self%column, p, p)
            fell = max(fell, before(p) - least)
            before(p) = least
         end do
      end do
      most = maxval(before)
      call say(name//', random paths: largest fall of what was dissipated, of the largest sum', &
               fell/max(most, tiny(most)))
      call test%check(most > 0.0_wp, name//': random paths dissipate')
      call test%check(fell <= 1.0e-12_wp*most, name//': dissipation never falls')
      call test%check(all(abs(self%column) <= huge(1.0_wp)), name//': random paths give numbers')
   end subroutine dissipates

   pure function identity() result(m)
      real(wp) :: m(3, 3)
      m = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp], [3, 3])
   end function identity

   !> Rotation about (1, -2, 0.5) (Rodrigues).
   pure function about_axis(angle) result(r)
      real(wp), intent(in) :: angle
      real(wp) :: r(3, 3), u(3), w(3, 3)
      u = [1.0_wp, -2.0_wp, 0.5_wp]/norm2([1.0_wp, -2.0_wp, 0.5_wp])
      w = reshape([0.0_wp, u(3), -u(2), -u(3), 0.0_wp, u(1), u(2), -u(1), 0.0_wp], [3, 3])
      r = identity() + sin(angle)*w + 2.0_wp*sin(0.5_wp*angle)**2*matmul(w, w)
   end function about_axis

end module m_material_point
