"""Restarts that are refused, and those that find a way."""

import shutil
import h5py
from restarts import *

END = 0.02
run(1, scene(PLASTIC, "straight", end=END))
run(1, scene(PLASTIC, "made", "every_steps=10", end=END))
require("two checkpoints are kept", len(checkpoints("made")) == 2)


def fresh(name):
    shutil.rmtree(name, ignore_errors=True)
    shutil.copytree("made", name)
    return checkpoints(name)


def refused(what, status, sentence, text="", restart=None, arguments=None, ranks=1):
    if arguments is not None:
        done = subprocess.run(command(ranks, *arguments), input=text, capture_output=True, text=True)
    else:
        done = subprocess.run(
            command(ranks, *([] if restart is None else ["--restart", restart])),
            input=text,
            capture_output=True,
            text=True,
        )
    lines = [line[8:] for line in done.stderr.splitlines() if line.startswith("gimp3d: ")]
    good = done.returncode == status and len(lines) == 1 and re.search(sentence, lines[0]) is not None
    require(f"{what}: {done.returncode}: {lines}", good)


# the scene
text = scene(PLASTIC, "made", end=END).replace("&scene", "&scene restart='made',")
changes = [
    (
        "another material",
        "young=1e6",
        "young=2e6",
        r"^&material young=2e6 was young=1e6 in made/checkpoint_\d+\.h5; only end_time",
    ),
    (
        "a group more",
        "&anti_locking /",
        "&anti_locking / &gravity acceleration=0,0,-9 /",
        r"^the group &gravity was not there in ",
    ),
    (
        "a group less",
        "&damping kind='local', coefficient=0.1 /",
        "",
        r"^a group &damping is missing, it was there in ",
    ),
    (
        "an effect declined",
        "&anti_locking /",
        "&anti_locking kind='none' /",
        r"^&anti_locking kind='none' was kind='volumetric' in ",
    ),
    (
        "another body",
        "upper=0.8,0.8,0.8",
        "upper=0.8,0.7,0.8",
        r"^&body upper=0.8,0.7,0.8 was upper=0.8,0.8,0.8",
    ),
    ("another probe", "name='p'", "name='q'", r"^&probe name='q' was name='p'"),
    (
        "a variable more",
        "safety=0.35",
        "safety=0.35, time_step=1e-5",
        r"^&time time_step=1e-5 was time_step=0",
    ),
]
before = sorted((path, path.stat().st_mtime_ns) for path in Path("made").iterdir())
for what, old, new, sentence in changes:
    refused(what, 2, sentence, text.replace(old, new))
refused("on 2 ranks too", 2, changes[0][3], text.replace(changes[0][1], changes[0][2]), ranks=2)
require(
    "nothing was touched",
    before == sorted((path, path.stat().st_mtime_ns) for path in Path("made").iterdir()),
)

# the command line
refused("an unknown argument", 2, "^unknown argument --resume; usage: ", arguments=["--resume"])
refused("no directory", 2, "^--restart needs one directory; usage: ", arguments=["--restart"])
refused("a directory and a scene", 2, "^--restart goes with no scene", arguments=["--restart", "a", "b"])
refused(
    "a directory that is not there",
    2,
    "^cannot restart from nowhere: nowhere is not there",
    restart="nowhere",
)
refused(
    "a run without checkpoints",
    2,
    "^cannot restart from straight: straight holds no checkpoint",
    restart="straight",
)
refused(
    "&checkpoint without &output",
    2,
    "&checkpoint.*needs an &output",
    PLASTIC.format(end=END) + "&checkpoint /",
)
refused("a negative period", 2, "&checkpoint every=-1: must be", scene(PLASTIC, "x", "every=-1"))


# damage: the one before is taken, and the run says so
def taken(what, sentence, name="damaged"):
    output = run(1, restart=name)
    lines = [line for line in output.splitlines() if line.startswith("goes on    from")]
    require(f"{what}: {lines}", len(lines) == 1 and re.search(sentence, lines[0]) is not None)
    same(what, "straight", name)
    require(f"{what}: two whole ones are there again", len(checkpoints(name)) <= 2)


for what, where in (
    ("in the seal", 30),
    ("in the sum", 80),
    ("in front", 520),
    ("in the middle", 0.5),
    ("at the end", 0.999),
):
    older, newer = fresh("damaged")
    data = bytearray(newer.read_bytes())
    at = where if where > 1 else int(where * len(data))
    data[at] ^= 0x10
    newer.write_bytes(data)
    taken(f"a flipped bit {what}", f"{older.name}.*{newer.name} is damaged: going on from ")
for length in (0, 100, 512, 5000, -1):
    older, newer = fresh("damaged")
    data = newer.read_bytes()
    newer.write_bytes(data[:length])
    taken(
        f"cut to {length} bytes", f"{older.name}.*{newer.name} is (cut short|[0-9]+ bytes long, not [0-9]+)"
    )
older, newer = fresh("damaged")
with newer.open("ab") as file:
    file.write(b"more")
taken(
    "bytes behind the end",
    f"{newer.name} is [0-9]+ bytes long, not [0-9]+: going on from damaged/{older.name}",
)
older, newer = fresh("damaged")
for path in (older, newer):
    path.write_bytes(path.read_bytes()[:700])
refused(
    "nothing but damaged ones",
    4,
    f"^cannot restart from damaged: it holds no complete checkpoint; damaged/{newer.name} is 700 bytes",
    restart="damaged",
)
refused(
    "the same on 2 ranks",
    4,
    f"^cannot restart from damaged: it holds no complete checkpoint; damaged/{newer.name} is 700 bytes",
    restart="damaged",
    ranks=2,
)
shutil.rmtree("damaged")

# another format; another scene's tables under a good seal
older, newer = fresh("format")
reseal(newer, FORMAT + 1)
refused(
    "another format",
    2,
    rf"has the format {FORMAT + 1} of gimp3d [0-9.]+; this is gimp3d [0-9.]+, which reads format {FORMAT}$",
    restart="format",
)


def planted(what, status, sentence, change):
    older, newer = fresh("planted")
    with h5py.File(newer, "r+") as file:
        change(file)
    reseal(newer)
    refused(what, status, sentence, restart="planted")


def put(name, index, value):
    def change(file):
        file[name][index] = value

    return change


def case_of_another(file):
    text = bytes(file["case"][...]).replace(b"cell_size=0.1", b"cell_size=0.2")
    del file["case"]
    file["case"] = np.frombuffer(text, dtype=np.uint8)


def without(name):
    def change(file):
        del file[name]

    return change


planted(
    "nothing changed under a new seal: a count",
    4,
    "its blocks do not match its scene",
    put("blocks/table", (0, 2), 10**7),
)
planted(
    "a block that is not there", 4, "its blocks do not match its scene", put("blocks/table", (0, 1), 10**9)
)
planted("a level that is not there", 4, "its blocks do not match its scene", put("blocks/table", (0, 0), 3))
planted(
    "a bin that is not there", 4, "its particles do not match its scene", put("particles/own", (7, 2), 600)
)
planted(
    "a body that is not there", 4, "its particles do not match its scene", put("particles/own", (7, 1), 2)
)
planted(
    "a particle elsewhere", 4, "its particles do not match its scene", put("particles/position", (7, 1), 1e3)
)
planted("no field", 4, "table /particles/stress has another size", without("particles/stress"))
planted("no state", 4, "table /state/clock has another size", without("state/clock"))
planted("another scene", 4, "do not match its scene", case_of_another)

# what may change: the end, the output, the checkpoints
run(
    1,
    text.replace(f"end_time={END}", "end_time=0.03")
    .replace("'made'", "'longer'")
    .replace("restart='longer'", "restart='made'"),
    what="a longer run in another directory",
)
a, b = (np.loadtxt(f"{name}/energy.dat", skiprows=3) for name in ("made", "longer"))
require("longer: the rows before are there", np.array_equal(a, b[: len(a)]) and b[-1, 0] == 0.03)
require("longer: a probe too", len(np.loadtxt("longer/probe_p.dat", skiprows=3)) == len(b))
require("longer: the run before is as it was", not differences("made", "straight"))
old = fresh("again")
shutil.copy(old[0], "again/checkpoint_mine.h5")
run(1, scene(PLASTIC, "again", end=END))
require("a run that begins anew takes old checkpoints away", not checkpoints("again"))
require("but not those of other names", Path("again/checkpoint_mine.h5").exists())
os.rename("made", "renamed")
checkpoints("renamed")[-1].unlink()
run(1, restart="renamed/")
same("a directory with another name", "straight", "renamed")
output = run(1, restart="renamed")
require("a run that has ended goes on to its end", "goes on    from" in output)
same("and changes nothing", "straight", "renamed")
finish()
