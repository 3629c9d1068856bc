#!/usr/bin/env python3
"""Load noise of the thesis's E2 and E3 for penetration factors 0.3, 0.4 and 0.5.

usage: noise.py WORK GIMP3D RANKS

Noise is the rms of the load about a smooth curve (a parabola fitted over 5 % of the depth range on either
side), relative to that curve, over the second half of the depth range. Fails when a run does not reach its
depth or a load is not finite."""

import pathlib
import re
import subprocess
import sys
import numpy as np
from indentation import ROOT, table

WINDOW = 0.05  # share of the depth range on either side


def noise(depth, load):
    late = np.nonzero(depth >= 0.5 * depth[-1])[0]
    off = []
    for i in late:
        near = abs(depth - depth[i]) <= WINDOW * depth[-1]
        smooth = np.polyval(np.polyfit(depth[near] - depth[i], load[near], 2), 0.0)
        off.append(load[i] / smooth - 1)
    return np.sqrt(np.mean(np.square(off)))


def main():
    work, gimp3d, ranks = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3]
    print('scene        penetration_factor  depth [um]  load on the modelled quarter [mN]  noise [%]')
    for scene, tool, reach in (('deep_sphere', 'sphere', 3.5e-6), ('cone', 'cone', 0.5709e-6)):
        for factor in (0.3, 0.4, 0.5):
            out = work / f'{scene}_{factor}'
            text = (ROOT / 'input' / f'{scene}.nml').read_text()
            text = re.sub(r'penetration_factor=\S+', f'penetration_factor={factor}', text)
            text = re.sub(r'&output.*/', f"&output directory='{out}', formats='none' /", text)
            log = subprocess.run(['mpirun', '-n', ranks, gimp3d], input=text, capture_output=True, text=True)
            if log.returncode != 0:
                sys.exit(
                    f'FAILED: {scene} at {factor} ended with status {log.returncode}: {log.stderr[-500:]}'
                )
            rows, _ = table(out / f'tool_{tool}.dat')
            depth, load = rows[:, 1], rows[:, 4]
            if not np.isfinite(rows).all() or depth[-1] < reach * (1 - 1e-3):
                sys.exit(f'FAILED: {scene} at {factor} reached {depth[-1]} m')
            print(
                f'{scene:12s} {factor:18.1f} {depth[-1] * 1e6:11.4f} {load[-1] * 1e3:33.4f} '
                f'{100 * noise(depth, load):10.2f}',
                flush=True,
            )


main()
