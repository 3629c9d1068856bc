#!/bin/sh
#test: beside
# A user's own law: the VUMAT and the C law that come with it against the built-in laws, ranks, restart, and what is refused.
#test: limit 120
. "$(dirname "$0")/../harness/env.sh"
cp "$ROOT/input/vumat/j2.f" "$ROOT/input/vumat/elastic.c" .
for file in "$PWD/j2.f" "$PWD/elastic.c"; do make -s -C "$ROOT" vumat FILE="$file" >/dev/null || fail "make vumat FILE=$file"; done
# laws with a fault: no VUMAT; not a number at once, after a while in the stress, after a while in a state; no stiffness
sed 's/subroutine vumat/subroutine other/' j2.f >other.f
sed 's/^      e = props(1)/      e = log(-props(1))/' j2.f >nan.f
sed 's/^         stateNew(k,1) = .*/         stateNew(k,1) = stateOld(k,1) + deqps\n         if (totalTime .gt. 3.d-7) stressNew(k,4) = log(-yield)/' j2.f >stress.f
sed 's/^         stateNew(k,1) = .*/         stateNew(k,1) = stateOld(k,1) + deqps\n         if (totalTime .gt. 3.d-7) stateNew(k,1) = log(-yield)/' j2.f >state.f
sed 's/^      e = props(1)/      e = 0*props(1)/' j2.f >soft.f
# laws that leave more states than they say, or end the program: at the start, or in plastic flow
sed 's/^         stateNew(k,1) = .*/         stateNew(k,1) = stateOld(k,1) + deqps\n         if (deqps .gt. 0) stateNew(k,4) = 1/' j2.f >late.f
sed 's/^      e = props(1)/      e = props(1)\n      stop 7/' j2.f >stop.f
sed 's/^         stateNew(k,1) = .*/         stateNew(k,1) = stateOld(k,1) + deqps\n         if (deqps .gt. 0) call abort/' j2.f >abort.f
for name in late stop abort other nan stress state soft; do make -s -C "$ROOT" vumat FILE="$PWD/$name.f" >/dev/null || fail "$name.f"; done
"$PYTHON" "$ROOT/test/verification/vumat.py"
