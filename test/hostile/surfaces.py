"""Files that are no closed surface: each is refused in one sentence with status 2, the same on every rank,
and nothing is written; and a run whose file has changed does not go on. usage: surfaces.py DRIVER (in an
empty directory; GIMP3D is the program)"""

import math
import os
import struct
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
from gimp3d import surfaces

SCENE = """&scene title='a surface', end_time=1e-6 /
&grid lower=0,0,0, upper=1,1,1, cell_size=0.1 /
&material name='m', model='elastic', density=2710, young=70e9, poisson=0.33 /
&body material='m', shape='box', lower=0,0,0, upper=1,1,0.5 /
&tool shape='surface', file='{file}', {more}tip=0.5,0.5,0.5, times=0, speeds=10 /
"""
failures = 0


def judge(name, good, why):
    global failures
    failures += not good
    print(("" if good else "FAILED: ") + name + ("" if good else ": " + why))


ball = surfaces.sphere(0.2, 0.1)
good, text, obj = Path("good.stl"), Path("good.txt.stl"), Path("good.obj")
for path in (good, text, obj):
    surfaces.write(path, ball)
binary, ascii_, waves = good.read_bytes(), text.read_text(), obj.read_text()
heights = "# a tip\n0 1 0\n1 2 1\n0 1 0\n"


def triangles(change):
    """A binary file of triangles that have been changed."""
    changed = change(np.array(ball))
    surfaces.write("made.stl", changed if changed is not None else ball)
    return Path("made.stl").read_bytes()


def moved(t):
    t[7, 1] += [0.01, 0, 0]
    return t


def flat(t):
    """Two triangles between three points on a line, in the place of an edge."""
    a, b = t[0, 0], t[0, 1]
    return np.concatenate(
        [t[1:], [[a, (a + b) / 2, t[0, 2]], [(a + b) / 2, b, t[0, 2]], [a, b, (a + b) / 2]]]
    )


def boxes(sizes, shift=0.0, turned=1, up=0.0):
    """Cubes, the second one moved along all axes; with turned=-1 that is a hollow."""
    corner = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    cube = np.array([corner[[a, *pair]] for a, b, c, d in faces for pair in ((b, c), (c, d))])
    two = np.concatenate([sizes[0] * cube, (sizes[1] * cube + shift)[:, ::turned]])
    surfaces.write("made.stl", two + [0, 0, up])
    return Path("made.stl").read_bytes()


nan = bytearray(binary)
nan[84 + 12 : 84 + 16] = struct.pack("<f", float("nan"))
infinite = bytearray(binary)
infinite[84 + 50 * 3 + 20 : 84 + 50 * 3 + 24] = struct.pack("<f", float("inf"))
many = bytearray(binary)
many[80:84] = struct.pack("<I", 2000000000)
CASES = {  # name: (content, what the sentence has, what else the tool has)
    "a triangle is missing": (triangles(lambda t: t[1:]), "is not closed: the edge from ", ""),
    "a corner has moved": (triangles(moved), "is not closed: the edge from ", ""),
    "a triangle is twice": (
        triangles(lambda t: np.concatenate([t, t[5:6]])),
        "is not a closed surface: the edge from ",
        "",
    ),
    "a triangle is turned over": (
        triangles(lambda t: np.concatenate([t[:1, ::-1], t[1:]])),
        "is not a closed surface: the edge from ",
        "",
    ),
    "inside out": (triangles(lambda t: t[:, ::-1]), "is inside out", ""),
    "a flat triangle": (triangles(flat), "has a degenerate triangle", ""),
    "only a face": (triangles(lambda t: t[:1]), "is not closed", ""),
    "no triangles": (binary[:80] + bytes(4), "has no triangles", ""),
    "not a number": (bytes(nan), "has a corner of triangle 1 that is not a finite number", ""),
    "infinite": (bytes(infinite), "has a corner of triangle 4 that is not a finite number", ""),
    "two billion triangles": (bytes(many), "says it has 2000000000 triangles; allowed: 1 to 20000000", ""),
    "cut off": (binary[:-10], "says it has ", ""),
    "too long": (binary + binary, "says it has ", ""),
    "a header alone": (binary[:50], "is neither STL (binary or text), nor OBJ, nor", ""),
    "empty": (b"", "is empty", ""),
    "another format": (b"\x89PNG\r\n\x1a\n" + bytes(200), "is an image (PNG); allowed: ", ""),
    "a damaged HDF5 file": (b"\x89HDF\r\n\x1a\n" + bytes(200), "is an HDF5 file without", "spacing=1,1, "),
    "prose": (b"these are no triangles\n" * 20, "is neither STL (binary or text), nor OBJ, nor", ""),
    "text without its end": (ascii_[: len(ascii_) // 2].encode(), "", ""),
    "text with a word for a number": (
        ascii_.replace("vertex 0 0 0", "vertex 0 zero 0", 1).encode(),
        "must have three numbers",
        "",
    ),
    "text with NaN": (
        ascii_.replace("vertex 0 0 0", "vertex 0 nan 0", 1).encode(),
        "must have three numbers",
        "",
    ),
    "text with a facet of two": (
        ascii_.replace("vertex 0 0 0\n", "", 1).encode(),
        "a facet has 2 corners",
        "",
    ),
    "text with another word": (ascii_.replace("endloop", "endlop", 1).encode(), "unknown word 'endlop'", ""),
    "a corner that is not there": (
        (waves + "f 1 2 999999\n").encode(),
        "'999999' is not the number of a vertex; allowed: 1 to",
        "",
    ),
    "a face without its number": (
        (waves + "f 1 2 x\n").encode(),
        "'x' is not the number of a vertex; allowed: 1 to",
        "",
    ),
    "a face that crosses itself": (
        (waves + "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 1 -1 0\nv 0 2 0\nf -5 -4 -3 -2 -1\n").encode(),
        "the face intersects itself",
        "",
    ),
    "a face with many corners": (
        (waves + "f" + " 1" * 70 + "\n").encode(),
        "a face has more than 64 corners",
        "",
    ),
    "corners alone": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "has no triangles", ""),
    "heights without spacing": (heights.encode(), "holds heights; spacing must be given", ""),
    "triangles with spacing": (
        binary,
        "holds triangles, for which spacing is not used; leave it out",
        "spacing=1,1, ",
    ),
    "a row is short": (
        heights.replace("1 2 1", "1 2").encode(),
        "line 3: has 2 numbers, the first row 3",
        "spacing=0.1,0.1, ",
    ),
    "a height is no number": (
        heights.replace("2", "two").encode(),
        "line 3: 'two' is no number",
        "spacing=0.1,0.1, ",
    ),
    "one row": (b"1 2 3\n", "holds 3 by 1 heights; allowed: at least 2 by 2", "spacing=0.1,0.1, "),
    "changed": (binary, "has been changed: its checksum is ", "checksum='0123456789ABCDEF', "),
    "decimal commas and points": (
        b"0,5\t1,5\t0,5\n0.5\t1,5\t0,5\n",
        "line 2 has commas that are no decimal ones, or points too",
        "spacing=0.1,0.1, ",
    ),
    "corners with decimal commas": (
        ascii_.replace("vertex 0 0 0", "vertex 0,0 0,0 0,0", 1).encode(),
        "'0,0' has a decimal comma",
        "",
    ),
    "no scale": (
        b"0 250 0\n250 500 250\n0 250 0\n",
        "holds heights from 0 to 500, which with scale=1 are 500 m high over 0.2 by 0.2 m; allowed: at most",
        "spacing=0.1,0.1, ",
    ),
    "no value at a place": (
        b"0 2 0\n1 2 1\n0 2 -9999\n",
        "holds -9999 at place 3 of row 3 (1 in all), which marks a missing value; the others are 0 to 2",
        "spacing=0.1,0.1, scale=1e-3, ",
    ),
    "places and heights": (
        "".join(f"{0.1 * i} {0.1 * j} {i * j}\n" for j in range(4) for i in range(5) if i + j).encode(),
        "holds lines x y z, but 1 of the 20 places of their grid, 5 along x by 4 along y, are missing",
        "spacing=0.1,0.1, ",
    ),
    "a box in a box": (boxes((1, 0.5)), "overlaps itself: of the 1 m3 inside it 0.125 m3 are", ""),
    "boxes that cut each other": (boxes((1, 1), 0.7), "overlaps itself: of the 1.97 m3 inside it", ""),
}
turn = [
    (0.2 * (1 + k % 2) * math.cos(0.2 * math.pi * k), 0.2 * (1 + k % 2) * math.sin(0.2 * math.pi * k))
    for k in range(10)
]
# a star whose ends are a face each
polygons = "".join(f"v {x!r} {y!r} {z!r}\n" for z in (0.0, 0.3) for x, y in turn)
polygons += (
    "f "
    + " ".join(str(k) for k in range(10, 0, -1))
    + "\nf "
    + " ".join(str(k) for k in range(11, 21))
    + "\n"
)
polygons += "".join(f"f {k} {1 + k % 10} {11 + k % 10} {10 + k}\n" for k in range(1, 11))
GOOD = {
    "polygons": (polygons.encode(), ""),
    "binary": (binary, ""),
    "text": (ascii_.encode(), ""),
    "obj": (waves.encode(), ""),
    "scaled": (binary, "scale=0.5, rotation=0,0,90, "),
    "heights": (heights.encode(), "spacing=0.05,0.05, scale=0.1, rotation=180,0,0, "),
    "heights with commas": (b"0, 1, 0\n1,2,1\n0,1,0\n", "spacing=0.05,0.05, scale=0.1, rotation=180,0,0, "),
    "three heights a row": (
        b"0 0 1\n1 0 1\n2 0 1\n0 1 2\n1 1 1\n3 1 1\n",
        "spacing=0.05,0.05, rotation=180,0,0, ",
    ),
    "a hollow": (boxes((0.2, 0.1), turned=-1, up=0.1), ""),
    "boxes beside each other": (boxes((0.2, 0.2), 0.3, up=0.1), ""),
    "a needle": (triangles(lambda t: t * [1e-3, 1e-3, 1.0]), ""),
}
GRAINS = """&scene title='grains', end_time=1e-6 /
&grid lower=0,0,0, upper=1,1,1, cell_size=0.1 /
&material name='m', model='cubic', density=8960, c11=170e9, c12=124e9, c44=75e9 /
&body material='m', shape='box', lower=0,0,0, upper=1,1,0.5 /
&grains file='{file}', {more}lower=0,0,0, upper=1,1,1 /
"""
some = np.random.default_rng(1).uniform(size=(8, 6)) * [1, 1, 1, 360, 180, 360]


def grains(rows):
    return "".join(" ".join(f"{x:.9g}" for x in row) + "\n" for row in rows).encode()


BAD_GRAINS = {
    "radians": (grains(np.radians(some[:, 3:])), "no angle is above 6.28 in size", ""),
    "angles first": (grains(some[:, [3, 4, 5, 0, 1, 2]]), "no angle is above 6.28 in size", ""),
    "seeds in um": (grains(some * [1e6, 1e6, 1e6, 1, 1, 1]), "the seeds lie from", ""),
    "all seeds together": (grains(some * [1e-6, 1e-6, 1e-6, 1, 1, 1]), "the seeds lie from", ""),
    "angles with commas and points": (
        grains(some[:, 3:]).replace(b".", b",") + b"1.5 2,5 3,5\n",
        "line 9 has commas that are no decimal ones, or points too",
        "",
    ),
}
GOOD_GRAINS = {
    "degrees": (grains(some[:, 3:]), ""),
    "small degrees": (grains(some[:, 3:] / 100), "angles='degrees', "),
    "radians that are said": (grains(np.radians(some[:, 3:])), "angles='radians', "),
    "places and angles": (grains(some), ""),
    "numbers with commas": (grains(some).replace(b" ", b", "), ""),
}
for name, content in (
    ("h5", np.array([[0, 1, 0], [1, 2, 1], [0, 1, 0]])),
    ("h5 of one row", np.array([1, 2, 3])),
    ("h5 with NaN", np.array([[0, 1], [float("nan"), 2]])),
    ("h5 without heights", None),
):
    with h5py.File("made.h5", "w") as file:
        if content is not None:
            file["height"] = content
    made = Path("made.h5").read_bytes()
    if name == "h5":
        GOOD[name] = (made, GOOD["heights"][1])
    else:
        CASES[name] = (
            made,
            "that are not finite" if "NaN" in name else "is an HDF5 file without",
            "spacing=0.1,0.1, ",
        )
os.mkdir("scenes")
names, wanted = [], {}
for cases, status, text in (
    (CASES, 2, SCENE),
    (GOOD, 0, SCENE),
    (BAD_GRAINS, 2, GRAINS),
    (GOOD_GRAINS, 0, GRAINS),
):
    for name, (content, *rest) in cases.items():
        stem = name.replace(" ", "_")
        Path(f"{stem}.surface").write_bytes(content)
        Path(f"scenes/{stem}.nml").write_text(text.format(file=f"{stem}.surface", more=rest[-1]))
        names.append(f"scenes/{stem}.nml")
        wanted[names[-1]] = (name, status, rest[0] if status else "")
Path("scenes/directory.nml").write_text(SCENE.format(file="scenes", more=""))
names.append("scenes/directory.nml")
wanted[names[-1]] = ("a directory", 2, "is a directory")
os.mkfifo("pipe")
for stem, text in (("pipe", SCENE), ("pipe_of_grains", GRAINS)):
    Path(f"scenes/{stem}.nml").write_text(text.format(file="pipe", more=""))
    names.append(f"scenes/{stem}.nml")
    wanted[names[-1]] = ("a pipe", 2, "is a pipe or a device")
for ranks in (1, 2):
    before = sorted(os.listdir("."))
    done = subprocess.run(["mpirun", "-n", str(ranks), sys.argv[1], *names], capture_output=True, text=True)
    judge(f"the driver ends on {ranks} ranks", done.returncode == 0, done.stderr[-500:])
    blocks = done.stdout.split("== ")[1:]
    judge("as many answers as scenes", len(blocks) == len(names), f"{len(blocks)}, not {len(names)}")
    for block in blocks:
        head, *lines = block.rstrip("\n").split("\n")
        path, status = head.rsplit(" ", 1)
        name, expected, sentence = wanted[path]
        why = f"status {status}, said {lines[:2]}"
        if expected == 0:
            judge(f"{name} on {ranks} ranks: accepted", status == "0", why)
        else:
            judge(
                f"{name} on {ranks} ranks",
                status == "2"
                and len(lines) == 1
                and sentence in lines[0]
                and lines[0].startswith(("line 5, &tool file=", "line 5, &grains file=")),
                why,
            )
    judge("nothing is written", sorted(os.listdir(".")) == before, str(os.listdir(".")))


def run(*arguments, text=""):
    return subprocess.run(
        ["mpirun", "-n", "2", os.environ["GIMP3D"], *arguments], input=text, capture_output=True, text=True
    )


scene = (
    SCENE.format(file="die.stl", more="")
    + "&output directory='out', formats='none' /\n&checkpoint every_steps=2 /\n"
)
surfaces.write("die.stl", ball)
done = run(text=scene)
judge("a run with a surface", done.returncode == 0, done.stderr[-300:])
case = Path("out/case.nml").read_text()
judge("case.nml names the checksum", "checksum='" in case, case)
longer = scene.replace("title='a surface'", "title='a surface', restart='out'").replace(
    "end_time=1e-6", "end_time=2e-6"
)
done = run(text=longer)
judge("it goes on", done.returncode == 0, done.stderr[-300:])
surfaces.write("die.stl", ball * 1.001)
for name, done in (
    ("its scene", run(text=longer.replace("2e-6", "3e-6"))),
    ("--restart", run("--restart", "out")),
):
    said = [line for line in done.stderr.split("\n") if line.startswith("gimp3d: ")]
    judge(
        f"a changed file is refused with {name}",
        done.returncode == 2 and len(said) == 1 and "die.stl" in said[0] and "has been changed" in said[0],
        f"status {done.returncode}: {said}",
    )
sys.exit(1 if failures else 0)
