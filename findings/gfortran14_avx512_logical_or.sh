#!/bin/sh
# gfortran 14.2 (Debian 13), -O3 with AVX-512: `a = a .or. b` of logical arrays counts a billion of sixteen.
#
# Who is bitten: codes that mark points, cells or particles with arrays of logicals and are built for the machine
#       (-O3 -march=native), when they move to Debian 13. Masks and counts are wrong, in silence.
# A good guess: joining two arrays of logicals is right at any optimisation.
# Seen: the loop loads b under the mask "a is false" without clearing the other lanes, and ors all lanes into a: true
#       elements take the bits that happened to be in the register. 96 of 200 counts are wrong with
#       -O3 -march=x86-64-v4; none with -O2, with x86-64-v3, or with -fno-tree-loop-vectorize. gfortran 12.2 is right.
# Instead: where (b) a = .true. (checked below).
# Needs: root, debootstrap, a processor with AVX-512.
set -eu
grep -q avx512vl /proc/cpuinfo || { echo 'left out: this processor has no AVX-512'; exit 0; }
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Label: Debian' 'Component: main' | head -n 1)
debootstrap --variant=minbase --include=gfortran-14 trixie "$dir/root" "$mirror" >"$dir/log" 2>&1 || {
   tail -n 3 "$dir/log"
   exit 1
}
cat >"$dir/root/tmp/join.f90" <<'END'
module m_join
   implicit none
contains

   ! Which points are pressed, or were before.
   function pressed(gap, before) result(points)
      real, intent(in) :: gap(:)
      logical, intent(in) :: before(:)
      logical, allocatable :: points(:)
      points = gap < 0.0
#ifdef BY_WHERE
      where (before) points = .true.
#else
      points = points .or. before
#endif
   end function pressed

end module m_join
END
cat >"$dir/root/tmp/main.f90" <<'END'
program main
   use m_join, only: pressed
   implicit none
   integer :: i, n, wrong
   real, allocatable :: gap(:)
   logical, allocatable :: before(:)
   wrong = 0
   do n = 1, 200
      gap = [(sin(1.7*i), i=1, n)]
      before = [(mod(i, 5) == 0, i=1, n)]
      if (count(pressed(gap, before)) /= count([(sin(1.7*i) < 0.0 .or. mod(i, 5) == 0, i=1, n)])) wrong = wrong + 1
   end do
   print '(i0)', wrong
end program main
END
wrong() {
   chroot "$dir/root" sh -c "cd /tmp && gfortran-14 -cpp $1 join.f90 main.f90 -o t && ./t"
}
version=$(chroot "$dir/root" dpkg-query -W -f "\${Version}" gfortran-14)
echo "gfortran-14 $version"
[ "$version" = 14.2.0-19 ] || { echo "pinned to 14.2.0-19, and Debian 13 has another now"; exit 1; }
status=0
try() { # try OPTIONS WORD: how many counts of 200 are wrong; none or some are expected
   found=$(wrong "$1")
   echo "$1: $found of 200 counts are wrong"
   case "$2 $found" in 'none 0') ;; 'none '* | 'some 0') status=1 ;; esac
}
try '-O3 -march=x86-64-v4' some
try '-O3 -march=x86-64-v4 -DBY_WHERE' none
try '-O3 -march=x86-64-v4 -fno-tree-loop-vectorize' none
try '-O3 -march=x86-64-v3' none
try '-O2 -march=x86-64-v4' none
[ $status -eq 0 ] || echo 'this version does otherwise'
exit $status
