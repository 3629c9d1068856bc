!> Shared by laws of plastic flow: an elastic trial step, the return along the deviator to a yield surface in
!> the von Mises stress, and the fields (theory.md, eqs return, plastic-work). A law computes the flow of a
!> particle in `flow`.
module m_plastic
   use m_kinds, only: wp
   use m_field_table, only: field_table_t, layout_t
   use m_elastic, only: elastic_t
   implicit none
   private
   public :: plastic_t, lane_t, lanes, declare_plastic, initial_plastic, update_plastic, follow_shape, &
      shape_stretch, return_along_deviator, von_mises

   integer, parameter :: lanes = 128 !< particles at once: a law's data between its vector loops stay in the
                                     !< first-level cache
   real(wp), parameter :: hardly_plastic = 0.005_wp !< up to this plastic strain the stretch follows from the
                                                    !< stress

   !> One step of up to `lanes` particles.
   type :: lane_t
      real(wp) :: begun(lanes)  !< von Mises stress before the step, Pa; only for laws with asks_begun
      real(wp) :: trial(lanes)  !< von Mises stress after the elastic trial step, Pa
      real(wp) :: strain(lanes) !< increment of the equivalent plastic strain
      real(wp) :: work(lanes)   !< plastic work of the step per present volume, J/m3
   end type lane_t

   type, abstract, extends(elastic_t) :: plastic_t
      integer :: strain = 0 !< column of the equivalent plastic strain
      integer :: work = 0   !< column of the plastic work, J
      integer :: shape = 0  !< first column of the left Cauchy-Green tensor; 0 in scenes without tools
      logical :: asks_begun = .false. !< `flow` uses lane%begun
   contains
      procedure :: declare => declare_plastic
      procedure :: initial => initial_plastic
      procedure :: update => update_plastic
      procedure :: plastic_energy
      procedure :: equivalent_plastic_strain
      procedure :: may_flow
      procedure :: stretch
      procedure :: max_stretch
      procedure :: for_large_strains
      procedure :: default_effect
      procedure(flow_interface), deferred :: flow
   end type plastic_t

   abstract interface
      !> The flow of particles first..last (at most `lanes`; particle first is lane 1): from lane%trial, Pa,
      !> compute lane%strain and lane%work. `column` still holds the fields of the step's beginning, except
      !> for the stress, which is the trial stress; the law may update fields of its own.
      pure subroutine flow_interface(self, column, layout, time_step, first, last, lane)
         import :: plastic_t, layout_t, lane_t, wp
         class(plastic_t), intent(in) :: self
         real(wp), intent(inout), contiguous :: column(:, :)
         type(layout_t), intent(in) :: layout
         real(wp), intent(in) :: time_step
         integer, intent(in) :: first, last
         type(lane_t), intent(inout) :: lane
      end subroutine flow_interface
   end interface

contains

   pure logical function for_large_strains(self)
      class(plastic_t), intent(in) :: self
      for_large_strains = .true.
   end function for_large_strains

   !> Plastic flow is isochoric: with several particles a cell the grid locks (theory.md, eq. anti-locking).
   pure function default_effect(self) result(name)
      class(plastic_t), intent(in) :: self
      character(len=:), allocatable :: name
      name = 'anti_locking'
   end function default_effect

   !> Equivalent plastic strain and plastic work. The stress does not determine the thickness of a particle
   !> that has flowed: with tools, which need it, the left Cauchy-Green tensor is carried too.
   pure subroutine declare_plastic(self, table, has_tools)
      class(plastic_t), intent(inout) :: self
      type(field_table_t), intent(inout) :: table
      logical, intent(in) :: has_tools
      call table%declare('plastic_strain', 1, '1', written=.true.)
      call table%declare('plastic_work', 1, 'J', written=.false., extensive=.true.)
      self%strain = table%column('plastic_strain')
      self%work = table%column('plastic_work')
      if (.not. has_tools) return
      call table%declare('left_cauchy_green', 6, '1', written=.false.)
      self%shape = table%column('left_cauchy_green')
   end subroutine declare_plastic

   !> The left Cauchy-Green tensor, if carried, starts as the identity.
   pure subroutine initial_plastic(self, column, layout, first, last)
      class(plastic_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      integer, intent(in) :: first, last
      if (self%shape > 0) column(first:last, self%shape:self%shape + 2) = 1.0_wp
   end subroutine initial_plastic

   !> Elastic trial step, then return to the yield surface.
   pure subroutine update_plastic(self, column, layout, gradient, time_step, first, last)
      class(plastic_t), intent(in) :: self
      real(wp), intent(inout), contiguous :: column(:, :)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      type(lane_t) :: lane
      integer :: from, to, p
      if (self%shape > 0) call follow_shape(self%shape, column, gradient, time_step, first, last)
      associate (s => layout%stress)
         do from = first, last, lanes
            to = min(from + lanes - 1, last)
            if (self%asks_begun) call measure(column, s, from, to, lane%begun)
            call self%elastic_t%update(column, layout, gradient, time_step, from, to)
            call measure(column, s, from, to, lane%trial)
            lane%strain = 0.0_wp
            lane%work = 0.0_wp
            call self%flow(column, layout, time_step, from, to, lane)
            if (all(lane%strain <= 0.0_wp)) cycle
            !$omp simd
            do p = from, to
               call return_along_deviator(3.0_wp*self%shear*lane%strain(p - from + 1), &
                                          lane%trial(p - from + 1), column(p, s), column(p, s + 1), &
                                          column(p, s + 2), column(p, s + 3), column(p, s + 4), &
                                          column(p, s + 5))
               column(p, self%strain) = column(p, self%strain) + lane%strain(p - from + 1)
               column(p, self%work) = column(p, self%work) + column(p, layout%volume)*lane%work(p - from + 1)
            end do
         end do
      end associate
   end subroutine update_plastic

   !> Von Mises stresses of particles first..last, whose stress begins at column s.
   pure subroutine measure(column, s, first, last, stress)
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: s, first, last
      real(wp), intent(inout) :: stress(lanes)
      integer :: p
      !$omp simd
      do p = first, last
         stress(p - first + 1) = von_mises(column(p, s), column(p, s + 1), column(p, s + 2), &
                                           column(p, s + 3), column(p, s + 4), column(p, s + 5))
      end do
   end subroutine measure

   !> Von Mises stress of a stress tensor, in its unit.
   pure elemental real(wp) function von_mises(xx, yy, zz, yz, xz, xy)
      real(wp), intent(in) :: xx, yy, zz, yz, xz, xy
      von_mises = sqrt(0.5_wp*((xx - yy)**2 + (yy - zz)**2 + (zz - xx)**2) + 3.0_wp*(yz**2 + xz**2 + xy**2))
   end function von_mises

   !> Reduce the deviator by the share drop/trial. Computed as a difference, it leaves a stress without flow
   !> unchanged, to the bit.
   pure elemental subroutine return_along_deviator(drop, trial, xx, yy, zz, yz, xz, xy)
      real(wp), intent(in) :: drop, trial
      real(wp), intent(inout) :: xx, yy, zz, yz, xz, xy
      real(wp) :: share, mean
      share = min(1.0_wp, drop/max(trial, tiny(trial)))
      mean = (xx + yy + zz)/3.0_wp
      xx = xx - share*(xx - mean)
      yy = yy - share*(yy - mean)
      zz = zz - share*(zz - mean)
      yz = yz - share*yz
      xz = xz - share*xz
      xy = xy - share*xy
   end subroutine return_along_deviator

   !> b <- (I + dt L) b (I + dt L)^T.
   pure subroutine follow_shape(b, column, gradient, time_step, first, last)
      integer, intent(in) :: b !< first column of the tensor
      real(wp), intent(inout), contiguous :: column(:, :)
      real(wp), intent(in), contiguous :: gradient(:, :)
      real(wp), intent(in) :: time_step
      integer, intent(in) :: first, last
      integer :: p
      !$omp simd
      do p = first, last
         call push_forward(time_step, gradient(p, 1), gradient(p, 2), gradient(p, 3), gradient(p, 4), &
                           gradient(p, 5), gradient(p, 6), gradient(p, 7), gradient(p, 8), gradient(p, 9), &
                           column(p, b), column(p, b + 1), column(p, b + 2), column(p, b + 3), &
                           column(p, b + 4), column(p, b + 5))
      end do
   end subroutine follow_shape

   !> One particle; scalars, so that the loop above is vectorised.
   pure elemental subroutine push_forward(dt, l11, l21, l31, l12, l22, l32, l13, l23, l33, xx, yy, zz, yz, &
                                          xz, xy)
      real(wp), intent(in) :: dt, l11, l21, l31, l12, l22, l32, l13, l23, l33
      real(wp), intent(inout) :: xx, yy, zz, yz, xz, xy
      real(wp) :: f11, f22, f33, f12, f21, f13, f31, f23, f32, t11, t21, t31, t12, t22, t32, t13, t23, t33
      f11 = 1.0_wp + dt*l11; f21 = dt*l21; f31 = dt*l31
      f12 = dt*l12; f22 = 1.0_wp + dt*l22; f32 = dt*l32
      f13 = dt*l13; f23 = dt*l23; f33 = 1.0_wp + dt*l33
      t11 = f11*xx + f12*xy + f13*xz; t12 = f11*xy + f12*yy + f13*yz; t13 = f11*xz + f12*yz + f13*zz
      t21 = f21*xx + f22*xy + f23*xz; t22 = f21*xy + f22*yy + f23*yz; t23 = f21*xz + f22*yz + f23*zz
      t31 = f31*xx + f32*xy + f33*xz; t32 = f31*xy + f32*yy + f33*yz; t33 = f31*xz + f32*yz + f33*zz
      xx = t11*f11 + t12*f12 + t13*f13
      yy = t21*f21 + t22*f22 + t23*f23
      zz = t31*f31 + t32*f32 + t33*f33
      yz = t21*f31 + t22*f32 + t23*f33
      xz = t11*f31 + t12*f32 + t13*f33
      xy = t11*f21 + t12*f22 + t13*f23
   end subroutine push_forward

   !> Sum of the plastic work, J.
   pure real(wp) function plastic_energy(self, column, first, last)
      class(plastic_t), intent(in) :: self
      real(wp), intent(in), contiguous :: column(:, :)
      integer, intent(in) :: first, last
      plastic_energy = sum(column(first:last, self%work))
   end function plastic_energy

   pure real(wp) function equivalent_plastic_strain(self, values) result(strain)
      class(plastic_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      strain = values(self%strain)
   end function equivalent_plastic_strain

   !> sqrt(n . b . n), as for a neo-Hookean particle: elastic and plastic stretch together. Without tools the
   !> stretch from the stress, up to a small plastic strain; beyond it huge.
   pure real(wp) function stretch(self, values, layout, direction)
      class(plastic_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      type(layout_t), intent(in) :: layout
      real(wp), intent(in) :: direction(3)
      if (self%shape > 0) then
         stretch = shape_stretch(values(self%shape:self%shape + 5), direction)
      else if (values(self%strain) <= hardly_plastic) then
         stretch = self%elastic_t%stretch(values, layout, direction)
      else
         stretch = huge(1.0_wp)
      end if
   end function stretch

   !> The largest principal value of b does not exceed its largest row sum (Gershgorin).
   pure real(wp) function max_stretch(self, values, layout)
      class(plastic_t), intent(in) :: self
      real(wp), intent(in) :: values(:)
      type(layout_t), intent(in) :: layout
      associate (b => values(self%shape:self%shape + 5))
         max_stretch = sqrt(max(b(1) + abs(b(5)) + abs(b(6)), b(2) + abs(b(4)) + abs(b(6)), &
                                 b(3) + abs(b(4)) + abs(b(5))))
      end associate
   end function max_stretch

   !> sqrt(n . b . n).
   pure real(wp) function shape_stretch(b, n)
      real(wp), intent(in) :: b(6), n(3)
      shape_stretch = sqrt(sum(b(1:3)*n**2) + 2.0_wp*(b(4)*n(2)*n(3) + b(5)*n(1)*n(3) + b(6)*n(1)*n(2)))
   end function shape_stretch

   pure logical function may_flow(self)
      class(plastic_t), intent(in) :: self
      may_flow = .true.
   end function may_flow

end module m_plastic
