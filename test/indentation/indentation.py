#!/usr/bin/env python3
"""Press the shipped tools into the references' cylinder on several grids and set the load beside finite
elements.

usage: indentation.py WORK GIMP3D RANKS TOOL=CELLS,CELLS,... [TOOL=...] [--bound TOOL=PERCENT ...] [--falling
TOOL ...] [--area TOOL=PERCENT ...]

TOOL is sphere, cone or flat: the scenes input/sphere.nml, input/cone_cylinder.nml, input/flat_cylinder.nml;
flat8 is flat with 8 particles a cell instead of 1. CELLS is the number of cells along the cylinder's radius
and height of 20 um. Per grid and depth the load is a straight line fitted to the run's load within 2 % of the
depth range on both sides; the reference is the finest file in test/references/fem, for the punch what its two
finest extrapolate to (verification/section_fem.py).
--bound   the mean of |error| over the second half of the depth range on the finest grid must be below this
--falling and must fall with every finer grid until it is below the reference's own error
--area    the mean of contact_area over the reference's, second half of the depth range, finest grid, must be
within this of 1. Always: kinetic energy below 1 % of the tool's work over the second half of the depth range,
and overlap below 0.01 cells."""

import argparse
import pathlib
import re
import subprocess
import sys
import numpy as np
from gimp3d.run_log import facts_of
from section_fem import exact as extrapolated, reference

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCENES = {  # scene, tool, finest table of the reference, its own error (%)
    'sphere': ('sphere', 'sphere', 'h0.05', 0.3),
    'cone': ('cone_cylinder', 'cone', 'h0.025', 0.2),
    'flat': ('flat_cylinder', 'flat', 'h0.025', 0.3),
    'flat8': ('flat_cylinder', 'flat', 'h0.025', 0.3),
}
RADIUS = 20e-6  # m, of the cylinder, and its height
SMOOTH = 0.02  # share of the depth range on either side that a load is fitted over


def table(path):
    """Rows of a history, and the model's share of the tool from its header."""
    rows, share = [], 1.0
    for line in open(path):
        found = re.search(r'model_share="([^"]+)"', line)
        if found:
            share = float(found.group(1))
        if re.match(r'\s*[-+\dNI]', line):
            rows.append([float(word) for word in line.split()])
    return np.array(rows), share


def half_space(tool, depth, young=70e9, poisson=0.33):
    """Load (N) of the half-space theory at a depth (m): Hertz, Sneddon, flat punch."""
    modulus = young / (1 - poisson**2)
    return {
        'sphere': 4 / 3 * modulus * np.sqrt(10e-6) * depth**1.5,
        'cone': 2 / np.pi * modulus * np.tan(np.radians(70.3)) * depth**2,
        'flat': 2 * 2e-6 * modulus * depth,
    }[tool.rstrip('8')]


def run(tool, cells, work, gimp3d, ranks):
    """Run one grid; depths (m), loads (N) and contact areas (m2) of the whole body, and facts."""
    scene, name = SCENES[tool][:2]
    cell = RADIUS / cells
    out = work / f'{tool}_{cells}'
    text = (ROOT / 'input' / f'{scene}.nml').read_text()
    text = re.sub(r'cell_size=\S+,', f'cell_size={cell!r},', text)
    text = re.sub(
        r"upper=20.5e-6,20.5e-6,21e-6",
        f'upper={cell * (cells + 1)!r},{cell * (cells + 1)!r},{cell * (cells + 2)!r}',
        text,
    )
    if tool == 'flat8':
        text = text.replace('particles_per_cell=1', 'particles_per_cell=8')
    text = re.sub(r'&output.*/', f"&output directory='{out}', formats='none' /", text)
    log = subprocess.run(['mpirun', '-n', str(ranks), gimp3d], input=text, capture_output=True, text=True)
    if log.returncode != 0:
        sys.exit(
            f'{tool} on {cells} cells ended with status '
            f'{log.returncode}:\n{log.stdout[-2000:]}{log.stderr[-500:]}'
        )
    history, share = table(out / f'tool_{name}.dat')
    energy, _ = table(out / 'energy.dat')
    depth, load, area = history[:, 1], history[:, 4] / share, history[:, 5] / share
    late = np.searchsorted(depth, 0.5 * depth[-1])
    kinetic = np.max(energy[late:, 1] / energy[late:, 5])
    overlap = history[:, 6].max() / cell
    said = facts_of(out / 'cost.dat')
    seconds, particles = float(said['elapsed_s']), int(said['particles_at_start'])
    return depth, load, area, dict(kinetic=kinetic, overlap=overlap, seconds=seconds, particles=particles)


def at_depths(depth, load, wanted):
    """Load at the wanted depths: straight lines fitted around each."""
    reach = SMOOTH * wanted[-1]
    values = []
    for d in wanted:
        near = abs(depth - d) <= reach
        slope, middle = np.polyfit(depth[near] - d, load[near], 1)
        values.append(middle)
    return np.array(values)


def study(tool, grids, args):
    """One tool on all its grids; the list of faults."""
    kind = SCENES[tool][1]
    fine = reference(kind, SCENES[tool][2])
    wanted, exact_area = fine[:, 0] * 1e-6, np.pi * (fine[:, 2] * 1e-6) ** 2
    exact = extrapolated(kind, fine[:, 0]) * 1e-6
    late = wanted > 0.5 * wanted[-1] * (1 - 1e-9)
    errors, faults, columns, areas = [], [], [], []
    for cells in grids:
        depth, load, area, facts = run(tool, cells, args.work, args.gimp3d, args.ranks)
        error = 100 * (at_depths(depth, load, wanted) / exact - 1)
        errors.append(np.mean(abs(error[late])))
        columns.append(error)
        areas.append(100 * (at_depths(depth, area, wanted) / exact_area - 1))
        area_error = np.mean(areas[-1][late])
        print(
            f'{tool} cell {RADIUS / cells * 1e9:.0f} nm: {facts["particles"]} particles, '
            f'{facts["seconds"]:.1f} s; mean |error| '
            f'{errors[-1]:.2f} %, largest {abs(error[late]).max():.2f} % over the second half; kinetic/work '
            'at most '
            f'{100 * facts["kinetic"]:.2f} %, overlap at most {facts["overlap"]:.1e} cells; contact area '
            f'{area_error:+.1f} % in the mean',
            flush=True,
        )
        if not facts['kinetic'] < 0.01:
            faults.append(
                f'{tool} {cells}: kinetic energy {100 * facts["kinetic"]:.2f} % of the work, must be below 1 '
                '%'
            )
        if not facts['overlap'] < 0.01:
            faults.append(f'{tool} {cells}: overlap {facts["overlap"]:.2e} cells, must be below 0.01')
    print(
        f'{tool}: depth [um], finite elements [mN], half-space theory [% off], run [% off] on cells of '
        + ', '.join(f'{RADIUS / cells * 1e9:.0f} nm' for cells in grids)
        + '; the same of the contact area'
    )
    for i in range(len(wanted)):
        theory = 100 * (half_space(tool, wanted[i]) / exact[i] - 1)
        print(
            f'  {wanted[i] * 1e6:7.4f} {exact[i] * 1e3:10.4f} {theory:+8.2f} '
            + ' '.join(f'{c[i]:+8.2f}' for c in columns)
            + ';'
            + ' '.join(f'{a[i]:+8.1f}' for a in areas)
        )
    if tool in args.bound and not errors[-1] < args.bound[tool]:
        faults.append(
            f'{tool}: mean |error| {errors[-1]:.2f} % on the finest grid, must be below {args.bound[tool]} %'
        )
    if tool in args.area and not abs(area_error) < args.area[tool]:
        faults.append(
            f'{tool}: mean contact area {area_error:+.1f} % off on the finest grid, must be within '
            f'{args.area[tool]} %'
        )
    own = SCENES[tool][3]
    if tool in args.falling and not all(b < max(a, own) for a, b in zip(errors, errors[1:])):
        faults.append(f'{tool}: the error does not fall with every finer grid: {errors}')
    return faults


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('work', type=pathlib.Path)
    parser.add_argument('gimp3d')
    parser.add_argument('ranks', type=int)
    parser.add_argument('study', nargs='+')
    parser.add_argument('--bound', nargs='*', default=[])
    parser.add_argument('--area', nargs='*', default=[])
    parser.add_argument('--falling', nargs='*', default=[])
    args = parser.parse_args()
    args.bound, args.area = (
        {tool: float(value) for tool, value in (word.split('=') for word in words)}
        for words in (args.bound, args.area)
    )
    faults = []
    for word in args.study:
        tool, grids = word.split('=')
        faults += study(tool, [int(n) for n in grids.split(',')], args)
    for fault in faults:
        print('FAILED:', fault)
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()
