"""The tables of doc/user/benchmarks.md."""

import textwrap

from . import benchmark_cases

first, last = "<!-- made by make benchmarks: from here -->", "<!-- to here -->"
columns = 110


class NoPlace(Exception):
    """The document has no place for the tables."""


def between(text):
    """The document's text before and after the tables."""
    if text.count(first) != 1 or text.count(last) != 1 or text.index(first) > text.index(last):
        raise NoPlace(f"the document has no lines `{first}` and `{last}`, between which the tables go")
    return text[: text.index(first) + len(first)], text[text.index(last) :]


def filled(text, book):
    before, after = between(text)
    sections = "".join(section(book, case) for case in book.cases)
    return f"{before}\n\n{summary(book)}\n{sections}{not_yet()}\n{after}"


def wrapped(text):
    """Lines of a paragraph or of an item of a list."""
    indent = "  " if text.startswith("- ") else ""
    return (
        textwrap.fill(text, columns, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
        + "\n"
    )


def number(value):
    return f"{value:.4g}" if 1e-3 <= abs(value) < 1e5 or value == 0 else f"{value:.3e}"


def deviation(reference, value):
    """How far off, as the tolerance is meant."""
    return value - reference.value if reference.absolute else value / reference.value - 1


def shown(reference, value):
    off = deviation(reference, value)
    if reference.absolute:
        return f"{off:+.3f}"
    return f"{100 * off:+.2g} %" if abs(off) >= 5e-5 or off == 0 else f"{100 * off:+.0e} %"


def bound(reference):
    if reference.tolerance is None:
        return "-"
    return f"{reference.tolerance:g}" if reference.absolute else f"{100 * reference.tolerance:.3g} %"


def lines_of(book, case):
    """(row, reference, grid, entry) of all that the case compares."""
    for row in case.rows:
        for reference in row.references:
            for grid in row.grids or ["none"]:
                yield row, reference, grid, book.entry(row, grid)


def finest_of(book, row):
    """The finest grid of a row that has numbers."""
    done = [g for g in (row.grids or ["none"]) if (book.entry(row, g) or {}).get("found")]
    return done[-1] if done else None


def summary(book):
    """A line for each case: how much was run, what is within its bounds."""
    rows = [
        "| case | | rows run | within bounds, on the finest grid run | largest error there |",
        "|---|---|---|---|---|",
    ]
    for case in book.cases:
        compared = [row for row in case.rows if row.references]
        ran = [(row, finest_of(book, row)) for row in compared]
        ran = [(row, grid) for row, grid in ran if grid]
        inside = outside = 0
        worst = None
        for row, grid in ran:
            found = book.entry(row, grid)["found"]
            for reference in row.references:
                if reference.name not in found or reference.tolerance is None:
                    continue
                off = abs(deviation(reference, found[reference.name]))
                inside, outside = inside + (off <= reference.tolerance), outside + (off > reference.tolerance)
                if worst is None or off / reference.tolerance > worst[0]:
                    worst = off / reference.tolerance, reference, row, found[reference.name]
        said = (
            f"{shown(worst[1], worst[3])} ({worst[1].name}, {worst[2].what}; wanted {bound(worst[1])})"
            if worst
            else "-"
        )
        anchor = heading(case).lower()
        anchor = "".join(c for c in anchor if c.isalnum() or c in "-_ ").replace(" ", "-")
        rows.append(
            f"| [{case.name}](#{anchor}) | {case.title} | {len(ran)} of {len(compared)} | "
            f"{f'{inside} of {inside + outside}' if ran else 'not run'} | {said} |"
        )
    return "\n".join(rows) + "\n"


def heading(case):
    return f"{case.name}: {case.title}"


def section(book, case):
    text = [f"\n### {heading(case)}\n\n"]
    text.append(wrapped(f"Source: {case.source}.") + "\n")
    text.append(wrapped(f"Scene: {case.scene}.") + "\n")
    text.append(wrapped(case.why) + "\n")
    runs = any(row.grids for row in case.rows)
    head = ["row", "quantity", "reference"]
    if runs:
        head.append("grid (cells to the contact's radius)")
    head += ["ours", "error", "wanted"]
    if runs:
        head += ["kinetic / work [%]", "time [s], ranks"]
    table = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    before, missing, early, notes = None, [], [], []
    for row, reference, grid, entry in lines_of(book, case):
        if not entry:
            if row.key(grid) not in missing:
                missing.append(row.key(grid))
            continue
        if entry.get("fault"):
            if row.key(grid) not in early:
                early.append(row.key(grid))
                notes.append(
                    wrapped(f"- {row.what}, {grid} grid, has no numbers: {entry['fault']}. (`{row.name}`)")
                )
            continue
        found = entry.get("found") or {}
        value = found.get(reference.name)
        cells = [row.what if before is not row else "", reference.name, number(reference.value)]
        before = row
        if runs:
            cells.append(f"{grid} ({row.grids[grid].contact:g})")
        if value is None:
            cells += ["could not be had", "", bound(reference)]
        else:
            cells += [number(value), shown(reference, value), bound(reference)]
        if runs:
            kinetic = found.get("kinetic")
            cells += [
                f"{100 * kinetic:.2g}" if kinetic is not None else "-",
                f"{entry['seconds']:.0f}, {entry['ranks']}",
            ]
        table.append(f"| {' | '.join(cells)} |")
    if len(table) > 2:
        text.append("\n".join(table) + "\n")
    names = list(dict.fromkeys(name.rsplit("_", 1)[0] for name in missing))
    for grid in ("coarse", "fine", "finer"):
        those = [name for name in names if f"{name}_{grid}" in missing]
        if those:
            notes.append(
                wrapped(
                    f'- Not run on the {grid} grid: `make benchmarks CASES="{" ".join(those)}" GRIDS={grid}`'
                )
            )
    if notes:
        text.append(("\n" if len(table) > 2 else "") + "".join(notes))
    return "".join(text)


def not_yet():
    rows = ["", "### Not yet", "", "| case | why |", "|---|---|"]
    return "\n".join(rows + [f"| {name} | {why} |" for name, why in benchmark_cases.not_yet]) + "\n"
