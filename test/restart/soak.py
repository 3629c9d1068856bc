"""soak.py STEPS RANKS: a long run with contact, two levels, a level that follows its tool and many
checkpoints; memory and open files of every rank are watched, and the last checkpoint must still be good for a
restart.

A ball bobs on a block: it stays in contact, and the level moves with it."""

from gimp3d.run_log import facts_of
from restarts import *

steps, ranks = int(sys.argv[1]), int(sys.argv[2])
TIME_STEP = 9.5e-4  # s, about
end = steps * TIME_STEP
half = 0.5  # s, half a period
count = int(end / half) + 2
times = [0.0, 0.05] + [0.05 + half * (i + 1) for i in range(count)]
speeds = [0.0, 0.4] + [0.4 * (-1) ** (i + 1) for i in range(count)]
text = f"""
&scene title='a ball that bobs on a block', end_time={end} /
&grid lower=0,0,0, upper=0.7,0.7,0.7, cell_size=0.1, boundary='symmetry','free','symmetry','free','roller','free' /
&time time_step={TIME_STEP}, safety=0.4 /
&level lower=0,0,0.2, upper=0.4,0.4,0.7, follow='ball' /
&material name='soft', model='elastic', density=1000, young=1e6, poisson=0.3 /
&body material='soft', shape='box', lower=0,0,0, upper=0.6,0.6,0.4, particles_per_cell=1 /
&tool name='ball', shape='sphere', radius=0.3, tip=0,0,0.405,
      times={','.join(f'{t:.6g}' for t in times)},
      speeds={','.join(f'{v:.6g}' for v in speeds)} /
&damping kind='viscous', coefficient=5 /
&output directory='soaked', formats='hdf5', every={end / 20}, history_every={end / 2000} /
&checkpoint every_steps={max(1, steps // 200)} /
"""


def resident(pid):
    """Memory in use, kB, and open files of a process."""
    status = Path(f"/proc/{pid}/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+)", status)[1]), len(list(Path(f"/proc/{pid}/fd").iterdir()))


Path("log").mkdir(exist_ok=True)
with open("log/out", "w") as out:
    process = subprocess.Popen(
        command(ranks), stdin=subprocess.PIPE, stdout=out, stderr=subprocess.STDOUT, text=True
    )
    process.stdin.write(text)
    process.stdin.close()
    seen = {}
    while process.poll() is None:
        for pid in ranks_of(process, ranks):
            try:
                if os.readlink(f"/proc/{pid}/exe").endswith("gimp3d"):
                    seen.setdefault(pid, []).append((newest_step("soaked"), *resident(pid)))
            except (OSError, TypeError):
                pass
        time.sleep(0.2)
output = Path("log/out").read_text()
if not require(f"status {process.returncode}: {said(output)}", process.returncode == 0):
    print(output[-2000:])
    finish()
cost = facts_of("soaked/cost.dat")
done = int(cost["steps"])
require(f"{done} steps", done >= 0.9 * steps)
print(
    "   "
    + "\n   ".join(
        line for line in output.splitlines() if re.match(r"contact: .*solves|domains|\d+ steps to", line)
    )
)
contact = int(cost["contact_solves"])
require(f"contact in {contact} of {done} steps", contact > 0.5 * done)
require("the ranks were watched", len(seen) == ranks and all(len(rows) > 20 for rows in seen.values()))
for pid, rows in seen.items():
    early = [row for row in rows if 0.1 * done < row[0] <= 0.3 * done]
    late = [row for row in rows if row[0] > 0.8 * done]
    if not require(f"seen early ({len(early)}) and late ({len(late)})", early and late):
        continue
    memory = [max(row[1] for row in part) for part in (early, late)]
    files = [min(row[2] for row in part) for part in (early, late)]  # between writes: a file left open stays
    require(
        f"a rank: {memory[0] / 1000:.1f} MB of memory at most early, {memory[1] / 1000:.1f} MB late; at "
        f"least {files[0]} and {files[1]} open files",
        memory[1] <= 1.02 * memory[0] + 500 and files[1] <= files[0],
    )
rows = np.loadtxt(Path("soaked") / "energy.dat", skiprows=3)
require(f"{len(rows)} rows of history, all finite", len(rows) >= 1900 and np.isfinite(rows).all())
kept = checkpoints("soaked")
require(f"two checkpoints at steps {[step_of(path) for path in kept]}", len(kept) == 2)
again = text.replace("soaked", "straight")
run(1, text=again.replace(f"end_time={end}", f"end_time={end / 100}"))
run(1, restart="soaked")
require("it can be gone on from", True)
finish()
