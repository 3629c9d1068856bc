#!/usr/bin/env python3
"""Checks what worth.sh has run: the notes of cost.dat, and that the closing summaries say the same."""

import re
from pathlib import Path

import numpy

from runs import snapshots
from checks import finish, require

YOUNG, POISSON = 1e6, 0.3  # as in worth.sh
NUMBER = r"[-+]?[0-9]*\.?[0-9]+(?:[eE][-+]?[0-9]+)?"


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
    number = {key: float(value) for key, value in facts.items() if re.fullmatch(NUMBER, value)}
    rows = numpy.loadtxt(
        Path(name, "energy.dat"), skiprows=sum(line[0].isalpha() for line in Path(name, "energy.dat").open())
    )
    change = numpy.linalg.norm(rows[-1, 7:10] - rows[0, 7:10])
    require(f"{name}: change of momentum {change}", abs(number["momentum_change_kg_m_s"] / change - 1) < 1e-5)
    require(f"{name}: impulse of the tool {number['tool_impulse_kg_m_s']}", number["tool_impulse_kg_m_s"] > 1)
    if closed:
        require(
            f"{name}: momentum off by {number['momentum_error_kg_m_s']}",
            number["momentum_error_kg_m_s"] < 1e-12 * number["tool_impulse_kg_m_s"],
        )
        require(
            f"{name}: sentence on momentum",
            re.search(r"^momentum: .* off by .* % of the impulse given$", said, re.M),
        )
    else:
        require(f"{name}: cannot know the error of momentum", "momentum_error_kg_m_s" not in facts)
        require(
            f"{name}: sentence on momentum",
            re.search(r"^momentum: .*; held sides and effects account for the rest$", said, re.M),
        )
        require(
            f"{name}: something else pushes",
            abs(number["momentum_change_kg_m_s"] / number["tool_impulse_kg_m_s"] - 1) > 1e-3,
        )
    worst = numpy.abs(rows[:, 6]).max()
    # J: the column is relative to no less than this
    so_far = numpy.maximum.accumulate(numpy.abs(rows[:, 1:6]).max(axis=1))
    require(
        f"{name}: energy balance",
        worst > 0 and number["energy_balance_error_J"] >= 0.999 * (numpy.abs(rows[:, 6]) * so_far).max(),
    )
    require(f"{name}: mass", number["mass_error_kg"] < 1e-12 * rows[0, 13])
    require(f"{name}: complementarity {number['complementarity']}", 0 <= number["complementarity"] < 1e-4)
    require(
        f"{name}: overlap {number['largest_overlap_cells']} cells", 0 < number["largest_overlap_cells"] < 0.1
    )
    finest = 0.05 if name == "levels" else 0.1
    require(
        f"{name}: overlap in m",
        abs(number["largest_overlap_m"] / number["largest_overlap_cells"] / finest - 1) < 1e-4,
    )
    require(f"{name}: estimate {number['stress_error_share']}", 0.02 < number["stress_error_share"] < 1)
    require(
        f"{name}: largest estimate", 0 < number["largest_stress_error_Pa"] < 2 * number["largest_stress_Pa"]
    )
    place = [float(value) for value in facts["largest_stress_error_at_m"].split()]
    require(f"{name}: place {place}", 0.3 < min(place[:2]) and max(place[:2]) < 1.3)
    beside = number["stress_error_energy_beside_edges_J"]
    require(
        f"{name}: beside edges {beside}",
        (beside > 0) == (name == "levels") and beside <= number["stress_error_energy_J"],
    )
    norm, energy = strain_energies(name)
    require(
        f"{name}: energy norm of the stress {number['strain_energy_J']} and {norm}",
        abs(number["strain_energy_J"] / norm - 1) < 1e-3,
    )
    energy += number["subcell_energy_J"]  # what contact stores below the cells
    require(f"{name}: strain energy {rows[-1, 2]} and {energy}", abs(rows[-1, 2] / energy - 1) < 1e-5)
    require(f"{name}: memory", number["memory_B"] > 1e7 and "memory: " in said)
    print(
        f"   {name}: momentum {number['momentum_change_kg_m_s']:.4g}, tool "
        f"{number['tool_impulse_kg_m_s']:.4g}, off by "
        f"{number.get('momentum_error_kg_m_s', float('nan')):.2g} kg m/s; stress "
        f"{100 * number['stress_error_share']:.1f} %"
    )


for name, closed in (("held", False), ("free", True), ("levels", True), ("fallen", False)):
    judge(name, closed)
finish()
