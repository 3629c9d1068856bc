"""fuzz.py CASES: checkpoints that were damaged at random, and ones with changed tables under a seal that is
good again."""

import random
import shutil
import h5py
from restarts import *
from checks import faults

chance = random.Random(int(os.environ.get("FUZZ_SEED", "8")))
cases = int(sys.argv[1])
END = 0.01
text = scene(LEVELS, "made", "every_steps=4", end=END, every=0)
run(1, scene(LEVELS, "straight", end=END, every=0))
run(1, text)
older, newer = checkpoints("made")
good = newer.read_bytes()


def bytes_changed():
    data = bytearray(good)
    for _ in range(chance.choice([1, 1, 2, 10, 1000])):
        # often in front: the seal and what HDF5 says of itself
        at = (
            chance.randrange(len(data))
            if chance.random() < 0.4
            else chance.randrange(min(len(data), chance.choice([520, 4000])))
        )
        data[at] = chance.randrange(256)
    return bytes(data)


def cut():
    return good[: chance.randrange(len(good))]


def spliced():
    a, b = sorted((chance.randrange(len(good)), chance.randrange(len(good))))
    return chance.choice(
        [
            good[:a] + good[b:],
            good[:b] + good[a:],
            good + good[a:b],
            bytes(chance.randrange(256) for _ in range(a % 3000)),
        ]
    )


def table_changed(path):
    """One number of a table is another; the seal is good."""
    with h5py.File(path, "r+") as file:
        names = []
        file.visititems(lambda name, thing: names.append(name) if isinstance(thing, h5py.Dataset) else None)
        name = chance.choice(
            [n for n in names if chance.random() < 0.5 or not n.startswith("particles")] or names
        )
        data = file[name]
        if chance.random() < 0.2:
            del file[name]
            if chance.random() < 0.5:
                file[name] = np.zeros((3, 3))
            return name
        values = data[...]
        at = tuple(chance.randrange(n) for n in values.shape)
        if values.dtype == np.uint8:
            values[at] = chance.randrange(256)
        elif values.dtype.kind == "i":
            values[at] = chance.choice([0, -1, 1, 2**31, 2**62, -(2**63), int(values[at]) + 1])
        else:
            values[at] = chance.choice([0.0, -1.0, 1e300, -1e-300, np.nan, np.inf, 2 * values[at]])
        data[...] = values
    return name


statuses = {}
for case in range(cases):
    shutil.rmtree("fuzzed", ignore_errors=True)
    shutil.copytree("made", "fuzzed")
    target = Path("fuzzed") / newer.name
    sealed = case % 4 == 3
    if sealed:
        what = table_changed(target)
        reseal(target)
    else:
        what = chance.choice([bytes_changed, bytes_changed, cut, spliced])
        target.write_bytes(what())
        what = what.__name__
    alone = case % 5 == 4
    if alone:
        (Path("fuzzed") / older.name).unlink()
    ranks = 2 if case % 25 == 24 else 1
    try:
        done = subprocess.run(
            command(ranks, "--restart", "fuzzed"),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=30,
            errors="replace",
        )
    except subprocess.TimeoutExpired:
        require(f"case {case} ({what}): hangs", False)
        continue
    statuses[done.returncode] = statuses.get(done.returncode, 0) + 1
    allowed = {0, 2, 3, 4} if sealed else {0, 2, 4}
    sentences = [line for line in done.stderr.splitlines() if line.startswith("gimp3d: ")]
    if done.returncode not in allowed or (done.returncode != 0 and len(sentences) != 1):
        require(f"case {case} ({what}): status {done.returncode}: {done.stderr[-300:]}", False)
        shutil.copytree("fuzzed", f"case_{case}", dirs_exist_ok=True)
    if not sealed and not alone and done.returncode == 0:
        found = differences("straight", "fuzzed")
        if found:
            require(f"case {case} ({what}): {found[0]}", False)
print(f"   statuses: {statuses}")
require(f"{cases} mutations", not faults)
finish()
