"""A run that goes on, and one that was killed, is read and drawn: its histories by numpy.loadtxt, its
pictures by post/gimp3d/plots.py."""

from restarts import *

PICTURES = ("load_depth.png", "section.png", "energy.png")
run_text = scene(CONTACT, "watched", "every_steps=50", end=500, every=0.01, history=0.001)
run_text = run_text.replace("&output", "&probe name='p', position=0.1,0.1,0.5 /\n&output").replace(
    "speeds=0,8,8", "speeds=0,0.4,0"
)


def read(name):
    return np.loadtxt(f"watched/{name}", comments=["TITLE", "VARIABLES", "ZONE", "AUXDATA"], ndmin=2)


def columns_named(name):
    """How many columns the head of a history names."""
    head = Path("watched", name).read_text().split("ZONE")[0]
    return head[head.index("VARIABLES") :].count('"') // 2


def draw(what):
    for picture in PICTURES:
        Path("watched", picture).unlink(missing_ok=True)
    done = subprocess.run(
        [sys.executable, "-m", "gimp3d", "plots", "watched"], capture_output=True, text=True
    )
    missing = [picture for picture in PICTURES if not Path("watched", picture).exists()]
    require(
        f"{what}: pictures: status {done.returncode} {done.stderr[-200:]} {missing}",
        done.returncode == 0 and not missing,
    )


for ranks in (1, 2):
    process = start(ranks, run_text)
    require(
        f"{ranks} ranks: it begins",
        wait_for(lambda: len(list(Path("watched").glob("particles_*.hdf"))) > 1, process),
    )
    rows, faults = 0, set()
    wait_for(lambda: len(read("tool_ball.dat")) > 5, process)
    for _ in range(100):
        for name in ("tool_ball.dat", "energy.dat", "probe_p.dat"):
            table, columns = read(name), columns_named(name)
            faults |= {f"{name}: {table.shape[1]} columns"} if table.shape[1] != columns else set()
            faults |= set() if np.all(np.diff(table[:, 0]) > 0) else {f"{name}: times"}
            last = Path("watched", name).read_bytes()[-40:]
            faults |= set() if last.endswith(b"\n") else {f"{name} ends with {last}"}
        rows = len(table)
        time.sleep(0.02)
    require(
        f"{ranks} ranks: histories of {rows} rows can be read while it goes on {sorted(faults)}",
        not faults and rows > 5,
    )
    draw(f"{ranks} ranks: while it goes on")
    require(f"{ranks} ranks: it goes on", process.poll() is None)
    for pid in ranks_of(process, ranks):
        os.kill(pid, signal.SIGKILL)
    process.communicate()
    require(
        f"{ranks} ranks: killed, its histories can be read",
        len(read("energy.dat")) >= rows and len(read("probe_p.dat")) >= rows,
    )
    draw(f"{ranks} ranks: after it was killed")
    for path in Path("watched").iterdir():
        path.unlink()
finish()
