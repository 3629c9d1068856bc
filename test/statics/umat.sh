#!/bin/sh
#test: long
#test: beside
# model='umat': the UMAT that comes with it against model='j2', its Newton iterations, PNEWDT, arguments, explicit steps, refusals.
#test: limit 240
. "$(dirname "$0")/../harness/env.sh"
cp "$ROOT/input/umat/j2.f" .
# laws with a fault: no UMAT; moduli a tenth too large, and none; a smaller step is asked for beyond a strain, and always
sed 's/subroutine umat/subroutine other/' j2.f >other.f
sed 's/^      spd = spd.*/      ddsdde = 1.1d0*ddsdde/' j2.f >wrong.f
sed 's/^      spd = spd.*/      ddsdde = 0/' j2.f >stiffless.f
sed 's/^      spd = spd.*/      if (maxval(abs(dstran)) .gt. 0.01d0) pnewdt = 0.5d0/' j2.f >asks.f
sed 's/^      spd = spd.*/      if (dtime .gt. 1.d-8) pnewdt = 0.5d0/' j2.f >always.f
cat >checks.txt <<'END'
      statev(2) = stran(3) + dstran(3)
      off = 0
      do i = 1, 3
         do j = 1, 3
            off = max(off, abs(sum(drot(:,i)*drot(:,j))
     &            - merge(1.d0, 0.d0, i .eq. j)))
         end do
      end do
      off = max(off, abs(time(2) - statev(4)))
      if ((kinc .eq. 1) .neqv. (time(2) .le. 0.d0)) off = 1
      if (time(2) .gt. 0.d0) off = max(off, abs(dfgrd0(3,1)-statev(5)),
     &   abs(dfgrd0(1,3)-statev(6)), abs(dfgrd0(3,3)-statev(7)))
      statev(3) = max(statev(3), off)
      if (dtime .gt. 1.d-8) statev(4) = time(2) + dtime
      statev(5) = dfgrd1(3,1)
      statev(6) = dfgrd1(1,3)
      statev(7) = dfgrd1(3,3)
END
sed '/^      spd = spd/r checks.txt' j2.f >told.f
for name in j2 other wrong stiffless asks always told; do
   make -s -C "$ROOT" vumat FILE="$PWD/$name.f" >/dev/null || fail "make vumat FILE=$name.f"
done
"$PYTHON" "$ROOT/test/statics/umat.py"
