"""What the coarse grids of the book of benchmarks gave, within bounds. usage: benchmarks_bounds.py FILE"""

import json
import sys
from pathlib import Path

from gimp3d import benchmark_cases
from gimp3d import benchmark_table

# per cent, work ratio absolute: about one and a half times what was measured
bounds = {
    "layer_sphere": {"F/F_Hertz at sqrt(Rd)/t = 0.3568": 2.0, "F/F_Hertz at sqrt(Rd)/t = 0.1884": 3.2},
    "layer_cone": {"F/F_Love at d tan/t = 0.5316": 1.5, "F/F_Love at d tan/t = 0.2876": 2.2},
    "layer_punch": {"P/(2aE'd) at a/t = 0.4": 1.5},
    "film_punch_2": {"P/(2aE_f'd)": 1.5},
    "film_punch_0_5": {"P/(2aE_f'd)": 2.0},
    "cone_100_0": {
        "C/Y": 2.5,
        "S/(E'h)": 5.0,
        "Wp/Wt": 0.02,
        "H/Y, true area": 4.0,
        "H/Y, area of the profile": 5.0,
    },
    "impact": {
        "largest depth over exact": 1.0,
        "largest load over exact": 1.0,
        "time of contact over exact": 1.0,
        "speed back over speed": 1.0,
    },
}
measured = json.loads(Path(sys.argv[1]).read_text())
rows = {row.name: row for case in benchmark_cases.cases() for row in case.rows}
faults = 0
for name, wanted in bounds.items():
    found = measured[f"{name}_coarse"].get("found", {})
    for reference in rows[name].references:
        value = found.get(reference.name)
        bound = wanted[reference.name]
        off = (
            None
            if value is None
            else benchmark_table.deviation(reference, value) * (1 if reference.absolute else 100)
        )
        holds = off is not None and abs(off) <= bound
        said = (
            "missing"
            if off is None
            else f"{value:.5g}, reference {reference.value:.5g}, off by {off:+.3g}, at most {bound:g}"
        )
        print(f"{'ok     ' if holds else 'FAILED '} {name}, {reference.name}: {said}")
        faults += not holds
    kinetic = found.get("kinetic")
    if kinetic is not None:
        print(
            f"{'ok     ' if kinetic < 0.015 else 'FAILED '} {name}: kinetic energy is {100 * kinetic:.2g} % "
            "of the work"
        )
        faults += kinetic >= 0.015
sys.exit(bool(faults))
