"""A user's own law against the built-in ones."""

import os
import re
import shutil
import subprocess
from pathlib import Path
import numpy as np
from run_scene import ROOT, run
from vumat_fields import far, newest
from checks import finish, require

J2 = "model='j2', young=200e9, poisson=0.3, yield_stress=350e6, hardening_modulus=1e9"
VUMAT = "model='vumat', library='./j2.so', constants=200e9, 0.3, 350e6, 1e9, states=1"
C = "model='c_law', library='./elastic.so', constants=200e9, 0.3"
ELASTIC = "model='elastic', young=200e9, poisson=0.3"
# A block that hits a wall askew and turns: large turns beside plastic strains of 0.1.
SCENE = """&scene title='block', end_time=%s /
&grid lower=0,0,0, upper=12e-3,12e-3,16e-3, cell_size=1e-3, boundary='free','free','free','free','roller','free' /
&time safety=0.3 /
&material name='steel', density=7850, %s /
&body material='steel', shape='box', lower=4e-3,4e-3,0.3e-3, upper=8e-3,8e-3,6.3e-3, velocity=5,0,-50, angular_velocity=0,5e3,1e4 /
&anti_locking /
&output directory='%s', formats='hdf5', every=1e-5 /
"""


def refused(what, material, status, sentence, end="1e-5"):
    done = subprocess.run(
        [os.environ["GIMP3D"]], input=SCENE % (end, material, "refused"), capture_output=True, text=True
    )
    require(
        f"{what}: status {status}, {done.stderr.strip()[:240]}",
        done.returncode == status and re.search(sentence, done.stderr),
    )
    if status == 2:
        require(f"{what}: nothing written", not os.path.exists("refused"))
    shutil.rmtree("refused", ignore_errors=True)


END = "1.2e-5"
run(SCENE % (END, J2, "j2"), 1)
run(SCENE % (END, VUMAT, "vumat"), 1)
ours, built_in = newest("vumat"), newest("j2")
require(f"plastic strains of {built_in['plastic_strain'].max():.2f}", built_in["plastic_strain"].max() > 0.05)
for name, other in (
    ("SDV1", "plastic_strain"),
    ("stress", "stress"),
    ("velocity", "velocity"),
    ("domain", "domain"),
):
    off = far(ours[name], built_in[other])
    require(f"VUMAT against model='j2': {name} off by {off:.1e}", off < 1e-10)

# the same law in free form
lines = [re.sub("^c", "!", line) for line in Path("j2.f").read_text().splitlines()]
Path("free.f90").write_text(
    "\n".join(
        (line[6:] if line.startswith("     &") else line) + (" &" if after.startswith("     &") else "")
        for line, after in zip(lines, lines[1:] + [""])
    )
)
subprocess.run(
    ["make", "-s", "-C", str(ROOT), "vumat", f"FILE={Path('free.f90').resolve()}"],
    check=True,
    stdout=subprocess.DEVNULL,
)
run(SCENE % ("3e-6", VUMAT, "fixed"), 1)
run(SCENE % ("3e-6", VUMAT.replace("j2.so", "free.so"), "free"), 1)
fixed, free = newest("fixed"), newest("free")
require("in free form the same bits", all(np.array_equal(fixed[name], free[name]) for name in fixed))

run(SCENE % (END, VUMAT, "two"), 2)
two = newest("two")
require("the same bits on 2 ranks", all(np.array_equal(two[name], ours[name]) for name in ours))

# from the checkpoint before the last one
run((SCENE % (END, VUMAT, "again")) + "&checkpoint every_steps=60 /\n", 1)
saved = sorted(Path("again").glob("checkpoint_*.h5"))
require(f"two checkpoints, {saved[0].name} the first", len(saved) == 2)
saved[1].unlink()
for path in Path("again").glob("particles_*"):
    path.unlink()
done = subprocess.run([os.environ["GIMP3D"], "--restart", "again"], capture_output=True, text=True)
require(f"goes on: {done.stderr.strip()[:200]}", done.returncode == 0 and "goes on    from" in done.stdout)
again = newest("again")
require("the same bits after a restart", all(np.array_equal(again[name], ours[name]) for name in ours))

# in C, Green and Naghdi's rate: the same answer where nothing turns
slow = (
    SCENE.replace("velocity=5,0,-50, angular_velocity=0,5e3,1e4", "velocity=0,0,-1")
    .replace("4e-3,4e-3,0.3e-3, upper=8e-3,8e-3,6.3e-3", "4e-3,4e-3,0, upper=8e-3,8e-3,6e-3")
    .replace("safety=0.3", "safety=0.3, domain='corners'")
)
run(slow % ("3e-6", C, "c"), 1)
run(slow % ("3e-6", ELASTIC, "elastic"), 1)
off = far(newest("c")["stress"], newest("elastic")["stress"])
require(f"a law in C against model='elastic' at small strains: stress off by {off:.1e}", 1e-16 < off < 1e-4)

refused(
    "no library",
    VUMAT.replace("j2.so", "nothing.so"),
    2,
    r"library='./nothing.so': cannot be opened \(.*No such file",
)
refused("no vumat_", VUMAT.replace("j2.so", "other.so"), 2, r"has no vumat_; allowed: ")
refused("no c_law", C.replace("elastic.so", "j2.so"), 2, r"has no c_law; allowed: ")
refused("not a number at once", VUMAT.replace("j2.so", "nan.so"), 2, r"returns a stress that is NaN")
refused("no stiffness", VUMAT.replace("j2.so", "soft.so"), 2, r"has no stiffness")
refused("no library named", VUMAT.replace("library='./j2.so', ", ""), 2, r"&material library: missing")
refused(
    "too many states",
    VUMAT.replace("states=1", "states=300"),
    2,
    r"states=300: must be a whole number from 0 to 200",
)
refused("not a number in the stress", VUMAT.replace("j2.so", "stress.so"), 3, r"particle \d+ .*stress")
refused("not a number in a state", VUMAT.replace("j2.so", "state.so"), 3, r"particle \d+ .*stress")
refused(
    "too few states",
    VUMAT.replace("states=1", "states=0"),
    2,
    r"states=0: the law writes to state variable 1; allowed: at least as many states as it has",
)
refused(
    "too few states in flow", VUMAT.replace("j2.so", "late.so"), 3, r"particle \d+ .*more state variables"
)
refused(
    "a law that stops", VUMAT.replace("j2.so", "stop.so"), 2, r"the law of library='./stop.so' has ended the"
)
refused(
    "a law that aborts", VUMAT.replace("j2.so", "abort.so"), 3, r"./abort.so' has ended the program \(abort\)"
)

# another library of the same name
text = Path("again/case.nml").read_text()
require("case.nml names the checksum", "checksum='" in text)
shutil.copy("free.so", "new.so")
os.replace("new.so", "j2.so")
done = subprocess.run([os.environ["GIMP3D"], "--restart", "again"], capture_output=True, text=True)
require(
    f"another library is refused: {done.stderr.strip()[:200]}",
    done.returncode == 2 and re.search(r"library='./j2.so': has been changed: its checksum is", done.stderr),
)
finish()
