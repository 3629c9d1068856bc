#!/usr/bin/env python3
"""The gallery of hard cases: runs them, prints and writes their figures beside their bars, draws them.

usage: gallery.py WORK PROGRAM TEST_PROGRAMS [--ranks N] [--short] [CASE ...] gallery.py --page DIRECTORY
       put tables and pictures of runs under DIRECTORY (build) into doc/user/

--short runs the sizes of `make test`, and without named cases those that belong to it. Exit status 1 when a
figure misses its bar and is not known to."""

import argparse
import re
import shutil
import sys
from pathlib import Path

from hard_case import CASES, ROOT, Bench, draw, read_table, replace_rows, run_case

# noqa: F401, E401  (each enters its cases)
import crossing, empty_cells, spinning, loads, contact, impact, levels

PAGE = ROOT / "doc/user/hard_cases.md"
# How the page shows the runs: a heading for each build and number of ranks.
SHOWN = (("opt", "1"), ("opt", "2"), ("debug", "1"))


def run(args):
    unknown = [name for name in args.cases if name not in CASES]
    if unknown:
        sys.exit(f"There is no case {unknown[0]}; the cases are: {' '.join(CASES)}")
    names = args.cases or [name for name, case in CASES.items() if case.short or not args.short]
    table = args.work / "table.csv"
    args.work.mkdir(parents=True, exist_ok=True)
    missed = 0
    print(f"{'case':16} {'figure':64} {'bar':>19} {'value':>10}  verdict")
    for name in names:
        work = args.work / name
        shutil.rmtree(work, ignore_errors=True)
        work.mkdir()
        bench = Bench(args.program.resolve(), args.programs.resolve(), args.ranks, args.short, work.resolve())
        rows = run_case(CASES[name], bench)
        for row in rows:
            print(
                f"{name:16} {row['figure']:64} "
                f"{row['sense'][:9] if 'control' not in row['sense'] else 'above':>9}"
                f" {row['bar']:>9} {row['value']:>10}  "
                f"{row['verdict']}{' (control)' if 'control' in row['sense'] else ''}",
                flush=True,
            )
        missed += sum(row["verdict"] == "MISSED" for row in rows)
        replace_rows(table, name, rows)
        if not args.short:
            draw(bench, name, args.work / f"{name}.png")
    print(f"{missed} figures missed their bars; {table}")
    sys.exit(1 if missed else 0)


def page(build):
    """Write the tables into the page, between its two marks, and the pictures into
    doc/user/hard_cases.png."""
    rows = {}
    for mode, ranks in SHOWN:
        for size in ("", "_short"):
            for row in read_table(build / mode / f"hard_{ranks}{size}" / "table.csv"):
                if mode == "debug" or not size:
                    key = row["case"], row["figure"].split(": ")[-1], row["sense"], row["bar"], row["verdict"]
                    rows.setdefault(key, {}).setdefault((mode, ranks), []).append(row)
    if not rows:
        sys.exit(f"No tables of `make hard` are under {build}")
    lines = [
        "| case | figure, worst of its settings | bar | opt, 1 rank | opt, 2 ranks | debug (short form) "
        "| s |",
        "|---|---|---|---|---|---|---|",
    ]
    for (case, figure, sense, bar, verdict), found in rows.items():
        cells = [
            worst(found[key]) + ("" if verdict == "met" else f" **{verdict.lower()}**")
            if key in found
            else ""
            for key in SHOWN
        ]
        first = next(iter(found.values()))
        settings = f" ({len(first)})" if len(first) > 1 else ""
        lines.append(
            f"| {case} | {figure}{settings} | {sense} {bar} | {' | '.join(cells)} | {first[0]['seconds']} |"
        )
    text = PAGE.read_text()
    text = between(text, "table", "\n".join(lines) + "\n")
    maps = build / "opt/map"
    if (maps / "map.md").exists():
        text = between(text, "map", (maps / "map.md").read_text())
        small([maps / "map.png"], ROOT / "doc/user/stability_map.png", 1)
    PAGE.write_text(text)
    small([build / "opt/hard_1" / f"{name}.png" for name in CASES], ROOT / "doc/user/hard_cases.png")


def worst(rows):
    """The value that is nearest to missing its bar, or farthest beyond it: of a control, nearest to meeting
    it."""
    largest = ("at most" in rows[0]["sense"]) != ("control" in rows[0]["sense"])
    return (max if largest else min)((row["value"] for row in rows), key=float)


def between(text, mark, inner):
    """Put something between two marks of the page."""
    return re.sub(
        rf"(<!-- {mark} -->\n).*(<!-- end of {mark} -->)",
        lambda found: found[1] + inner + found[2],
        text,
        flags=re.S,
    )


def small(paths, target, columns=4, colours=48):
    """Pictures side by side in one, small."""
    from PIL import Image

    pictures = [Image.open(path).convert("RGB") for path in paths if path.exists()]
    width, height = pictures[0].size
    whole = Image.new("RGB", (columns * width, -(-len(pictures) // columns) * height), "white")
    for n, one in enumerate(pictures):
        whole.paste(one, (n % columns * width, n // columns * height))
    whole.quantize(colours).save(target, optimize=True)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--page", type=Path)
    parser.add_argument("work", type=Path, nargs="?")
    parser.add_argument("program", type=Path, nargs="?")
    parser.add_argument("programs", type=Path, nargs="?")
    parser.add_argument("--ranks", type=int, default=1)
    parser.add_argument("--short", action="store_true")
    parser.add_argument("cases", nargs="*")
    args = parser.parse_intermixed_args()
    if args.page:
        page(args.page)
    elif args.programs is None:
        parser.error("WORK, PROGRAM and TEST_PROGRAMS are wanted")
    else:
        run(args)


if __name__ == "__main__":
    main()
