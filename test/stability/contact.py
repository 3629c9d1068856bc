"""Tools: deep indentation, load noise, rebound, edges."""
import re

import numpy as np

from hard_case import ROOT, hard_case


def shipped(name, **changes):
    """A scene of input/ with other values, its output to the case's directory."""
    text = (ROOT / "input" / f"{name}.nml").read_text()
    text = re.sub(r"directory='[^']*'", "directory='OUT'", text)
    for variable, value in changes.items():
        text, count = re.subn(rf"\b{variable}=[^,/\s]+(?:,[-0-9.][^,/\s=]*)*", f"{variable}={value}", text)
        if count != 1:
            raise ValueError(f"{variable} stands {count} times in input/{name}.nml")
    return text


def noise(depth, load, window=0.05):
    """Rms of the load about a parabola over 5 % of the depth range on either side, relative, over the second half of the depth."""
    off = []
    for here in np.linspace(0.5, 1 - window, 100) * depth[-1]:
        near = abs(depth - here) <= window * depth[-1]
        off.append(np.interp(here, depth, load) / np.polyval(np.polyfit(depth[near] - here, load[near], 2), 0.0) - 1)
    return np.sqrt(np.mean(np.square(off)))


@hard_case("buried_sphere", short=True)
def buried_sphere(bench):
    """E3 of the thesis, whose finite-element run quits at 3.114 um: the sphere (R = 3.4 um) on to 3.5 um, below the surface."""
    out = bench.run("sphere", shipped("deep_sphere"))
    rows = out.tool("sphere")
    depth, load = rows["depth"] * 1e6, rows["load_z"] * 1e3
    bench.at_least("depth reached [um]", depth[-1], 3.4999)
    bench.at_least("smallest load after first touch over the largest", load[depth > 0.1] / load.max(), 0.0)
    # A load-depth curve is read to a per cent or two.
    bench.at_most("load noise, relative", noise(depth, load), 0.02)
    bench.at_most("overlap over the cell", rows["max_gap_violation"] / 1.28e-6, 0.05)

    def draw(axes):
        axes.plot(depth, load)
        axes.axvline(3.114, color="r", lw=0.5, label="where the finite elements quit")
        axes.set(xlabel="depth [um]", ylabel="load on the quarter [mN]")
    bench.picture(draw)
