!> Files of embedded-atom potentials as LAMMPS reads them: funcfl (style eam) and setfl (eam/alloy, eam/fs).
module m_potential_file
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use m_kinds, only: wp
   use m_checksum, only: text_checksum
   use m_filesystem, only: never_ends, read_file
   use m_text, only: to_text
   implicit none
   private

   real(wp), parameter, public :: joule_per_ev = 1.602176634e-19_wp
   real(wp), parameter, public :: kg_per_u = 1.66053906660e-27_wp
   integer, parameter :: longest_file = 200*1024*1024 !< bytes
   integer, parameter :: max_points = 10000000      !< of a table
   character(len=*), parameter :: usual_place = '/usr/share/lammps/potentials'
   real(wp), parameter :: hartree = 27.2_wp, bohr = 0.529_wp !< eV, angstrom, as funcfl files mean them

   !> The functions of one element, in eV and angstrom (tables); lengths of their own in m, masses in kg.
   type, public :: potential_file_t
      character(len=:), allocatable :: path, checksum
      real(wp) :: mass = 0.0_wp, constant = 0.0_wp, cutoff = 0.0_wp
      real(wp) :: spacing = 0.0_wp         !< of distances, m
      real(wp) :: density_spacing = 0.0_wp !< of densities
      real(wp), allocatable :: embedding(:), density(:), pair_r(:) !< F(rho), f(r), r phi(r)
   contains
      procedure :: read => read_potential
      procedure, private :: read_setfl
      procedure, private :: read_funcfl
      procedure, private :: read_header
   end type potential_file_t

   !> A text and how far it has been read.
   type :: reading_t
      character(len=:), allocatable :: text
      integer :: at = 1
      logical :: failed = .false.
   contains
      procedure :: line
      procedure :: word
      procedure :: number
      procedure :: table
   end type reading_t

contains

   !> Read the file: by its name as it stands, else where LAMMPS_POTENTIALS says, else where Debian has
   !> LAMMPS's. What is wrong is said of the variable `culprit`, as what follows its name.
   subroutine read_potential(self, name, style, element, culprit, fault)
      class(potential_file_t), intent(out) :: self
      character(len=*), intent(in) :: name, style, element
      character(len=:), allocatable, intent(out) :: culprit, fault
      type(reading_t) :: reading
      logical :: ok
      culprit = 'potential'
      fault = ''
      call find_file(name, self%path, ok)
      if (.not. ok) then
         fault = 'cannot be read; allowed: a file of style '//style//', in the directory in which the '// &
                 'program was started, in that of LAMMPS_POTENTIALS, or in '//usual_place
         return
      end if
      call read_file(self%path, longest_file, reading%text, ok)
      if (.not. ok .or. len(reading%text) > longest_file) then
         fault = 'cannot be read; allowed: a file of style '//style//' of at most 200 MB'
         return
      end if
      self%checksum = text_checksum(reading%text)
      if (style == 'eam') then
         call self%read_funcfl(reading)
      else
         call self%read_setfl(reading, style == 'eam/fs', element, fault)
         if (fault /= '') culprit = 'element'
         if (fault /= '') return
      end if
      if (reading%failed) fault = 'is no file of style '//style//' (it was read as far as byte '// &
                                  to_text(reading%at)//'); allowed: '//form_of(style)
   end subroutine read_potential

   pure function form_of(style) result(form)
      character(len=*), intent(in) :: style
      character(len=:), allocatable :: form
      form = 'DYNAMO''s setfl format'
      if (style == 'eam') form = 'DYNAMO''s funcfl format'
      if (style == 'eam/fs') form = 'the setfl format of Finnis-Sinclair potentials'
   end function form_of

   subroutine find_file(name, path, ok)
      character(len=*), intent(in) :: name
      character(len=:), allocatable, intent(out) :: path
      logical, intent(out) :: ok
      character(len=4096) :: place
      path = name
      inquire (file=path, exist=ok)
      if (ok) ok = .not. never_ends(path)
      if (ok .or. index(name, '/') > 0) return
      call get_environment_variable('LAMMPS_POTENTIALS', place)
      if (place /= '') then
         path = trim(place)//'/'//name
         inquire (file=path, exist=ok)
         if (ok) return
      end if
      path = usual_place//'/'//name
      inquire (file=path, exist=ok)
   end subroutine find_file

   !> setfl: three lines of comment, the elements, the tables' sizes, F and f of each element, r phi of each
   !> pair.
   subroutine read_setfl(self, reading, finnis_sinclair, element, fault)
      class(potential_file_t), intent(inout) :: self
      type(reading_t), intent(inout) :: reading
      logical, intent(in) :: finnis_sinclair
      character(len=*), intent(in) :: element
      character(len=:), allocatable, intent(inout) :: fault
      character(len=:), allocatable :: list, name
      real(wp), allocatable :: values(:)
      integer :: elements, own, e, k, radii, densities
      call reading%line(list); call reading%line(list); call reading%line(list)
      elements = nint(min(max(reading%number(), 0.0_wp), 1.0e3_wp))
      reading%failed = reading%failed .or. elements < 1
      if (reading%failed) return
      own = 0
      list = ''
      do e = 1, elements
         call reading%word(name)
         if (name == element) own = e
         list = list//', '//name
      end do
      if (own == 0) then
         fault = 'is not in the file; allowed: '//list(3:)
         return
      end if
      call self%read_header(reading, densities, radii)
      if (reading%failed) return
      do e = 1, elements
         call read_element(self, reading, e == own)
         call reading%table(densities, values)
         if (e == own) self%embedding = values
         do k = 1, merge(elements, 1, finnis_sinclair)
            call reading%table(radii, values)
            if (e == own .and. (k == own .or. .not. finnis_sinclair)) self%density = values
         end do
         if (reading%failed) return
      end do
      do e = 1, elements
         do k = 1, e
            call reading%table(radii, values)
            if (reading%failed) return
            if (e == own .and. k == own) self%pair_r = values
         end do
      end do
   end subroutine read_setfl

   !> funcfl: a comment, the element, the tables' sizes, F, the effective charge Z and f; r phi = Z^2 in
   !> atomic units.
   subroutine read_funcfl(self, reading)
      class(potential_file_t), intent(inout) :: self
      type(reading_t), intent(inout) :: reading
      character(len=:), allocatable :: comment
      real(wp), allocatable :: charge(:)
      integer :: radii, densities
      call reading%line(comment)
      call read_element(self, reading, .true.)
      call self%read_header(reading, densities, radii)
      call reading%table(densities, self%embedding)
      call reading%table(radii, charge)
      call reading%table(radii, self%density)
      if (.not. reading%failed) self%pair_r = hartree*bohr*charge**2
   end subroutine read_funcfl

   !> Atomic number, mass, constant and name of the lattice.
   subroutine read_element(self, reading, own)
      class(potential_file_t), intent(inout) :: self
      type(reading_t), intent(inout) :: reading
      logical, intent(in) :: own
      character(len=:), allocatable :: rest
      real(wp) :: atomic, mass, constant
      atomic = reading%number()
      mass = reading%number()
      constant = reading%number()
      call reading%line(rest) ! the lattice
      reading%failed = reading%failed .or. .not. mass > 0.0_wp
      if (.not. own) return
      self%mass = mass*kg_per_u
      self%constant = constant*1.0e-10_wp
   end subroutine read_element

   !> How many values the tables have, and how far apart.
   subroutine read_header(self, reading, densities, radii)
      class(potential_file_t), intent(inout) :: self
      type(reading_t), intent(inout) :: reading
      integer, intent(out) :: densities, radii
      character(len=:), allocatable :: rest
      real(wp) :: sizes(2)
      sizes(1) = reading%number()
      self%density_spacing = reading%number()
      sizes(2) = reading%number()
      self%spacing = reading%number()*1.0e-10_wp
      self%cutoff = reading%number()*1.0e-10_wp
      call reading%line(rest)
      densities = 0
      radii = 0
      if (.not. (all(sizes >= 5.0_wp .and. sizes <= real(max_points, wp)) .and. &
                 min(self%density_spacing, self%spacing, self%cutoff) > 0.0_wp)) reading%failed = .true.
      if (reading%failed) return
      densities = nint(sizes(1))
      radii = nint(sizes(2))
      if (self%cutoff > radii*self%spacing*(1.0_wp + 1.0e-6_wp)) reading%failed = .true.
   end subroutine read_header

   !> The rest of a line.
   subroutine line(self, text)
      class(reading_t), intent(inout) :: self
      character(len=:), allocatable, intent(out) :: text
      integer :: length
      text = ''
      if (self%at > len(self%text)) self%failed = .true.
      if (self%failed) return
      length = index(self%text(self%at:), achar(10)) - 1
      if (length < 0) length = len(self%text) - self%at + 1
      text = self%text(self%at:self%at + length - 1)
      self%at = self%at + length + 1
   end subroutine line

   !> The next word; empty, and failed, at the end.
   subroutine word(self, text)
      class(reading_t), intent(inout) :: self
      character(len=:), allocatable, intent(out) :: text
      character(len=*), parameter :: gaps = ' '//achar(9)//achar(10)//achar(13)
      integer :: first, length
      text = ''
      if (self%failed .or. self%at > len(self%text)) then
         self%failed = .true.
         return
      end if
      first = verify(self%text(self%at:), gaps)
      if (first == 0) then
         self%failed = .true.
         return
      end if
      self%at = self%at + first - 1
      length = scan(self%text(self%at:), gaps) - 1
      if (length < 0) length = len(self%text) - self%at + 1
      text = self%text(self%at:self%at + length - 1)
      self%at = self%at + length
   end subroutine word

   !> The next word as a number.
   real(wp) function number(self)
      class(reading_t), intent(inout) :: self
      character(len=:), allocatable :: text
      integer :: status
      number = 0.0_wp
      call self%word(text)
      if (self%failed) return
      if (verify(text, '0123456789+-.eEdD') > 0) self%failed = .true.
      if (self%failed) return
      read (text, *, iostat=status) number
      if (status /= 0) self%failed = .true.
      if (.not. ieee_is_finite(number)) self%failed = .true.
   end function number

   !> As many numbers.
   subroutine table(self, count, values)
      class(reading_t), intent(inout) :: self
      integer, intent(in) :: count
      real(wp), allocatable, intent(out) :: values(:)
      integer :: k
      allocate (values(count))
      do k = 1, count
         values(k) = self%number()
         if (self%failed) return
      end do
   end subroutine table

end module m_potential_file
