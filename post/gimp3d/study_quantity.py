"""Curves that a study compares: from what a run wrote, from theory, from tables."""

import numpy as np

from . import indentation
from .run_data import History, Unreadable
from .scene_text import BadSetting
from .study_scene import is_about_point


def curve_of(run, quantity):
    """x and y of a run: depth (m) and load of the whole body (N); time (s, as at the given speed) and a
    column; 0 and a number."""
    if quantity.kind == "printed":
        return np.zeros(1), np.array([run.record["printed"][quantity.column or "error"]])
    speed = run.settings.get("speed", 1.0)
    if quantity.kind == "load":
        return load(run, quantity)
    if quantity.kind == "energy":
        history = History(run.directory / "energy.dat")
        share = 1.0 if quantity.column == "balance_error" else run.share
        return history["time"] * speed, share * column_of(history, quantity.column)
    time, values = probe(run, quantity)
    if quantity.kind == "frequency":
        return np.zeros(1), np.array([frequency(time, values, run)])
    return time * speed, values


def worst_balance(run):
    """Largest error of the energy balance over the second half of the time, per cent; None where a run has no
    energy.dat."""
    if not (run.directory / "energy.dat").is_file():
        return None
    history = History(run.directory / "energy.dat")
    late = history["time"] >= 0.5 * history["time"][-1]
    return 100 * float(np.max(np.abs(history["balance_error"][late])))


def tool_of(case, quantity):
    tools = case.get("tool", [])
    for number, tool in enumerate(tools, 1):
        if not quantity.tool or tool.get("name", [f"tool{number}"])[0] == quantity.tool:
            return tool, tool.get("name", [f"tool{number}"])[0]
    raise BadSetting(f"quantity {quantity.name}: the scene has no tool {quantity.tool}")


def load(run, quantity):
    tool, name = tool_of(run.case, quantity)
    history = History(run.directory / f"tool_{name}.dat")
    _, gap = indentation.indented_body(run.case, tool, history)
    share = indentation.share_of_body(history)
    along = indentation.unit_axis(tool)
    # up to the largest depth: the way back is another curve
    way = slice(0, int(np.argmax(history["depth"])) + 1)
    force = -sum(history[f"load_{axis}"] * part for axis, part in zip("xyz", along)) / share
    return history["depth"][way] - gap, force[way]


def probe(run, quantity):
    """Time and the column of a probe, or from those about a point its value there; displacement_x, _y, _z
    are made of positions."""
    if not quantity.point:
        history = History(run.directory / f"probe_{quantity.probe}.dat")
        return history["time"], column_of(history, quantity.column)
    names = [one["name"][0] for one in run.case["probe"] if is_about_point(one)]
    probes = [History(run.directory / f"probe_{name}.dat") for name in names]
    weights = weights_at(run, quantity, np.array([[one[axis][0] for axis in "xyz"] for one in probes]))
    values = sum(weight * column_of(one, quantity.column) for weight, one in zip(weights, probes))
    return probes[0]["time"], values


def weights_at(run, quantity, start):
    """What particles (n, 3) about the point count: the mean where they lie evenly about it, else what a
    straight line through them has there. At a side of symmetry their middle stands for the point."""
    grid, sides = run.case["grid"][0], run.case["grid"][0].get("boundary", [])
    off = (start - quantity.point) / run.cell
    for i in range(3):
        at_side = min(abs(quantity.point[i] - grid[side][i]) for side in ("lower", "upper")) < 1e-6 * run.cell
        if at_side and set(sides) & {"symmetry"} and np.ptp(off[:, i]) < 1e-6:
            off[:, i] = 0.0
        elif off[:, i].min() > 1e-6 or off[:, i].max() < -1e-6:
            raise BadSetting(
                f"quantity {quantity.name}: the particles around the point all lie on one side of it along "
                f"{'xyz'[i]} (their middle is {start[:, i].mean():.6g} m) with cells of {run.cell:.4g} m"
            )
    if np.all(abs(off.mean(axis=0)) < 1e-6):
        return np.full(len(off), 1 / len(off))
    return np.linalg.pinv(np.column_stack([np.ones(len(off)), off]))[0]


def column_of(history, name):
    if name.startswith("displacement_"):
        place = history[name[-1]]
        return place - place[0]
    if name not in history.columns:
        raise BadSetting(
            f"column='{name}': there are {', '.join(history.columns)}, displacement_x, displacement_y, "
            "displacement_z"
        )
    return history[name]


def frequency(time, values, run):
    """Of a vibration about its mean, Hz: from the first to the last time that it passes the mean upwards."""
    off = values - 0.5 * (values.max() + values.min())
    up = np.nonzero((off[:-1] < 0) & (off[1:] >= 0))[0]
    if len(up) < 2:
        raise Unreadable(f"{run.directory}: fewer than two periods of a vibration")
    at = time[up] - off[up] * (time[up + 1] - time[up]) / (off[up + 1] - off[up])
    return (len(at) - 1) / (at[-1] - at[0])


def suddenly_heavy_bar(run, quantity):
    """A bar along z in uniaxial strain on a roller or symmetry base at the grid's lower side, at rest until
    gravity acts at time 0: displacement along z of the probe's particle over time, from 400 modes. With wave
    speed c, length L, acceleration g downwards,

       u(Z, t) = -sum_k 2 g/(L w_k^2 q_k) sin(q_k Z) (1 - cos(w_k t)),   q_k = (k - 1/2) pi/L,  w_k = c q_k
    """
    material, body = run.case["material"][0], run.case["body"][0]
    young, poisson = material["young"][0], material["poisson"][0]
    c = np.sqrt(young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson)) / material["density"][0])
    length, base = body["upper"][2] - body["lower"][2], body["lower"][2]
    g = -run.case["gravity"][0]["acceleration"][2]
    history = History(run.directory / f"probe_{quantity.probe}.dat")
    q = (np.arange(1, 401) - 0.5) * np.pi / length
    shape = 2 * g / (length * (c * q) ** 2 * q) * np.sin(q * (history["z"][0] - base))
    return history["time"], -(1 - np.cos(np.outer(history["time"], c * q))) @ shape


theories = {"suddenly_heavy_bar": suddenly_heavy_bar}


def reference_of(quantity, runs, folder):
    """A known answer: (name, x, y) with y a function of a run's x where it has none of its own; None for
    Richardson's limit and runs as references."""
    wanted = quantity.reference
    if quantity.kind == "printed":
        return "exact", None
    if isinstance(wanted, (int, float)) and not isinstance(wanted, bool):
        return f"{wanted:.6g}", (np.zeros(1), np.full(1, float(wanted)))
    if wanted == "theory" and quantity.kind == "load":
        tool, name = tool_of(runs[0].case, quantity)
        history = History(runs[0].directory / f"tool_{name}.dat")
        theory = indentation.half_space_theory(runs[0].case, tool, history)
        if theory is None:
            raise BadSetting(f"quantity {quantity.name}: there is no theory for this tool")
        return theory[0], theory[1]
    if wanted == "theory":
        if quantity.theory not in theories:
            raise BadSetting(
                f"quantity {quantity.name}: theory='{quantity.theory}'; there are {', '.join(theories)}"
            )
        return quantity.theory.replace("_", " "), theories[quantity.theory]
    if isinstance(wanted, str) and wanted != "richardson":
        return wanted.rsplit("/", 1)[-1], indentation.read_reference(folder / wanted)
    return None


def places(quantity, curves, table=None):
    """Where curves are compared: the table's own places in the window of the way that all curves go, or 200
    places in it."""
    if len(next(iter(curves))[0]) == 1:
        return np.zeros(1)
    last = min(x[-1] for x, _ in curves)
    if table is not None:
        last = min(last * (1 + 1e-9), table[0][-1] * (1 + 1e-9))
        own = table[0][
            (table[0] > quantity.window[0] * last * (1 - 1e-9))
            & (table[0] <= quantity.window[1] * last * (1 + 1e-9))
        ]
        if len(own) < 3:
            raise BadSetting(
                f"quantity {quantity.name}: the reference has fewer than 3 rows where the runs are compared"
            )
        return own
    return np.linspace(quantity.window[0], quantity.window[1], 201)[1:] * last


def at(quantity, curve, x):
    """A curve at given places: lines fitted around them for loads, else straight in between."""
    own, values = curve
    if len(own) == 1:
        return values
    if quantity.kind != "load" or quantity.smooth == 0:
        return np.interp(x, own, values)
    reach, found = quantity.smooth * x[-1], []
    for here in x:
        near = np.abs(own - here) <= reach
        if np.count_nonzero(near) < 4:
            found.append(np.interp(here, own, values))
        else:
            found.append(np.polyfit(own[near] - here, values[near], 1)[1])
    return np.array(found)
