"""A short study from end to end. usage: ladder.py ROOT GIMP3D"""

import csv
import json
import subprocess
import sys
from pathlib import Path
from checks import finish, require
from gimp3d import RunFailed, solve_for, study_of

ROOT, GIMP3D = Path(sys.argv[1]), sys.argv[2]
SETTING = f"""
title = "short"
cells = [2e-6, 1.3333333333333333e-6, 1e-6]
comparisons = [["1 a cell", "8 a cell"]]
targets = [5]
about = {{cell = 1.3333333333333333e-6}}
[quantity.load]
kind = "load"
reference = "{ROOT}/test/references/fem/sphere_hypo_h0.1.csv"
reference_error = 0.3
[quantity.limit]
kind = "load"
[families."8 a cell"]
[families."1 a cell"]
particles = 1
[shares]
contact = {{tolerance = 1e-11}}
inertia = {{speed = 2.0}}
"""


def study(*options, setting="setting.toml", scene=ROOT / "input/hertz.nml"):
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "gimp3d",
            "study",
            scene,
            "--setting",
            setting,
            "--out",
            "out",
            "--program",
            GIMP3D,
            *options,
        ],
        capture_output=True,
        text=True,
    )
    return done.returncode, done.stdout, done.stderr


def rows(path):
    with open(path) as file:
        return list(csv.DictReader(file))


def records():
    return {path: path.read_text() for path in sorted(Path("out/runs").glob("*/study.json"))}


Path("setting.toml").write_text(SETTING)
status, said, wrong = study("--repeats", "1", "--budget", "1e-6")
print(said + wrong)
table = rows("out/load/study.csv")
require(
    "a budget that the first run takes up: the rest is left out and told",
    status == 0
    and sum(line.startswith("left out: ") for line in said.splitlines()) == 8
    and sum(bool(row["error_percent"]) for row in table) == 1
    and sum(row["fault"] == "left out: budget" for row in table) == 5,
)
before = records()
status, said, wrong = study("--repeats", "1")
print(said + wrong)
require("the study goes on", status == 0 and not wrong)
require(
    "what was run is not run again",
    all(records()[path] == text for path, text in before.items()) and len(records()) > len(before),
)
table = {(row["family"], round(float(row["cell"]) * 1e9)): row for row in rows("out/load/study.csv")}
require(
    "all six rungs stand in the table",
    len(table) == 6 and all(row["error_percent"] and not row["fault"] for row in table.values()),
)
errors = {key: float(row["error_percent"]) for key, row in table.items()}
seconds = {key: float(row["core_seconds"]) for key, row in table.items()}
eight = [errors["8 a cell", cell] for cell in (2000, 1333, 1000)]
require(f"8 a cell: the error falls with every finer grid: {eight}", eight[0] > eight[1] > eight[2])
require("8 a cell: below 1 % on 1000 nm, with the compliance below a cell", eight[2] < 1)
# With 8 a cell contact has the compliance below a cell: the finest grid is within .6 %, the reference known
# to .3 %.
fitted = next(line for line in said.splitlines() if line.startswith("Fitted orders"))
eight, one = (float(fitted.split(f"{name} a cell ")[1].rstrip(".").split(",")[0]) for name in "81")
require(f"8 a cell: order {eight} is above 1", eight > 1)
require(f"1 a cell: order {one} is between 1 and 2.5", 1 < one < 2.5)
front = {
    key
    for key in table
    if not any(
        seconds[o] <= seconds[key]
        and errors[o] < errors[key]
        or seconds[o] < seconds[key]
        and errors[o] <= errors[key]
        for o in table
    )
}
require(
    f"the front is that of all pairs: {sorted(front)}",
    front == {key for key, row in table.items() if row["on_front"] == "1"},
)
fewer = [
    int(table["1 a cell", cell]["particles"]) / int(table["8 a cell", cell]["particles"])
    for cell in (2000, 1000)
]
require("1 a cell has an eighth of the particles", all(0.115 < share < 0.135 for share in fewer))
shares = {row["share"]: float(row["change_percent"]) for row in rows("out/load/shares.csv")}
print(shares)
require(
    "shares: space above inertia above a contact solved more sharply",
    shares["space"] > shares["inertia"] > shares["contact"] >= 0,
)
require(
    "shares: a hundred in all",
    abs(sum(float(row["share_percent"]) for row in rows("out/load/shares.csv")) - 100) < 1e-6,
)
require("answers: what 5 % costs, the comparison", "5 % costs" in said and "1 a cell at equal error" in said)
picture = Path("out/load/study.png").read_bytes()
require("a picture", picture[:8] == b"\x89PNG\r\n\x1a\n" and len(picture) > 20000)

before = records()
found = study_of(
    ROOT / "input/hertz.nml", setting="setting.toml", out="out", program=GIMP3D, repeats=1, quantity="load"
)
csv_rows = rows("out/load/study.csv")
require(
    "from Python: the same table as data",
    [f"{row['error_percent']}" for row in found["runs"]] == [row["error_percent"] for row in csv_rows]
    and found["answers"] == Path("out/load/answers.txt").read_text().splitlines()
    and set(found["orders"]) == {"8 a cell", "1 a cell"},
    found,
)
try:
    solve_for("absent.nml", error=1, program=GIMP3D)
    require("from Python: a scene that is not there", False)
except RunFailed as failure:
    require("from Python: a scene that is not there", failure.status == 2 and "absent.nml" in str(failure))
status, said, wrong = study("--repeats", "1", "--quantity", "limit")
require("another quantity of the same runs: nothing is run", status == 0 and records() == before)
errors = (
    {
        row["cell"]: float(row["error_percent"])
        for row in rows("out/limit/study.csv")
        if row["family"] == "8 a cell" and row["error_percent"]
    }
    if status == 0
    else {}
)
require(
    f"beside the grids' own limit, or the finest run and a sentence: {errors}",
    "Richardson's limit of 8 a cell (order" in said
    and len(errors) == 3
    or "Richardson's limit is not to be had" in said,
)

# A broken record, and wrong settings
one = next(iter(records()))
one.write_text("{")
status, said, wrong = study("--repeats", "1")
require(
    "a record that is cut off is told, with its name",
    status == 2 and str(one.parent.name) in wrong and "Traceback" not in wrong,
)
one.write_text(before[one])
json.loads(one.read_text())
for sentence, options, old, new in (
    ("QUANTITY=mass", ["--quantity", "mass"], "", ""),
    ("unknown knob", [], "tolerance =", "tolerances ="),
    ("no.csv", [], "sphere_hypo_h0.1", "no"),
    ("--budget", ["--budget", "-1"], "", ""),
    ("must be", [], "speed = 2.0", '"scene.end_time" = -1.0'),
):
    Path("bad.toml").write_text(SETTING.replace(old, new) if old else SETTING)
    status, said, wrong = study("--repeats", "1", *options, setting="bad.toml")
    require(
        f"refused: {sentence}: {wrong.strip()[-150:]}",
        status == 2 and sentence in wrong and "Traceback" not in wrong,
    )
    if sentence == "no.csv":
        left = sorted(path.name for path in Path("out/load").iterdir())
        require(f"a study that fails leaves no answer of an earlier one: {left}", not left)
status, said, wrong = study(scene="absent.nml")
require(
    "a scene that is not there is refused", status == 2 and "absent.nml" in wrong and "Traceback" not in wrong
)
for kind, content in (
    ("empty", ""),
    ("words", "&grid cell_size='a' /\n&body /\n"),
    ("NaN", "&grid cell_size=NaN /\n"),
):
    Path("spoilt.nml").write_text(content)
    status, said, wrong = study(scene="spoilt.nml")
    require(
        f"a scene that is {kind} is refused: {wrong.strip()[-150:]}", status == 2 and wrong.count("\n") == 1
    )
finish()
