"""Steps that have no equilibrium, and times that must be met. usage: faults.py (in an empty directory; GIMP3D
is the program)

- A first step that is far longer than the run is halved from what may be taken, not from itself.
- Where gravity moves particles too far, the one that is named is at the top, which goes farthest; the step is
  not halved in vain.
- A particle that leaves the grid after a step: the state of the step before stands.
- A tool that stops after 1e-4 s of a run of 1e6 s has gone that far, and no further.
- A block that friction holds slips in part.
- A body that nothing holds is named in the first step.
- A wall limit ends a run within a step."""

import re

from static_scenes import check, counts, finish, require, run, tool

BLOCK = """&grid lower=0,0,0, upper=0.6,0.6,1, cell_size=0.1, boundary='symmetry','free','symmetry','free','roller','free' /
&body material='soft', shape='box', lower=0,0,0, upper=0.3,0.3,0.6 /
&material name='soft', density=50, young=1e3, poisson=0.3, """

log = run(
    "&scene title='long', end_time=1e-6 /\n"
    + BLOCK
    + """model='neo_hookean' /
&pressure lower=0,0,0.6, upper=0.3,0.3,0.6, times=0,1e-6, values=0,300 /
&quasi_static step=1e3 /
&output directory='long', formats='none' /
""",
    1,
)
require("a step that is too long is halved", counts(log)[4] > 0)

log = run(
    "&scene title='heavy', end_time=1 /\n"
    + BLOCK
    + """model='neo_hookean' /
&gravity acceleration=0,0,-30 /
&quasi_static step=0.1 /
&output directory='heavy' /
""",
    1,
    (3,),
)
place = re.search(r"at \(([^)]*)\) m on level 1: no equilibrium", log)
require("the particle at the top moves too far", place and float(place[1].split(",")[2]) > 0.5)
require("a constant load is tried twice", log.count("it is halved") == 2)
require("a ramp is advised", "(ramp)" in log)

log = run(
    "&scene title='leaves', end_time=10 /\n"
    + BLOCK
    + """model='j2', yield_stress=20, hardening_modulus=10 /
&tool name='p', shape='flat', radius=1, tip=0,0,0.6, times=0, speeds=0.1 /
&quasi_static step=1 /
&output directory='leaves' /
""",
    1,
    (3,),
)
found = re.search(r"step (\d+), .* left the grid .* the last good state, of step (\d+), stands", log)
require("a particle leaves the grid: the state before stands", found and int(found[1]) == int(found[2]) + 1)

run(
    "&scene title='stops', end_time=1e6 /\n"
    + BLOCK
    + """model='neo_hookean' /
&tool name='p', shape='flat', radius=1, tip=0,0,0.6, times=0,1e-4,1.0001e-4, speeds=100,100,0 /
&quasi_static step=1e-5 /
&output directory='stops', history_every=1e-9, formats='none' /
""",
    1,
)
depth = tool("stops", "p")["depth"][-1]
check("the way of a tool that stops early in a long run", depth / 0.0100005 - 1, 1e-9)

# a block that friction holds, one particle a cell, pushed by 0.9 of what it bears: it slips in part
run(
    """&scene title='block on a rigid plane pushed at its side', end_time=0.3 /
&grid lower=-0.1,0,-0.05, upper=0.1,0.1,0.15, cell_size=0.025, boundary='free','free','symmetry','free','free','free' /
&time domain='stretch' /
&material name='m', model='elastic', density=1000, young=1e7, poisson=0.3 /
&body material='m', shape='box', lower=-0.05,0,0, upper=0.05,0.05,0.1, particles_per_cell=1 /
&tool name='plane', shape='flat', radius=1, tip=0,0,0, axis=0,0,1, friction=0.5, times=0, speeds=0 /
&pressure lower=-0.05,0,0.1, upper=0.05,0.05,0.1, times=0,1, values=0,1000 /
&pressure lower=-0.05,0,0, upper=-0.05,0.05,0.1, times=0,1, values=0,450 /
&quasi_static step=0.1, max_step=0.1 /
&output directory='slips', history_every=0.1, formats='none' /
""",
    1,
)
history = tool("slips", "plane")
check(
    "a block that slips in part: load along it, relative",
    history["load_x"][-1] / (0.3 * 450 * 5e-3) - 1,
    1e-3,
)
check(
    "a block that slips in part: load across it, relative",
    history["load_z"][-1] / (-0.3 * 1000 * 5e-3) - 1,
    1e-3,
)

# what nothing holds is said in the first step, by name and direction; unless the loads do not push it
LOOSE = """&scene title='loose', end_time=1 /
&grid lower=0,0,0, upper=1,1,1, cell_size=0.1, boundary={boundary} /
&material name='soft', model='neo_hookean', density=50, young=1e3, poisson=0.3 /
&body name='{name}', material='soft', shape='box', lower=0.3,0.3,{bottom}, upper=0.6,0.6,0.6 /
&pressure lower={lower}, upper={upper}, times=0,1, values=0,300 /
&quasi_static step=0.5 /
&output directory='loose', formats='none' /
"""
FREE, STANDS = "6*'free'", "'free','free','free','free','roller','free'"
TOP, PART, SIDE = (
    ("0.3,0.3,0.6", "0.6,0.6,0.6"),
    ("0.45,0.3,0.6", "0.6,0.6,0.6"),
    ("0.6,0.3,0", "0.6,0.6,0.6"),
)
for number, (boundary, bottom, (lower, upper), ranks, said) in enumerate(
    (
        (FREE, 0.3, TOP, 1, "push it along z, and it is unconstrained"),
        (FREE, 0.3, PART, 2, "rotate it about y, and it is unconstrained"),
        (STANDS, 0, SIDE, 2, "push it along x, and it is unconstrained"),
        (STANDS, 0, TOP, 1, None),
    )
):
    name = f"block_{number}"
    text = LOOSE.format(boundary=boundary, name=name, bottom=bottom, lower=lower, upper=upper)
    log = run(text, ranks, (3 if said else 0,))
    if said:
        require(
            f"{name}: {said}", re.search(rf"gimp3d: body {name}: the loads {said}.*of step 0, stands", log)
        )
        require(f"{name}: no step is halved", "it is halved" not in log)
    else:
        require(f"{name}: not pushed along what nothing holds", "unconstrained" not in log)

# what a dent alone would have to hold is told by the linear solver, with either preconditioner
DENT = """&scene title='dent', end_time=1 /
&grid lower=0,0,0, upper=1,1,1, cell_size=0.1, boundary='free','free','free','free','roller','free' /
&material name='soft', model='neo_hookean', density=50, young=1e3, poisson=0.3 /
&body name='slab', material='soft', shape='box', lower=0.2,0.2,0, upper=0.6,0.6,0.3 /
&tool name='ball', shape='sphere', radius=0.2, tip=0.4,0.4,0.3, times=0, speeds=0.02 /
&pressure lower=0.2,0.2,0, upper=0.2,0.6,0.3, times=0,1, values=0,100 /
&quasi_static step=0.5, preconditioner='{preconditioner}' /
&output directory='dent_{preconditioner}', formats='none' /
"""
for kind in ("jacobi", "bpx"):
    log = run(DENT.format(preconditioner=kind), 1, (3,))
    require(f"dent, {kind}: it holds nothing", "the loads push it along x, and it is unconstrained" in log)

# a wall limit that is over in the first step ends the run there, with a checkpoint to go on from
STOPPED = """&scene title='{name}', end_time=1 /
&grid lower=0,0,0, upper=0.6,0.6,1, cell_size=0.1, boundary='symmetry','free','symmetry','free','roller','free' /
&body material='soft', shape='box', lower=0,0,0, upper=0.3,0.3,0.6 /
&material name='soft', density=50, young=1e3, poisson=0.3, model='neo_hookean' /
&tool name='p', shape='flat', radius=1, tip=0,0,0.6, times=0, speeds=0.1 /
&quasi_static step=0.25, max_step=0.25 /
&checkpoint every_steps=1, wall_limit={limit} /
&output directory='{name}', history_every=1e-9, formats='none' /
"""
run(STOPPED.format(name="through", limit=0), 1)
for ranks in (1, 2):
    name = f"stopped_{ranks}"
    text = STOPPED.format(name=name, limit=1e-3)
    log = run(text, ranks, (5,))
    require(f"{name}: {log.splitlines()[-1]}", "within step 1, which begins anew, step 0, time 0 s" in log)
    run(text.replace("end_time=1 ", f"restart='{name}', end_time=1 ").replace("wall_limit=0.001", ""), ranks)
    history, through = tool(name, "p"), tool("through", "p")
    require(f"{name}: as many rows as without a stop", len(history["time"]) == len(through["time"]))
    check(
        f"{name}: load, relative",
        history["load_z"] / max(through["load_z"]) - through["load_z"] / max(through["load_z"]),
        1e-9,
    )
finish()
