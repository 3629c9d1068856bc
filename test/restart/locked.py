"""locked.py: named semaphores, locked, as Open MPI's component for shared file pointers leaves them behind
when a run is killed while it opens a file. With that component a run waits for them for ever; as the program
chooses it, it does not."""

import ctypes
from restarts import *

libc = ctypes.CDLL(None)
libc.sem_open.restype = ctypes.c_void_p
names = [
    f"OMPIO_{kind}.h5{part}".encode()
    for kind in ("checkpoint_000000000005", "checkpoint_000000000010", "particles_00000000")
    for part in (".part", ".part.part")
]
text = scene(PLASTIC, "locked", "every_steps=5", end=0.05, every=0.02)


def run_for(seconds, **settings):
    """The status of the scene on two ranks; None where it has not ended in so much time."""
    process = subprocess.Popen(
        command(2),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env=dict(os.environ, **settings),
    )
    try:
        output = process.communicate(text, timeout=seconds)[0]
    except subprocess.TimeoutExpired:
        for pid in ranks_of(process, 2):
            os.kill(pid, signal.SIGKILL)
        process.communicate()
        return None
    if process.returncode != 0:
        print(output[-500:])
    return process.returncode


require("without locks it ends", run_for(100) == 0)
try:
    for name in names:
        require(f"a lock, {name.decode()}", libc.sem_open(name, os.O_CREAT, 0o600, 0) is not None)
    require("with locks too", run_for(100) == 0)
    require(
        f"checkpoints of steps {[step_of(path) for path in checkpoints('locked')]}",
        len(checkpoints("locked")) == 2,
    )
    waits = run_for(10, OMPI_MCA_sharedfp="sm") is None  # a control of the MPI, not of the program
    print(
        "   with the component that looks for them it waits"
        if waits
        else "   this MPI never waits: nothing is shown by that"
    )
finally:
    for name in names:
        libc.sem_unlink(name)
finish()
