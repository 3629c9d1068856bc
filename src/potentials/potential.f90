!> Potentials between atoms of one element: pairs, and atoms embedded in the density of their neighbours,
!> E = sum_i F(rho_i) + sum_(i<j) phi(r_ij), rho_i = sum_j f(r_ij) (theory.md, eq. embedded). SI units.
module m_potential
   use m_kinds, only: wp
   use m_group_reader, only: group_reader_t
   use m_value_range, only: above
   use m_potential_file, only: potential_file_t, joule_per_ev
   use m_spline_table, only: spline_table_t
   implicit none
   private
   public :: pair_styles

   integer, parameter :: longest_path = 1000
   character(len=16), parameter :: pair_styles(5) = [character(len=16) :: 'eam/alloy', 'eam/fs', 'eam', &
                                                     'lj/cut', 'lj/smooth/linear']
   integer, parameter :: lj_cut = 4, lj_smooth = 5

   type, public :: potential_t
      integer :: style = 0                          !< among pair_styles
      character(len=:), allocatable :: file         !< as the scene names it
      character(len=:), allocatable :: path         !< where it was found
      character(len=:), allocatable :: checksum     !< of the file; empty: not known
      character(len=:), allocatable :: element      !< of a file that holds several
      real(wp) :: epsilon = 0.0_wp, sigma = 0.0_wp  !< of Lennard-Jones, J and m
      real(wp) :: cutoff = 0.0_wp                   !< m
      real(wp) :: mass = 0.0_wp                     !< of an atom by the file, kg; 0: it does not say
      real(wp) :: nominal = 0.0_wp                  !< constant of the lattice by the file, m; 0: the same
      logical :: embeds = .false.                   !< F and f are there
      logical :: good = .false.                     !< it can be evaluated
      real(wp) :: shift = 0.0_wp, tilt = 0.0_wp     !< of lj/smooth/linear: phi(cutoff), phi'(cutoff)
      type(spline_table_t) :: pair_r, density, embedding !< r phi(r), f(r), F(rho)
   contains
      procedure :: variables
      procedure :: pair
      procedure :: neighbour
      procedure :: embed
      procedure, private :: load
   end type potential_t

contains

   !> The variables of a potential in a group, by the names that LAMMPS has; the file is read.
   subroutine variables(self, group)
      class(potential_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      logical :: lj, writes
      if (.not. allocated(self%file)) self%file = ''
      if (.not. allocated(self%element)) self%element = ''
      if (.not. allocated(self%checksum)) self%checksum = ''
      if (self%style == 0) self%style = 1
      writes = group%is_writing()
      if (group%is_reading() .and. group%is_given('style')) call refuse_many_body(group)
      call group%get_choice('style', self%style, pair_styles)
      lj = self%style == lj_cut .or. self%style == lj_smooth
      if (.not. (writes .and. lj)) then
         call group%get_text('potential', self%file, longest_path, required=.not. lj)
         call group%get_text('element', self%element, longest_path, required=self%style == 1 .or. &
                             self%style == 2)
         if (.not. writes .or. self%checksum /= '') call group%get_text('checksum', self%checksum, &
                                                                        longest_path)
      end if
      call group%get('epsilon', self%epsilon, above(0.0_wp, 'J'), required=lj, used=lj)
      call group%get('sigma', self%sigma, above(0.0_wp, 'm'), required=lj, used=lj)
      call group%get('cutoff', self%cutoff, above(0.0_wp, 'm'), required=lj, used=lj)
      if (.not. group%is_reading()) return
      self%good = .false.
      if (lj) then
         call set_lj(self, group)
      else if (self%style > 0 .and. self%file /= '') then
         call self%load(group)
      end if
   end subroutine variables

   !> A potential of LAMMPS whose forces are not those of pairs: say why it is refused.
   subroutine refuse_many_body(group)
      type(group_reader_t), intent(inout) :: group
      character(len=11), parameter :: many_body(11) = [character(len=11) :: 'tersoff', 'tersoff/mod', &
                                                       'sw', 'meam', 'meam/c', 'meam/spline', 'adp', &
                                                       'airebo', 'rebo', 'reaxff', 'snap']
      character(len=:), allocatable :: word
      word = ''
      call group%get_text('style', word, longest_path)
      if (.not. any(many_body == word)) return
      call group%refuse('style', ''''//word//''' is not supported: its energy depends on the angles '// &
                        'between bonds, so that a bond across the interface has no force of its own, '// &
                        'with which to push the continuum; allowed: '//allowed())
   contains
      pure function allowed() result(text)
         character(len=:), allocatable :: text
         integer :: k
         text = trim(pair_styles(1))
         do k = 2, size(pair_styles)
            text = text//', '//trim(pair_styles(k))
         end do
      end function allowed
   end subroutine refuse_many_body

   !> Lennard-Jones: what belongs to it alone.
   subroutine set_lj(self, group)
      class(potential_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      real(wp) :: value, slope
      if (self%file /= '') call group%refuse('potential', 'belongs to styles eam, eam/alloy and eam/fs, '// &
                                             'which read a file')
      if (.not. min(self%epsilon, self%sigma, self%cutoff) > 0.0_wp) return
      if (self%cutoff < 1.5_wp*self%sigma) then
         call group%refuse('cutoff', 'must be a number, 1.5 sigma or more, in m')
         return
      end if
      self%good = .true.
      self%shift = 0.0_wp
      self%tilt = 0.0_wp
      if (self%style /= lj_smooth) return
      call self%pair(self%cutoff*(1.0_wp - epsilon(value)), value, slope)
      self%shift = value
      self%tilt = slope
   end subroutine set_lj

   !> Read the tables.
   subroutine load(self, group)
      class(potential_t), intent(inout) :: self
      type(group_reader_t), intent(inout) :: group
      type(potential_file_t) :: file
      character(len=:), allocatable :: fault, culprit
      call file%read(self%file, trim(pair_styles(self%style)), self%element, culprit, fault)
      if (fault /= '') then
         call group%refuse(culprit, fault)
         return
      end if
      if (self%checksum /= '' .and. self%checksum /= file%checksum) then
         call group%refuse('checksum', 'is '//self%checksum//', the file '//file%path//' has '// &
                           file%checksum//': it has been changed since the scene was made')
         return
      end if
      self%checksum = file%checksum
      self%path = file%path
      self%cutoff = file%cutoff
      self%mass = file%mass
      self%nominal = file%constant
      call self%embedding%set(file%density_spacing, file%embedding*joule_per_ev)
      call self%density%set(file%spacing, file%density)
      call self%pair_r%set(file%spacing, file%pair_r*joule_per_ev*1.0e-10_wp)
      self%embeds = .true.
      self%good = .true.
   end subroutine load

   !> phi (J) of two atoms at a distance, and its derivative (J/m).
   pure subroutine pair(self, r, value, slope)
      class(potential_t), intent(in) :: self
      real(wp), intent(in) :: r !< m
      real(wp), intent(out) :: value, slope
      real(wp) :: s6
      value = 0.0_wp
      slope = 0.0_wp
      if (r >= self%cutoff) return
      if (self%embeds) then
         call self%pair_r%evaluate(r, value, slope)
         value = value/r
         slope = (slope - value)/r
      else
         s6 = (self%sigma/r)**6
         value = 4.0_wp*self%epsilon*s6*(s6 - 1.0_wp) - self%shift - self%tilt*(r - self%cutoff)
         slope = 4.0_wp*self%epsilon*s6*(6.0_wp - 12.0_wp*s6)/r - self%tilt
      end if
   end subroutine pair

   !> f of a neighbour at a distance, and its derivative by it.
   pure subroutine neighbour(self, r, value, slope)
      class(potential_t), intent(in) :: self
      real(wp), intent(in) :: r !< m
      real(wp), intent(out) :: value, slope
      value = 0.0_wp
      slope = 0.0_wp
      if (self%embeds .and. r < self%cutoff) call self%density%evaluate(r, value, slope)
   end subroutine neighbour

   !> F (J) of an atom in a density, and its derivative.
   pure subroutine embed(self, density, value, slope)
      class(potential_t), intent(in) :: self
      real(wp), intent(in) :: density
      real(wp), intent(out) :: value, slope
      value = 0.0_wp
      slope = 0.0_wp
      if (self%embeds) call self%embedding%evaluate(max(density, 0.0_wp), value, slope)
   end subroutine embed

end module m_potential
