!> Closed surfaces with overlapping parts: shells that cut or contain each other, or one that cuts itself. A
!> volume enclosed twice, or with a negative sign, has no valid distance (theory.md, eq. pseudonormal).
module m_self_overlap
   use m_kinds, only: wp
   use m_triangles, only: triangles_t
   implicit none
   private
   public :: look_for_overlap

   integer, parameter :: columns = 160 !< number of lines along each of two axes; they run along the third
   !> Lines are offset from the midpoints of their cells, so that no edge along a plane of the file meets one.
   real(wp), parameter :: beside(2) = [0.5_wp + 0.0193741_wp, 0.5_wp - 0.0271653_wp]

   type :: crossings_t
      integer, allocatable :: first(:)  !< of each line's crossings
      real(wp), allocatable :: place(:) !< m, along the line
      integer, allocatable :: turn(:)   !< 1: into the surface; -1: out of it
   end type crossings_t

contains

   !> Volume inside, and the part of it that is enclosed more than once or where the surface is inside out,
   !> m3: by lines along the three axes.
   subroutine look_for_overlap(triangles, inside, wrong)
      type(triangles_t), intent(in) :: triangles
      real(wp), intent(out) :: inside, wrong
      type(crossings_t) :: found
      real(wp) :: lower(3), upper(3), width(2)
      integer :: axis, c, others(2)
      call triangles%bounds(lower, upper)
      inside = 0.0_wp
      wrong = 0.0_wp
      do axis = 1, 3
         others = [mod(axis, 3) + 1, mod(axis + 1, 3) + 1]
         width = (upper(others) - lower(others))/columns
         call find_crossings(triangles, axis, others, lower(others), width, found)
         do c = 1, columns**2
            associate (from => found%first(c), to => found%first(c + 1) - 1)
               call go_along(found%place(from:to), found%turn(from:to), product(width)/3.0_wp, inside, wrong)
            end associate
         end do
      end do
   end subroutine look_for_overlap

   !> Intersections of all lines with triangles: counted first, then stored line by line.
   subroutine find_crossings(triangles, axis, others, lower, width, found)
      type(triangles_t), intent(in) :: triangles
      integer, intent(in) :: axis, others(2)
      real(wp), intent(in) :: lower(2), width(2)
      type(crossings_t), intent(inout) :: found
      integer, allocatable :: next(:)
      integer :: c, pass
      allocate (next(columns**2), source=0)
      do pass = 1, 2
         call meet_all(pass == 2)
         if (pass == 2) exit
         found%first = [1, next]
         do c = 2, columns**2 + 1
            found%first(c) = found%first(c) + found%first(c - 1)
         end do
         next = found%first(:columns**2)
         c = found%first(columns**2 + 1) - 1
         if (allocated(found%place)) deallocate (found%place, found%turn)
         allocate (found%place(c), found%turn(c))
      end do
   contains
      subroutine meet_all(keep)
         logical, intent(in) :: keep
         real(wp) :: corner(2, 3), at(2), area, part(3)
         integer :: t, i, j, k, low(2), high(2)
         do t = 1, triangles%count()
            do k = 1, 3
               corner(:, k) = (triangles%corner(others, triangles%of(k, t)) - lower)/width
            end do
            low = max(1, ceiling(minval(corner, dim=2) + 1.0_wp - beside))
            high = min(columns, floor(maxval(corner, dim=2) + 1.0_wp - beside))
            area = turned(corner(:, 2) - corner(:, 1), corner(:, 3) - corner(:, 1))
            if (.not. abs(area) > 0.0_wp) cycle
            do j = low(2), high(2)
               do i = low(1), high(1)
                  at = [i, j] - 1 + beside
                  part(1) = turned(corner(:, 2) - at, corner(:, 3) - at)/area
                  part(2) = turned(corner(:, 3) - at, corner(:, 1) - at)/area
                  part(3) = turned(corner(:, 1) - at, corner(:, 2) - at)/area
                  if (any(part < 0.0_wp)) cycle
                  k = i + columns*(j - 1)
                  if (keep) then
                     found%place(next(k)) = sum(part*triangles%corner(axis, triangles%of(:, t)))
                     found%turn(next(k)) = merge(-1, 1, area > 0.0_wp) ! the normal is in the direction of the
                                                                       ! line: an exit
                  end if
                  next(k) = next(k) + 1
               end do
            end do
         end do
      end subroutine meet_all
   end subroutine find_crossings

   pure real(wp) function turned(a, b)
      real(wp), intent(in) :: a(2), b(2)
      turned = a(1)*b(2) - a(2)*b(1)
   end function turned

   !> A line's share of the volumes. One that meets an edge may have a crossing too many, and is skipped.
   subroutine go_along(place, turn, area, inside, wrong)
      real(wp), intent(inout) :: place(:)
      integer, intent(inout) :: turn(:)
      real(wp), intent(in) :: area !< of its cross-section, m2
      real(wp), intent(inout) :: inside, wrong
      real(wp) :: one
      integer :: n, m, deep, which
      if (sum(turn) /= 0) return
      do n = 2, size(place)
         one = place(n)
         which = turn(n)
         m = n - 1
         do while (m >= 1)
            if (place(m) <= one) exit
            place(m + 1) = place(m)
            turn(m + 1) = turn(m)
            m = m - 1
         end do
         place(m + 1) = one
         turn(m + 1) = which
      end do
      deep = 0
      do n = 1, size(place) - 1
         deep = deep + turn(n)
         if (deep > 0) inside = inside + area*(place(n + 1) - place(n))
         if (deep > 1 .or. deep < 0) wrong = wrong + area*(place(n + 1) - place(n))
      end do
   end subroutine go_along

end module m_self_overlap
