"""Runs small scenes on one rank and compares with what each may cost: fields, rows with their calls, files,
PETSc's voice. See effects_free.sh. Two blocks, whose particles move all the time, so that the calls a step
can be counted by hand."""

import os
import re
import subprocess
import sys
from pathlib import Path

BLOCKS, STEPS = 2, 5
# of an option that it does not know, wherever it is started
PETSC_SAYS = "There are options you set that were not used"

SCENE = """&scene    title='{name}', end_time=1e-2 /
&grid     lower=0,0,0, upper=1.6,0.8,0.8, cell_size=0.1 /
&time     time_step=2e-3, transfer='{transfer}', stress_update='{update}', domain='{domain}' /
&material name='soft', density=1000, young=1e5, poisson=0.3, {law} /
&body     material='soft', shape='box', lower=0.2,0.2,0.2, upper=1.2,0.5,0.5, velocity=0.1,0.02,-0.1, angular_velocity=0.1,0,0 /
&output   directory='{name}', formats='none', fields={shown} /
{groups}
"""

# Fields of every scene, and rows with their calls
FIELDS = {"position": 3, "velocity": 3, "mass": 1, "volume": 1, "half_size": 1, "stress": 6}
EACH = BLOCKS * STEPS
# Lists at the end of each step; P2G ahead of it, and of what has come at its beginning; the begin of the
# exchange, and sums of inner blocks and
# of the others; what a row of the histories asks of each block, and the row itself
# output: the copy at the start, the estimate at the end
ROWS = {
    "lists": EACH,
    "P2G": 2 * EACH,
    "exchange": 3 * STEPS,
    "nodes": EACH,
    "G2P": EACH,
    "stress": EACH,
    "migration": STEPS,
    "control": STEPS,
    "output": EACH + STEPS + 1,
    "guard": 1,
    "indicators": 1,
}
FILES = {"case.nml", "cost.dat", "energy.dat", "run.log"}
OFFERED = [
    "affine transfer",
    "deforming domains",
    "tool contact",
    "contact between bodies",
    "friction",
    "probes",
    "gravity",
    "damping",
    "pressure",
    "bulk_viscosity",
    "damage",
    "anti_locking",
    "grains",
    "atoms",
]

GRAVITY = "&gravity acceleration=0,0,-1 /"
DAMPING = "&damping kind='viscous', coefficient=1 /"
PRESSURE = "&pressure lower=0.2,0.2,0.5, upper=0.5,0.5,0.5, times=0, values=10 /"
VISCOSITY = "&bulk_viscosity /"
ANTI_LOCKING = "&anti_locking /"
TOOL = "&tool name='ball', shape='sphere', radius=1, tip=0.7,0.35,0.5, times=0, speeds=1 /"
PROBE = "&probe name='one', position=0.7,0.35,0.35 /"
J2 = "model='j2', yield_stress=1e3"
NO_LOCKING = "&anti_locking kind='none' /"

CUBIC = "c11=1.7e5, c12=1.2e5, c44=0.8e5"
CRYSTAL = (
    f"model='crystal', {CUBIC}, reference_rate=1, rate_sensitivity=0.05, tau0=1e3, tau_s=2e3, h0=1e3, q=1.4"
)
GRAINS = "&grains lower=0.2,0.2,0.2, upper=1.2,0.5,0.5, count=3 /"

ON_NODES = {"nodes": 2 * EACH}  # nodes go on after the effect; its work is measured
ON_FORCES = {"P2G": EACH, "nodes": EACH}  # so does P2G; its work is measured
PATCH = ({"pressure_area_1": 3, "pressure_arm_1": 3}, ON_FORCES | {"pressure": 2 * EACH}, {"pressure": 48})
# the gradient only where transfer does not keep it anyway
LOCKING_FIELDS = {"pressure_shift": 1, "kept_gradient": 9}
TOUCH = {"contact_pressure": 1, "last_contact_pressure": 1, "contact_gap": 1, "contact_deflection": 1}
FLOW = {"plastic_strain": 1, "plastic_work": 1}
LATTICE = {"elastic_stretch": 6, "orientation": 4}
SLIP = {"first_orientation": 4, "lattice_rotation": 1, "slip": 1, "slip_resistance": 12}

# name, what is said differently, fields, calls and effects (bytes a particle) other than those above, other
# files
CASES = [
    ("plain", {}, {}, {}, {}),
    ("affine", {"transfer": "affine"}, {"velocity_gradient": 9}, {}, {"affine transfer": 72}),
    # nothing is done ahead
    (
        "musl",
        {"update": "musl"},
        {"next_position": 3},
        {"exchange": 3 * STEPS, "nodes": EACH, "G2P": EACH, "output": -EACH},
        {},
    ),
    ("stretch", {"domain": "stretch"}, {"half_size": 3, "generation": 1}, {}, {"deforming domains": 24}),
    (
        "corners",
        {"domain": "corners"},
        {"half_size": 0, "domain": 9, "generation": 1},
        {},
        {"deforming domains": 72},
    ),
    ("displacement", {"shown": "'displacement'"}, {"start": 3}, {}, {}),
    ("strain", {"shown": "'strain','deformation_gradient'"}, {"motion_gradient": 9}, {}, {}),
    ("neo_hookean", {"law": "model='neo_hookean'"}, {"deformation_gradient": 9}, {}, {}),
    ("j2", {"law": J2, "groups": NO_LOCKING}, FLOW, {}, {}),
    (
        "johnson_cook",
        {
            "law": "model='johnson_cook', yield_stress=1e3, hardening_modulus=1e3, hardening_exponent=0.5, "
            "rate_coefficient=0.01, thermal_exponent=1, specific_heat=400, melting_temperature=1300",
            "groups": NO_LOCKING,
        },
        FLOW | {"temperature": 1},
        {},
        {},
    ),
    ("cubic", {"law": "model='cubic', " + CUBIC}, LATTICE, {}, {}),
    ("crystal", {"law": CRYSTAL, "groups": NO_LOCKING}, LATTICE | SLIP | FLOW, {}, {}),
    # it acts at the start
    (
        "grains",
        {"law": CRYSTAL, "groups": NO_LOCKING + GRAINS},
        LATTICE | SLIP | FLOW | {"grain": 1},
        {"grains": 0},
        {"grains": 8},
    ),
    ("gravity", {"groups": GRAVITY}, {}, ON_NODES | {"gravity": EACH}, {"gravity": 0}),
    ("damping", {"groups": DAMPING}, {"unseen_heat": 1}, ON_NODES | {"damping": EACH}, {"damping": 8}),
    ("pressure", {"groups": PRESSURE}, *PATCH),
    (
        "bulk_viscosity",
        {"groups": VISCOSITY},
        {"viscous_pressure": 1, "viscous_heat": 1},
        {"bulk_viscosity": EACH},
        {"bulk_viscosity": 16},
    ),
    (
        "damage",
        {"law": J2, "groups": NO_LOCKING + "\n&damage tension_limit=1e9 /"},
        FLOW
        | {"damage": 1, "damage_strain": 1, "lost_tension": 1, "failure_energy": 1, "work_before_failure": 1},
        {"damage": EACH},
        {"damage": 40},
    ),
    (
        "kinematic",
        {"law": J2 + ", kinematic_modulus=1e4,1e3", "groups": NO_LOCKING},
        FLOW | {"back_stress_1": 6, "back_stress_2": 6},
        {},
        {},
    ),
    (
        "anti_locking",
        {"groups": ANTI_LOCKING},
        LOCKING_FIELDS,
        {"anti_locking": EACH, "exchange": STEPS},
        {"anti_locking": 80},
    ),
    (
        "together",
        {"groups": "\n".join([GRAVITY, DAMPING, PRESSURE, VISCOSITY, ANTI_LOCKING])},
        {"unseen_heat": 1} | PATCH[0] | LOCKING_FIELDS | {"viscous_pressure": 1, "viscous_heat": 1},
        {
            "P2G": EACH,
            "nodes": 2 * EACH,
            "gravity": EACH,
            "damping": EACH,
            "pressure": 2 * EACH,
            "bulk_viscosity": EACH,
            "anti_locking": EACH,
            "exchange": STEPS,
        },
        {"gravity": 0, "damping": 8, "pressure": 48, "bulk_viscosity": 16, "anti_locking": 80},
    ),
    ("probe", {"groups": PROBE}, {}, {}, {"probes": 0}, {"probe_one.dat"}),
    ("tool", {"groups": TOOL}, TOUCH, {"contact": STEPS}, {"tool contact": 32}, {"tool_ball.dat"}),
    (
        "tool_with_friction",
        {"groups": TOOL.replace(" /", ", friction=0.2 /")},
        TOUCH | {"contact_friction": 3, "contact_shear_deflection": 3},
        {"contact": STEPS},
        {"tool contact": 32, "friction": 48},
        {"tool_ball.dat"},
    ),
    (
        "tool_and_flow",
        {"groups": TOOL + NO_LOCKING, "law": J2},
        FLOW | TOUCH | {"left_cauchy_green": 6},
        {"contact": STEPS},
        {"tool contact": 32},
        {"tool_ball.dat"},
    ),
]


def run(name, words):
    """Run a scene; its output and cost.dat."""
    scene = SCENE.format(
        **(
            {
                "name": name,
                "transfer": "plain",
                "update": "usl",
                "domain": "fixed",
                "law": "model='elastic'",
                "groups": "",
                "shown": "'none'",
            }
            | words
        )
    )
    if CUBIC in scene:
        scene = scene.replace("young=1e5, poisson=0.3, ", "")
    Path(f"{name}.nml").write_text(scene)
    done = subprocess.run(
        [os.environ["GIMP3D"]],
        input=scene,
        capture_output=True,
        text=True,
        timeout=300,
        env=os.environ | {"PETSC_OPTIONS": "-no_such_option -options_left"},
    )
    if done.returncode != 0:
        sys.exit(f"FAILED: {name}: exit status {done.returncode}: {done.stdout[-600:]}{done.stderr[-600:]}")
    return done.stdout + done.stderr, Path(name, "cost.dat").read_text()


def sizes(line, unit):
    """'a 3, b 1' or 'a (3 B a particle)' -> {'a': 3, 'b': 1}."""
    return {
        found[1].strip(): int(found[2])
        for found in re.finditer(r"([a-z_0-9 ]+?) \(?(\d+)" + unit + r"(?:, |$)", line)
    }


def judge(said, cost, files, fields, calls, effects, others=frozenset()):
    """What differs from what the scene may cost: a list of sentences."""
    wrong = []

    def compare(what, found, wanted):
        if found != wanted:
            wrong.append(f"{what}: found {found}, wanted {wanted}")

    line = re.search(r"^fields +(.*), together (\d+) B a particle$", said, re.M)
    wanted = {name: columns for name, columns in (FIELDS | fields).items() if columns > 0}
    compare("fields", sizes(line[1], ""), wanted)
    compare("bytes a particle", int(line[2]), 8 * sum(wanted.values()))
    line = re.search(r"^effects +(.*?)(?:; left out: (.*))?$", said, re.M)
    compare("effects", sizes(line[1], r" B a particle\)"), effects)
    compare("no effects", line[1] == "none", not effects)
    compare(
        "left out", line[2].split(", ") if line[2] else [], [name for name in OFFERED if name not in effects]
    )
    names = dict(re.findall(r'^AUXDATA phase_(\d+)="(.*)"$', cost, re.M))
    table = [line.split() for line in cost.splitlines() if re.match(r" *\d", line)]
    entered = {names[str(int(float(row[0])))]: int(float(row[4])) for row in table if float(row[4]) > 0}
    compare(
        "rows",
        entered,
        {row: ROWS.get(row, 0) + calls.get(row, 0) for row in ROWS | calls if calls.get(row) != 0},
    )
    # no row for what was not called for, not even an empty one
    phases = [
        "lists",
        "P2G",
        "exchange",
        "nodes",
        "contact",
        "G2P",
        "stress",
        "migration",
        "control",
        "balance",
        "output",
    ]
    compare(
        "names of rows",
        list(names.values()),
        phases + [name for name in effects if name in calls] + ["guard", "indicators", "the rest", "all"],
    )
    compare("steps", re.search(r"^(\d+) steps to", said, re.M)[1], str(STEPS))
    compare("files", files, FILES | others)
    compare("PETSc speaks", PETSC_SAYS in said, "tool contact" in effects)
    compare(
        "contact solves", bool(re.search(r"^contact: [1-9]\d* solves", said, re.M)), "tool contact" in effects
    )
    return wrong


def fail(sentence):
    global failures
    failures += 1
    print(f"FAILED: {sentence}")


failures = 0
for name, words, fields, calls, effects, *others in CASES:
    said, cost = run(name, words)
    files = {path.name for path in Path(name).iterdir()}
    sentences = judge(said, cost, files, fields, calls, effects, *others)
    for sentence in sentences:
        fail(f"{name}: {sentence}")
    print(f"   {name}: {8 * sum((FIELDS | fields).values())} B a particle, {len(ROWS | calls)} rows")
    if name == "plain":
        plain = said, cost, files

# What must not pass: each planted fault changes one thing that a scene without effects says or leaves behind
said, cost, files = plain
PLANTED = {
    "a field": (said.replace(", together 120 B", ", viscous_pressure 1, together 128 B"), cost, files),
    "a field that the sum forgets": (
        said.replace(", together", ", viscous_pressure 1, together"),
        cost,
        files,
    ),
    "an effect that is on": (
        re.sub("^effects +none", "effects    gravity (0 B a particle)", said, flags=re.M),
        cost,
        files,
    ),
    "an effect that is nowhere": (said.replace("gravity, ", ""), cost, files),
    "an empty row": (
        said,
        cost.replace("AUXDATA phase_12=", 'AUXDATA phase_14="gravity"\nAUXDATA phase_12='),
        files,
    ),
    "a call": (said, re.sub(r"^( *4\.0+E\+000(?: +\S+){3}) +\S+", r"\1 7.0", cost, flags=re.M), files),
    "contact": (said, re.sub(r"^( *5\.0+E\+000(?: +\S+){3}) +\S+", r"\1 1.0", cost, flags=re.M), files),
    "a file": (said, cost, files | {"probe_one.dat"}),
    "PETSc": (said + PETSC_SAYS, cost, files),
}
for what, (a, b, c) in PLANTED.items():
    if (a, b, c) == plain:
        fail(f"planted: {what}: could not be planted")
    if not judge(a, b, c, {}, {}, {}):
        fail(f"planted: {what}: was not found")
sys.exit(1 if failures else 0)
