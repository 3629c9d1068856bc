#!/bin/sh
# gfortran 14.2 (Debian 13; 12.2 of Debian 12 the same): ieee_is_finite, ieee_is_nan and ieee_class raise invalid on a
# signalling NaN.
#
# Who is bitten: readers of binary files (STL, instruments' data) that check numbers by ieee_is_finite, in builds with
#       -ffpe-trap=invalid: bits that happen to be a signalling NaN end the program inside the check that was to refuse
#       them. Builds without traps answer rightly, with the flag left raised for whoever looks at it later.
# A good guess: as in IEEE 754 (isFinite, isNaN and class are quiet), asking raises nothing.
# Seen: the answers are right and ieee_invalid is raised, at -O0 and -O2; not for a quiet NaN or an infinity.
# Instead: look at the bits of the exponent as an integer (checked below).
# Needs: root, debootstrap.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Label: Debian' 'Component: main' | head -n 1)
debootstrap --variant=minbase --include=gfortran-14 trixie "$dir/root" "$mirror" >"$dir/log" 2>&1 || {
   tail -n 3 "$dir/log"
   exit 1
}
cat >"$dir/root/tmp/ask.f90" <<'END'
program ask
   use, intrinsic :: ieee_arithmetic
   use, intrinsic :: iso_fortran_env, only: int32, real32
   implicit none
   integer(int32), parameter :: bits(3) = [int(z'7FA00000', int32), int(z'7FC00000', int32), int(z'7F800000', int32)]
   integer(int32), parameter :: exponent = int(z'7F800000', int32)
   character(len=*), parameter :: names(3) = ['signalling', 'quiet     ', 'infinite  ']
   real(real32) :: values(3)
   logical :: answer(4), raised(4)
   integer :: n
   values = transfer(bits, values)
   do n = 1, 3
      call ieee_set_flag(ieee_invalid, .false.)
      answer(1) = ieee_is_finite(values(n))
      call look(raised(1))
      answer(2) = ieee_is_nan(values(n))
      call look(raised(2))
      answer(3) = ieee_class(values(n)) == ieee_signaling_nan
      call look(raised(3))
      answer(4) = iand(transfer(values(n), 0_int32), exponent) /= exponent
      call look(raised(4))
      print '(a, 4(1x, l1), a, 4(1x, l1))', names(n), answer, ' raised', raised
   end do
contains
   subroutine look(raised)
      logical, intent(out) :: raised
      call ieee_get_flag(ieee_invalid, raised)
      call ieee_set_flag(ieee_invalid, .false.)
   end subroutine look
end program ask
END
for level in -O0 -O2; do
   chroot "$dir/root" sh -c "cd /tmp && gfortran-14 $level ask.f90 -o ask && ./ask" | tee "$dir/seen"
   # finite, NaN, signalling, finite by bits
   printf '%s\n' 'signalling F T T F raised T T T F' 'quiet      F T F F raised F F F F' \
      'infinite   F F F F raised F F F F' | cmp - "$dir/seen"
done
