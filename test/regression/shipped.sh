#!/bin/bash
#test: beside
# Every scene of input/ is accepted, steps and ends well: the first thousandth of its time (a tenth of that where steps are quasi-static,
# whose size follows the time that is left). Without RANKS, those whose start alone takes seconds are left to shipped_long.sh.
#    shipped.sh [RANKS]
#test: limit 180
. "$(dirname "$0")/../harness/env.sh"
ranks=${1:-1}
ln -s "$ROOT/input" input # files that scenes name
for scene in "$ROOT"/input/*.nml "$ROOT"/input/tutorial/*.nml; do
   name=$(echo "${scene#"$ROOT"/input/}" | tr / _)
   name=${name%.nml}
   case $#$name in 0atoms_sphere | 0hold | 0hold_load) continue ;; esac
   share=1000
   if grep -q '&quasi_static' "$scene"; then share=10000; fi
   awk -v share=$share '
      match($0, /end_time=[-+0-9.eEdD]+/) {
         value = substr($0, RSTART + 9, RLENGTH - 9)
         $0 = substr($0, 1, RSTART + 8) sprintf("%.9g", value/share) substr($0, RSTART + RLENGTH)
      }
      { print }' "$scene" >"$name.nml"
   if ! run_scene "$ranks" "$name.nml" "$name.log"; then
      grep -q '^&atoms' "$scene" && grep -q 'Cu_mishin1.*cannot be read\|LAMMPS cannot be opened' "$name.log" ||
         fail "$name ended badly: $(tail -n 3 "$name.log")"
      echo "  left out, LAMMPS or its potentials are not there: $name"
      continue
   fi
   grep -q '^finished' "$name.log" || fail "$name has no closing summary"
   echo "ok      $name: $(grep 'steps to' "$name.log")"
done
