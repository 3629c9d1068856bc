!> Derivatives of the stress that laws give in closed form, against differences of their stress, about random
!> steps from random states.
program closed_tangents
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_material, only: material_t
   use m_elastic, only: elastic_t
   use m_neo_hookean, only: neo_hookean_t
   use m_j2, only: j2_t
   use m_norton, only: norton_t
   use m_assertions, only: assertions_t
   use m_material_point, only: material_point_t, read_law
   use m_chance, only: chance_t
   implicit none
   integer, parameter :: many = 200
   character(len=*), parameter :: moduli = 'young=1e9, poisson=0.3, '
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   call comm%start()
   call test%start(comm, 'closed_tangents')
   call compare('elastic', elastic_t(), '', 1)
   call compare('neo_hookean', neo_hookean_t(), '', 1)
   call compare('neo_hookean in four parts', neo_hookean_t(), '', 4)
   call compare('j2', j2_t(), 'yield_stress=2e7, hardening_modulus=1e8', 1)
   call compare('j2 by a table', j2_t(), &
                'hardening_strain=0,0.05,0.2,1, hardening_stress=2e7,4e7,5e7,5.5e7', 1)
   call compare('j2 that flows without hardening', j2_t(), 'yield_stress=2e7', 1)
   call has_none('j2 in four parts', j2_t(), 'yield_stress=2e7', 4)
   call has_none('norton', norton_t(), 'creep_stress=1e7, creep_rate=1e-3, creep_exponent=5', 1)
   call test%finish()

contains

   !> Random values between -size and size.
   subroutine shake(values, size)
      real(wp), intent(out) :: values(:, :)
      real(wp), intent(in) :: size !< of the largest
      integer :: i, j
      do j = 1, ubound(values, 2)
         do i = 1, ubound(values, 1)
            values(i, j) = chance%between(-size, size)
         end do
      end do
   end subroutine shake

   subroutine compare(what, law, variables, parts)
      character(len=*), intent(in) :: what, variables
      class(material_t), intent(in) :: law
      integer, intent(in) :: parts
      class(material_t), allocatable :: known
      type(material_point_t) :: point
      real(wp) :: a(many, 9), slope(many, 54), other(many, 54), before(many, 9), stress(many, 6), far, &
                  wrong, size_of
      character(len=:), allocatable :: complaint
      logical :: has
      integer :: c, kl
      real(wp), parameter :: step = 1.0e-6_wp
      allocate (known, source=law)
      call read_law(known, moduli//variables, complaint)
      call test%check(complaint == '', what//': the law is read '//complaint)
      call point%ready(known, 1000.0_wp, many)
      do c = 1, 3 ! a state
         call shake(before, 0.1_wp)
         call known%update(point%column, point%layout, before, 1.0_wp, 1, many)
      end do
      call shake(a, 0.15_wp)
      call known%stress_tangent(point%column, point%layout, a, parts, 0.5_wp, many, slope, has)
      call test%check(has, what//': it is known')
      do kl = 1, 9
         do c = 1, 2
            before = a
            before(:, kl) = before(:, kl) + merge(step, -step, c == 1)
            call after(known, point, before, stress)
            if (c == 1) other(:, 6*kl - 5:6*kl) = stress
            if (c == 2) other(:, 6*kl - 5:6*kl) = (other(:, 6*kl - 5:6*kl) - stress)/(2.0_wp*step)
         end do
      end do
      size_of = maxval(abs(other))
      far = maxval(abs(slope - other))/size_of
      call test%check_close(far, 0.0_wp, 1.0e-7_wp, what//': slopes against differences, relative')
      ! negative control: of another state it is another one
      point%column(:, point%layout%stress:point%layout%stress + 5) = 0.0_wp
      if (point%layout%deformation > 0) point%column(:, point%layout%deformation + 1) = 0.0_wp
      call known%stress_tangent(point%column, point%layout, a, parts, 0.5_wp, many, slope, has)
      wrong = maxval(abs(slope - other))/size_of
      call test%check(wrong > 1.0e-3_wp, what//': of another state it differs')
   end subroutine compare

   !> The stress after a step from where the points stand.
   subroutine after(law, point, a, stress)
      class(material_t), intent(in) :: law
      type(material_point_t), intent(in) :: point
      real(wp), intent(in) :: a(many, 9)
      real(wp), intent(out) :: stress(many, 6)
      real(wp), allocatable :: column(:, :)
      column = point%column
      call law%update(column, point%layout, a/0.5_wp, 0.5_wp, 1, many)
      stress = column(:, point%layout%stress:point%layout%stress + 5)
   end subroutine after

   !> Where differences have to do, the law says so.
   subroutine has_none(what, law, variables, parts)
      character(len=*), intent(in) :: what, variables
      class(material_t), intent(in) :: law
      integer, intent(in) :: parts
      class(material_t), allocatable :: known
      type(material_point_t) :: point
      real(wp) :: a(1, 9), slope(1, 54)
      character(len=:), allocatable :: complaint
      logical :: has
      allocate (known, source=law)
      call read_law(known, moduli//variables, complaint)
      call point%ready(known, 1000.0_wp, 1)
      a = 0.01_wp
      call known%stress_tangent(point%column, point%layout, a, parts, 1.0_wp, 1, slope, has)
      call test%check(.not. has, what//': not known')
   end subroutine has_none

end program closed_tangents
