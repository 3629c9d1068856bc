"""A UMAT in quasi-static and explicit steps against the built-in law, and what it may ask for. usage: umat.py (in
an empty directory with the libraries; GIMP3D is the program)"""

import os
import re
import subprocess

from static_scenes import check, counts, finish, last_particles, require, run, tool
from vumat_fields import far

J2 = "model='j2', young=200e9, poisson=0.3, yield_stress=350e6, hardening_modulus=1e9"
UMAT = "model='umat', library='./{}.so', constants=200e9, 0.3, 350e6, 1e9, states=1"
FIELDS = (("SDV1", "plastic_strain"), ("stress", "stress"), ("position", "position"), ("volume", "volume"))


def pressed(name, law, how="tolerance=1e-6", end=0.6):
    """A ball that is pressed into a block and leaves again."""
    return f"""&scene title='{name}', end_time={end} /
&grid lower=0,0,0, upper=8e-3,8e-3,6e-3, cell_size=1e-3, boundary='symmetry','free','symmetry','free','fixed','free' /
&material name='steel', density=7850, {law} /
&body material='steel', shape='box', lower=0,0,0, upper=6e-3,6e-3,4.5e-3 /
&tool name='ball', shape='sphere', radius=4e-3, tip=0,0,4.5e-3, times=0,0.4,0.401, speeds=1e-3,1e-3,-1e-3 /
&time domain='stretch' /
&anti_locking kind='none' /
&quasi_static step=0.1, max_step=0.1, {how} /
&output directory='{name}' /
"""


def against_j2():
    """The same answer, and no more Newton iterations than a tenth above those of the built-in law. With
    moduli a tenth too large the first step's answer stays, and the iterations do not."""
    log = run(pressed("j2", J2, "tolerance=1e-12"), 1)
    require(
        "locking of plastic flow is warned of",
        re.search("^may lock .*without &anti_locking", log, re.M) is not None,
    )
    run(pressed("umat", UMAT.format("j2"), "tolerance=1e-12"), 1)
    ours, built_in = last_particles("umat"), last_particles("j2")
    require(
        f"plastic strains of {built_in['plastic_strain'].max():.2f}", built_in["plastic_strain"].max() > 0.1
    )
    for name, other in FIELDS:
        check(f"UMAT against model='j2': {name}, relative", far(ours[name], built_in[other]), 1e-10)
    loads = [tool(name, "ball")["load_z"] for name in ("j2", "umat")]
    require("the ball pressed, and left", loads[0].max() > 1e3 and loads[0][-1] == 0.0)
    check("its load, relative", far(loads[1], loads[0]), 1e-10)
    newton = {}
    for name, law in (("n_j2", J2), ("n_umat", UMAT.format("j2")), ("n_wrong", UMAT.format("wrong"))):
        newton[name] = counts(run(pressed(name, law, end=0.4), 1))[1]
    print(f"Newton iterations a step: {newton}")
    check("Newton iterations of the UMAT, over those of model='j2'", newton["n_umat"] / newton["n_j2"], 1.1)
    require("with wrong moduli there are more", newton["n_wrong"] > 1.2 * newton["n_umat"])
    first = [tool(name, "ball")["load_z"][1] for name in ("n_wrong", "n_j2")]
    check("but the load of the first step is the same, relative", first[0] / first[1] - 1, 1e-3)
    run(pressed("two", UMAT.format("j2"), "tolerance=1e-12"), 2)
    check("on 2 ranks: stress, relative", far(last_particles("two")["stress"], ours["stress"]), 1e-9)


def asks_for_less():
    """PNEWDT below 1 where a strain is above 0.01: steps are halved until none is; a law that always asks ends
    the run with status 3 and a sentence."""
    log = run(pressed("asks", UMAT.format("asks"), end=0.1), 1)
    require("PNEWDT: the log says why", "a law asks for a smaller step" in log)
    require(f"PNEWDT: {counts(log)[4]:.0f} times halved", counts(log)[4] >= 1 and counts(log)[0] > 1)
    log = run(pressed("always", UMAT.format("always"), end=0.1), 1, allowed=(3,))
    require("PNEWDT always: the sentence", "a law asks for a smaller step" in log and "no equilibrium" in log)


def arguments():
    """What the call gets: a law that compares its arguments with each other, and gives no stress where they
    disagree."""
    run(pressed("told", UMAT.format("told").replace("states=1", "states=7"), end=0.4), 1)
    fields = last_particles("told")
    require("STRAN is summed", abs(fields["SDV2"]).max() > 0.01)
    check("TIME, KINC, DFGRD1 = DF DFGRD0, sum of DTIME: what they are off by", fields["SDV3"].max(), 1e-10)


def explicit():
    """In explicit steps: a block that hits a wall askew, against the built-in law."""
    scene = """&scene title='block', end_time=6e-6 /
&grid lower=0,0,0, upper=12e-3,12e-3,16e-3, cell_size=1e-3, boundary='free','free','free','free','roller','free' /
&time safety=0.3 /
&material name='steel', density=7850, {} /
&body material='steel', shape='box', lower=4e-3,4e-3,0.3e-3, upper=8e-3,8e-3,6.3e-3, velocity=5,0,-50, angular_velocity=0,5e3,1e4 /
&anti_locking /
&output directory='{}' /
"""
    run(scene.format(J2, "hits"), 1)
    run(scene.format(UMAT.format("j2"), "hits_too"), 1)
    for name, other in FIELDS:
        check(
            f"explicit: {name}, relative",
            far(last_particles("hits_too")[name], last_particles("hits")[other]),
            1e-10,
        )


def refused():
    for law, sentence in (
        (UMAT.format("nothing"), r"cannot be opened"),
        (UMAT.format("other"), r"has no umat_; allowed: "),
        (UMAT.format("stiffless"), r"leaves DDSDDE\(1,1\) at 0 at the start; it must return "),
    ):
        done = subprocess.run(
            [os.environ["GIMP3D"]], input=pressed("refused", law), capture_output=True, text=True
        )
        require(
            f"status 2, {done.stderr.strip()[:200]}",
            done.returncode == 2 and re.search(sentence, done.stderr) and not os.path.exists("refused"),
        )


if __name__ == "__main__":
    against_j2()
    asks_for_less()
    arguments()
    explicit()
    refused()
    finish()
