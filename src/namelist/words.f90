!> Words of a scene: case, lists, and the nearest of several names.
module m_words
   use m_synonyms, only: meant
   implicit none
   private
   public :: lower_case, joined, advice, nearest_word, edit_distance

   integer, parameter :: longest = 64 !< of a word that is compared

contains

   !> The text with A-Z as a-z.
   pure function lower_case(text) result(lower)
      character(len=*), intent(in) :: text
      character(len=len(text)) :: lower
      integer :: i
      lower = text
      do i = 1, len(text)
         if (text(i:i) >= 'A' .and. text(i:i) <= 'Z') lower(i:i) = achar(iachar(text(i:i)) + 32)
      end do
   end function lower_case

   !> The words of a list, as `a, b, c`.
   pure function joined(words) result(text)
      character(len=*), intent(in) :: words(:)
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, size(words)
         if (i > 1) text = text//', '
         text = text//trim(words(i))
      end do
   end function joined

   !> Suggestion for an unknown word: `; nearest: young; allowed: name, density, young`. A synonym from other
   !> programs comes before a word of similar spelling: `; meant: tool`.
   pure function advice(word, allowed) result(text)
      character(len=*), intent(in) :: word
      character(len=*), intent(in) :: allowed(:)
      character(len=:), allocatable :: text
      integer :: nearest
      text = ''
      text = meant(lower_case(word), allowed)
      if (text /= '') then
         text = '; '//text
      else
         nearest = nearest_word(word, allowed)
         if (nearest > 0) text = '; nearest: '//trim(allowed(nearest))
      end if
      text = text//'; allowed: '//joined(allowed)
   end function advice

   !> Index of the word with the smallest edit distance; 0 if none is similar: more than half of the letters
   !> would change, and none is part of the other.
   pure integer function nearest_word(word, allowed) result(nearest)
      character(len=*), intent(in) :: word
      character(len=*), intent(in) :: allowed(:)
      integer :: i, distance, smallest
      nearest = 0
      smallest = huge(smallest)
      do i = 1, size(allowed)
         distance = edit_distance(lower_case(word), lower_case(trim(allowed(i))))
         if (distance >= smallest) cycle
         if (2*distance > max(len(word), len_trim(allowed(i))) .and. .not. is_part(word, allowed(i))) cycle
         smallest = distance
         nearest = i
      end do
   end function nearest_word

   !> True when one of two words of three letters or more is part of the other.
   pure logical function is_part(a, b)
      character(len=*), intent(in) :: a, b
      is_part = .false.
      if (min(len_trim(a), len_trim(b)) < 3) return
      is_part = index(lower_case(trim(a)), lower_case(trim(b))) > 0 .or. &
                index(lower_case(trim(b)), lower_case(trim(a))) > 0
   end function is_part

   !> Letters to insert, delete or change to turn one word into another (Levenshtein); of long words only the
   !> beginnings are compared.
   pure integer function edit_distance(a, b) result(distance)
      character(len=*), intent(in) :: a, b
      integer :: row(0:longest), i, j, corner, above
      integer :: length_a, length_b
      length_a = min(len(a), longest)
      length_b = min(len(b), longest)
      row = [(j, j=0, longest)]
      do i = 1, length_a
         corner = row(0)
         row(0) = i
         do j = 1, length_b
            above = row(j)
            row(j) = min(above + 1, row(j - 1) + 1, corner + merge(0, 1, a(i:i) == b(j:j)))
            corner = above
         end do
      end do
      distance = row(length_b)
   end function edit_distance

end module m_words
