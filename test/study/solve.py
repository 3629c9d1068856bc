"""`make solve` with a stand-in for the program whose errors and times are known (pretend.py), and its model
with made-up numbers.

usage: solve.py ROOT"""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(sys.argv[1])
from gimp3d.solve import seconds_of, speed_is_free, time_step_of
from gimp3d.solve_model import Choice, Errors, Price, Sample, choose
from gimp3d.scene_text import BadSetting
from gimp3d.study_scene import side_that_moves
from checks import finish, near, require


# ---- the model ----
x = np.linspace(0.5, 1, 50)
exact = lambda h, speed=1.0, step=1.0: 3 * x**1.5 + 0.1 * x * h**1.7 + 0.02 * speed + 0.01 * step * x
sample = lambda h, speed=1.0, step=1.0: Sample(h, speed, step, exact(h, speed, step))
errors = Errors(
    [sample(h) for h in (1.0, 0.5, 0.3)],
    (sample(0.5), sample(0.5, speed=2.0)),
    (sample(0.5), sample(0.5, step=0.5)),
)
rms = lambda curve: 100 * np.sqrt(np.mean(curve**2)) / 3
parts = errors.parts(0.2, speed=0.5, step=0.25)
require(f"order {errors.order:.6f}", near(errors.order, 1.7, 1e-6) and not errors.notes)
require(
    "each part by itself",
    near(parts["space"], rms(0.1 * x * 0.2**1.7), 1e-6)
    and near(parts["speed"], rms(0.01 + 0 * x), 1e-6)
    and near(parts["time step"], rms(0.0025 * x), 1e-6),
)
require("parts add as sizes", near(errors.total(0.2, 0.5, 0.25), sum(parts.values())))
large = lambda body, speed: Sample(1.0, speed, 1.0, exact(1.0, speed * body) + 0.3 * x / body, body)
finite = dict(speeds=(large(1.0, 1.0), large(1.0, 2.0)), bodies=(large(1.0, 1.0), large(1.6, 0.7)))
ladder = [Sample(h, 1.0, 1.0, exact(h) + 0.3 * x) for h in (1.0, 0.5, 0.3)]
told, counted = Errors(ladder, **finite), Errors(ladder, **finite, half_space=True)
require(
    "a finite body: told, or a part that goes down with its size, and the limit is without it",
    near(told.finite_body(), 100 * np.sqrt(np.mean((0.3 * x) ** 2)) / told.scale, 1e-6)
    and "finite body" not in told.parts(0.3)
    and near(counted.parts(0.3, body=2.0)["finite body"], 0.5 * rms(0.3 * x), 1e-2)
    and near(counted.parts(0.3, body=2.0)["speed"], 2 * counted.parts(0.3)["speed"])
    and np.allclose(counted.limit + 0.3 * x, told.limit),
)
slower = Errors(
    [sample(1.0), sample(0.5), sample(0.3, speed=0.25)],
    (sample(0.5), sample(0.5, speed=2.0)),
    (sample(0.5), sample(0.5, step=0.5)),
)
require(
    "a grid at another speed is taken to the speed of none",
    near(slower.order, 1.7, 1e-6) and near(slower.total(0.3, 0.25), errors.total(0.3, 0.25), 1e-6),
)
for law, taken in ((1.0, 1.0), (2.0, 2.0), (0.3, 0.5), (4.0, 3.0)):
    known = Errors([Sample(h, 1.0, 1.0, 3 * x + 0.2 * x * h**law) for h in (1.0, 0.5, 0.3)])
    true = 100 * np.sqrt(np.mean((0.2 * x * 0.3**law) ** 2)) / 3
    require(
        f"runs with an error of order {law:g}: {known.order:.3g} is taken, {known.total(0.3):.3g} % said, "
        f"{true:.3g} % true",
        near(known.order, taken, 1e-6)
        and near(known.total(0.3), true, 1e-6) == (law == taken)
        and abs(known.total(0.3) - true) < known.trust
        and bool(known.notes) == (law != taken),
    )
rough = Errors([Sample(h, 1.0, 1.0, 3 * x + c) for h, c in ((1.0, 0.3), (0.5, 0.0), (0.25, 0.06))])
require(
    f"grids without an order: the first, and a note: {rough.notes}",
    rough.order == 1.0
    and "no order in the cell" in rough.notes[0]
    and rough.total(0.25) > 1.9
    and rough.trust > 1,
)
require("no part that was not looked at", set(rough.parts(1.0)) == {"space"})
price = Price([(s, u, 1e-3 * s + 1e-7 * u) for s, u in ((100, 1e5), (200, 2e6), (400, 3e7))])
require("the price of steps and particle-steps", near(price.of(1000, 1e9), 101, 1e-6))
require(
    "and of particle-steps alone, where the fit would be below 0",
    near(Price([(100, 1e6, 1.0), (400, 8e6, 9.0)]).of(1, 8e6), 9.0),
)
options = [
    Choice({}, (n,), error, seconds, 1.0)
    for n, (error, seconds) in enumerate([(5, 1), (1.5, 10), (0.9, 30), (0.7, 20), (0.1, 900)])
]
require("the cheapest within the margin of the target", choose(options, 1.0, 1e3)[0] is options[3])
require(
    "none",
    choose(options, 0.1, 1e3)[0] is None
    and choose(options, 0.1, 25)[1] is options[3]
    and choose(options, 0.1, 0.5)[1] is None,
)
quasi = {"tool": [{"speeds": [0, 20]}], "material": [{"model": ["j2"]}], "body": [{}]}
require("the speed is free where only a tool is prescribed", speed_is_free(quasi))
require(
    "and not in impact, with rates, with gravity, without anything prescribed",
    not any(
        speed_is_free({**quasi, **more})
        for more in (
            {"body": [{"velocity": [0, 0, -1]}]},
            {"material": [{"model": ["norton"]}]},
            {"gravity": [{}]},
            {"tool": []},
        )
    ),
)
require(
    "a part of a time step is of the scene's own",
    time_step_of({}) == ("safety", 0.35)
    and time_step_of({"time": [{"safety": [0.1], "time_step": [0.0]}]}) == ("safety", 0.1)
    and time_step_of({"time": [{"safety": [0.1], "time_step": [3e-9]}]}) == ("time_step", 3e-9),
)
times = {"600": 600, "90s": 90, "10min": 600, "2h": 7200, "1e3": 1000, "0.5 h": 1800}
require("times of a budget", all(seconds_of(text) == value for text, value in times.items()))
held = {
    "grid": [{"lower": [0, 0, 0], "upper": [6, 6, 6], "boundary": [*["free"] * 3, "roller", "free", "free"]}],
    "body": [{"upper": [6, 6, 4]}],
}
require(
    "cells that would move a side away from the body that it holds",
    side_that_moves(held, 4.0) == "y+"
    and side_that_moves(held, 2.0) is None
    and side_that_moves({**held, "body": [{"upper": [6, 5, 4]}]}, 4.0) is None,
)
try:
    Errors([Sample(h, 1.0, 1.0, 0 * x) for h in (1.0, 0.5, 0.3)])
    require("a quantity that is 0 has no error in per cent", False)
except BadSetting as error:
    require("a quantity that is 0 has no error in per cent", "is 0" in str(error))

# ---- the command ----
SETTING = """
[quantity.load]
kind = "load"
[families.uniform]
values = [1e-6]
"""
BOXES = "level_boxes = [[[0, 0, 12e-6], [8e-6, 8e-6, 1]], [[0, 0, 16e-6], [4e-6, 4e-6, 1]]]\n"
Path("plain.toml").write_text(SETTING)
Path("boxes.toml").write_text(BOXES + SETTING)
Path("program").write_text("not run\n")
launch = f"{sys.executable} {Path(__file__).with_name('pretend.py')}"


scene = ROOT / "input/hertz.nml"
lying = Path("lying.nml")  # the cylinder across the tool's way: pressed on its curved side
lying.write_text(scene.read_text().replace("shape='cylinder'", "shape='cylinder', axis=1,0,0"))


def solve(error, budget, setting="plain", out="out", ranks=2, half_space=False, scene=scene, **pretend):
    Path("calls").unlink(missing_ok=True)
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "gimp3d",
            "solve",
            scene,
            "--error",
            str(error),
            "--budget",
            str(budget),
            "--setting",
            f"{setting}.toml",
            "--out",
            out,
            "--program",
            "program",
            "--launch",
            launch,
            "--ranks",
            str(ranks),
            *["--half-space"] * half_space,
        ],
        capture_output=True,
        text=True,
        env={
            **os.environ,
            "PRETEND_LOG": str(Path("calls").resolve()),
            **{f"PRETEND_{k}": str(v) for k, v in pretend.items()},
        },
    )
    print(done.stdout + done.stderr)
    answer = Path(out) / "answer.json"
    return (
        done.returncode,
        done.stdout + done.stderr,
        json.loads(answer.read_text()) if done.returncode == 0 else None,
        [line.split() for line in Path("calls").read_text().splitlines()] if Path("calls").exists() else [],
    )


def true_error(answer, a, order, b=0.0, c=0.0):
    """Rms over the second half of the depth of what pretend.py adds, per cent of the largest exact load."""
    settings = answer["settings"]
    off = (
        a * (answer["finest_cell"] * 1e6) ** order
        + b * settings.get("speed", 1.0)
        + c * settings.get("safety", 0.35) / 0.35
    )
    depth = np.linspace(0.5, 1, 201)[1:]
    return 100 * abs(off) * np.sqrt(np.mean(depth**3))


for target in (2, 0.5):
    status, said, answer, calls = solve(target, 4e3, out=f"out_{target}", A=0.02, ORDER=1.5, B=0.003, C=0.001)
    true = true_error(answer, 0.02, 1.5, 0.003, 0.001)
    require(
        f"{target} %: met, {answer['error']:.3g} % said, {true:.3g} % true",
        status == 0
        and answer["met"]
        and true <= target
        and near(answer["error"], true, 0.02)
        and answer["error_uncertainty"] < target,
    )
    require(
        f"predicted {answer['predicted_seconds']:.3g} s, took {answer['seconds']:.3g} s; predicted "
        f"{answer['predicted_megabytes']:.3g} MB, {answer['megabytes']:.3g} MB",
        near(answer["predicted_seconds"], answer["seconds"], 0.1)
        and near(answer["predicted_megabytes"], answer["megabytes"], 0.1),
    )
    chosen = (Path(f"out_{target}") / "chosen.nml").read_text()
    require(
        "the scene that was chosen is there, with its outputs",
        "&output" in chosen
        and f"out_{target}/run'" in chosen
        and f"cell_size={answer['settings']['cell']!r}" in chosen,
    )
cheaper = min(calls and [float(call[1]) for call in calls if call[0] == "run"])
require("nothing finer than what was chosen was run", near(cheaper * 1e-6, answer["finest_cell"], 1e-3))
_, _, levelled, _ = solve(0.5, 1e5, "boxes", out="out_boxes", A=0.02, ORDER=1.5)
_, _, uniform, _ = solve(0.5, 1e5, out="out_uniform", A=0.02, ORDER=1.5)
require(
    f"levels where they are cheaper: {levelled['settings']}",
    levelled["settings"]["levels"] > 0
    and levelled["seconds"] < 0.3 * uniform["seconds"]
    and levelled["error"] <= 0.5,
)
require(
    f"levels cost more a particle-step: {levelled['predicted_seconds']:.3g} s predicted, took "
    f"{levelled['seconds']:.3g}",
    near(levelled["predicted_seconds"], levelled["seconds"], 0.1),
)
_, said, busy, _ = solve(0.5, 1e5, "boxes", out="out_busy", ranks=1, A=0.02, ORDER=1.5, SHARE=60)
require(
    f"on a busy machine the same settings; {busy['predicted_seconds']:.3g} s of the processor predicted, "
    f"took {busy['seconds']:.3g}",
    busy["settings"] == levelled["settings"]
    and near(busy["predicted_seconds"], busy["seconds"], 0.1)
    and near(busy["seconds"], levelled["seconds"], 1e-3)
    and np.allclose(busy["pace"], 1, atol=1e-3)
    and "at the pace of pilots" in said,
)
_, _, wrong, _ = solve(0.5, 1e5, "boxes", out="out_plan", A=0.02, ORDER=1.5, PLAN=1.7)
require(
    "plans that say 1.7 times what it will be are corrected by a pilot",
    near(wrong["predicted_seconds"], wrong["seconds"], 0.1),
)
_, _, again, calls = solve(0.5, 1e5, "boxes", out="out_boxes", A=0.02, ORDER=1.5)
require(
    "what was run is not run again",
    not [call for call in calls if call[0] == "run"] and again["error"] == levelled["error"],
)
status, said, _, calls = solve(0.5, 40, out="out_short", A=0.02, ORDER=1.5, B=0.003)
require(
    "a budget that does not do: what it would take, and what is to be had",
    status == 1 and "would take" in said and "is to be had" in said,
)
status, said, answer, _ = solve(0.5, 1e5, "boxes", out="out_inertia", A=0.02, ORDER=1.5, Q=0.004)
true = status == 0 and 100 * 0.004 * answer["settings"].get("speed", 1.0) ** 2 + true_error(answer, 0.02, 1.5)
require(
    f"a speed that counts by its square: one pilot more, met, {true:.3g} % true at most",
    status == 0 and "is missed" in said and "one more, slower" in said and true <= 0.5,
)
status, said, answer, _ = solve(2, 1e6, "boxes", out="out_body", A=0.02, ORDER=1.5, D=0.05)
require(
    f"a finite body is told: {answer and answer['finite_body']:.3g} %, and no part of the error",
    status == 0 and near(answer["finite_body"], 5 * np.sqrt(np.mean(np.linspace(0.5, 1, 99) ** 3)), 0.1),
)
status, said, answer, _ = solve(
    2, 1e6, "boxes", out="out_half", half_space=True, A=0.02, ORDER=1.5, D=0.05, B=0.001
)
true = true_error(answer, 0.02, 1.5, 0.001) + 100 * 0.05 / answer["settings"].get("body", 1.0)
require(
    f"with a half-space looked for the body is chosen, {answer['settings']}: {true:.3g} % true at most",
    status == 0
    and answer["settings"].get("body", 1.0) > 1
    and "finite body" in answer["parts"]
    and true <= 3.3,
)
_, said, plain, _ = solve(2, 1e6, "boxes", out="out_flat", A=0.02, ORDER=1.5, FILL=0.07)
require(
    "pressed on its flat end: nothing is said of the surface",
    "surface  " not in said and plain["surface"] == 0,
)
status, said, answer, _ = solve(2, 1e6, "boxes", out="out_lying", scene=lying, A=0.02, ORDER=1.5, FILL=0.07)
finest, shape = answer["finest_cell"] * 1e6, np.sqrt(np.mean(np.linspace(0.5, 1, 99) ** 3))
require(
    f"a curved surface: {answer['error']:.3g} +- {answer['error_uncertainty']:.3g} %, of which another "
    f"way to fill the body {answer['surface']:.3g}, exact {7 * finest * shape:.3g}",
    near(answer["surface"], 7 * finest * shape, 0.05)
    and answer["error_uncertainty"] >= answer["surface"]
    and "surface    curved: fill='share'" in said,
)
for more in (0.01, -0.03):  # of the order of the error of the grids, and larger, with the other sign
    status, said, answer, calls = solve(0.5, 1e5, out=f"out_section_{more}", A=0.02, ORDER=1.5, SECTION=more)
    finest = answer["finest_cell"] * 1e6
    true = 100 * abs(0.02 * finest**1.5 + more * finest) * shape
    require(
        f"pilots by the section, {answer['error']:.3g} +- {answer['error_uncertainty']:.3g} % said, "
        f"{true:.3g} true: what sets the body apart counts",
        status == 0
        and "pilots are given by the section" in said
        and answer["section"]["pilots"] >= 6
        and near(answer["error"], true, 0.05)
        and near(answer["section"]["difference_of_run"], 100 * abs(more) * finest * shape, 0.05)
        and answer["error_uncertainty"] >= answer["section"]["difference_of_run"]
        and answer["section"]["price"] < 0.2,
    )
_, said, plain, _ = solve(2, 1e5, out="out_no_section", A=0.02, ORDER=1.5)
require(
    "where the program gives no section: why, and pilots of the scene itself",
    "runs of the scene itself: gimp3d: line 3, &body: is no body of revolution" in said
    and plain["section"] is None,
)
solve(1000, 1e9, out="out_never", A=0.2, ORDER=1.0)
require("an answer that an earlier command gave", Path("out_never/answer.json").is_file())
status, said, answer, calls = solve(0.001, 1e9, out="out_never", A=0.2, ORDER=1.0)
left = [name for name in ("answer.json", "chosen.nml") if Path("out_never", name).exists()]
require(f"nothing of it is left where this one has none: {left}", not left)
require("an error that no settings have", status == 1 and "is not to be had" in said)
status, said, answer, _ = solve(1, 1e5, out="out_jump", A=0.02, ORDER=1.5, JUMP=0.45)
require(
    "an error that comes up below the pilots' cells is not missed in silence",
    status == 1
    or answer["error"] > 1
    or true_error(answer, 0.02, 1.5) + (5 if answer["finest_cell"] < 0.45e-6 else 0)
    <= 1 + answer["error_uncertainty"],
)
status, said, answer, _ = solve(1, 1e5, out="out_refused", A=0.02, ORDER=1.5, REFUSED="3 0.5 0.6666666667")
require(
    "cells that are refused are gone around",
    status == 0 and all(abs(1e6 * answer["settings"]["cell"] - bad) > 0.01 for bad in (3, 0.5, 2 / 3)),
)
status, said, _, _ = solve(
    1, 1e5, out="out_none", A=0.02, REFUSED="4 3 2 1.3333333333 1 0.6666666667 0.5 0.3333333333"
)
require(
    "fewer than three cells", status == 2 and "fewer than three cells" in said and "does not divide" in said
)
status, said, _, _ = solve(-1, 100, out="out_bad")
require("an error below 0", status == 2 and "ERROR must be above 0" in said)
finish()
