#!/bin/bash
#test: beside
# Every kind of bad input: exit status 2, the exact sentence once, nothing written.   run.sh [PROGRAM]
#
# cases/table.txt holds the cases. All go through read_scene, many in one launch, on 1 and 2 ranks; some go through the program
# itself (PROGRAM, by default $GIMP3D; read_scene where neither is there) on its standard input. Then: each variable that can be
# read is a row of doc/user/input.md and the other way round, and failures planted here must be caught.
#test: limit 240
here=$(cd "$(dirname "$0")" && pwd)
asked=${1:+$(realpath "$1")}
. "$here/../harness/env.sh"
set +e
driver=${DRIVER:-$BUILD_DIR/test/input/read_scene}
unit=${UNIT:-$BUILD_DIR/test/input/namelist_test}
program=${asked:-$GIMP3D}
table=$PWD/table.txt # with the words that stand in its braces
seconds=60 # then it hangs
[ "$BUILD" = debug ] && seconds=300
[ -x "$driver" ] || fail "$driver is not there: make tests"
if [ ! -x "$program" ]; then
   [ -z "$asked" ] || fail "$program is not there"
   echo "$program is not there: read_scene stands in for it"
   program=$driver
fi
list() { uniq | paste -sd, | sed 's/,/, /g'; }
sed "s/{groups}/$("$driver" --names | cut -d' ' -f1 | list)/; s/{models}/$("$driver" --models | list)/" "$here/cases/table.txt" >"$table"
passed=0 failed=0

pass() { passed=$((passed + 1)); }
miss() { # miss SENTENCE...: one test failed
   failed=$((failed + 1))
   printf 'FAILED: %s\n' "$*"
}

# names of the cases; the command or the sentence of one
names() { awk 'BEGIN { RS = ""; FS = "\n" } !/^#/ { print $1 }' "$table"; }
field() { awk -v name="$1" -v n="$2" 'BEGIN { RS = ""; FS = "\n" } $1 == name { print $n }' "$table"; }

# judge TABLE SAID: what read_scene said of the cases against the table: a line `pass NAME` or `FAIL NAME: why` each
judge() {
   awk '
      function close_case() {
         if (name == "") return
         if (said[name] == "" && lines > 0) { status_of[name] = status; said[name] = first; count[name] = lines }
         name = ""
      }
      FNR == 1 { files++ }
      files == 1 {
         if (/^#/) next
         if ($0 == "") { part = 0; next }
         part++
         if (part == 1) { order[++cases] = $0; current = $0 }
         if (part == 3) wanted[current] = $0
         next
      }
      /^== .* [0-9]+$/ { close_case(); name = $2; sub(/.nml$/, "", name); status = $3; lines = 0; next }
      name == "" { print "FAIL " $0; next }
      { lines++; if (lines == 1) first = $0; if (/differs: |^cannot read/) { print "FAIL " name ": " $0 } }
      END {
         close_case()
         for (i = 1; i <= cases; i++) {
            name = order[i]
            if (!(name in said)) print "FAIL " name ": read_scene said nothing"
            else if (wanted[name] == "accepted" && status_of[name] != 0) print "FAIL " name ": refused: " said[name]
            else if (wanted[name] == "accepted") print "pass " name
            else if (status_of[name] != 2) print "FAIL " name ": exit status " status_of[name] ", not 2"
            else if (count[name] != 1) print "FAIL " name ": " count[name] " lines, not 1"
            else if (said[name] != wanted[name]) print "FAIL " name ": said    " said[name] "\n        wanted  " wanted[name]
            else print "pass " name
         }
      }' "$1" "$2"
}

# ---- the scenes -----------------------------------------------------------------------------------------------------------------

mkdir -p scenes empty said
list=()
while IFS= read -r name; do
   (cd scenes && eval "$(field "$name" 2)") <"$here/cases/good.nml" >"scenes/$name.nml" || miss "$name: its scene cannot be made"
   list+=("$name.nml")
done < <(names)
[ ${#list[@]} -ge 40 ] || miss "only ${#list[@]} cases in $table"
written() { find scenes empty | sort | diff before - | grep '^[<>]'; }
find scenes empty | sort >before

# ---- all cases through read_scene, on 1 and 2 ranks -------------------------------------------------------------------------------

for ranks in 1 2; do
   (cd scenes && timeout -k 5 $((4 * seconds)) mpirun -n $ranks "$driver" "${list[@]}") >said/all_$ranks 2>said/errors_$ranks </dev/null
   status=$?
   [ $status -eq 0 ] || miss "read_scene on $ranks ranks ended with status $status: $(tail -n 3 said/errors_$ranks)"
   judge "$table" said/all_$ranks >said/verdict_$ranks
   passed=$((passed + $(grep -c '^pass ' said/verdict_$ranks)))
   failed=$((failed + $(grep -c '^FAIL ' said/verdict_$ranks)))
   sed -n "/^pass /!s/^FAIL /FAILED on $ranks ranks: /p" said/verdict_$ranks
done

# ---- the program and its standard input -------------------------------------------------------------------------------------------

# one RANKS NAME INPUT SENTENCE: leaves `pass` or what was wrong in said/one_NAME_RANKS
one() {
   local ranks=$1 name=$2 input=$3 wanted="gimp3d: $4" out=said/one_$2_$1 status launch=()
   # two at a time: a program without mpirun that ends takes its folder away, which another would be beginning to use
   local place
   place=$(mktemp -d -p "${OMPI_MCA_orte_tmpdir_base:-${TMPDIR:-/tmp}}")
   local -x OMPI_MCA_orte_tmpdir_base=$place
   [ "$ranks" = 1 ] || launch=(mpirun -n "$ranks")
   (cd empty && exec timeout -k 5 $seconds "${launch[@]}" "$program" <"$input") >"$out.out" 2>"$out.err"
   status=$?
   if [ $status -ne 2 ]; then
      echo "exit status $status, not 2: $(tail -n 3 "$out.err")"
   elif [ "$(grep -ac '^gimp3d: ' "$out.err")" != 1 ] || ! grep -aqFx -- "$wanted" "$out.err"; then
      printf 'said    %s\n        wanted  %s\n' "$(grep -a '^gimp3d: ' "$out.err")" "$wanted"
   else
      echo pass
   fi >"$out"
   rm -rf "$place"
}

# verdict RANKS NAME: count what `one` left
verdict() {
   local text
   text=$(cat "said/one_$2_$1")
   if [ "$text" = pass ]; then pass; else miss "$2 through $(basename "$program") on $1 ranks: $text"; fi
}

chosen='unknown-variable negative-young tool-inside-the-body unwritable-directory empty-input binary-input very-long-line last-group-not-closed'
for ranks in 1 2; do
   running=0
   for name in $chosen; do
      one $ranks $name "$WORK/scenes/$name.nml" "$(field $name 3)" &
      running=$((running + 1))
      [ $((running % 2)) -ne 0 ] || wait
   done
   wait
   for name in $chosen; do verdict $ranks $name; done
done
one 1 endless-input /dev/zero 'the scene is longer than 16 MB'
verdict 1 endless-input
one 1 directory-for-input / 'standard input cannot be read; give a scene: gimp3d < scene.nml'
verdict 1 directory-for-input

# ---- nothing written ----------------------------------------------------------------------------------------------------------------

if [ -z "$(written)" ]; then pass; else miss "something was written: $(written | tr '\n' ' ')"; fi

# ---- doc/user/input.md ---------------------------------------------------------------------------------------------------------------------

# rows: `group variable` of each row | `group` | `name` | ...
timeout -k 5 $seconds "$driver" --names </dev/null | sort >names.code
sed -n 's/^| *`\([a-z_]*\)` *| *`\([a-z0-9_]*\)` *|.*/\1 \2/p' "$ROOT/doc/user/input.md" | sort >names.doc
if [ "$(wc -l <names.code)" -gt 20 ] && diff names.code names.doc >names.diff; then
   pass
else
   miss "doc/user/input.md: read but not in the table: $(sed -n 's/^< //p' names.diff | tr '\n' ';') in the table but not read: $(sed -n 's/^> //p' names.diff | tr '\n' ';')"
fi

# ---- the reading of namelists --------------------------------------------------------------------------------------------------------

for ranks in 1 2; do
   if timeout -k 5 $((2 * seconds)) mpirun -n $ranks "$unit" >said/unit_$ranks 2>&1 </dev/null; then
      pass
   else
      miss "namelist_test on $ranks ranks: $(tail -n 5 said/unit_$ranks)"
   fi
done

# ---- planted failures -----------------------------------------------------------------------------------------------------------------

# planted WHAT NUMBER TABLE SAID: judge must find this number of failures, no more and no less
planted() {
   local found
   found=$(judge "$3" "$4" | grep -c '^FAIL ')
   if [ "$found" = "$2" ]; then pass; else miss "planted: $1: $found failures found, not $2"; fi
}
planted 'nothing' 0 "$table" said/all_1
sed '/^negative-young$/,/^$/s/must be above/must be over/' "$table" >table.planted
planted 'another sentence' 1 table.planted said/all_1
awk 'BEGIN { RS = ""; FS = "\n" } $1 == "accepted-as-it-is" { $3 = "line 1: refused" } { print $1 "\n" $2 "\n" $3 "\n" }' "$table" >table.planted
planted 'accepted where it is to be refused' 1 table.planted said/all_1
awk 'BEGIN { RS = ""; FS = "\n" } $1 == "nan" { $3 = "accepted" } { print $1 "\n" $2 "\n" $3 "\n" }' "$table" >table.planted
planted 'refused where it is to be accepted' 1 table.planted said/all_1
sed "/^== $(names | tail -n 1).nml/,\$d" said/all_1 >said/planted
planted 'a driver that crashes before the last case' 1 "$table" said/planted
sed '/^== nan.nml/s/ 2$/ 139/' said/all_1 >said/planted
planted 'another exit status' 1 "$table" said/planted
sed '/^== nan.nml/{n;p;}' said/all_1 >said/planted
planted 'the sentence twice' 1 "$table" said/planted
sed '/^== nan.nml/{n;s/$/\nrank 1 differs: /;}' said/all_1 | grep -v '^$' >said/planted
planted 'a rank that differs' 2 "$table" said/planted

real=$program
printf '#!/bin/sh\necho "gimp3d: %s" >&2\nexit ${1:-0}\n' "$(field negative-young 3)" >pretend
chmod +x pretend
program=$WORK/pretend
one 1 planted_status "$WORK/scenes/negative-young.nml" "$(field negative-young 3)"
sed -i 's/exit .*/exit 2/' pretend
one 1 planted_sentence "$WORK/scenes/nan.nml" "$(field nan 3)"
sed -i 's/^echo.*/&\n&/' pretend
one 1 planted_twice "$WORK/scenes/negative-young.nml" "$(field negative-young 3)"
printf '#!/bin/sh\nexit 139\n' >pretend
one 1 planted_crash "$WORK/scenes/negative-young.nml" "$(field negative-young 3)"
program=$real
one 1 planted_good "$WORK/scenes/accepted-without-optional-groups.nml" 'line 1: refused'
for name in planted_status planted_sentence planted_twice planted_crash planted_good; do
   if [ "$(cat said/one_${name}_1)" = pass ]; then miss "$name was not caught"; else pass; fi
done

mkdir -p empty/out
if [ -n "$(written)" ]; then pass; else miss 'planted: a directory that was left was not found'; fi

echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
