#!/bin/sh
# gfortran 14.2 (Debian 13; 12.2 of Debian 12 the same): a row that ASSOCIATE names is passed as if it were contiguous.
#
# Who is bitten: array codes that name a row (or what lies at every n-th place) by ASSOCIATE and hand it to a kernel with
#       an explicit-shape dummy: the kernel gets the elements that lie next in memory. Nothing is said, -Wall included.
# A good guess: the compiler makes a contiguous copy, as it does when the row is passed without ASSOCIATE.
# Seen: of a 4 x 3 array with 1 to 12, row 2 is 2, 6, 10; through ASSOCIATE the kernel sees 2, 3, 4. Dummies that are
#       explicit-shape, assumed-size and contiguous are all hit; an assumed-shape dummy gets the right row.
# Needs: root, debootstrap.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Label: Debian' 'Component: main' | head -n 1)
debootstrap --variant=minbase --include=gfortran-14 trixie "$dir/root" "$mirror" >"$dir/log" 2>&1 || {
   tail -n 3 "$dir/log"
   exit 1
}
cat >"$dir/root/tmp/row.f90" <<'END'
module m_row
   implicit none
contains

   subroutine explicit_shape(n, x)
      integer, intent(in) :: n
      real, intent(in) :: x(n)
      print '(a, *(1x, i0))', 'explicit', nint(x)
   end subroutine explicit_shape

   subroutine assumed_size(x)
      real, intent(in) :: x(*)
      print '(a, *(1x, i0))', 'size', nint(x(:3))
   end subroutine assumed_size

   subroutine contiguous_shape(x)
      real, intent(in), contiguous :: x(:)
      print '(a, *(1x, i0))', 'contiguous', nint(x)
   end subroutine contiguous_shape

   subroutine assumed_shape(x)
      real, intent(in) :: x(:)
      print '(a, *(1x, i0))', 'shape', nint(x)
   end subroutine assumed_shape

   subroutine use_row(table)
      real, intent(in) :: table(:, :)
      call explicit_shape(3, table(2, :))
      associate (row => table(2, :))
         call explicit_shape(3, row)
         call assumed_size(row)
         call contiguous_shape(row)
         call assumed_shape(row)
      end associate
   end subroutine use_row

end module m_row

program main
   use m_row, only: use_row
   implicit none
   integer :: i
   call use_row(reshape([(real(i), i=1, 12)], [4, 3]))
end program main
END
version=$(chroot "$dir/root" dpkg-query -W -f "\${Version}" gfortran-14)
echo "gfortran-14 $version"
[ "$version" = 14.2.0-19 ] || { echo "pinned to 14.2.0-19, and Debian 13 has another now"; exit 1; }
found=$(chroot "$dir/root" sh -c 'cd /tmp && gfortran-14 -Wall -Wextra -O0 row.f90 -o row && ./row' 2>&1)
echo "$found"
wanted='explicit 2 6 10
explicit 2 3 4
size 2 3 4
contiguous 2 3 4
shape 2 6 10'
[ "$found" = "$wanted" ] || { echo 'this version does otherwise'; exit 1; }
