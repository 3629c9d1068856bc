"""What make hardness has found, for the page of a run."""

import json

from . import hardness
from .report_page import section, si, table, tag

reasons = {
    "beta": "beta_reason", "epsilon": "epsilon_reason", "area_oliver_pharr": "area_function",
    "modulus_scene": "scene_reason", "young_scene": "scene_reason",
}  # fmt: skip
over_depth = "max_load", "hardness_oliver_pharr", "hardness_true", "modulus_oliver_pharr", "modulus_true"
of_key = {key: (label, unit) for label, key, unit in hardness.table}


def hardness_sections(report):
    """A section for each file of make hardness: one, or one a tool."""
    made = []
    for path in sorted(report.directory.glob("hardness*.json")):
        if not report.is_of_run(path):
            report.problems.append(
                f"{path.name} is older than the run: it is of an earlier one, and is not shown; make "
                "hardness makes that of this run"
            )
            continue
        answer = report.read(path.name, lambda path: json.loads(path.read_text()))
        if isinstance(answer, dict):
            made.append(report.attempt(f"the hardness of {path.name}", lambda: of_tool(path.name, answer)))
    return [one for one in made if one]


def of_tool(name, answer):
    untrusted = answer.get("not_measured") or {}
    rows = [
        (
            label,
            "not measured" if key in untrusted else quantity(answer, key, unit),
            answer.get(reasons.get(key)) or "",
        )
        for label, key, unit in hardness.table
        if answer.get(key) is not None or key in untrusted
    ]
    content = [table(f"From {name} (make hardness)", ["quantity", "value", ""], rows)]
    unloadings = answer.get("unloadings") or []
    if len(unloadings) > 1:
        content.append(
            table(
                "Over depth, of each unloading",
                ["depth", *(of_key[key][0] for key in over_depth)],
                [
                    tuple(quantity(row, key, of_key[key][1]) for key in ("max_depth", *over_depth))
                    for row in unloadings
                ],
            )
        )
    content += [tag("p", sentence) for sentence in dict.fromkeys(untrusted.values())]
    content += [tag("p", sentence) for key in ("notes", "missing") for sentence in answer.get(key) or []]
    tool = name.removeprefix("hardness").removesuffix(".json")
    return section(f"hardness{tool}", f"Hardness{tool.replace('_', ', ', 1)}", *content)


def quantity(answer, key, unit):
    """A number and its uncertainty in the unit that suits; a dash where there is none."""
    if answer.get(key) is None:
        return "-"
    return si(answer[key], unit, error=answer.get(f"{key}_uncertainty"))
