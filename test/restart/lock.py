"""One run at a time in an output directory: locks of runs that go on are respected, those of dead ones taken
over."""

import shutil
import socket
from restarts import *

OUT = Path("out")
LOCK = OUT / "run.lock"
long_one = scene(PLASTIC, OUT, "every_steps=20", end=500, every=0, history=0.001)
short_one = scene(PLASTIC, OUT, "every_steps=20", end=0.02, every=0.01)


def contents():
    """What does not belong to the run that goes on: nothing of this may appear or change."""
    return sorted(
        path.name
        for path in OUT.iterdir()
        if not path.name.startswith(("checkpoint_", "particles")) and not path.name.endswith(".part")
    )


def ask(what, status, sentence, text="", restart=None, ranks=1):
    """Run to the end; the sentence of its error (or a line of what it says), the only one."""
    arguments = [] if restart is None else ["--restart", str(restart)]
    done = subprocess.run(command(ranks, *arguments), input=text, capture_output=True, text=True)
    lines = [line for line in done.stderr.splitlines() if line.startswith("gimp3d: ")]
    found = (
        re.search(sentence, lines[0] if status else done.stdout) if status == 0 or len(lines) == 1 else None
    )
    require(
        f"{what}: status {done.returncode}, {lines or found and found[0]}",
        done.returncode == status and found is not None,
    )
    if status == 0:
        require(
            f"{what}: no lock and nothing begun is left",
            not list(OUT.glob("*.lock*")) + list(OUT.glob("*.part*")),
        )


def write_lock(host, process, started="1", system="another start pid:[1]", minutes=0):
    OUT.mkdir(exist_ok=True)
    LOCK.write_text(
        f"gimp3d output lock\nhost {host}\nprocess {process}\nstarted {started}\nsystem {system}\nsince "
        "2026-01-02 03:04:05\n"
    )
    past = time.time() - 60 * minutes
    os.utime(LOCK, (past, past))


def field(text, word):
    return re.search(rf"^{word} (.*)$", text, re.M)[1]


for ranks in (1, 2):
    shutil.rmtree(OUT, ignore_errors=True)
    process = start(ranks, long_one)
    require(f"{ranks} ranks: it begins", wait_for(lambda: len(checkpoints(OUT)) > 0, process))
    text = LOCK.read_text()
    require(
        f"{ranks} ranks: the lock names the process", int(field(text, "process")) in ranks_of(process, ranks)
    )
    before = contents()
    going_on = (
        rf"^gimp3d: out is in use by a running gimp3d, process {field(text, 'process')} on \S+ since .*: "
        "wait for its end"
    )
    ask(f"{ranks} ranks: a second run", 4, going_on, short_one)
    ask(f"{ranks} ranks: a second run on 2", 4, going_on, short_one, ranks=2)
    ask(f"{ranks} ranks: a restart", 4, going_on, restart=OUT)
    ask(
        f"{ranks} ranks: by another name",
        4,
        "^gimp3d: ./out/ is in use by a running gimp3d",
        short_one.replace("'out'", "'./out/'"),
    )
    plan = subprocess.run(
        [GIMP3D], input=short_one.replace("&scene", "&scene mode='plan',"), capture_output=True, text=True
    )
    require(f"{ranks} ranks: a plan needs no lock", plan.returncode == 0)
    require(
        f"{ranks} ranks: nothing else is there: {contents()}",
        contents() == before and LOCK.read_text() == text,
    )
    require(f"{ranks} ranks: the first goes on", process.poll() is None)
    for pid in ranks_of(process, ranks)[:1]:
        os.kill(pid, signal.SIGKILL)
    process.communicate()
    require(f"{ranks} ranks: killed, its lock is there", LOCK.exists())
    saved = newest_step(OUT)
    process = start(ranks, restart=OUT)
    require(f"{ranks} ranks: it goes on after kill -9", wait_for(lambda: newest_step(OUT) > saved, process))
    for pid in ranks_of(process, ranks)[-1:]:
        os.kill(pid, signal.SIGTERM)
    output = process.communicate()[0]
    require(
        f"{ranks} ranks: with a word",
        re.search(r"^run.lock   of process \d+ on \S+ since .* taken over: that run is dead$", output, re.M),
    )
    require(
        f"{ranks} ranks: status {process.returncode}, no lock is left",
        process.returncode == 5 and not LOCK.exists(),
    )

# the same process id, but of another program
process = start(1, long_one)
wait_for(lambda: LOCK.exists() and LOCK.read_text().endswith("\n"), process)
text = LOCK.read_text()
process.kill()
process.communicate()
LOCK.write_text(text.replace(f"process {field(text, 'process')}", f"process {os.getpid()}"))
ask("its process id is another program's now", 0, "taken over", short_one)

# another machine: by the age of the lock
write_lock("elsewhere", 12, minutes=1)
ask(
    "a run on another machine",
    4,
    r"process 12 on elsewhere since 2026-01-02 03:04:05, last seen \d+ min \d+ s ago: .* "
    "remove out/run.lock$",
    short_one,
)
ask("a restart on another machine", 4, "process 12 on elsewhere", restart=OUT)
write_lock("elsewhere", 12, minutes=-3)
ask("a clock that is ahead", 4, r"last seen 0 s ago", short_one)
write_lock("elsewhere", 12, minutes=11)
ask(
    "a dead one on another machine",
    0,
    "run.lock   of process 12 on elsewhere since .* taken over",
    short_one,
    ranks=2,
)
write_lock(socket.gethostname(), 999999, minutes=1)
ask("a container of this machine's name", 4, "last seen", short_one)
LOCK.write_text("")
ask("an empty lock", 4, "a process that its lock does not name, last seen", short_one)
os.utime(LOCK, (time.time() - 900,) * 2)
ask("an old empty lock", 0, "taken over", short_one)

# many at once: one of them runs
for dead in (False, True):
    shutil.rmtree(OUT, ignore_errors=True)
    if dead:
        write_lock("elsewhere", 12, minutes=30)
    several = [start(1, long_one) for _ in range(6)]
    wait_for(lambda: len(checkpoints(OUT)) > 0, several[0], 20)
    until = time.monotonic() + 60
    while sum(one.poll() is None for one in several) > 1 and time.monotonic() < until:
        time.sleep(0.05)
    left = [one for one in several if one.poll() is None]
    refused = sum(one.returncode == 4 for one in several)
    # Open MPI itself fails now and then where programs without a launcher start at the same moment: these
    # never were runs
    not_begun = sum(
        one.returncode == 1 and "MPI_Init" in one.communicate()[0] for one in several if one not in left
    )
    require(
        f"six at once{', over a dead one' if dead else ''}: {len(left)} runs, {refused} refused, {not_begun} "
        "not begun by Open MPI",
        len(left) == 1 and refused + not_begun == 5 and refused >= 2,
    )
    for one in left:
        one.send_signal(signal.SIGTERM)
    for one in several:
        if not one.stdout.closed:
            one.communicate()
    require("and gives the lock back", not list(OUT.glob("*.lock*")))

# ends of all kinds give it back; what is refused leaves nothing
shutil.rmtree(OUT)
ask("bad input", 2, "young", short_one.replace("young=1e6", "young=-1"))
require("bad input makes no directory", not OUT.exists())
run(
    1,
    short_one.replace("upper=0.8,0.8,0.8 /", "upper=0.8,0.8,0.8, velocity=0,0,30 /").replace(
        "end_time=0.02", "end_time=1"
    ),
    expect=3,
)
require("a fault gives it back", not LOCK.exists() and (OUT / "energy.dat").exists())
run(1, short_one)


# a run that has ended is left alone
def state():
    return {path.name: (path.stat().st_mtime_ns, path.stat().st_size) for path in OUT.iterdir()}


before = state()
for ranks in (1, 2):
    output = run(ranks, restart=OUT)
    require(f"{ranks} ranks: a run that has ended says so", "nothing is left to do" in output)
    require(f"{ranks} ranks: and is left alone", state() == before)
finish()
