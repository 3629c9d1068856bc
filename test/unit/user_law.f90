!> What a law of a user's gets: stretch, increments and turns in the frame of R, by laws whose answer is known
!> in another way. And moduli of any symmetry.
module m_given_laws
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t
   use m_user_law, only: user_law_t, points_t
   implicit none
   private
   public :: given_t, hyperelastic, jaumann, frame_only, summed

   integer, parameter :: hyperelastic = 1, jaumann = 2, frame_only = 3, summed = 4

   type, extends(user_law_t) :: given_t
      integer :: kind = 0
      real(wp) :: shear = 0.0_wp, bulk = 0.0_wp
   contains
      procedure :: load
      procedure :: evaluate
   end type given_t

contains

   subroutine load(self, group, found)
      class(given_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      logical, intent(out) :: found
      found = .true.
   end subroutine load

   pure function matrix(a) result(m) !< of xx yy zz xy yz xz
      real(wp), intent(in) :: a(6)
      real(wp) :: m(3, 3)
      m = reshape([a(1), a(4), a(6), a(4), a(2), a(5), a(6), a(5), a(3)], [3, 3])
   end function matrix

   pure function tensor(m) result(a)
      real(wp), intent(in) :: m(3, 3)
      real(wp) :: a(6)
      a = [m(1, 1), m(2, 2), m(3, 3), m(1, 2), m(2, 3), m(1, 3)]
   end function tensor

   pure subroutine evaluate(self, points)
      class(given_t), intent(in) :: self
      type(points_t), intent(inout) :: points
      real(wp) :: u(3, 3), b(3, 3), j, w(3), s(3, 3), r(3, 3), k(3, 3), strain(3, 3)
      real(wp), parameter :: one(3, 3) = reshape([1.0_wp, 0.0_wp, 0.0_wp, 0.0_wp, 1.0_wp, 0.0_wp, 0.0_wp, &
                                                  0.0_wp, 1.0_wp], [3, 3])
      integer :: p
      do p = 1, points%count
         strain = matrix(points%strain(p, :))
         select case (self%kind)
         case (hyperelastic) ! neo-Hookean, from U alone: R^T b R = U U
            u = matrix(points%stretch(p, :))
            b = matmul(u, u)
            j = u(1, 1)*(u(2, 2)*u(3, 3) - u(2, 3)**2) - u(1, 2)*(u(1, 2)*u(3, 3) - u(2, 3)*u(1, 3)) &
                + u(1, 3)*(u(1, 2)*u(2, 3) - u(2, 2)*u(1, 3))
            s = self%shear*j**(-5.0_wp/3.0_wp)*(b - (b(1, 1) + b(2, 2) + b(3, 3))/3.0_wp*one) &
                + self%bulk*(j - 1.0_wp)*one
         case (jaumann, frame_only) ! rate forms: that of eq. elastic by the spin, that of Green and Naghdi
                                    ! without
            w = points%spin(p, :)
            if (self%kind == frame_only) w = 0.0_wp
            k = reshape([0.0_wp, w(3), -w(2), -w(3), 0.0_wp, w(1), w(2), -w(1), 0.0_wp], [3, 3])
            r = one + (k + 0.5_wp*matmul(k, k))/(1.0_wp + 0.25_wp*sum(w**2))
            s = matmul(r, matmul(matrix(points%stress_old(p, :)), transpose(r))) + 2.0_wp*self%shear*strain &
                + (self%bulk - 2.0_wp*self%shear/3.0_wp)*(strain(1, 1) + strain(2, 2) + strain(3, 3))*one
         case default ! F^T F = U U of both times, seen from inside; the states are the sum of strains and the
                      ! time
            b = reshape(points%deformation(p, [1, 7, 6, 4, 2, 8, 9, 5, 3]), [3, 3])
            u = matrix(points%stretch(p, :))
            points%state(p, 1) = maxval(abs(matmul(transpose(b), b) - matmul(u, u)))
            b = reshape(points%deformation_old(p, [1, 7, 6, 4, 2, 8, 9, 5, 3]), [3, 3])
            u = matrix(points%stretch_old(p, :))
            points%state(p, 1) = max(points%state(p, 1), maxval(abs(matmul(transpose(b), b) - matmul(u, u))))
            points%state(p, 2:7) = points%state_old(p, 2:7) + points%strain(p, :)
            points%state(p, 8) = points%time
            s = 0.0_wp
         end select
         points%stress(p, :) = tensor(s)
      end do
   end subroutine evaluate

end module m_given_laws

program user_law
   use m_kinds, only: wp
   use m_communicator, only: communicator_t
   use m_field_table, only: field_table_t, layout_t
   use m_material, only: material_t
   use m_elastic, only: elastic_t
   use m_neo_hookean, only: neo_hookean_t
   use m_tangent, only: tangent_t
   use m_given_laws
   use m_deform, only: advance_volume
   use m_assertions, only: assertions_t
   use m_chance, only: chance_t, keep_worst, say
   implicit none
   integer, parameter :: n = 300 ! more than two calls
   real(wp), parameter :: shear = 80.0e9_wp, bulk = 160.0e9_wp, density = 7850.0_wp
   type(communicator_t) :: comm
   type(assertions_t) :: test
   type(chance_t) :: chance
   type(layout_t) :: layout
   real(wp), allocatable :: column(:, :), gradient(:, :)
   call comm%start()
   call test%start(comm, 'user_law')
   call same_answer(hyperelastic, 'neo-Hookean from the stretch U')
   call same_answer(jaumann, 'Jaumann''s rate by the spin beyond the frame''s')
   call turning()
   call summing()
   call moduli()
   call test%finish()

contains

   subroutine ready(law)
      class(material_t), intent(inout) :: law
      type(field_table_t) :: table
      law%density = density
      call table%declare('mass', 1, 'kg', .true.)
      call table%declare('volume', 1, 'm3', .true.)
      call table%declare('stress', 6, 'Pa', .true.)
      call law%declare(table, has_tools=.true.)
      layout = table%layout()
      if (allocated(column)) deallocate (column, gradient)
      allocate (column(n, table%columns), gradient(n, 9), source=0.0_wp)
      column(:, layout%volume) = 1.0_wp
      column(:, layout%mass) = density
      call law%initial(column, layout, 1, n)
   end subroutine ready

   type(given_t) function given(kind)
      integer, intent(in) :: kind
      given%kind = kind
      given%shear = shear
      given%bulk = bulk
      given%states = merge(8, 0, kind == summed)
   end function given

   subroutine advance(law, dt)
      class(material_t), intent(in) :: law
      real(wp), intent(in) :: dt
      real(wp) :: smallest
      call law%update(column, layout, gradient, dt, 1, n)
      call advance_volume(n, gradient, dt, column(:, layout%volume), smallest)
   end subroutine advance

   !> 100 random steps of all particles by two laws: the same stress and the same energy's worth of work.
   subroutine same_answer(kind, what)
      integer, intent(in) :: kind
      character(len=*), intent(in) :: what
      class(material_t), allocatable :: theirs
      real(wp) :: stress(n, 6), size_of_stress
      integer :: side, t, p
      do side = 1, 2
         chance%state = 77
         if (side == 1) then
            allocate (theirs, source=given(kind))
         else if (kind == hyperelastic) then
            allocate (theirs, source=neo_hookean_t(lame=bulk - 2.0_wp*shear/3.0_wp, shear=shear))
         else
            allocate (theirs, source=elastic_t(lame=bulk - 2.0_wp*shear/3.0_wp, shear=shear))
         end if
         call ready(theirs)
         do t = 1, 100
            do p = 1, n
               gradient(p, :) = chance%several(9, -0.04_wp, 0.04_wp)
            end do
            call advance(theirs, 1.0_wp)
         end do
         if (side == 1) stress = column(:, layout%stress:layout%stress + 5)
         deallocate (theirs)
      end do
      size_of_stress = maxval(abs(stress))
      stress = stress - column(:, layout%stress:layout%stress + 5)
      call say(what//': off the built-in law over the largest stress', maxval(abs(stress))/size_of_stress)
      call test%check(size_of_stress > 0.1_wp*shear, what//': the paths are long')
      call test%check_close(maxval(abs(stress))/size_of_stress, 0.0_wp, 1.0e-12_wp, what// &
                            ': the built-in law''s answer')
   end subroutine same_answer

   !> A stressed body turns ten times: the stress in the frame stays, with the frame alone and with the spin.
   subroutine turning()
      type(given_t) :: law
      real(wp) :: r(3, 3), k(3, 3), s(3, 3), turned(3, 3), angle, off
      real(wp), parameter :: axis(3) = [1.0_wp, -2.0_wp, 0.5_wp]/sqrt(5.25_wp)
      integer, parameter :: steps = 2000
      integer :: t, p
      law = given(frame_only)
      law%shear = 0.0_wp ! eq. elastic sees a strain of angle^4/4 a step
      law%bulk = 0.0_wp
      call ready(law)
      do p = 1, n
         column(p, layout%stress:layout%stress + 5) = chance%several(6, -1.0e8_wp, 1.0e8_wp)
      end do
      s = symmetric(column(7, layout%stress:layout%stress + 5))
      angle = 20.3_wp*acos(-1.0_wp)
      k = reshape([0.0_wp, axis(3), -axis(2), -axis(3), 0.0_wp, axis(1), axis(2), -axis(1), 0.0_wp], [3, 3])
      r = sin(angle/steps)*k + 2.0_wp*sin(0.5_wp*angle/steps)**2*matmul(k, k)
      do p = 1, n
         gradient(p, :) = reshape(r, [9])
      end do
      do t = 1, steps
         call advance(law, 1.0_wp)
      end do
      r = sin(angle)*k + 2.0_wp*sin(0.5_wp*angle)**2*matmul(k, k)
      do p = 1, 3
         r(p, p) = r(p, p) + 1.0_wp
      end do
      turned = matmul(r, matmul(s, transpose(r)))
      off = maxval(abs(turned - symmetric(column(7, layout%stress:layout%stress + 5))))/1.0e8_wp
      call say('ten turns: stress against R sigma R^T, relative', off)
      call test%check_close(off, 0.0_wp, 1.0e-10_wp, 'the stress turns with the body')
   end subroutine turning

   pure function symmetric(a) result(m)
      real(wp), intent(in) :: a(6)
      real(wp) :: m(3, 3)
      m = reshape([a(1), a(6), a(5), a(6), a(2), a(4), a(5), a(4), a(3)], [3, 3])
   end function symmetric

   !> Along one path: U and F agree at both times, the strains add up to the logarithmic strain, the time goes
   !> on, and work is done.
   subroutine summing()
      type(given_t) :: law
      real(wp), parameter :: e(3) = [0.3_wp, -0.2_wp, 0.1_wp]
      real(wp) :: l(3, 3), work
      integer, parameter :: steps = 1000
      integer :: p, t, first
      law = given(summed)
      call ready(law)
      l = 0.0_wp
      do p = 1, 3
         l(p, p) = exp(e(p)/steps) - 1.0_wp
      end do
      do p = 1, n
         gradient(p, :) = reshape(l, [9])/1.0e-3_wp
      end do
      do t = 1, steps
         call advance(law, 1.0e-3_wp)
      end do
      first = law%sdv(1)
      call test%check_close(maxval(column(:, first)), 0.0_wp, 1.0e-13_wp, &
                            'stretch and deformation gradient agree')
      call test%check_close(column(n, first + 1:first + 6), [e, 0.0_wp, 0.0_wp, 0.0_wp], 1.0e-6_wp, &
                            'strains add up')
      call test%check_close(column(5, first + 7), 1.0_wp, 1.0e-12_wp, 'the time is that of the step''s end')
      law = given(frame_only)
      call ready(law)
      do p = 1, n
         gradient(p, :) = reshape(l, [9])/1.0e-3_wp
      end do
      do t = 1, steps
         call advance(law, 1.0e-3_wp)
      end do
      work = 0.5_wp*(bulk - 2.0_wp*shear/3.0_wp)*sum(e)**2 + shear*sum(e**2)
      ! per mass, with the density of each step: the integral of e d e/density along the straight path
      work = work*2.0_wp*(exp(sum(e))*(sum(e) - 1.0_wp) + 1.0_wp)/sum(e)**2/density
      call test%check_close(law%strain_energy(column, layout, 1, n)/(n*density)/work, 1.0_wp, 1.0e-3_wp, &
                            'energy that a law does not write is the work of its stress')
   end subroutine summing

   !> Speeds of waves and energies against what is known.
   subroutine moduli()
      type(tangent_t) :: tangent
      real(wp), parameter :: c11 = 168.4e9_wp, c12 = 121.4e9_wp, c44 = 75.4e9_wp
      integer :: i
      tangent%stiffness = 0.0_wp
      tangent%stiffness(1:3, 1:3) = c12
      do i = 1, 3
         tangent%stiffness(i, i) = c11
         tangent%stiffness(i + 3, i + 3) = c44
      end do
      call test%check(tangent%invert(), 'cubic moduli can be inverted')
      call test%check_close(tangent%wave_modulus()/((c11 + 2.0_wp*c12 + 4.0_wp*c44)/3.0_wp), 1.0_wp, &
                            1.0e-12_wp, 'copper: the fastest wave goes along the diagonal of the cube')
      call test%check_close(1.0_wp/tangent%compliance(1, 1)/((c11 - c12)*(c11 + 2.0_wp*c12)/(c11 + c12)), &
                            1.0_wp, 1.0e-12_wp, 'copper: Young''s modulus along an edge')
      tangent%stiffness(4, 4) = -c44
      call test%check(.not. tangent%invert(), 'moduli that store nothing are refused')
   end subroutine moduli

end program user_law
