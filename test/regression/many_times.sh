#!/bin/bash
#test: beside
#test: long
# As many times as are wanted: 200 000 points of a straight line do what its two ends do, and case.nml says them all.
. "$(dirname "$0")/../harness/env.sh"
"$PYTHON" - <<'PYTHON'
scene = """&scene title='{name}', end_time=0.02 /
&grid lower=0,0,0, upper=1.2,1.2,1.2, cell_size=0.1, boundary='roller','free','roller','free','roller','free' /
&material name='soft', model='elastic', density=1000, young=1e6, poisson=0.3 /
&body material='soft', shape='box', lower=0,0,0, upper=0.6,0.6,0.6, particles_per_cell=1 /
&pressure lower=0,0,0.6, upper=0.6,0.6,0.6, times={times}, values={values} /
&output directory='{name}', formats='none', history_every=0.002 /
"""
for name, points in (("two", 2), ("many", 200001)):
    times = [0.04 * n / (points - 1) for n in range(points)]
    values = [2e3 * n / (points - 1) for n in range(points)]
    with open(f"{name}.nml", "w") as file:
        file.write(scene.format(name=name, times=",".join(map(repr, times)), values=",".join(map(repr, values))))
PYTHON
for name in two many; do
   run_scene 1 $name.nml $name.log || fail "$name: status $?: $(tail -n 2 $name.log)"
done
compare --tolerance 1e-9 $(printf -- '--scale angular_momentum_%s=1e-3 --scale momentum_%s=1e-3 ' x x y y z z) --scale balance_error=1 two/energy.dat many/energy.dat || fail 'many points of a line are not the line'
cp -r many first
run_scene 1 first/case.nml again.log || fail "its case.nml: status $?: $(tail -n 2 again.log)"
cmp first/case.nml many/case.nml || fail 'the case of its case is another'
cmp first/energy.dat many/energy.dat || fail 'its case.nml does something else'
