#!/bin/sh
# CalculiX 2.20 (Debian 12): an axisymmetric model takes forces of the whole circle and prints those of a sector of 2 degrees.
#
# Who is bitten: who compares an axisymmetric indenter, punch or tube with CalculiX: *CLOAD and *NODE PRINT, RF differ by 180.
# A good guess: what is printed as reaction balances what was given as load.
# Seen: CAX4, force -1 on a node of the top: the reactions of the floor add up to 1/180. A column of radius 1 pressed to a
#       stress of -1: .01745 is printed as the total reaction (pi/180, of a flat sector); the whole circle's is pi. EVOL is
#       the sector's volume as well.
# Instead: multiply printed forces by 180 (and by 1.0002 more for the flat sector, where per mille count).
# Needs: root, debootstrap.
set -eu
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Created-By: Packages' 'Label: Debian' 'Component: main' | head -n 1)
debootstrap --variant=minbase --include=calculix-ccx bookworm "$dir/root" "$mirror" >"$dir/log" 2>&1 || {
   tail -n 3 "$dir/log"
   exit 1
}
cat >"$dir/root/tmp/column.inp" <<'END'
*NODE, NSET=ALL
1, 0., 0.
2, 1., 0.
3, 1., 1.
4, 0., 1.
*ELEMENT, TYPE=CAX4, ELSET=COLUMN
1, 1, 2, 3, 4
*NSET, NSET=FLOOR
1, 2
*NSET, NSET=TOP
3, 4
*MATERIAL, NAME=SOFT
*ELASTIC
1000., 0.
*SOLID SECTION, ELSET=COLUMN, MATERIAL=SOFT
*BOUNDARY
1, 1, 1
4, 1, 1
FLOOR, 2, 2
*STEP
*STATIC
*CLOAD
3, 2, -1.
*NODE PRINT, NSET=FLOOR, TOTALS=ONLY
RF
*END STEP
*STEP
*STATIC
*CLOAD, OP=NEW
*BOUNDARY
TOP, 2, 2, -.001
*NODE PRINT, NSET=FLOOR, TOTALS=ONLY
RF
*END STEP
END
version=$(chroot "$dir/root" dpkg-query -W -f "\${Version}" calculix-ccx)
echo "calculix-ccx $version"
[ "$version" = 2.20-1 ] || { echo 'pinned to 2.20-1, and Debian 12 has another now'; exit 1; }
chroot "$dir/root" sh -c 'cd /tmp && ccx column >log && cat column.dat' | awk '
   /total force/ {n++; wait = 2; next}
   wait > 0 && --wait == 0 {force[n] = $2}
   END {
      printf "given 1, printed %.6f = 1/%.1f\n", force[1], 1/force[1]
      printf "stress -1 over radius 1: printed %.6f, whole circle %.6f\n", force[2], 3.14159265
      off = force[1]*180 - 1
      exit !(off*off < 1e-6 && force[2] > .0174 && force[2] < .0175)
   }' || { echo 'this version does otherwise'; exit 1; }
