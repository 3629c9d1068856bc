"""Bodies of all laws that hit a wall, on 1 and 2 ranks, straight through and from a checkpoint."""

import os
import shutil
import subprocess
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
from run_scene import run
from checks import finish, require
from runs import same_bits, snapshots

LAWS = {
    "elastic": "young=1e9, poisson=0.3",
    "neo_hookean": "young=1e8, poisson=0.3",
    "j2": "young=1e9, poisson=0.3, yield_stress=1e6, kinematic_modulus=1e7,1e6, kinematic_recovery=50,0",
    "johnson_cook": "young=1e9, poisson=0.3, yield_stress=1e6, hardening_modulus=1e6, "
    "hardening_exponent=0.3, rate_coefficient=0.02, "
    "thermal_exponent=1, melting_temperature=1000, specific_heat=400",
    "norton": "young=1e9, poisson=0.3, yield_stress=3e6, creep_stress=1e6, creep_rate=1, creep_exponent=3, "
    "primary_strain=1e-3, primary_time=1e-3",
    "maxwell": "young=1e9, poisson=0.3, relaxation_times=1e-4,1e-2, "
    "shear_ratios=0.4,0.3, bulk_ratios=0.1,0.2",
    "mie_grueneisen": "sound_speed=1000, hugoniot_slope=1.5, grueneisen=2, strength='j2', young=1e9, "
    "poisson=0.3, yield_stress=1e6",
    "drucker_prager": "young=1e9, poisson=0.3, friction_angle=30, cohesion=2e5, dilation_angle=5, "
    "cap_pressure=3e6, cap_hardening=1e8",
}


def scene(name, more=""):
    text = (
        "&scene title='all laws', end_time=2.5e-3 /\n&grid lower=0,0,0, upper=2.4,1.6,0.6, cell_size=0.05, "
        "boundary='free','free','free','free','roller','free' /\n&time safety=0.3, domain='corners' /\n"
        "&bulk_viscosity /\n&anti_locking /\n"
        f"&damage constants=0.02,0.05,-1.5,0.01,0.5, tension_limit=1.5e6 {more} /\n"
    )
    for n, (law, variables) in enumerate(LAWS.items()):
        x, y = 0.1 + 0.55 * (n % 4), 0.35 + 0.5 * (n // 4)
        text += (
            f"&material name='{law}', model='{law}', density=1000, {variables} /\n&body material='{law}', "
            f"shape='box', lower={x:g},{y:g},0.05, upper={x + 0.15:g},{y + 0.15:g},0.2, velocity=10,0,-30, "
            "angular_velocity=0,30,0 /\n"
        )
    return text + f"&output directory='{name}', every=1.25e-3 /\n&checkpoint every_steps=60 /\n"


def go_on(name, ranks):
    """From the checkpoint before the last one."""
    saved = sorted(Path(name).glob("checkpoint_*.h5"))
    require(f"{name}: two checkpoints", len(saved) == 2)
    saved[-1].unlink()
    done = subprocess.run(
        ["mpirun", "-n", str(ranks), os.environ["GIMP3D"], "--restart", name], capture_output=True, text=True
    )
    require(
        f"{name}: goes on on {ranks}: {done.stderr[-300:]}",
        done.returncode == 0 and "goes on    from" in done.stdout,
    )


run(scene("one"), 1)
run(scene("two"), 2)
same_bits("one", "two")
last = snapshots("one")[-1]
for field in ("plastic_strain", "creep_strain", "internal_energy", "compaction", "temperature", "damage"):
    require(f"{field} is at work", last.fields[field].max() > 0)
shutil.copytree("one", "kept")
go_on("one", 2)
same_bits("kept", "one")

run(scene("eroded", ", erode=.true."), 1)
require("some are gone", len(snapshots("eroded")[-1].ids) < len(last.ids))
shutil.copytree("eroded", "eroded_kept")
go_on("eroded", 2)
same_bits("eroded_kept", "eroded")
print("the same bits")
finish()
