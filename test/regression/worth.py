#!/usr/bin/env python3
"""Checks what worth.sh has run: the notes of cost.dat, and that the closing summaries say the same."""

import re
import sys
from pathlib import Path

import numpy

from runs import snapshots

YOUNG, POISSON = 1e6, 0.3  # as in worth.sh
failed = 0


def need(condition, sentence):
    global failed
    if not condition:
        failed += 1
        print(f"FAILED: {sentence}")


def strain_energies(name):
    """Of the last snapshot: half of V sigma : C^-1 : sigma, and the strain energy (theory.md, eq.
    elastic-energy), J."""
    last = snapshots(name)[-1]
    stress, volume = last.fields["stress"], last.fields["volume"]
    trace = stress[:, :3].sum(axis=1)
    squares = (stress[:, :3] ** 2).sum(axis=1) + 2 * (stress[:, 3:] ** 2).sum(axis=1)
    norm = 0.5 * volume * ((1 + POISSON) * squares - POISSON * trace**2) / YOUNG
    theta = (1 - 2 * POISSON) * trace / YOUNG
    return norm.sum(), (norm * 2 * (theta - 1 + numpy.exp(-theta)) / theta**2).sum()


def judge(name, closed):
    text, said = Path(name, "cost.dat").read_text(), Path(f"{name}.log").read_text()
    facts = dict(re.findall(r'^AUXDATA (\w+)="(.*)"', text, re.M))
    number = {key: float(value) for key, value in facts.items() if re.fullmatch(r"[-+0-9.eE]+", value)}
    rows = numpy.loadtxt(
        Path(name, "energy.dat"), skiprows=sum(line[0].isalpha() for line in Path(name, "energy.dat").open())
    )
    change = numpy.linalg.norm(rows[-1, 7:10] - rows[0, 7:10])
    need(abs(number["momentum_change_kg_m_s"] / change - 1) < 1e-5, f"{name}: change of momentum {change}")
    need(number["tool_impulse_kg_m_s"] > 1, f"{name}: impulse of the tool {number['tool_impulse_kg_m_s']}")
    if closed:
        need(
            number["momentum_error_kg_m_s"] < 1e-12 * number["tool_impulse_kg_m_s"],
            f"{name}: momentum off by {number['momentum_error_kg_m_s']}",
        )
        need(
            re.search(r"^momentum: .* off by .* % of the impulse given$", said, re.M),
            f"{name}: sentence on momentum",
        )
    else:
        need("momentum_error_kg_m_s" not in facts, f"{name}: cannot know the error of momentum")
        need(
            re.search(r"^momentum: .*; held sides and effects account for the rest$", said, re.M),
            f"{name}: sentence on momentum",
        )
        need(
            abs(number["momentum_change_kg_m_s"] / number["tool_impulse_kg_m_s"] - 1) > 1e-3,
            f"{name}: something else pushes",
        )
    worst = numpy.abs(rows[:, 6]).max()
    # J: the column is relative to no less than this
    so_far = numpy.maximum.accumulate(numpy.abs(rows[:, 1:6]).max(axis=1))
    need(
        worst > 0 and number["energy_balance_error_J"] >= 0.999 * (numpy.abs(rows[:, 6]) * so_far).max(),
        f"{name}: energy balance",
    )
    need(number["mass_error_kg"] < 1e-12 * rows[0, 13], f"{name}: mass")
    need(0 <= number["complementarity"] < 1e-4, f"{name}: complementarity {number['complementarity']}")
    need(
        0 < number["largest_overlap_cells"] < 0.1, f"{name}: overlap {number['largest_overlap_cells']} cells"
    )
    finest = 0.05 if name == "levels" else 0.1
    need(
        abs(number["largest_overlap_m"] / number["largest_overlap_cells"] / finest - 1) < 1e-4,
        f"{name}: overlap in m",
    )
    need(0.02 < number["stress_error_share"] < 1, f"{name}: estimate {number['stress_error_share']}")
    need(0 < number["largest_stress_error_Pa"] < 2 * number["largest_stress_Pa"], f"{name}: largest estimate")
    place = [float(value) for value in facts["largest_stress_error_at_m"].split()]
    need(0.3 < min(place[:2]) and max(place[:2]) < 1.3, f"{name}: place {place}")
    beside = number["stress_error_energy_beside_edges_J"]
    need(
        (beside > 0) == (name == "levels") and beside <= number["stress_error_energy_J"],
        f"{name}: beside edges {beside}",
    )
    norm, energy = strain_energies(name)
    need(
        abs(number["strain_energy_J"] / norm - 1) < 1e-3,
        f"{name}: energy norm of the stress {number['strain_energy_J']} and {norm}",
    )
    need(abs(rows[-1, 2] / energy - 1) < 1e-5, f"{name}: strain energy {rows[-1, 2]} and {energy}")
    need(number["memory_B"] > 1e7 and "memory: " in said, f"{name}: memory")
    print(
        f"   {name}: momentum {number['momentum_change_kg_m_s']:.4g}, tool "
        f"{number['tool_impulse_kg_m_s']:.4g}, off by "
        f"{number.get('momentum_error_kg_m_s', float('nan')):.2g} kg m/s; stress "
        f"{100 * number['stress_error_share']:.1f} %"
    )


for name, closed in (("held", False), ("free", True), ("levels", True), ("fallen", False)):
    judge(name, closed)
sys.exit(failed)
