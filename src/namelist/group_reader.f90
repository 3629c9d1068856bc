!> Typed access to the variables of one group: each variable has one call, which sets what is allowed. After
!> `begin_text` the same calls write the values passed to them: so one procedure a group both reads and writes
!> it. Reading continues after an error; `finish` reports the most important one: an unknown variable (often
!> the cause of a missing one), then one that does not belong to the choice made, then the first wrong value.
module m_group_reader
   use m_kinds, only: wp
   use m_constants, only: exit_input
   use m_errors, only: error_t, fail
   use m_namelist_group, only: group_t
   use m_namelist_lines, only: reals_line, integer_line, logical_line
   use m_number_text, only: read_real, read_integer, number_good, number_infinite, number_size
   use m_schema_text, only: number_property, integer_property, plain_property
   use m_text, only: to_text
   use m_value_range, only: range_t
   use m_words, only: lower_case, advice, joined
   implicit none
   private

   integer, parameter, public :: name_length = 64 !< characters of a name used in file names
   integer, parameter :: max_known = 240         !< variables of a group, including those of other choices

   !> A group being read or written.
   type, public :: group_reader_t
      private
      type(group_t) :: group
      integer :: count = 0                                   !< variables looked up so far
      character(len=name_length) :: known(max_known) = ''   !< their names
      logical :: used(max_known) = .true.                   !< whether each belongs to the choice made
      character(len=name_length) :: choices(max_known) = '' !< the choice each belongs to, as shape='box'
      character(len=name_length) :: choice = ''              !< the last choice made
      logical :: set_aside = .false. !< variables looked up belong to a choice that was not made
      logical :: writing = .false.
      character(len=:), allocatable :: lines                 !< lines written so far
      type(error_t) :: first_fault
      logical :: describing = .false.            !< schema properties are being made: these, of this offer
      character(len=:), allocatable :: properties, needed, offer
      integer, public :: fewer = 0               !< above 0: the next variable may have this number of values
                                                 !< instead
   contains
      procedure :: begin
      procedure :: begin_text
      procedure :: begin_schema
      procedure :: schema_text
      procedure :: text => written_text
      procedure :: others
      procedure :: finish
      procedure :: names
      procedure :: is_given
      procedure :: values_given
      procedure :: is_writing
      procedure :: is_reading
      procedure :: refuse
      generic :: get => get_real, get_reals, get_integer, get_logical
      procedure :: get_list
      procedure :: get_text
      procedure :: get_set
      procedure :: get_name
      procedure :: get_choice
      procedure :: get_choices
      procedure :: get_option
      procedure, private :: get_real, get_reals, get_integer, get_logical
      procedure, private :: look_up
      procedure, private :: note
      procedure, private :: writes
      procedure, private :: check_count
      procedure, private :: number
      procedure, private :: word_index
      procedure, private :: note_unit
   end type group_reader_t

   interface
      !> Switch to a schema: variables become properties, and the group an object of a JSON Schema
      !> (schema_text).
      module subroutine begin_schema(self)
         class(group_reader_t), intent(out) :: self
      end subroutine begin_schema
      module function schema_text(self) result(text)
         class(group_reader_t), intent(in) :: self
         character(len=:), allocatable :: text
      end function schema_text
      module subroutine note(self, name, property, required)
         class(group_reader_t), intent(inout) :: self
         character(len=*), intent(in) :: name, property
         logical, intent(in), optional :: required
      end subroutine note
      !> Number of values given for a variable.
      pure module integer function values_given(self, name)
         class(group_reader_t), intent(in) :: self
         character(len=*), intent(in) :: name
      end function values_given
      !> Refuse a number of values other than `wanted`.
      module subroutine check_count(self, found, wanted, expected, good)
         class(group_reader_t), intent(inout) :: self
         integer, intent(in) :: found, wanted
         character(len=*), intent(in) :: expected
         logical, intent(out) :: good
      end subroutine check_count
      !> Message for a number with its unit in one value, as 210GPa or '210 GPa': units are not written, and
      !> the value to write instead.
      module function note_unit(self, found, i) result(text)
         class(group_reader_t), intent(in) :: self
         integer, intent(in) :: found, i
         character(len=:), allocatable :: text
      end function note_unit
      module subroutine get_option(self, name, value, options)
         class(group_reader_t), intent(inout) :: self
         character(len=*), intent(in) :: name
         integer, intent(inout) :: value
         integer, intent(in) :: options(:)
      end subroutine get_option
      !> A text of 1 to `longest` characters.
      module subroutine get_text(self, name, value, longest, required)
         class(group_reader_t), intent(inout) :: self
         character(len=*), intent(in) :: name
         character(len=:), allocatable, intent(inout) :: value
         integer, intent(in) :: longest
         logical, intent(in), optional :: required
      end subroutine get_text
      !> A name that can be part of a file name; `value` is the default on entry.
      module subroutine get_name(self, name, value, required)
         class(group_reader_t), intent(inout) :: self
         character(len=*), intent(in) :: name
         character(len=:), allocatable, intent(inout) :: value
         logical, intent(in), optional :: required
      end subroutine get_name
      !> As get_choice, for the number of words in `values`.
      module subroutine get_choices(self, name, values, words, required)
         class(group_reader_t), intent(inout) :: self
         character(len=*), intent(in) :: name
         integer, intent(inout) :: values(:)
         character(len=*), intent(in) :: words(:)
         logical, intent(in), optional :: required
      end subroutine get_choices
      !> Index of the i-th value among the words; 0 and an error if it is none of them.
      module integer function word_index(self, found, i, words, expected)
         class(group_reader_t), intent(inout) :: self
         integer, intent(in) :: found, i
         character(len=*), intent(in) :: words(:)
         character(len=*), intent(in) :: expected
      end function word_index
      !> As get_choices, for one or more of the words, each at most once.
      module subroutine get_set(self, name, chosen, words)
         class(group_reader_t), intent(inout) :: self
         character(len=*), intent(in) :: name
         logical, intent(inout) :: chosen(:)
         character(len=*), intent(in) :: words(:)
      end subroutine get_set
   end interface

contains

   !> Begin reading a group. Without one, an empty group: calls then only record which variables are known.
   subroutine begin(self, group)
      class(group_reader_t), intent(out) :: self
      type(group_t), intent(in), optional :: group
      self%group%name = ''
      allocate (self%group%entries(0))
      if (present(group)) self%group = group
   end subroutine begin

   !> Write a group instead of reading one.
   subroutine begin_text(self, name)
      class(group_reader_t), intent(out) :: self
      character(len=*), intent(in) :: name
      call self%begin()
      self%group%name = name
      self%writing = .true.
      self%lines = ''
   end subroutine begin_text

   !> The text of the group written.
   function written_text(self) result(text)
      class(group_reader_t), intent(in) :: self
      character(len=:), allocatable :: text
      text = '&'//self%group%name//new_line('a')//self%lines//'/'//new_line('a')
   end function written_text

   !> Set while variables belong to choices that the scene has not made: their names are known, but must not
   !> be used.
   subroutine others(self, set_aside, name)
      class(group_reader_t), intent(inout) :: self
      logical, intent(in) :: set_aside
      character(len=*), intent(in), optional :: name !< of the choice
      self%set_aside = set_aside
      self%offer = ''
      if (present(name)) self%offer = name
   end subroutine others

   !> True when the value of a variable is to be written.
   pure logical function writes(self, used)
      class(group_reader_t), intent(in) :: self
      logical, intent(in), optional :: used
      writes = self%writing .and. .not. self%set_aside
      if (writes .and. present(used)) writes = used
   end function writes

   !> After all variables: report the most important error, if any.
   subroutine finish(self, error)
      class(group_reader_t), intent(in) :: self
      type(error_t), intent(inout) :: error
      character(len=name_length), allocatable :: used(:)
      integer :: i, k
      used = pack(self%known(:self%count), self%used(:self%count))
      do i = 1, size(self%group%entries)
         associate (entry => self%group%entries(i))
            if (any(self%known(:self%count) == entry%name)) cycle
            call fail(error, exit_input, 'line '//to_text(entry%line)//', &'//self%group%name//' '// &
                      entry%name//': unknown variable'//advice(entry%name, used))
         end associate
      end do
      do i = 1, size(self%group%entries)
         do k = 1, self%count
            if (self%used(k) .or. self%known(k) /= self%group%entries(i)%name) cycle
            call fail(error, exit_input, self%group%entry_place(self%group%entries(i)%name)// &
                      ': not used with '//trim(self%choices(k))//'; allowed: '//joined(used))
         end do
      end do
      if (self%first_fault%happened()) call fail(error, self%first_fault%status, self%first_fault%message)
   end subroutine finish

   !> The variables looked up so far.
   function names(self) result(list)
      class(group_reader_t), intent(in) :: self
      character(len=name_length) :: list(self%count)
      list = self%known(:self%count)
   end function names

   !> True when values are being written, not read.
   pure logical function is_writing(self)
      class(group_reader_t), intent(in) :: self
      is_writing = self%writing
   end function is_writing

   !> True when values are being read, for a choice that the scene has made.
   pure logical function is_reading(self)
      class(group_reader_t), intent(in) :: self
      is_reading = .not. (self%writing .or. self%set_aside) .and. size(self%group%entries) > 0
   end function is_reading

   !> True when the scene sets a variable; false while writing.
   pure logical function is_given(self, name)
      class(group_reader_t), intent(in) :: self
      character(len=*), intent(in) :: name
      is_given = self%group%find_entry(name) > 0
   end function is_given

   !> Record an error in the value of a variable; the message begins with its position. Ignored while writing,
   !> and for choices that were not made.
   subroutine refuse(self, name, sentence)
      class(group_reader_t), intent(inout) :: self
      character(len=*), intent(in) :: name, sentence
      if (.not. (self%writing .or. self%set_aside)) &
         call fail(self%first_fault, exit_input, self%group%entry_place(name)//': '//sentence)
   end subroutine refuse

   !> Register a variable; its index in the group, or 0 when it is not given (an error if required). A
   !> variable known to several choices keeps its state for the one made.
   integer function look_up(self, name, expected, required, used) result(found)
      class(group_reader_t), intent(inout) :: self
      character(len=*), intent(in) :: name, expected
      logical, intent(in), optional :: required, used
      integer :: k
      found = 0
      k = findloc(self%known(:self%count) == name, .true., dim=1)
      if (k > 0 .and. self%set_aside) return
      if (k == 0) then
         self%count = self%count + 1
         k = self%count
         self%known(k) = name
      end if
      if (self%set_aside) then
         self%used(k) = .false.
         self%choices(k) = self%choice
         return
      end if
      found = self%group%find_entry(name)
      if (present(used)) then
         self%used(k) = used
         self%choices(k) = self%choice
         if (.not. used) found = 0
         if (.not. used) return
      end if
      if (self%writing .or. .not. present(required)) return
      if (required .and. found == 0) call self%refuse(name, 'missing; '//expected)
   end function look_up

   !> Read one number of a variable and check it.
   subroutine number(self, found, i, range, value, expected)
      class(group_reader_t), intent(inout) :: self
      integer, intent(in) :: found, i
      type(range_t), intent(in) :: range
      real(wp), intent(inout) :: value
      character(len=*), intent(in) :: expected
      real(wp) :: new
      integer :: fault
      associate (entry => self%group%entries(found))
         call read_real(entry%value_text(i), new, fault)
         if (entry%values(i)%quoted .or. .not. any(fault == [number_good, number_infinite, number_size])) then
            call self%refuse(entry%name, expected//self%note_unit(found, i))
         else if (fault == number_infinite) then
            call self%refuse(entry%name, spliced(expected, 'finite'))
         else if (fault == number_size) then
            call self%refuse(entry%name, expected//', of a size from 1e-100 to 1e100')
         else if (.not. range%holds(new)) then
            call self%refuse(entry%name, 'must be '//range%limits())
         else
            value = new
         end if
      end associate
   end subroutine number

   !> `must be a number ...` as `must be a finite number ...`.
   function spliced(expected, word) result(text)
      character(len=*), intent(in) :: expected, word
      character(len=:), allocatable :: text
      integer :: at
      at = index(expected, 'number')
      text = expected(:at - 1)//word//' '//expected(at:)
   end function spliced

   subroutine get_real(self, name, value, range, required, used)
      class(group_reader_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: value
      type(range_t), intent(in) :: range
      logical, intent(in), optional :: required, used
      character(len=:), allocatable :: expected
      integer :: found
      logical :: good
      expected = trim('must be a number '//range%limits())
      found = self%look_up(name, expected, required, used)
      if (self%writes(used)) self%lines = self%lines//reals_line(name, [value])
      if (self%describing) call self%note(name, number_property(range, 1, 0), required)
      call self%check_count(found, 1, expected, good)
      if (good) call self%number(found, 1, range, value, expected)
   end subroutine get_real

   !> The number of values in `values`, all required.
   subroutine get_reals(self, name, values, range, required, used)
      class(group_reader_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), intent(inout) :: values(:)
      type(range_t), intent(in) :: range
      logical, intent(in), optional :: required, used
      character(len=:), allocatable :: expected
      integer :: found, i
      logical :: good
      expected = trim('must be '//to_text(size(values))//' numbers '//range%limits())
      found = self%look_up(name, expected, required, used)
      if (self%writes(used)) self%lines = self%lines//reals_line(name, values)
      if (self%describing) call self%note(name, number_property(range, size(values), self%fewer), &
                                          required)
      self%fewer = 0
      call self%check_count(found, size(values), expected, good)
      if (.not. good) return
      do i = 1, size(values)
         call self%number(found, i, range, values(i), expected)
      end do
   end subroutine get_reals

   !> Any number of values, at least one if required.
   subroutine get_list(self, name, values, range, required, used)
      class(group_reader_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      real(wp), allocatable, intent(inout) :: values(:)
      type(range_t), intent(in) :: range
      logical, intent(in), optional :: required, used
      character(len=:), allocatable :: expected
      integer :: found, i
      expected = trim('must be numbers '//range%limits())
      found = self%look_up(name, expected, required, used)
      if (self%writes(used) .and. allocated(values)) self%lines = self%lines//reals_line(name, values)
      if (self%describing) call self%note(name, number_property(range, 0, 0), required)
      if (found == 0) return
      values = [(0.0_wp, i=1, size(self%group%entries(found)%values))]
      do i = 1, size(values)
         call self%number(found, i, range, values(i), expected)
      end do
   end subroutine get_list

   !> An integer, at least `least`.
   subroutine get_integer(self, name, value, least, required, used)
      class(group_reader_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(inout) :: value
      integer, intent(in) :: least
      logical, intent(in), optional :: required, used
      character(len=:), allocatable :: expected
      integer :: found, new
      logical :: good
      expected = 'must be a whole number, at least '//to_text(least)
      found = self%look_up(name, expected, required, used)
      if (self%writes(used)) self%lines = self%lines//integer_line(name, value)
      if (self%describing) call self%note(name, integer_property(least), required)
      call self%check_count(found, 1, expected, good)
      if (.not. good) return
      call read_integer(self%group%entries(found)%value_text(1), new, good)
      if (.not. good .or. self%group%entries(found)%values(1)%quoted .or. new < least) then
         call self%refuse(name, expected)
      else
         value = new
      end if
   end subroutine get_integer

   !> True or false, as Fortran writes it: .true., true, .t. or t.
   subroutine get_logical(self, name, value)
      class(group_reader_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      logical, intent(inout) :: value
      character(len=*), parameter :: yes(4) = [character(len=7) :: '.true.', 'true', '.t.', 't']
      character(len=*), parameter :: no(4) = [character(len=7) :: '.false.', 'false', '.f.', 'f']
      character(len=*), parameter :: expected = 'must be .true. or .false.'
      character(len=:), allocatable :: word
      integer :: found
      logical :: good
      found = self%look_up(name, expected)
      if (self%writes()) self%lines = self%lines//logical_line(name, value)
      if (self%describing) call self%note(name, plain_property('boolean'))
      call self%check_count(found, 1, expected, good)
      if (.not. good) return
      word = lower_case(self%group%entries(found)%value_text(1))
      if (self%group%entries(found)%values(1)%quoted .or. .not. (any(yes == word) .or. any(no == word))) then
         call self%refuse(name, expected)
      else
         value = any(yes == word)
      end if
   end subroutine get_logical

   !> The index of one of the words. Unchanged when not given, 0 when the word is unknown.
   subroutine get_choice(self, name, value, words, required)
      class(group_reader_t), intent(inout) :: self
      character(len=*), intent(in) :: name
      integer, intent(inout) :: value
      character(len=*), intent(in) :: words(:)
      logical, intent(in), optional :: required
      integer :: values(1)
      values = value
      call self%get_choices(name, values, words, required)
      value = values(1)
   end subroutine get_choice

end module m_group_reader
