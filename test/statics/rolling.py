"""input/slow_rolling.nml: quasi-static steps with friction against the explicit scheme on the same cells and
with the same domains. usage: rolling.py (in an empty directory; GIMP3D is the program)"""

import numpy as np

from static_scenes import ROOT, check, finish, require, run, tool


def means(directory, since, until, width):
    """Load across and along, and moment, over a time in which all is steady, of a width of 1 m."""
    history = tool(directory, "roll")
    steady = (history["time"] >= since) & (history["time"] <= until)
    time = history["time"][steady]
    require(f"{directory}: rows", steady.sum() > 10)
    return [
        np.trapezoid(history[name][steady], time) / np.ptp(time) / width
        for name in ("load_z", "load_x", "moment_y")
    ]


if __name__ == "__main__":
    run((ROOT / "input/slow_rolling.nml").read_text().replace("out/slow_rolling", "slow"), 1)
    slow = means("slow", 0.2, 0.34, 4e-3)
    text = (ROOT / "input/rolling.nml").read_text()
    for old, new in (
        ("upper=44e-3,2e-3,14e-3, cell_size=2e-3", "upper=44e-3,4e-3,16e-3, cell_size=4e-3"),
        ("upper=-29e-3,2e-3,10e-3", "upper=-29e-3,4e-3,10e-3"),
        ("out/rolling", "quick"),
    ):
        require(f"rolling.nml has {old}", old in text)
        text = text.replace(old, new)
    run(text + "&time domain='stretch' /\n", 1)
    quick = means("quick", 1.2e-3, 2.4e-3, 4e-3)
    print(f"   load {slow[0]:.4g} and {quick[0]:.4g} N/m, moment {slow[2]:.4g} and {quick[2]:.4g} N m/m")
    check("slow rolling: force along the plate, which nothing holds, over the load", slow[1] / slow[0], 1e-5)
    check("slow rolling: load against the explicit scheme's, relative", slow[0] / quick[0] - 1, 0.07)
    check("slow rolling: moment against the explicit scheme's, relative", slow[2] / quick[2] - 1, 0.03)
    finish()
