"""What a run does on signals and at its wall limit."""

from restarts import *

END = 0.8


def send(process, ranks, number):
    for pid in ranks_of(process, ranks)[-1:]:
        os.kill(pid, number)


def going_on(directory):
    """How often runs there have gone on from a checkpoint, as their log says."""
    log = Path(directory, "run.log")
    return log.read_text().count("\ngoes on ") if log.exists() else 0


run(1, scene(PLASTIC, "straight", end=END, every=0.2, history=0.001))
for ranks in (1, 2):
    directory = f"signals_{ranks}"
    # without a &checkpoint
    process = start(ranks, scene(PLASTIC, directory, end=END, every=0.2, history=0.001))
    require(f"{ranks} ranks: begins", wait_for(lambda: Path(directory, "energy.dat").exists(), process))
    send(process, ranks, signal.SIGUSR1)
    require(
        f"{ranks} ranks: SIGUSR1 makes a checkpoint",
        wait_for(lambda: len(checkpoints(directory)) > 0, process),
    )
    require(f"{ranks} ranks: and the run goes on", process.poll() is None)
    send(process, ranks, signal.SIGTERM)
    output = process.communicate()[0]
    require(f"{ranks} ranks: SIGTERM ends with status {process.returncode}", process.returncode == 5)
    require(
        f"{ranks} ranks: {said(output)}",
        "stopped by SIGTERM, step " in said(output) and directory in said(output),
    )
    require(f"{ranks} ranks: no parts are left", not list(Path(directory).glob("*.part")))
    process = start(ranks, restart=directory)
    require(f"{ranks} ranks: goes on", wait_for(lambda: going_on(directory) == 1, process))
    send(process, ranks, signal.SIGINT)
    output = process.communicate()[0]
    require(
        f"{ranks} ranks: SIGINT ends with status {process.returncode}",
        process.returncode == 5 and "stopped by SIGINT" in said(output),
    )
    run(ranks, restart=directory)
    same(f"{ranks} ranks: after USR1, TERM and INT", "straight", directory)

# mpirun hands SIGUSR1 on at once; SIGTERM, of Open MPI 4, after so many seconds, after as many more it kills;
# its status is its own; of Open MPI 5 it kills 0.2 s after SIGTERM
os.environ["OMPI_MCA_odls_base_sigkill_timeout"] = "8"
version = subprocess.run(["mpirun", "--version"], capture_output=True, text=True).stdout
process = start(2, scene(PLASTIC, "launcher", end=2000, every=0, history=1))
wait_for(lambda: Path("launcher", "energy.dat").exists(), process)
process.send_signal(signal.SIGUSR1)
require("mpirun passes SIGUSR1 on", wait_for(lambda: len(checkpoints("launcher")) > 0, process))
first = newest_step("launcher")
process.send_signal(signal.SIGTERM)
process.communicate()
if "(Open MPI) 4" in version:
    log = Path("launcher", "run.log").read_text()
    require(
        f"mpirun passes SIGTERM on, and ends with status {process.returncode}", "stopped by SIGTERM" in log
    )
    require("with a newer checkpoint", newest_step("launcher") > first)
    require("and nothing begun", not list(Path("launcher").glob("*.part")))
else:
    print(f"left out: SIGTERM to mpirun, {version.splitlines()[0]}")

# the limit on the wall; going on with another one
output = run(1, scene(PLASTIC, "limit", "wall_limit=0.05", end=END, every=0.2, history=0.001), expect=5)
require(said(output), "stopped at its wall limit of 0.05 s" in said(output))
require("wall limit: a checkpoint", len(checkpoints("limit")) == 1)
text = scene(PLASTIC, "limit", end=END, every=0.2, history=0.001).replace("&scene", "&scene restart='limit',")
run(1, text, what="limit")
same("after the wall limit", "straight", "limit")

# checkpoints by the scene's time, by steps, by the wall; the last two stay; none without a wish
for wish in ("every=0.03", "every_steps=50", "every_wall=0.01", ""):
    name = "wish_" + wish.split("=")[0]
    run(1, scene(PLASTIC, name, wish, end=END, every=0.2, history=0.001))
    found = [step_of(path) for path in checkpoints(name)]
    require(f"&checkpoint {wish}: {found}", len(found) == (2 if wish else 1))
    same(f"&checkpoint {wish}", "straight", name)
require("without &checkpoint there is none", not checkpoints("straight"))

# no &output: no checkpoint, but the run ends
process = start(1, PLASTIC.format(end=1000))
require("no &output: it begins", any(line.startswith("guard ") for line in process.stdout))
process.send_signal(signal.SIGTERM)
output = process.communicate()[0]
require(f"no &output: {said(output)}", process.returncode == 5 and "no &output" in said(output))

# nobody reads the console any more: the run goes on, with PETSc (quasi-static steps) and without
STATIC = """&scene title='a block pressed, quasi-static', end_time={end} /
&grid lower=0,0,0, upper=4,4,4, cell_size=1, boundary='roller','free','roller','free','roller','free' /
&material name='soft', model='elastic', density=1000, young=1e6, poisson=0.3 /
&body material='soft', shape='box', lower=0,0,0, upper=3,3,3 /
&pressure lower=0,0,3, upper=3,3,3, times=0, values=1e3 /
&quasi_static step={end} /
"""
for name, text in (("unread", PLASTIC), ("unread_static", STATIC)):
    process = subprocess.Popen(GIMP3D, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    process.stdout.close()
    process.stdout = None
    error = process.communicate(scene(text, name, end=0.1, history=0.01).encode())[1].decode()
    require(f"{name}: status {process.returncode} {error[-200:]}", process.returncode == 0)
    require(f"{name}: the log is whole", "\nprocessors: " in Path(name, "run.log").read_text())
finish()
