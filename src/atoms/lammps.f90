!> LAMMPS as a library that is opened while the program runs, through its C interface (library.h): nothing of
!> it is linked. Where it is not there, one sentence says so.
module m_lammps
   use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_double, c_f_pointer, &
      c_f_procpointer, c_funptr, c_int, c_loc, c_null_char, c_null_ptr, c_ptr
   use mpi_f08, only: MPI_Comm
   use m_kinds, only: wp
   use m_constants, only: exit_numerical
   use m_dynamic_library, only: find_procedure
   use m_foreign_call, only: begin_foreign_call, describe_foreign_code, end_foreign_call, name_foreign_code
   implicit none
   private

   character(len=*), parameter, public :: usual_library = 'liblammps.so.0'
   integer, parameter :: longest_message = 1024, longest_argument = 16

   abstract interface
      type(c_ptr) function open_interface(argc, argv, comm) bind(c)
         import :: c_ptr, c_int
         integer(c_int), value :: argc, comm
         type(c_ptr), intent(in) :: argv(*)
      end function open_interface
      subroutine handle_interface(handle) bind(c)
         import :: c_ptr
         type(c_ptr), value :: handle
      end subroutine handle_interface
      type(c_ptr) function text_interface(handle, text) bind(c)
         import :: c_ptr, c_char
         type(c_ptr), value :: handle
         character(kind=c_char), intent(in) :: text(*)
      end function text_interface
      real(c_double) function number_interface(handle, text) bind(c)
         import :: c_ptr, c_char, c_double
         type(c_ptr), value :: handle
         character(kind=c_char), intent(in) :: text(*)
      end function number_interface
      integer(c_int) function setting_interface(handle, text) bind(c)
         import :: c_ptr, c_char, c_int
         type(c_ptr), value :: handle
         character(kind=c_char), intent(in) :: text(*)
      end function setting_interface
      integer(c_int) function count_interface(handle) bind(c)
         import :: c_ptr, c_int
         type(c_ptr), value :: handle
      end function count_interface
      integer(c_int) function message_interface(handle, buffer, size) bind(c)
         import :: c_ptr, c_char, c_int
         type(c_ptr), value :: handle
         character(kind=c_char), intent(inout) :: buffer(*)
         integer(c_int), value :: size
      end function message_interface
      integer(c_int) function create_interface(handle, n, id, kind, x, v, image, expand) bind(c)
         import :: c_ptr, c_int, c_double
         type(c_ptr), value :: handle, v, image
         integer(c_int), value :: n, expand
         integer(c_int), intent(in) :: id(*), kind(*)
         real(c_double), intent(in) :: x(*)
      end function create_interface
      type(c_ptr) function compute_interface(handle, id, style, kind) bind(c)
         import :: c_ptr, c_char, c_int
         type(c_ptr), value :: handle
         character(kind=c_char), intent(in) :: id(*)
         integer(c_int), value :: style, kind
      end function compute_interface
      subroutine callback_interface(handle, id, procedure, context) bind(c)
         import :: c_ptr, c_funptr, c_char
         type(c_ptr), value :: handle, context
         type(c_funptr), value :: procedure
         character(kind=c_char), intent(in) :: id(*)
      end subroutine callback_interface
   end interface

   !> One LAMMPS of this rank.
   type, public :: lammps_t
      type(c_ptr) :: handle = c_null_ptr
      character(len=:), allocatable :: fault !< of the last command; empty: none
      integer(c_int), private :: code = 0    !< its number among foreign code
      procedure(open_interface), pointer, nopass, private :: c_open => null()
      procedure(handle_interface), pointer, nopass, private :: c_close => null()
      procedure(text_interface), pointer, nopass, private :: c_command => null(), c_atom => null()
      procedure(number_interface), pointer, nopass, private :: c_thermo => null()
      procedure(setting_interface), pointer, nopass, private :: c_setting => null()
      procedure(count_interface), pointer, nopass, private :: c_has_error => null(), c_version => null()
      procedure(message_interface), pointer, nopass, private :: c_message => null()
      procedure(create_interface), pointer, nopass, private :: c_create => null()
      procedure(compute_interface), pointer, nopass, private :: c_compute => null()
      procedure(callback_interface), pointer, nopass, private :: c_call_back => null()
   contains
      procedure :: load
      procedure :: start
      procedure :: command
      procedure :: thermo
      procedure :: setting
      procedure :: version
      procedure :: create
      procedure :: scalar
      procedure :: call_back
      procedure :: vectors
      procedure :: numbers
      procedure :: of_atoms
      procedure :: rows_of_atoms
      procedure :: finish
   end type lammps_t

contains

   !> Open the library. `complaint` is a clause about what is wrong; empty: it is there.
   subroutine load(self, library, complaint)
      class(lammps_t), intent(inout) :: self
      character(len=*), intent(in) :: library
      character(len=:), allocatable, intent(out) :: complaint
      procedure(open_interface), pointer :: open_it
      procedure(handle_interface), pointer :: close_it
      procedure(text_interface), pointer :: command_it, atom_of
      procedure(number_interface), pointer :: thermo_of
      procedure(setting_interface), pointer :: setting_of
      procedure(count_interface), pointer :: has_error, version_of
      procedure(message_interface), pointer :: message_of
      procedure(create_interface), pointer :: create_them
      procedure(compute_interface), pointer :: compute_of
      procedure(callback_interface), pointer :: set_call_back
      complaint = ''
      call c_f_procpointer(found('lammps_open_fortran'), open_it)
      if (complaint /= '') return
      call c_f_procpointer(found('lammps_close'), close_it)
      call c_f_procpointer(found('lammps_command'), command_it)
      call c_f_procpointer(found('lammps_extract_atom'), atom_of)
      call c_f_procpointer(found('lammps_get_thermo'), thermo_of)
      call c_f_procpointer(found('lammps_extract_setting'), setting_of)
      call c_f_procpointer(found('lammps_has_error'), has_error)
      call c_f_procpointer(found('lammps_version'), version_of)
      call c_f_procpointer(found('lammps_get_last_error_message'), message_of)
      call c_f_procpointer(found('lammps_create_atoms'), create_them)
      call c_f_procpointer(found('lammps_extract_compute'), compute_of)
      call c_f_procpointer(found('lammps_set_fix_external_callback'), set_call_back)
      self%c_open => open_it
      self%c_close => close_it
      self%c_command => command_it
      self%c_atom => atom_of
      self%c_thermo => thermo_of
      self%c_setting => setting_of
      self%c_has_error => has_error
      self%c_version => version_of
      self%c_message => message_of
      self%c_create => create_them
      self%c_compute => compute_of
      self%c_call_back => set_call_back
   contains
      type(c_funptr) function found(name) result(address)
         character(len=*), intent(in) :: name
         character(len=:), allocatable :: reason
         logical :: opened
         call find_procedure(library, name, address, opened, reason)
         if (reason == '' .or. complaint /= '') return
         if (opened) complaint = 'the library '//library//' has no '//name//', which LAMMPS of 2021 and '// &
                                 'later has'
         if (.not. opened) complaint = 'LAMMPS cannot be opened ('//reason//'); `make deps ATOMS=yes` '// &
                                       'installs it, as apt-get install liblammps0 lammps-data does'
      end function found
   end subroutine load

   !> Begin a LAMMPS that writes neither to the screen nor to a log.
   subroutine start(self, comm)
      class(lammps_t), intent(inout) :: self
      type(MPI_Comm), intent(in) :: comm
      character(kind=c_char, len=longest_argument), target :: words(6)
      type(c_ptr) :: arguments(7)
      integer :: k
      words = [character(len=longest_argument) :: 'lammps', '-log', 'none', '-screen', 'none', '-nocite']
      do k = 1, size(words)
         words(k) = trim(words(k))//c_null_char
         arguments(k) = c_loc(words(k))
      end do
      arguments(7) = c_null_ptr
      self%handle = self%c_open(6_c_int, arguments, int(comm%mpi_val, c_int))
      self%fault = ''
      if (.not. c_associated(self%handle)) self%fault = 'LAMMPS cannot be started'
      self%code = name_foreign_code('LAMMPS')
   end subroutine start

   !> One command of LAMMPS's input; after a fault nothing more is done. A LAMMPS that was built without
   !> exceptions ends the program in place of a fault: the sentence is m_foreign_call's then.
   subroutine command(self, text)
      class(lammps_t), intent(inout) :: self
      character(len=*), intent(in) :: text
      type(c_ptr) :: ignored
      character(kind=c_char, len=longest_message) :: message
      integer(c_int) :: kind
      integer :: length
      if (self%fault /= '') return
      call describe_foreign_code(self%code, 'LAMMPS, which was told `'//text//'`,')
      call begin_foreign_call(self%code, int(exit_numerical, c_int))
      ignored = self%c_command(self%handle, text//c_null_char)
      call end_foreign_call()
      if (self%c_has_error(self%handle) == 0) return
      message = ' '
      kind = self%c_message(self%handle, message, int(longest_message, c_int))
      length = index(message, c_null_char) - 1
      if (length < 0) length = len_trim(message)
      if (length > 0) then
         if (message(length:length) == achar(10)) length = length - 1
      end if
      self%fault = 'LAMMPS failed at `'//text//'`: '//message(:length)
   end subroutine command

   !> A quantity of the thermodynamic output (`pe`, `pxx`, ...), in LAMMPS's units.
   real(wp) function thermo(self, name)
      class(lammps_t), intent(in) :: self
      character(len=*), intent(in) :: name
      thermo = self%c_thermo(self%handle, name//c_null_char)
   end function thermo

   integer function setting(self, name)
      class(lammps_t), intent(in) :: self
      character(len=*), intent(in) :: name
      setting = self%c_setting(self%handle, name//c_null_char)
   end function setting

   !> The date of its release, as 20210929.
   integer function version(self)
      class(lammps_t), intent(in) :: self
      version = self%c_version(self%handle)
   end function version

   !> Put atoms with numbers 1 to n at places, of types; how many were taken.
   integer function create(self, types, places)
      class(lammps_t), intent(in) :: self
      integer, intent(in) :: types(:)
      real(wp), intent(in), contiguous :: places(:, :) !< (3, n), in LAMMPS's units
      integer(c_int), allocatable :: ids(:)
      integer :: k
      ids = [(int(k, c_int), k=1, size(types))]
      create = self%c_create(self%handle, size(types, kind=c_int), ids, int(types, c_int), places, &
                             c_null_ptr, c_null_ptr, 0_c_int)
   end function create

   !> The number that a compute makes of all atoms.
   real(wp) function scalar(self, id)
      class(lammps_t), intent(in) :: self
      character(len=*), intent(in) :: id
      real(c_double), pointer :: value
      call c_f_pointer(self%c_compute(self%handle, id//c_null_char, 0_c_int, 0_c_int), value)
      scalar = value
   end function scalar

   !> A `fix external` calls a procedure, with a context, when the forces of a step are known.
   subroutine call_back(self, id, procedure, context)
      class(lammps_t), intent(in) :: self
      character(len=*), intent(in) :: id
      type(c_funptr), intent(in) :: procedure
      type(c_ptr), intent(in) :: context
      call self%c_call_back(self%handle, id//c_null_char, procedure, context)
   end subroutine call_back

   !> A vector of each atom of this rank (`x`, `v`, `f`), in LAMMPS's own memory and order: (3, atoms). Valid
   !> until the next command.
   subroutine vectors(self, name, values)
      class(lammps_t), intent(in) :: self
      character(len=*), intent(in) :: name
      real(c_double), pointer, intent(out) :: values(:, :)
      type(c_ptr), pointer :: rows(:)
      type(c_ptr) :: address
      integer :: n
      n = self%setting('nlocal')
      values => null()
      address = self%c_atom(self%handle, name//c_null_char)
      if (n < 1 .or. .not. c_associated(address)) return
      call c_f_pointer(address, rows, [1])
      call c_f_pointer(rows(1), values, [3, n])
   end subroutine vectors

   !> A whole number of each atom of this rank (`id`, `type`), as above.
   subroutine numbers(self, name, values)
      class(lammps_t), intent(in) :: self
      character(len=*), intent(in) :: name
      integer(c_int), pointer, intent(out) :: values(:)
      type(c_ptr) :: address
      values => null()
      address = self%c_atom(self%handle, name//c_null_char)
      if (c_associated(address)) call c_f_pointer(address, values, [self%setting('nlocal')])
   end subroutine numbers

   !> The number that a compute makes of each atom of this rank. Valid until the next command.
   subroutine of_atoms(self, id, values)
      class(lammps_t), intent(in) :: self
      character(len=*), intent(in) :: id
      real(c_double), pointer, intent(out) :: values(:)
      type(c_ptr) :: address
      values => null()
      address = self%c_compute(self%handle, id//c_null_char, 1_c_int, 1_c_int)
      if (c_associated(address)) call c_f_pointer(address, values, [self%setting('nlocal')])
   end subroutine of_atoms

   !> The `columns` numbers that a compute makes of each atom, as above: (columns, atoms).
   subroutine rows_of_atoms(self, id, columns, values)
      class(lammps_t), intent(in) :: self
      character(len=*), intent(in) :: id
      integer, intent(in) :: columns
      real(c_double), pointer, intent(out) :: values(:, :)
      type(c_ptr), pointer :: rows(:)
      type(c_ptr) :: address
      values => null()
      address = self%c_compute(self%handle, id//c_null_char, 1_c_int, 2_c_int)
      if (.not. c_associated(address)) return
      call c_f_pointer(address, rows, [1])
      call c_f_pointer(rows(1), values, [columns, self%setting('nlocal')])
   end subroutine rows_of_atoms

   subroutine finish(self)
      class(lammps_t), intent(inout) :: self
      if (c_associated(self%handle)) call self%c_close(self%handle)
      self%handle = c_null_ptr
   end subroutine finish

end module m_lammps
