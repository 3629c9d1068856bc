!> Sheets of a closed surface: sets of its triangles such that faces that meet at a sharp concave edge are of
!> different sheets. In such a corner a body touches a face of each (theory.md, Concave edges).
module m_surface_sheets
   use m_kinds, only: wp
   use m_vectors, only: cross
   use m_triangles, only: triangles_t, corner_after
   implicit none
   private
   public :: sheets_t, find_sheets

   real(wp), parameter :: sharp = 0.906_wp !< cosine of the smallest turn of the normal at a sharp edge, 25
                                           !< degrees
   real(wp), parameter :: small_face = 1.0e-3_wp !< of the whole area: a smaller face is roughness
   integer, parameter :: max_sheets = 8 !< a face that meets so many others shares the last one: each costs a
                                        !< column a particle, and three faces meet in a corner

   type :: sheets_t
      integer :: count = 1
      integer, allocatable :: of(:)             !< (triangles): 1 to count
      integer, allocatable :: of_corner(:)      !< (corners): the lowest of its triangles'
      logical, allocatable :: inner_corner(:)   !< (corners): all its triangles are of one sheet
   end type sheets_t

contains

   !> Sheets of a surface after `close_up`.
   pure type(sheets_t) function find_sheets(triangles) result(sheets)
      type(triangles_t), intent(in) :: triangles
      integer, allocatable :: face(:) !< (triangles): number of the smooth face that it is part of
      real(wp), allocatable :: area(:) !< (faces), m2
      integer, allocatable :: pairs(:, :) !< (2, concave edges): numbers of the faces that meet there
      integer :: faces, t
      call find_faces(triangles, face, faces)
      allocate (area(faces), source=0.0_wp)
      do t = 1, triangles%count()
         associate (corner => triangles%corner(:, triangles%of(:, t)))
            area(face(t)) = area(face(t)) + 0.5_wp*norm2(cross(corner(:, 2) - corner(:, 1), &
                                                               corner(:, 3) - corner(:, 1)))
         end associate
      end do
      call find_pairs(triangles, face, area > small_face*sum(area), pairs)
      sheets%of = sheet_of_faces(faces, pairs)
      sheets%count = maxval(sheets%of)
      sheets%of = sheets%of(face)
      allocate (sheets%of_corner(size(triangles%corner, 2)), source=sheets%count)
      allocate (sheets%inner_corner(size(triangles%corner, 2)), source=.true.)
      do t = 1, triangles%count()
         sheets%of_corner(triangles%of(:, t)) = min(sheets%of_corner(triangles%of(:, t)), sheets%of(t))
      end do
      do t = 1, triangles%count()
         where (sheets%of_corner(triangles%of(:, t)) /= sheets%of(t)) &
            sheets%inner_corner(triangles%of(:, t)) = .false.
      end do
   end function find_sheets

   !> Smooth faces: triangles that meet without a sharp edge.
   pure subroutine find_faces(triangles, face, faces)
      type(triangles_t), intent(in) :: triangles
      integer, allocatable, intent(out) :: face(:)
      integer, intent(out) :: faces
      integer :: stack(triangles%count())
      integer :: k, start, t, top
      allocate (face(triangles%count()), source=0)
      faces = 0
      do start = 1, triangles%count()
         if (face(start) > 0) cycle
         faces = faces + 1
         face(start) = faces
         stack(1) = start
         top = 1
         do while (top > 0)
            t = stack(top)
            top = top - 1
            do k = 1, 3
               associate (next => triangles%beside(k, t))
                  if (face(next) > 0 .or. is_sharp(triangles, t, next)) cycle
                  face(next) = faces
                  top = top + 1
                  stack(top) = next
               end associate
            end do
         end do
      end do
   end subroutine find_faces

   pure logical function is_sharp(triangles, t, u)
      type(triangles_t), intent(in) :: triangles
      integer, intent(in) :: t, u
      is_sharp = dot_product(triangles%face_normal(:, t), triangles%face_normal(:, u)) < sharp
   end function is_sharp

   !> The faces on both sides of each sharp concave edge, without small ones.
   pure subroutine find_pairs(triangles, face, large, pairs)
      type(triangles_t), intent(in) :: triangles
      integer, intent(in) :: face(:)
      logical, intent(in) :: large(:) !< (faces)
      integer, allocatable, intent(out) :: pairs(:, :)
      integer :: found(2, 3*triangles%count()), count, k, t
      count = 0
      do t = 1, triangles%count()
         do k = 1, 3
            associate (u => triangles%beside(k, t))
               if (face(u) <= face(t) .or. .not. is_sharp(triangles, t, u)) cycle
               if (.not. (large(face(t)) .and. large(face(u)) .and. is_concave(triangles, k, t))) cycle
               count = count + 1
               found(:, count) = [face(t), face(u)]
            end associate
         end do
      end do
      pairs = found(:, :count)
   end subroutine find_pairs

   !> True when the triangle beside an edge rises to the outer side of this one.
   pure logical function is_concave(triangles, k, t)
      type(triangles_t), intent(in) :: triangles
      integer, intent(in) :: k, t !< the edge from corner k of triangle t to the next
      real(wp) :: opposite(3)
      integer :: c
      associate (u => triangles%beside(k, t), a => triangles%of(k, t), b => triangles%of(corner_after(k), t))
         do c = 1, 3
            if (triangles%of(c, u) /= a .and. triangles%of(c, u) /= b) opposite = &
               triangles%corner(:, triangles%of(c, u)) - triangles%corner(:, a)
         end do
      end associate
      is_concave = dot_product(triangles%face_normal(:, t), opposite) > 0.0_wp
   end function is_concave

   !> The lowest sheet for each face that none of those has that it meets at a concave edge.
   pure function sheet_of_faces(faces, pairs) result(sheet)
      integer, intent(in) :: faces, pairs(:, :)
      integer :: sheet(faces)
      integer :: start(faces + 1), others(2*size(pairs, 2)), f, n, own
      logical :: taken(max_sheets)
      start = 0
      do n = 1, size(pairs, 2) ! those beside each face, one face after the other
         start(pairs(:, n)) = start(pairs(:, n)) + 1
      end do
      do f = 2, faces + 1
         start(f) = start(f) + start(f - 1)
      end do
      start(faces + 1) = size(others)
      do n = 1, size(pairs, 2)
         do own = 1, 2
            others(start(pairs(own, n))) = pairs(3 - own, n)
            start(pairs(own, n)) = start(pairs(own, n)) - 1
         end do
      end do
      sheet = 1
      do f = 1, faces
         taken = .false.
         do n = start(f) + 1, start(f + 1)
            if (others(n) < f) taken(sheet(others(n))) = .true.
         end do
         sheet(f) = findloc(taken, .false., dim=1)
         if (sheet(f) == 0) sheet(f) = max_sheets
      end do
   end function sheet_of_faces

end module m_surface_sheets
