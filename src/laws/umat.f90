!> Interface to laws written for Abaqus/Standard: the user subroutine UMAT, in a shared library
!> (doc/developer/vumat.md).
module m_umat
   use, intrinsic :: iso_c_binding, only: c_int, c_double, c_char, c_size_t, c_funptr, c_f_procpointer
   use m_kinds, only: wp
   use m_constants, only: exit_numerical
   use m_foreign_call, only: begin_foreign_call, end_foreign_call
   use m_text, only: to_text
   use m_vectors, only: cross
   use m_group_reader, only: group_reader_t
   use m_field_table, only: layout_t
   use m_user_law, only: user_law_t, points_t, matrix_place
   use m_user_library, only: find_law, law_name, name_size
   implicit none
   private
   public :: umat_t

   integer, parameter :: order(6) = [1, 2, 3, 4, 6, 5] !< 11 22 33 12 13 23 among xx yy zz xy yz xz
   integer, parameter :: static_step = 2 !< JSTEP(2): general static procedure
   !> 11 21 31 12 22 32 13 23 33 among xx yy zz xy xz yz
   integer, parameter :: tensor_of(9) = [1, 4, 5, 4, 2, 6, 5, 6, 3]
   !> xx yy zz yz xz xy among 11 21 31 12 22 32 13 23 33
   integer, parameter :: matrix_of(6) = [1, 5, 9, 8, 7, 4]

   abstract interface
      !> As in its manual; the length of CMNAME comes last, as Fortran compilers pass it.
      pure subroutine umat_interface(stress, statev, ddsdde, sse, spd, scd, rpl, ddsddt, drplde, drpldt, &
                                     stran, dstran, time, dtime, temp, dtemp, predef, dpred, cmname, ndi, &
                                     nshr, ntens, nstatv, props, nprops, coords, drot, pnewdt, celent, &
                                     dfgrd0, dfgrd1, noel, npt, layer, kspt, jstep, kinc, &
                                     cmname_length) bind(c)
         import :: c_int, c_double, c_char, c_size_t
         real(c_double), intent(inout) :: stress(*), statev(*), ddsdde(*), sse, spd, scd, rpl, ddsddt(*), &
                                          drplde(*), drpldt, pnewdt
         real(c_double), intent(in) :: stran(*), dstran(*), time(*), dtime, temp, dtemp, predef(*), &
                                       dpred(*), props(*), coords(*), drot(*), celent, dfgrd0(*), dfgrd1(*)
         character(kind=c_char), intent(in) :: cmname(*)
         integer(c_int), intent(in) :: ndi, nshr, ntens, nstatv, nprops, noel, npt, layer, kspt, jstep(*), &
                                       kinc
         integer(c_size_t), intent(in), value :: cmname_length
      end subroutine umat_interface
   end interface

   type, extends(user_law_t) :: umat_t
      procedure(umat_interface), pointer, nopass, private :: law => null()
   contains
      procedure :: load
      procedure :: evaluate
      procedure :: stress_tangent
      procedure :: requests_cutback
      procedure :: fault_text
      procedure :: is_time_dependent
   end type umat_t

contains

   !> Find `umat_`, the symbol name of gfortran and Intel's compilers.
   subroutine load(self, group, found)
      class(umat_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      logical, intent(out) :: found
      type(c_funptr) :: address
      procedure(umat_interface), pointer :: law
      self%turns = .false.
      call find_law(self%library, self%checksum, group, 'umat_', 'mylaw.f', 'SUBROUTINE UMAT', address, &
                    found)
      if (.not. found) return
      call c_f_procpointer(address, law)
      self%law => law
   end subroutine load

   !> Point by point, in the frame of the grid: stresses and strains have already been rotated by the step's
   !> rotation. Energies of a call are per present volume; values that a law does not set stay not_written.
   pure subroutine evaluate(self, points)
      class(umat_t), intent(in) :: self
      type(points_t), intent(inout) :: points
      integer :: p
      do p = 1, points%count
         call ask_one(self, points, p)
      end do
   end subroutine evaluate

   !> One point.
   pure subroutine ask_one(self, points, p)
      class(umat_t), intent(in) :: self
      type(points_t), intent(inout) :: points
      integer, intent(in) :: p
      real(c_double), parameter :: doubled(6) = [1.0_wp, 1.0_wp, 1.0_wp, 2.0_wp, 2.0_wp, 2.0_wp]
      real(c_double) :: stress(6), moduli(36), sse, spd, scd, rpl, by_heat(6), heat(6), heat_slope, share
      real(c_double) :: state(size(points%state, 2)), props(max(1, size(self%constants))), begins(2)
      real(c_double) :: stored
      props(:size(self%constants)) = self%constants
      stress = points%stress(p, order)
      state = points%state(p, :)
      moduli = 0.0_wp
      by_heat = 0.0_wp
      heat = 0.0_wp
      rpl = 0.0_wp
      heat_slope = 0.0_wp
      share = 1.0_wp
      begins = points%time - points%time_step ! of this step, and of the run
      stored = points%density(p)*(points%energy_old(p) - points%inelastic_old(p))
      sse = stored
      spd = points%density(p)*points%inelastic_old(p)
      scd = 0.0_wp
      call self%law(stress, state, moduli, sse, spd, scd, rpl, by_heat, heat, heat_slope, &
                    doubled*points%total(p, order), doubled*points%strain(p, order), begins, &
                    points%time_step, self%temperature, 0.0_wp, [0.0_wp], [0.0_wp], law_name(self%label), 3, &
                    3, 6, self%states, props, size(self%constants), points%place(p, :), &
                    turn(points%spin(p, :)), share, points%size(p), in_order(points%deformation_old(p, :)), &
                    in_order(points%deformation(p, :)), p, 1, 1, 1, [1, static_step, 1, 0], &
                    merge(2, 1, begins(2) > 0.0_wp), int(name_size, c_size_t))
      points%stress(p, order) = stress
      points%state(p, :) = state
      points%moduli(p, :) = moduli
      points%share(p) = share
      points%inelastic(p) = (spd + scd)/points%density(p)
      ! if the law set no energy, it is the work of the stress
      if (abs(sse - stored) > 0.0_wp) points%energy(p) = (sse + spd + scd)/points%density(p)
   end subroutine ask_one

   !> The rotation of Hughes and Winget, column by column.
   pure function turn(spin) result(r)
      real(wp), intent(in) :: spin(3)
      real(wp) :: r(9)
      real(wp) :: c
      associate (wx => spin(1), wy => spin(2), wz => spin(3))
         c = 1.0_wp/(1.0_wp + 0.25_wp*sum(spin**2))
         r = [1.0_wp - 0.5_wp*c*(wy*wy + wz*wz), c*(0.5_wp*wx*wy + wz), c*(0.5_wp*wx*wz - wy), &
              c*(0.5_wp*wx*wy - wz), 1.0_wp - 0.5_wp*c*(wx*wx + wz*wz), c*(0.5_wp*wy*wz + wx), &
              c*(0.5_wp*wx*wz + wy), c*(0.5_wp*wy*wz - wx), 1.0_wp - 0.5_wp*c*(wx*wx + wy*wy)]
      end associate
   end function turn

   !> 11 21 31 12 22 32 13 23 33 of 11 22 33 12 23 31 21 32 13.
   pure function in_order(f) result(matrix)
      real(wp), intent(in) :: f(9)
      real(wp) :: matrix(9)
      matrix = f(matrix_place)
   end function in_order

   !> From DDSDDE, the moduli of the Jaumann rate of Kirchhoff stress over J: with l = dA F^-1, d and w its
   !> parts, d sigma = DDSDDE : d - sigma tr d + w sigma - sigma w (theory.md, eq. umat-tangent).
   pure subroutine stress_tangent(self, column, layout, gradient, parts, time_step, count, slope, known)
      class(umat_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      integer, intent(in) :: parts, count
      real(wp), intent(in) :: time_step
      real(wp), intent(inout), contiguous :: slope(:, :)
      logical, intent(out) :: known
      type(points_t) :: points
      real(wp) :: r(count, 9), s(3, 3), l(3, 3), inverse(3, 3), w(3, 3), strain(6), change(3, 3), flat(9)
      integer :: kl, p
      known = parts == 1
      if (.not. known) return
      call self%fill_points(column, layout, gradient/time_step, time_step, 1, count, points, r)
      points%stress = points%stress_old
      points%state(:, :self%states) = points%state_old
      points%state(:, self%states + 1:) = 0.0_wp
      call begin_foreign_call(self%called, exit_numerical)
      call self%evaluate(points)
      call end_foreign_call()
      do p = 1, count
         s = reshape(points%stress(p, order(tensor_of)), [3, 3])
         inverse = inverse_of(gradient(p, :))
         do kl = 1, 9
            l = 0.0_wp ! dA has a single 1: l has a row of the inverse in one row
            l(mod(kl - 1, 3) + 1, :) = inverse((kl - 1)/3 + 1, :)
            w = 0.5_wp*(l - transpose(l))
            strain = [l(1, 1), l(2, 2), l(3, 3), l(1, 2) + l(2, 1), l(1, 3) + l(3, 1), l(2, 3) + l(3, 2)]
            strain = matmul(reshape(points%moduli(p, :), [6, 6]), strain)
            change = reshape(strain(tensor_of), [3, 3]) - (l(1, 1) + l(2, 2) + l(3, 3))*s + matmul(w, s) &
                     - matmul(s, w)
            flat = reshape(change, [9])
            slope(p, 6*kl - 5:6*kl) = flat(matrix_of)
         end do
      end do
   end subroutine stress_tangent

   !> (I + A)^-1.
   pure function inverse_of(a) result(inverse)
      real(wp), intent(in) :: a(9)
      real(wp) :: inverse(3, 3)
      real(wp) :: f(3, 3)
      integer :: i
      f = reshape(a, [3, 3])
      do i = 1, 3
         f(i, i) = f(i, i) + 1.0_wp
      end do
      inverse(1, :) = cross(f(:, 2), f(:, 3))
      inverse(2, :) = cross(f(:, 3), f(:, 1))
      inverse(3, :) = cross(f(:, 1), f(:, 2))
      inverse = inverse/dot_product(f(:, 1), inverse(1, :))
   end function inverse_of

   !> True if PNEWDT was below 1 in one of the particles.
   pure logical function requests_cutback(self, column, first, last)
      class(umat_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: first, last
      requests_cutback = any(column(first:last, self%share) < 1.0_wp)
   end function requests_cutback

   pure function fault_text(self) result(text)
      class(umat_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = ': its UMAT returned NaN in stress or state, requested a cutback (PNEWDT '// &
             'below 1), or wrote to more state variables than its '//to_text(self%states)//' states'
   end function fault_text

   !> Unknown, so steps assume that it is.
   pure logical function is_time_dependent(self)
      class(umat_t), intent(in) :: self
      is_time_dependent = .true.
   end function is_time_dependent

end module m_umat
