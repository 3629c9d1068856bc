!> Variables of a group with words as values: texts, names, choices; integers from a list; number of values.
submodule (m_group_reader) m_group_words
   use m_namelist_group, only: entry_t
   use m_namelist_lines, only: text_line, words_line
   use m_synonyms, only: factor_of
   use m_schema_text, only: words_property, json_text
   implicit none

contains

   module procedure values_given
      integer :: found
      values_given = 0
      found = self%group%find_entry(name)
      if (found > 0) values_given = size(self%group%entries(found)%values)
   end procedure values_given

   module procedure check_count
      integer :: given
      good = .false.
      if (found == 0) return
      given = size(self%group%entries(found)%values)
      good = given == wanted
      if (.not. good) call self%refuse(self%group%entries(found)%name, expected//'; '//to_text(given)// &
                                       ' given'//unit_behind(self%group%entries(found)))
   end procedure check_count

   !> Message for a unit as last value: units are not written, and the value to write instead.
   function unit_behind(entry) result(text)
      type(entry_t), intent(in) :: entry
      character(len=:), allocatable :: text, unit
      real(wp) :: value
      integer :: fault
      text = ''
      if (size(entry%values) < 2 .or. any(entry%values%quoted)) return
      associate (last => size(entry%values))
         unit = entry%value_text(last)
         call read_real(entry%value_text(last - 1), value, fault)
         if (fault == number_good .and. factor_of(unit) > 0.0_wp) &
            text = in_si(value, unit, entry%value_text(last - 1)//' '//unit)
      end associate
   end function unit_behind

   module procedure note_unit
      character(len=:), allocatable :: word, unit
      real(wp) :: value
      integer :: length, fault
      text = ''
      word = trim(self%group%entries(found)%value_text(i))
      do length = len(word) - 1, 1, -1
         call read_real(word(:length), value, fault)
         if (fault /= number_good) cycle
         unit = trim(adjustl(word(length + 1:)))
         if (factor_of(unit) > 0.0_wp) text = in_si(value, unit, word)
         return
      end do
   end procedure note_unit

   function in_si(value, unit, shown) result(text)
      real(wp), intent(in) :: value
      character(len=*), intent(in) :: unit, shown
      character(len=:), allocatable :: text
      text = '; units are not written, all is in SI: '//to_text(value*factor_of(unit))//' for '//shown
      if (index(unit, 'deg') == 1) text = '; units are not written: '//to_text(value)//' for '//shown
   end function in_si

   module procedure begin_schema
      call self%begin()
      self%describing = .true.
      self%offer = ''
      self%properties = ''
      self%needed = ''
   end procedure begin_schema

   module procedure schema_text
      text = '{"type":"object","additionalProperties":false,"required":['//self%needed//'],"properties":{'// &
             self%properties//'}}'
   end procedure schema_text

   module procedure note
      character(len=:), allocatable :: key
      key = json_text(name)//':{'
      if (index(self%properties, new_line('a')//key) > 0) return
      if (self%properties /= '') self%properties = self%properties//','
      self%properties = self%properties//new_line('a')//key//property
      if (self%offer /= '') self%properties = self%properties//',"$comment":'//json_text('of '//self%offer)
      self%properties = self%properties//'}'
      if (.not. present(required) .or. self%offer /= '') return
      if (.not. required) return
      if (self%needed /= '') self%needed = self%needed//','
      self%needed = self%needed//json_text(name)
   end procedure note

   module procedure get_option
      character(len=:), allocatable :: expected
      integer :: found, new, i
      logical :: good
      expected = 'must be one of '//to_text(options(1))
      do i = 2, size(options)
         expected = expected//', '//to_text(options(i))
      end do
      found = self%look_up(name, expected)
      if (self%writes()) self%lines = self%lines//integer_line(name, value)
      if (self%describing) call self%note(name, integer_property(minval(options)))
      call self%check_count(found, 1, expected, good)
      if (.not. good) return
      call read_integer(self%group%entries(found)%value_text(1), new, good)
      if (.not. good .or. self%group%entries(found)%values(1)%quoted .or. .not. any(options == new)) then
         call self%refuse(name, expected)
      else
         value = new
      end if
   end procedure get_option

   module procedure get_text
      character(len=:), allocatable :: expected, text
      integer :: found
      logical :: good
      expected = 'must be a text in quotes, of 1 to '//to_text(longest)//' characters'
      found = self%look_up(name, expected, required)
      if (self%writes()) self%lines = self%lines//text_line(name, value)
      if (self%describing) call self%note(name, plain_property('string'), required)
      call self%check_count(found, 1, expected, good)
      if (.not. good) return
      text = trim(self%group%entries(found)%value_text(1))
      good = self%group%entries(found)%values(1)%quoted .and. len(text) > 0 .and. characters(text) <= longest
      if (good) value = text
      if (.not. good) call self%refuse(name, expected)
   end procedure get_text

   !> Number of characters of a UTF-8 text: bytes that do not continue one.
   pure integer function characters(text)
      character(len=*), intent(in) :: text
      integer :: i
      characters = count([(ichar(text(i:i)) < 128 .or. ichar(text(i:i)) >= 192, i=1, len(text))])
   end function characters

   module procedure get_name
      character(len=*), parameter :: allowed = 'abcdefghijklmnopqrstuvwxyz0123456789_-'
      character(len=:), allocatable :: expected, text
      integer :: found
      logical :: good
      expected = 'must be in quotes, of 1 to '//to_text(name_length)//' letters, digits, _ or -'
      found = self%look_up(name, expected, required)
      if (self%writes()) self%lines = self%lines//text_line(name, value)
      if (self%describing) call self%note(name, plain_property('string'), required)
      call self%check_count(found, 1, expected, good)
      if (.not. good) return
      text = self%group%entries(found)%value_text(1)
      good = self%group%entries(found)%values(1)%quoted .and. len(text) > 0 .and. len(text) <= name_length &
             .and. verify(lower_case(text), allowed) == 0
      if (good) value = text
      if (.not. good) call self%refuse(name, expected)
   end procedure get_name

   module procedure get_choices
      character(len=:), allocatable :: expected
      integer :: found, i
      logical :: good
      expected = 'must be in quotes, one of '//joined(words)
      if (size(values) > 1) expected = 'must be '//to_text(size(values))//' words in quotes, each one of '// &
                                       joined(words)
      found = self%look_up(name, expected, required)
      if (self%describing) call self%note(name, words_property(words, size(values), self%fewer), required)
      self%fewer = 0
      if (self%writes()) then
         self%lines = self%lines//words_line(name, words(values))
         return
      end if
      if (found == 0 .and. present(required)) then
         if (required) values = 0
      end if
      call self%check_count(found, size(values), expected, good)
      if (found > 0) self%choice = name//'='//self%group%entries(found)%shown
      if (found == 0 .and. values(1) > 0) self%choice = name//'='''//trim(words(values(1)))//''''
      if (found > 0 .and. .not. good) values = 0
      if (.not. good) return
      do i = 1, size(values)
         values(i) = self%word_index(found, i, words, expected)
      end do
   end procedure get_choices

   module procedure word_index
      character(len=:), allocatable :: word
      associate (entry => self%group%entries(found))
         word = lower_case(entry%value_text(i))
         do word_index = size(words), 1, -1
            if (word == lower_case(trim(words(word_index))) .and. entry%values(i)%quoted) return
         end do
         if (entry%values(i)%quoted) call self%refuse(entry%name, 'unknown '//entry%name//advice(word, words))
         call self%refuse(entry%name, expected)
      end associate
   end procedure word_index

   module procedure get_set
      character(len=:), allocatable :: expected
      integer :: found, i, k
      expected = 'must be words in quotes, each one of '//joined(words)
      found = self%look_up(name, expected)
      if (self%writes()) self%lines = self%lines//words_line(name, pack(words, chosen))
      if (self%describing) call self%note(name, words_property(words, 0, 0))
      if (found == 0) return
      chosen = .false.
      do i = 1, size(self%group%entries(found)%values)
         k = self%word_index(found, i, words, expected)
         if (k == 0) return
         if (chosen(k)) call self%refuse(name, expected//'; '//trim(words(k))//' given twice')
         chosen(k) = .true.
      end do
   end procedure get_set

end submodule m_group_words
