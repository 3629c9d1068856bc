"""post/gimp3d/error_bar.py on made-up answers. usage: error_bar.py ROOT WORK

The hardness on cells h is 2 GPa + c h^p: on two grids of any ratio the error of first order is exact for p =
1, on three it is 1.25 times the true one for the p that they show."""

import contextlib
import io
import json
import math
import sys
from pathlib import Path

ROOT, WORK = Path(sys.argv[1]), Path(sys.argv[2])
from gimp3d import error_bar
from checks import finish, near, require

scene = """&scene title='{title}', end_time={end} /
&grid lower=0,0,0, upper=38.4e-6,38.4e-6,38.4e-6, cell_size={cell}, boundary='symmetry','free','symmetry','free','roller','free' /
&level lower=0,0,12.8e-6, upper=12.8e-6,12.8e-6,38.4e-6 /
&material name='alloy', model='j2', density=2710, young={young}, poisson=0.3, yield_stress=700e6 /
&body material='alloy', shape='box', lower=0,0,0, upper={width},25.6e-6,25.6e-6 /
&tool name='cone', shape='cone', half_angle={angle}, tip=0,0,25.6e-6, times=0,{end}, speeds=10,10 /
&output directory='{title}' /
"""


def run(
    name,
    cell,
    hardness,
    sigma=0.0,
    depth=2e-7,
    end=1e-9,
    young=70e9,
    width=25.6e-6,
    angle=70.3,
    source="column",
):
    """A directory with what a run and `make hardness` leave there."""
    (WORK / name).mkdir(exist_ok=True)
    (WORK / name / "case.nml").write_text(
        scene.format(title=name, cell=cell, end=end, young=young, width=width, angle=angle)
    )
    answer = {
        "max_depth": depth,
        "hardness_true": hardness,
        "hardness_true_uncertainty": sigma,
        "young_true": None,
        "area_true_source": source,
    }
    (WORK / name / "hardness.json").write_text(json.dumps(answer))
    return str(WORK / name)


def bars(*names):
    """Status, what is printed, and the row of the true hardness in error_bar.json of the finest run (first of
    the names)."""
    (Path(names[0]) / "error_bar.json").unlink(missing_ok=True)
    said = io.StringIO()
    sys.argv = ["error_bar.py", *names]
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
        status = error_bar.main()
    path = Path(names[0]) / "error_bar.json"
    found = json.loads(path.read_text())["quantities"] if path.is_file() else []
    return status, said.getvalue(), next((row for row in found if row["key"] == "hardness_true"), None)


def law(cell, p):
    return 2e9 + 1e8 * (cell / 2e-6) ** p


fine, middle, coarse = 1.6e-6, 2.56e-6, 3.2e-6

status, said, row = bars(run("fine", fine, law(fine, 1), 3e6), run("coarse", coarse, law(coarse, 1), 9e6))
require(
    "two grids of first order: the error is the true one",
    status == 0 and near(row["parts"]["grid"], law(fine, 1) - 2e9, 1e-6),
)
require(
    "the uncertainty is that of the finest run", row["parts"]["fit"] == 3e6 and row["value"] == law(fine, 1)
)
require(
    "the error bar is the root of the sum of the squares", near(row["error_bar"], math.hypot(8e7, 3e6), 1e-6)
)
require(
    "the table has it in per cent",
    "hardness, true" in said and "1, assumed" in said and "cells of 800, 1600 nm" in said,
)
require("what no run has is left out", "E, true" not in said)

for p in (0.7, 1.0, 1.6):
    ones = [
        run(name, cell, law(cell, p))
        for name, cell in (("fine", fine), ("middle", middle), ("coarse", coarse))
    ]
    status, said, row = bars(*ones)
    require(
        f"three grids of order {p}: 1.25 times the true error",
        near(row["parts"]["grid"], 1.25 * (law(fine, p) - 2e9), 1e-4),
    )
    require(f"... and the order is said: {row['order']}", row["order"] == f"{p:.2f}")
    require(
        "... in whatever order they are named",
        near(bars(ones[0], ones[2], ones[1])[2]["error_bar"], row["error_bar"], 1e-6),
    )
mixed = [ones[0], ones[1], run("coarse", coarse, law(coarse, 1.6), source="profile")]
status, said, row = bars(*mixed)
require(
    "true areas of different sources: no order, and it is said",
    row["order"] == "none: spread"
    and near(row["parts"]["grid"], law(coarse, 1.6) - law(fine, 1.6), 1e-6)
    and "of the profile in some runs" in said,
)
ones = [
    run(name, cell, law(cell, 4)) for name, cell in (("fine", fine), ("middle", middle), ("coarse", coarse))
]
row = bars(*ones)[2]
step = (law(middle, 4) - law(fine, 4)) / ((middle / fine) ** 2 - 1)
require(
    "an order above 2 counts as 2",
    near(row["parts"]["grid"], 1.25 * step, 1e-6) and row["order"].startswith("2, not"),
)
ones = [run("fine", fine, 2.00e9), run("middle", middle, 2.03e9), run("coarse", coarse, 1.99e9)]
row = bars(*ones)[2]
require(
    "without an order: the spread", near(row["parts"]["grid"], 4e7, 1e-6) and row["order"] == "none: spread"
)

ones = [run("fine", fine, 2.0e9), run("coarse", coarse, 2.1e9), run("slow", coarse, 2.06e9, end=2e-9)]
row = bars(*ones)[2]
require(
    "half the speed, beside the run of its cells",
    near(row["parts"]["speed"], 8e7, 1e-6) and near(row["parts"]["grid"], 1e8, 1e-6),
)
require("... counts in the error bar", near(row["error_bar"], math.hypot(8e7, 1e8), 1e-6))
ones = [run("fine", fine, 2.0e9), run("coarse", coarse, 2.1e9), run("fast", coarse, 2.16e9, end=0.5e-9)]
require("twice the speed", near(bars(*ones)[2]["parts"]["speed"], 6e7, 1e-6))
ones = [run("fine", fine, 2.0e9), run("coarse", coarse, 2.1e9), run("wide", fine, 2.03e9, width=28.8e-6)]
row = bars(*ones)[2]
require("a wider body is said by its name", near(row["parts"]["body.upper"], 3e7, 1e-6))

as_block = scene
scene = as_block.replace("&grid ", "&grid geometry='axisymmetric', ")
scene = scene.replace("38.4e-6,38.4e-6,38.4e-6", "38.4e-6,{cell},38.4e-6")
scene = scene.replace("upper={width},25.6e-6,25.6e-6", "upper={width},{cell},25.6e-6")
row = bars(run("fine", fine, law(fine, 1)), run("coarse", coarse, law(coarse, 1)))[2]
require("sections, one cell along y of any edge", near(row["parts"]["grid"], law(fine, 1) - 2e9, 1e-6))
scene = as_block

good = run("fine", fine, 2e9)
for name, word, more in (
    ("other", "another problem", {"young": 200e9}),
    ("blunt", "&tool half_angle", {"angle": 68}),
    ("deep", "goes to 210 nm", {"depth": 2.1e-7}),
    ("slow", "one thing at a time", {"end": 2e-9}),
):
    status, said, row = bars(good, run(name, coarse, 2.1e9, **more))
    require(f"refused: {name}", status == 2 and word in said and said.count("\n") == 1 and row is None)
status, said, row = bars(good, run("same", fine, 2.1e9))
require("refused: the same cells twice", status == 2 and "nothing else in it differs" in said)
status, said, row = bars(good)
require("refused: one run", status == 2 and "two or more" in said)
status, said, row = bars(good, str(WORK / "absent"))
require("refused: no directory", status == 2 and "no such directory" in said)
(WORK / "bare").mkdir(exist_ok=True)
status, said, row = bars(good, str(WORK / "bare"))
require(
    "refused: no hardness.json, with the command that makes it",
    status == 2 and f"make hardness RUN={WORK / 'bare'}" in said,
)
run("coarse", coarse, law(coarse, 1))
run("fine", fine, law(fine, 1))
finish()
