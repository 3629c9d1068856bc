"""What pages must be in a browser: opened.py CHROMIUM, in the directory of the runs of browser.sh."""

import sys
from pathlib import Path

from browser import look
from page import Page

chromium, failed = sys.argv[1], 0


def faults_of(found, page, width):
    """Sentences on what is wrong with an opened page."""
    if not found:
        return ["the browser shows nothing"]
    faults = list(found["faults"]) + [f"fetched {name}" for name in found["fetched"]]
    if found["width"] != width:
        faults.append(f"the frame is {found['width']} wide")
    if max(found["page"], found["opened"]) > width:
        faults.append(f"the page scrolls sideways: {found['page']}, {found['opened']} of {width}")
    faults += [f"a picture is not shown: {one}" for one in found["images"] if not one["natural"] > 0]
    # Those of noscript are not there where scripts run
    stills = sum(1 for name in page.ids if name.startswith("still-"))
    if len(found["images"]) != len(page.all("img")) - stills:
        faults.append(f"{len(found['images'])} pictures of {len(page.all('img')) - stills}")
    if found["small"]:
        faults.append(f"text below 11 pixels: {found['small'][:3]}")
    for name, chart in page.charts.items():
        shown = found["charts"].get(name)
        if not shown:
            faults.append(f"the chart {name} is not drawn")
            continue
        first = chart["views"][0]["series"]
        points = [
            sum(value is not None for value in one["y"]) for one in first if one.get("mark") != "points"
        ]
        if shown["curves"] != points:
            faults.append(f"{name}: curves of {shown['curves']} points, not {points}")
        if shown["wide"] > width or shown["wide"] < 0.3 * min(width, 800) or shown["high"] < 200:
            faults.append(f"{name} is {shown['wide']} x {shown['high']}")
        if not all(axis in shown["read"] for axis in (one["name"] for one in chart["axes"])):
            faults.append(f"{name} reads out: {shown['read']}")
        if (
            shown["zoomed"] == shown["labels"]
            or shown["back"] != shown["labels"]
            or shown["key"] == shown["read"]
        ):
            faults.append(f"{name} does not zoom, come back or go on by keys")
        if len(chart["views"]) > 1 and shown["views"] != [True] * len(chart["views"]):
            faults.append(f"{name}: not every view is drawn: {shown['views']}")
        if shown["hidden"] != 1:
            faults.append(f"{name}: a curve cannot be hidden")
    return faults


# Page, width, and what was planted: of that every word is to be found in a fault; a page without must have
# none
cases = [
    ("run/report.html", 400, ()),
    ("run/report.html", 1600, ()),
    ("fault/report.html", 400, ()),
    ("gallery/index.html", 400, ()),
    ("gallery/index.html", 1600, ()),
]
text = Path("run/report.html").read_text()
planted = {
    "looks": (
        [
            (
                "<main>",
                '<main><div style="width:500px">x</div><p style="font-size:9px">x</p><img '
                'src="http://127.0.0.1:9/x.png" alt="x">',
            ),
            (
                '<figure id="section-0"><img src="data:image/png;base64,iVBO',
                '<figure id="section-0"><img src="data:image/png;base64,xxxx',
            ),
        ],
        ["scrolls sideways", "below 11 pixels", "refused", "a picture is not shown: {'id': 'section-0'"],
    ),
    "script": (
        [('"use strict";', '"use strict"; nothing_of_the_kind();')],
        ["nothing_of_the_kind", "chart-energy is not drawn"],
    ),
    "zoom": ([("this.zoom = [flatX", "this.zooms = [flatX")], ["does not zoom"]),
}
for name, (changes, wanted) in planted.items():
    changed = text
    for old, new in changes:
        if old not in changed:
            failed += 1
            print(f"FAILED: nothing to plant {name} in")
        changed = changed.replace(old, new, 1)
    Path(f"planted_{name}.html").write_text(changed)
    cases.append((f"planted_{name}.html", 400, wanted))

for (name, width, wanted), found in zip(cases, look(chromium, [case[:2] for case in cases])):
    faults = faults_of(found, Page(name), width)
    missed = [word for word in wanted if not any(word in fault for fault in faults)]
    if missed or (faults and not wanted):
        failed += 1
        print(f"FAILED: {name} at {width}: {f'not noticed: {missed}; ' if missed else ''}{faults}")
    else:
        print(f"   {name} at {width}: {'as planted' if wanted else 'fine'}")
sys.exit(1 if failed else 0)
