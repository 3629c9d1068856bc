"""What the pages of report.sh must say: report.py PROJECT, in its directory of runs."""

import sys
from pathlib import Path

project = Path(sys.argv[1])

import numpy as np
from page import Page
from gimp3d.report_charts import chosen_rows, most_rows
from gimp3d.report_worth import judge
from gimp3d.run_data import History, Particles
from checks import finish, near, require


def section(page, name):
    found = page.by_id(name)
    return found[2] if found else ""


def whole_run():
    """A finished run: everything is there, with the run's own numbers."""
    page = Page("run/report.html")
    require("the page of the run", not page.faults, page.faults)
    title = "</title><script>alert(\"1 < 2 & 3\")</script> it's $x_2$"
    require("the title as it is", page.all("h1")[0][2] == title, page.all("h1")[0][2])
    require(
        "no script but the data, plotly and the charts", len(page.all("script")) == 3, len(page.all("script"))
    )
    require(
        "the policy",
        "default-src 'none'"
        in (page.all("meta", **{"http-equiv": "Content-Security-Policy"}) or [["", {"content": ""}]])[0][1][
            "content"
        ],
    )
    wanted = {
        "warnings",
        "scene",
        "pictures",
        "curves",
        "hardness",
        "time",
        "worth",
        "repeat",
        "chart-tool-cone",
        "chart-energy",
        "chart-probes",
        "time-bars",
        "still-load-cone",
        "still-energy",
    }
    wanted |= {
        f"{what}{near_by}"
        for what in (
            "section-0",
            "section-1",
            "section-2",
            "surface-height",
            "surface-strain",
            "surface-stress",
        )
        for near_by in ("", "-near")
    }
    require("every picture", wanted <= set(page.ids), wanted - set(page.ids))
    shots = len(list(Path("run").glob("particles_*.hdf")))
    require("the number of pictures", len(page.all("img")) == 14 + shots, len(page.all("img")))
    order = [one for one in page.ids if one in ("answer", "pictures", "warnings", "numbers", "scene")]
    require("the answer comes first", order == ["answer", "pictures", "warnings", "numbers", "scene"], order)
    shown = section(page, "answer")
    for words in ("Hardness, true area9.5 \N{PLUS-MINUS SIGN} 0.2 GPa", "Largest depth50 nm"):
        require(f"the answer says {words}", words in shown, shown)

    history = History(Path("run/tool_cone.dat"))
    chart = page.charts["chart-tool-cone"]
    load = next(view for view in chart["views"] if view["name"] == "load, full body")["series"]
    require(
        "load of the full body",
        all(near(a, b, 1e-5) for a, b in zip(load[0]["y"], 4 * history["load_z"]))
        and len(load[0]["y"]) == history.rows,
    )
    require("depth", all(near(a, b, 1e-5) for a, b in zip(chart["axes"][0]["values"], history["depth"])))
    require("theory beside it", [one["name"] for one in load[1:]] == ["Sneddon (half-space)"], load[1:])
    modulus = 70e9 / (1 - 0.33**2)
    deepest = load[1]["x"][-1]
    require(
        "Sneddon's load",
        near(load[1]["y"][-1], 2 / np.pi * modulus * np.tan(np.radians(70.3)) * deepest**2, 1e-5),
        load[1]["y"][-1],
    )
    energy, drawn = History(Path("run/energy.dat")), page.charts["chart-energy"]["views"]
    plastic = next(one for one in drawn[0]["series"] if one["name"] == "plastic")
    require("plastic work", near(plastic["y"][-1], energy["plastic"][-1], 1e-5), plastic["y"][-1])
    require(
        "balance error in per cent",
        near(drawn[1]["series"][0]["y"][-1], 100 * energy["balance_error"][-1], 1e-5),
    )
    probes = page.charts["chart-probes"]["views"][0]["series"]
    require("both probes", [one["name"] for one in probes] == ["below", "beside"], probes)
    require(
        "a probe's stress",
        near(probes[1]["y"][-1], History(Path("run/probe_beside.dat"))["von_mises"][-1], 1e-5),
    )

    # Every value of case.nml, with its unit
    for words in (
        "cell_size",
        "2e-7 m",
        "= 200 nm",
        "'symmetry', 'free', 'symmetry', 'free', 'roller', 'free'",
        "7e10 Pa",
        "= 70 GPa",
        "2710 kg/m3",
        "70.3 degrees",
        "0, 8 m/s",
        "hardening_modulus",
        "penetration_factor",
        "compliance",
        "&level",
        "&guard",
    ):
        require(f"the scene says {words}", words in section(page, "scene"))
    cost = History(Path("run/cost.dat"))
    shares = {row[0]: row for row in rows_of(page, "time")}
    number = next(n for n in range(cost.rows) if cost.notes[f"phase_{n + 1}"] == "P2G")
    require(
        "the share of P2G",
        shares.get("P2G", ["", "", ""])[2] == f"{cost['share of elapsed time'][number]:.1f} %",
        shares.get("P2G"),
    )
    require("the share of levels", "levels" in shares and "all" not in shares, list(shares))
    worth = {row[0]: row for row in rows_of(page, "worth")}
    require(
        "overlap",
        worth["overlap with tools"][1] == f"{float(cost.notes['largest_overlap_cells']):.3g} cells",
        worth["overlap with tools"],
    )
    require("mass", worth["mass"][2] == "good", worth.get("mass"))
    balance = float(cost.notes["energy_balance_error_J"]) / float(cost.notes["largest_energy_J"])
    require(
        "energy balance error",
        worth["energy balance error"][1].startswith(f"{100 * balance:.3g} %"),
        worth["energy balance error"],
    )
    repeat = section(page, "repeat")
    import hashlib

    for words in (
        "mpirun -n 1 ./gimp3d < run/case.nml",
        hashlib.sha256(Path("run/case.nml").read_bytes()).hexdigest(),
        "GCC",
    ):
        require(f"how to repeat it says {words}", words in repeat, repeat[:400])
    version = [
        line
        for line in (project / "src/base/constants.f90").read_text().splitlines()
        if "program_version" in line
    ][0].split("'")[1]
    require("the version", f"gimp3d {version}," in repeat, repeat[:400])
    hardness = section(page, "hardness")
    for words in (
        "From hardness.json",
        "largest depth h50 nm",
        "hardness, true9.5 \N{PLUS-MINUS SIGN} 0.2 GPa",
        "area, true2.5 \N{MICRO SIGN}m\N{SUPERSCRIPT TWO}",
        "The unloaded surface is missing",
    ):
        require(f"hardness says {words}", words in hardness, hardness)
    require("and no pile-up, for there is none", "pile-up" not in hardness, hardness)
    other = section(page, "hardness_other")
    for words in ("Hardness, other", "largest depth h70 nm", "Over depth", "6 \N{PLUS-MINUS SIGN} 0.5 GPa"):
        require(f"hardness of the other tool says {words}", words in other, other)


def rows_of(page, name):
    """The cells of the rows of the table in a section."""
    found, inside = [], False
    start = page.elements.index(page.by_id(name))
    for element in page.elements[start + 1 :]:
        if element[0] == "section":
            break
        if element[0] == "tr":
            found.append([])
        elif element[0] in ("td", "th"):
            found[-1].append(element[2])
    return found[1:]


def others():
    """Runs that lack something: the page says what, and has the rest."""
    expected = {  # run: words that stand in the warnings, ids that are there, ids that are not
        "killed": (
            ["it was killed", "It said last: step", "Not there: cost.dat"],
            ["section-0", "chart-tool-cone"],
            ["time-bars"],
        ),
        "tecplot": (
            ["Tecplot snapshots only"],
            ["chart-tool-cone", "time-bars"],
            ["section-0", "surface-height"],
        ),
        "bare": (
            ["run.log is missing", "Not there: energy.dat", "Not there: tool_cone.dat", "wrote no snapshot"],
            ["scene"],
            ["chart-energy", "section-0", "hardness"],
        ),
        "caseless": (
            ["Not there: case.nml", "the section could not be made"],
            ["chart-energy", "time-bars"],
            ["chart-tool-cone"],
        ),
        "broken": (
            [
                "tool_cone.dat cannot be read",
                "tool_cone.dat:8: 1 values for 24 columns",
                "hardness.json cannot be read",
                "particles cannot be read",
                "energy.dat holds values that are not finite",
            ],
            ["chart-energy", "time-bars"],
            ["section-0", "chart-tool-cone"],
        ),
        "older": (["1 particle files here are not in the run's index"], ["section-0"], []),
        "stale": (
            ["hardness.json is older than the run", "hardness_other.json is older than the run"],
            ["chart-energy"],
            ["hardness", "hardness_other"],
        ),
        "alarmed": (
            [
                "WARNING: energy loss",
                "range      particles are compressed by 40 %",
                "retry 1: planted",
                "faults: 1 retry",
                "energy balance error: 30 %",
            ],
            ["worth"],
            ["section-0"],
        ),
        "fault": (
            ["The run ended with a fault: step", "left the grid through its side y+"],
            ["section-0", "chart-energy", "chart-probes"],
            ["chart-tool-cone"],
        ),
    }
    for name, (words, there, absent) in expected.items():
        page = Page(f"{name}/report.html")
        require(f"the page of {name}", not page.faults, page.faults)
        for word in words:
            require(
                f"the page of {name} says '{word}'",
                word in section(page, "warnings"),
                section(page, "warnings"),
            )
        require(f"the page of {name} has", set(there) <= set(page.ids), set(there) - set(page.ids))
        require(f"the page of {name} has not", not set(absent) & set(page.ids), set(absent) & set(page.ids))
    fine = section(Page("run/report.html"), "warnings")
    require(
        "a good run raises no alarm",
        "Not there" not in fine and "cannot" not in fine and "WARNING" not in fine,
        fine,
    )


def verdicts():
    """One bad figure at a time turns its own verdict and no other."""
    notes = History(Path("run/cost.dat")).notes
    energy, tools = History(Path("run/energy.dat")), [History(Path("run/tool_cone.dat"))]
    before = {row.quantity: row.verdict for row in judge(notes, energy, tools)}
    largest = float(notes["largest_energy_J"])
    bad = {
        "overlap with tools": ("largest_overlap_cells", 0.0051),
        "complementarity": ("complementarity", 2e-6),
        "energy balance error": ("energy_balance_error_J", 0.021 * largest),
        "work of tools": ("work_apart_of_tools_J", 0.031 * largest),
        "work of the contact condition itself": ("constraint_work_J", -0.011 * largest),
        "mass": ("mass_error_kg", 1e-9),
    }
    good = {
        "largest_overlap_cells": 0.0049,
        "complementarity": 0.9e-6,
        "energy_balance_error_J": 0.019 * largest,
        "work_apart_of_tools_J": 0.029 * largest,
        "constraint_work_J": 0.009 * largest,
        "mass_error_kg": 0.0,
    }
    for quantity, (name, value) in bad.items():
        for number, verdict in ((value, "look at it"), (good[name], "good")):
            rows = {row.quantity: row.verdict for row in judge({**notes, name: str(number)}, energy, tools)}
            changed = {one for one in rows if rows[one] != before[one] and one != quantity}
            require(
                f"{quantity} at {name}={number:g}", rows[quantity] == verdict and not changed, (rows, changed)
            )
    for above, residual, verdict in (
        (0, "9e-9", "good"),
        (1, "9e-4", "good"),
        (40, "9e-9", "look at it"),
        (1, "2e-3", "look at it"),
    ):
        said = {
            "contact_solves": "1000",
            "contact_largest_residual": residual,
            "contact_steps_above_tolerance": str(above),
        }
        row = judge(said, None, [])[0]
        require(f"residual {residual}, {above} steps above", row.verdict == verdict, row)
    # Kinetic energy: of the second half of the depth only, while the tool goes in
    energy.columns["external_work"] = np.full(energy.rows, 1.0)
    energy.columns["strain"] = np.zeros(energy.rows)
    for share, where, verdict in (
        (0.009, slice(None), "good"),
        (0.011, slice(None), "look at it"),
        (0.5, slice(0, energy.rows // 4), "good"),
    ):
        energy.columns["kinetic"] = np.zeros(energy.rows)
        energy.columns["kinetic"][where] = share
        row = next(row for row in judge({}, energy, tools) if row.quantity == "kinetic energy")
        require(f"kinetic energy {share} at {where}", row.verdict == verdict, row)
    require("nothing to judge by", judge({}, None, []) == [])


def rows_and_surface():
    """Long histories keep their peaks; a surface seen from above is the highest particle of each place."""
    from types import SimpleNamespace
    from gimp3d.report_pictures import Surface

    values = np.sin(np.linspace(0, 50, 100000))
    values[54321] = 7.0
    rows = chosen_rows(values)
    require(
        "a long history",
        len(rows) <= most_rows + 2 and 54321 in rows and rows[0] == 0 and rows[-1] == 99999,
        len(rows),
    )
    run = SimpleNamespace(tools=[], case={})
    # Two layers, of which the upper has a hole at (2, 1), and a bump at (0, 0)
    points = [(x, y, z) for z in (0, 1) for x in range(4) for y in range(3) if (x, y, z) != (2, 1, 1)] + [
        (0, 0, 2)
    ]
    position = np.array(points, dtype=float)
    particles = Particles.__new__(Particles)
    particles.fields = {"position": position, "half_size": np.full((len(points), 1), 0.5)}
    particles.ids, particles.boxes, particles.cells, particles.time = (
        np.arange(len(points)),
        np.empty((0, 2, 3)),
        np.empty(0),
        0.0,
    )
    top = Surface(run, particles)
    seen, extent = top.seen(top.whole)
    height = np.where(seen >= 0, top.top[seen], np.nan)
    expected = np.full((3, 4), 1.5)
    expected[1, 2], expected[0, 0] = 0.5, 2.5
    require("the surface from above", seen.shape == (3, 4) and np.array_equal(height, expected), height)
    require("its extent", np.allclose(extent, (-0.5, 3.5, -0.5, 2.5)), extent)


def at_largest_load():
    """A load that stands after a second, with snapshots at 0, 5 and 10 s: not the one at 0, though it is nearest
    to the first time of the largest load."""
    from types import SimpleNamespace
    from gimp3d import plots

    class Rows(dict):
        rows = 4

    history = Rows(time=np.array([0.0, 1.0, 5.0, 10.0]), load_x=np.zeros(4), load_y=np.zeros(4))
    history["load_z"] = np.array([0.0, 1e3, 1e3, 1e3])
    run = SimpleNamespace(tools=[{"axis": [0, 0, -1]}], tool_history=lambda tool: history)
    times = {"first": 0.0, "middle": 5.0, "last": 10.0}
    kept, plots.time_of_snapshot = plots.time_of_snapshot, times.get
    found = plots.at_largest_load(run, list(times))
    plots.time_of_snapshot = kept
    require("the snapshot under load", found == "middle", found)


whole_run()
others()
at_largest_load()
verdicts()
rows_and_surface()
finish()
