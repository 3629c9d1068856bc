"""What the scripts of this suite share: scenes, runs that are stopped and taken up again, and directories
that must be the same."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from runs import everything
from checks import finish, require

GIMP3D = os.environ["GIMP3D"]
STATE = Path(__file__).resolve().parents[2] / "src/model/state.f90"
FORMAT = int(re.search(r"state_format = (\d+)", STATE.read_text()).group(1))

LEVELS = """
&scene title='free block, two levels', end_time={end} /
&grid lower=0,0,0, upper=2.4,1.6,1.6, cell_size=0.1 /
&time safety=0.35, domain='fixed' /
&level lower=0.6,0.4,0.4, upper=1.4,1.2,1.2 /
&material name='soft', model='elastic', density=1000, young=1e6, poisson=0.3 /
&body material='soft', shape='box', lower=0.4,0.5,0.5, upper=0.9,1.1,1.1, velocity=6,3,2, angular_velocity=1,8,3 /
&gravity acceleration=0,0,-9.81 /
&probe name='p', position=0.65,0.8,0.8 /
"""
SPLITTING = """
&scene title='a cloud that flies apart and is split', end_time={end} /
&grid lower=0,0,0, upper=2.4,1.6,1.6, cell_size=0.1 /
&time safety=0.35, domain='corners' /
&material name='weak', model='neo_hookean', density=1000, young=1e4, poisson=0.3 /
&body material='weak', shape='box', lower=0.9,0.5,0.5, upper=1.2,0.8,0.8, angular_velocity=0,30,25 /
&probe name='p', position=1.1,0.7,0.7 /
"""
PLASTIC = """
&scene title='a block pressed into flow, damped', end_time={end} /
&grid lower=0,0,0, upper=1.2,1.2,1.2, cell_size=0.1, boundary='roller','free','roller','free','roller','free' /
&time safety=0.35, domain='fixed' /
&material name='lead', model='j2', density=1000, young=1e6, poisson=0.3, yield_stress=2e4, hardening_modulus=1e5 /
&body material='lead', shape='box', lower=0,0,0, upper=0.8,0.8,0.8 /
&pressure lower=0,0,0.8, upper=0.4,0.4,0.8, times=0,0.01, values=0,6e4 /
&damping kind='local', coefficient=0.1 /
&anti_locking /
&probe name='p', position=0.1,0.1,0.75 /
"""
RESTING = """
&scene title='two that rest, out of order, and are hit after 60 steps', end_time={end} /
&grid lower=0,0,0, upper=2.4,0.8,0.8, cell_size=0.1 /
&time safety=0.35, domain='fixed' /
&material name='soft', model='elastic', density=1000, young=1e6, poisson=0.3 /
&material name='other', model='elastic', density=1170, young=9e5, poisson=0.3 /
&body material='soft', shape='box', lower=0.93,0.13,0.13, upper=1.13,0.63,0.63, particles_per_cell=1 /
&body material='other', shape='box', lower=1.13,0.13,0.13, upper=1.43,0.63,0.63, particles_per_cell=1 /
&body material='soft', shape='box', lower=0.23,0.13,0.13, upper=0.73,0.63,0.63, particles_per_cell=1, velocity=2,0,0 /
"""
CONTACT = """
&scene title='a ball that rubs', end_time={end} /
&grid lower=0,0,0, upper=1.2,1.2,1.0, cell_size=0.1, boundary='symmetry','free','symmetry','free','roller','free' /
&material name='soft', model='elastic', density=1000, young=1e6, poisson=0.3 /
&body material='soft', shape='box', lower=0,0,0, upper=1,1,0.6 /
&tool name='ball', shape='sphere', radius=0.5, tip=0,0,0.6, times=0,0.01,1, speeds=0,8,8, friction=0.3 /
"""
SPREAD = """
&scene title='a ball pressed into lead, on the corner of four blocks', end_time={end} /
&grid lower=0,0,0, upper=3.2,3.2,1.2, cell_size=0.1, boundary='roller','free','roller','free','roller','free' /
&time domain='fixed' /
&material name='lead', model='j2', density=1000, young=1e6, poisson=0.3, yield_stress=2e4, hardening_modulus=1e5 /
&body material='lead', shape='box', lower=0,0,0, upper=3.0,3.0,0.6, particles_per_cell=1 /
&tool name='ball', shape='sphere', radius=0.6, tip=1.6,1.6,0.6, times=0,0.01,1, speeds=0,8,8, friction=0.3 /
"""
MOVING = LEVELS.replace("upper=1.4,1.2,1.2 /", "upper=1.4,1.2,1.2, criterion='strain', max_cells=6000 /")
FOLLOWING = CONTACT.replace("&tool", "&level lower=0,0,0.4, upper=0.8,0.8,1, follow='ball' /\n&tool").replace(
    ", friction=0.3", ""
)
FOLLOWING_PARTS = FOLLOWING.replace(
    "&level", "&anti_locking /\n&level of=1, shape='sphere', radius=0.55, follow='ball' /\n&level of=1,"
)


def scene(text, directory, checkpoint=None, end=0.03, every=0.012, history=0.0, more=""):
    """A scene that writes to a directory; `checkpoint`: the variables of its group."""
    text = (
        text.format(end=end)
        + f"&output directory='{directory}', every={every}, history_every={history} /\n"
        + more
    )
    return text if checkpoint is None else text + f"&checkpoint {checkpoint} /\n"


def command(ranks, *arguments):
    return ([] if ranks == 1 else ["mpirun", "-n", str(ranks)]) + [GIMP3D, *arguments]


def run(ranks, text="", restart=None, expect=0, what=None):
    """Run a scene, or go on from a directory; the output of the program."""
    arguments = [] if restart is None else ["--restart", str(restart)]
    done = subprocess.run(command(ranks, *arguments), input=text, capture_output=True, text=True)
    if done.returncode != expect:
        require(
            f"{what or restart or 'a scene'} on {ranks} ranks: status {done.returncode}, not {expect}: "
            f"{done.stderr[-500:]}",
            False,
        )
    return done.stdout + done.stderr


def said(output):
    """The sentence of an error."""
    lines = [line for line in output.splitlines() if line.startswith("gimp3d: ")]
    return lines[-1][8:] if lines else ""


def checkpoints(directory):
    try:
        return sorted(Path(directory).glob("checkpoint_[0-9]*.h5"))
    except (
        FileNotFoundError
    ):  # a run that is starting makes the directory and takes it away again, to see that it can
        return []


def step_of(path):
    return int(re.search(r"_(\d+)\.h5$", str(path)).group(1))


def newest_step(directory):
    found = checkpoints(directory)
    return step_of(found[-1]) if found else -1


def ranks_of(process, ranks):
    """Process ids of the program itself."""
    return [process.pid] if ranks == 1 else children_of(process.pid)


def children_of(parent):
    """Process ids of a process's children, the oldest first."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:  # it has ended meanwhile
            continue
        if int(fields[1]) == parent:
            found.append(int(stat.parent.name))
    return sorted(found)


def start(ranks, text=None, restart=None):
    arguments = [] if restart is None else ["--restart", str(restart)]
    process = subprocess.Popen(
        command(ranks, *arguments),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    if text is not None:
        process.stdin.write(text)
    process.stdin.close()
    process.stdin = None
    return process


def wait_for(condition, process, seconds=60.0):
    """Wait until something is so, or the process has ended."""
    until = time.monotonic() + seconds
    while not condition() and process.poll() is None and time.monotonic() < until:
        time.sleep(0.005)
    return condition()


def part_run(ranks, directory, text=None, restart=None, number=signal.SIGTERM):
    """Run until there is a checkpoint newer than those that are there, then send a signal to one rank. The
    status and the output."""
    before = newest_step(directory)
    if restart is None:
        before = -1
        for path in checkpoints(directory):
            path.unlink()
    process = start(ranks, text, restart)
    wait_for(lambda: newest_step(directory) > before, process)
    for pid in ranks_of(process, ranks)[-1:]:
        try:
            os.kill(pid, number)
        except ProcessLookupError:
            pass
    output = process.communicate()[0]
    return process.returncode, output


def differences(one, other):
    """In what two runs differ, bit by bit: histories, snapshots, index."""
    one, other = Path(one), Path(other)
    found = []
    names = {
        path.name
        for directory in (one, other)
        for path in directory.iterdir()
        if path.name.startswith("particles")
        or path.suffix in (".part", ".xdmf")
        or (path.suffix == ".dat" and path.name != "cost.dat")
    }
    if not any(name.endswith(".hdf") for name in names) or "energy.dat" not in names:
        found.append("nothing to compare")
    for name in sorted(names):
        if not (one / name).exists() or not (other / name).exists():
            found.append(f"{name} is in one of them only")
        elif name.endswith((".h5", ".hdf")):
            a, b = everything(one / name), everything(other / name)
            found += [
                f"{name} {key}"
                for key in sorted(set(a) | set(b))
                if key not in a
                or key not in b
                or a[key].shape != b[key].shape
                or a[key].tobytes() != b[key].tobytes()
            ]
        elif (one / name).read_bytes() != (other / name).read_bytes():
            a, b = (one / name).read_text().split("\n"), (other / name).read_text().split("\n")
            row = next((i for i, (p, q) in enumerate(zip(a, b)) if p != q), min(len(a), len(b)))
            found.append(f"{name}: {len(a)} and {len(b)} lines, the first that differs is {row + 1}")
    return found


def same(what, one, other):
    found = differences(one, other)
    return require(f"{what}: the same bits" if not found else f"{what}: {'; '.join(found[:5])}", not found)


# ---- the file's seal, as src/base/checksum.f90 makes it
# ------------------------------------------------------------------------------------------------------------

PRIME, RUN, PIECE, SEAL = 4294967291, 16384, 4194304, 512


def fletcher(words, a, b):
    """Sums over 32-bit words."""
    for first in range(0, len(words), RUN):
        part = words[first : first + RUN].astype(np.uint64)
        n = len(part)
        b = (b + n * a + int(np.sum(part * np.arange(n, 0, -1, dtype=np.uint64)))) % PRIME
        a = (a + int(np.sum(part))) % PRIME
    return a, b


def sums(data, filler):
    data = data + filler * (-len(data) % 4)
    return np.frombuffer(data, dtype="<u4")


def checksum_of_text(text):
    a, b = fletcher(sums(text, b" "), len(text), 0)
    return f"{b:08X}{a:08X}"


def checksum_of_file(data):
    parts = [data[i : i + PIECE] for i in range(0, len(data), PIECE)]
    a, b = len(parts), 0
    for part in parts:
        for value in fletcher(sums(part, b"\0"), len(part), 0):
            a = (a + value) % PRIME
            b = (b + a) % PRIME
    return f"{b:08X}{a:08X}"


def reseal(path, format_number=FORMAT):
    """Give a file that was changed a good seal again."""
    data = Path(path).read_bytes()
    body = data[SEAL:]
    text = (
        f"gimp3d checkpoint\nformat {format_number}\nprogram 0.1.0\nbytes {len(body)}\nchecksum "
        f"{checksum_of_file(body)}\n"
    ).encode()
    text = text.ljust(SEAL - 17)
    Path(path).write_bytes(text + checksum_of_text(text).encode() + b"\n" + body)
