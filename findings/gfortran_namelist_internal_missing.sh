#!/bin/sh
# gfortran 14.2 (Debian 13; 12.2 of Debian 12 the same): a namelist group that is not there reads with status 0 from a string.
#
# Who is bitten: parallel codes whose first rank reads the input file into character lines, sends these to all, and reads each
#       group there by read(lines, nml=..., iostat=...): an optional group that is absent counts as given, a required one that
#       was misspelt as read, and the defaults run.
# A good guess: end of file (iostat = -1), as the same text gives from a file, and as the same string gives when the group is
#       there but its closing slash is not.
# Seen: no group, an empty string, another group: iostat = 0, variables untouched; from a file with these lines -1. With an
#       array of lines, as long as none holds the group, the same. A second surprise beside it: x = 1e400 gives Infinity with
#       status 0 in both (an integer out of range is an error, 5010).
# Instead: look for the group's name in the text before reading, or set a variable to a value no user gives and test it;
#       and test reals by ieee_is_finite.
# Needs: root, debootstrap.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Label: Debian' 'Component: main' | head -n 1)
debootstrap --variant=minbase --include=gfortran-14 trixie "$dir/root" "$mirror" >"$dir/log" 2>&1 || {
   tail -n 3 "$dir/log"
   exit 1
}
cat >"$dir/root/tmp/groups.f90" <<'END'
program groups
   implicit none
   character(32) :: texts(5)
   character(32) :: lines(3)
   real(8) :: width
   integer :: cells, file, from_file, from_string, i
   namelist /grid/ cells, width
   texts = [character(32) :: '&other cells=7 /', ' ', '&grid cells=7', '&grid cells=7 /', '&grid width=1e400 /']
   do i = 1, size(texts)
      cells = -1
      width = -1
      read (texts(i), nml=grid, iostat=from_string)
      open (newunit=file, status='scratch')
      write (file, '(a)') trim(texts(i))
      rewind (file)
      read (file, nml=grid, iostat=from_file)
      close (file)
      print '(a, t24, 2(a, i0), a, i0, a, g0)', trim(texts(i)), 'string ', from_string, ' file ', from_file, &
         ' cells ', cells, ' width ', width
   end do
   lines = [character(32) :: '&other cells=7 /', '&more cells=8 /', ' ']
   read (lines, nml=grid, iostat=from_string)
   print '(a, i0)', 'three lines without it: ', from_string
end program groups
END
chroot "$dir/root" sh -c 'cd /tmp && gfortran-14 -Wall groups.f90 -o groups && ./groups' >"$dir/seen"
cat "$dir/seen"
cat >"$dir/wanted" <<'END'
&other cells=7 /       string 0 file -1 cells -1 width -1.0000000000000000
                       string 0 file -1 cells -1 width -1.0000000000000000
&grid cells=7          string -1 file -1 cells 7 width -1.0000000000000000
&grid cells=7 /        string 0 file 0 cells 7 width -1.0000000000000000
&grid width=1e400 /    string 0 file 0 cells -1 width Inf
three lines without it: 0
END
diff "$dir/wanted" "$dir/seen" >"$dir/difference" || {
   echo 'this version does otherwise:'
   cat "$dir/difference"
   exit 1
}
