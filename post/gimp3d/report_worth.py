"""What the accuracy of a run is worth: its own figures beside the limits of doc/user/output.md, "How to judge
a run"."""

from dataclasses import dataclass

import numpy as np

from . import indentation
from .run_log import numbers_of

good, look, compare = "good", "look at it", "compare"

# The limits of that table.
many_steps = 0.01  # share of the contact solves above their tolerance that is more than single steps
most_residual = 1e-3
most_overlap = 5e-3  # cells
most_bridge = 1e-6  # of largest force times cell
most_balance = 0.02  # of the largest energy or work
most_apart_effects = 0.01  # the same
most_apart_tools = 0.03
most_condition = 0.01
most_kinetic = 0.01  # of the work or the strain energy
most_momentum = 1e-9  # of the largest momentum that the energy allows
most_mass = 1e-10
most_off = 0.25  # of the time expected


@dataclass
class Judgement:
    """A row: what, what it is, what is good, `good`, `look at it` or `compare` (one run does not tell), what
    to do else, and whether that says anything of the results."""

    quantity: str
    value: str
    limit: str
    verdict: str
    advice: str
    matters: bool = True


def percent(share):
    return f"{100 * share:.3g} %"


def judge(notes, energy, tools, answer=None):
    """The rows that can be made of what is there.

    notes   AUXDATA of cost.dat (texts)
    energy  History of energy.dat, or None
    tools   histories of tools (History)
    answer  what make hardness has found (hardness.json), or None
    """
    figures = numbers_of(notes)
    rows = [
        *contact(figures),
        *balances(figures),
        kinetic(energy, tools, answer or {}),
        *conserved(figures, energy),
        stress_error(figures),
        expected(figures),
        retries(figures),
    ]
    return [row for row in rows if row]


def contact(figures):
    if "contact_largest_residual" in figures:
        residual, above = figures["contact_largest_residual"], figures["contact_steps_above_tolerance"]
        solves = figures["contact_solves"]
        few = above <= many_steps * solves and residual <= most_residual
        yield Judgement(
            "contact residual",
            f"{residual:.3g} (relative), {above:.0f} of {solves:.0f} solves above the tolerance",
            "no more than single steps above the tolerance",
            good if few else look,
            "larger max_iterations in &contact, or a smaller safety",
        )
    if "largest_overlap_cells" in figures:
        overlap = figures["largest_overlap_cells"]
        yield Judgement(
            "overlap with tools",
            f"{overlap:.3g} cells",
            f"at most {most_overlap:g} cells",
            good if overlap <= most_overlap else look,
            "a smaller compliance in &contact",
        )
    if "complementarity" in figures:
        bridge = figures["complementarity"]
        yield Judgement(
            "complementarity",
            f"{bridge:.3g} of largest force times cell",
            "many orders below 1",
            good if bridge <= most_bridge else look,
            "as for the residual",
        )


def balances(figures):
    largest = figures.get("largest_energy_J", 0.0)
    if not largest > 0:
        return
    remedy = "smaller cells, domain='stretch', more particles per cell"
    for name, what, most, advice in (
        (
            "energy_balance_error_J",
            "energy balance error",
            most_balance,
            "see where it grows in the energies; if energy grows without a cause, a smaller safety",
        ),
        ("work_apart_of_effects_J", "work of effects", most_apart_effects, remedy),
        ("work_apart_of_tools_J", "work of tools", most_apart_tools, remedy),
        (
            "constraint_work_J",
            "work of the contact condition itself",
            most_condition,
            "smaller cells, domain='corners'",
        ),
    ):
        if name in figures:
            share = abs(figures[name]) / largest
            yield Judgement(
                what,
                f"{percent(share)} of the largest energy or work",
                f"at most {percent(most)}",
                good if share <= most else look,
                advice,
            )


def kinetic(energy, tools, answer):
    """For a load that is meant to be quasi-static: kinetic energy beside the work, from half of the largest
    depth on; until the end of the unloading where hardness has used one, else until the largest depth."""
    if answer.get("kinetic_share") is not None:
        return kinetic_row(answer["kinetic_share"], "the part of the curve that hardness uses")
    moved = [tool for tool in tools if tool.rows and np.nanmax(tool["depth"]) > 0]
    if (
        not moved
        or energy is None
        or not energy.rows
        or not {"kinetic", "external_work", "strain"} <= set(energy.columns)
    ):
        return None
    tool = moved[0]
    turn = int(np.nanargmax(tool["depth"]))
    if not turn:
        return None
    half = tool["time"][int(np.argmax(tool["depth"] >= 0.5 * tool["depth"][turn]))]
    share = indentation.kinetic_share(energy, half, tool["time"][turn])
    return None if share is None else kinetic_row(share, "the second half of the depth")


def kinetic_row(share, where):
    return Judgement(
        "kinetic energy",
        f"at most {percent(share)} of the work over {where}",
        f"below {percent(most_kinetic)} for a quasi-static load",
        good if share < most_kinetic else look,
        "load more slowly, if the load is meant to be quasi-static",
    )


def conserved(figures, energy):
    mass = (
        float(energy["mass"][0]) if energy is not None and energy.rows and "mass" in energy.columns else 0.0
    )
    if "momentum_error_kg_m_s" in figures and mass > 0:
        scale = np.sqrt(2 * mass * np.nanmax(energy["kinetic"]))
        share = figures["momentum_error_kg_m_s"] / scale if scale > 0 else 0.0
        yield Judgement(
            "momentum",
            f"off by {share:.2g} of sqrt(2 m E), E the largest kinetic energy",
            "rounding",
            good if share <= most_momentum else look,
            "a defect: report it",
        )
    if "mass_error_kg" in figures and mass > 0:
        share = abs(figures["mass_error_kg"]) / mass
        yield Judgement(
            "mass",
            f"changed by {share:.2g} of it",
            "0, or rounding",
            good if share <= most_mass else look,
            "a defect: report it",
        )


def stress_error(figures):
    if "stress_error_share" not in figures:
        return None
    return Judgement(
        "estimated stress error",
        f"{percent(figures['stress_error_share'])} in the energy norm",
        "falls in proportion to the cell size",
        compare,
        "it is the error of the stress of single particles; loads and means are much better. Run once more "
        "with other cells (make study)",
    )


def expected(figures):
    if not {"expected_elapsed_s", "elapsed_s"} <= set(figures):
        return None
    off = figures["elapsed_s"] / figures["expected_elapsed_s"] - 1
    return Judgement(
        "time",
        f"{100 * off:+.3g} % of what the run expected",
        f"within {percent(most_off)}",
        good if abs(off) <= most_off else look,
        "the machine had other work, or material started to move late; the results are none the worse",
        matters=False,
    )


def retries(figures):
    if "retries" not in figures:
        return None
    count = int(figures["retries"])
    return Judgement(
        "faults",
        {0: "no retries", 1: "1 retry"}.get(count, f"{count} retries"),
        "no retries",
        look if count else good,
        "see the warnings: what the fault was, and with which steps the run went on",
    )
