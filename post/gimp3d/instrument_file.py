"""A load-depth curve as the files of Hysitron's instruments have it (.hld), which micromechanics and nanodent
read: nm, uN, s."""

import math
from datetime import datetime

import numpy as np

from .oliver_pharr import ideal_area


def tip_coefficients(tool):
    """C0, C1, ... of the tip's area C0 h^2 + C1 h + C2 h^(1/2) + ... (nm2, h in nm) where the tool's form has
    it exactly: a cone or pyramid that ends in a point, a sphere. None of others."""
    if tool["shape"][0] == "sphere":
        return -math.pi, 2e9 * math.pi * tool["radius"][0]
    numbers = {name: tool[name][0] for name in ("half_angle", "faces") if name in tool}
    if tool["shape"][0] not in ("cone", "berkovich", "pyramid") or tool.get("tip_radius", [0.0])[0]:
        return None
    return ideal_area(tool["shape"][0], **numbers)(1.0), 0.0


def segment(number, kind, times, loads, points):
    begin, end = times
    return [
        f"Segment Time: {end - begin:.9e}",
        f"Segment Number: {number}",
        f"Segment Type: {kind}",
        f"Segment Begin Time: {begin:.9e}",
        f"Segment End Time: {end:.9e}",
        f"Segment Begin Demand: {loads[0]:.9e}",
        f"Segment End Demand: {loads[1]:.9e}",
        f"Segment Points: {points}",
    ]


def hld_text(time, depth, load, tool, title):
    """The text of the file: time (s), depth from the surface (m), load of the full body (N), the tool of
    case.nml, the run's title."""
    depth, load = 1e9 * np.asarray(depth), 1e6 * np.asarray(load)
    top = int(np.argmax(load))
    lines = [
        "File Version: Hysitron_Ver_5.0",
        f"Time Stamp: {datetime.now().strftime('%a %b %d %H:%M:%S %Y')}",
        f"Sample Notes: {' '.join(str(title).split())} (a simulation by gimp3d)",
        "Machine Comp: 0.0",
    ]
    coefficients = tip_coefficients(tool)
    if coefficients:
        lines += [f"Tip C{n}: {value:.12e}" for n, value in enumerate((*coefficients, 0.0, 0.0, 0.0, 0.0))]
    lines += ["Contact Threshold: 0.0", "Drift Rate: 0.0", "Number of Segments: 2"]
    lines += segment(1, "Loading", (time[0], time[top]), (load[0], load[top]), top + 1)
    lines += segment(2, "Unloading", (time[top], time[-1]), (load[top], load[-1]), len(time) - top - 1)
    lines += ["Sample Approach Data Points: 0", "Time_s\tMotorDisp_mm\tPiezo Extension_nm"]
    lines += ["Drift Measurement Data Points: 0", "Time_s\tDisp_nm"]
    lines += [f"Test Data Points: {len(time)}", "Time_s\tDisp_nm\tForce_uN"]
    lines += [f"{t:.12e}\t{h:.9e}\t{p:.9e}" for t, h, p in zip(time, depth, load)]
    return "\n".join(lines) + "\n"
