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
        if shown["drawn"][0] != shown["drawn"][1]:
            faults.append(f"{name}: {shown['drawn'][0]} curves are drawn of {shown['drawn'][1]}")
        if (
            chart["axes"][0]["name"] not in shown["labels"]
            or chart["views"][0]["name"] not in shown["labels"]
        ):
            faults.append(f"{name} is labelled {shown['labels']}")
        if first[0]["name"] not in shown["read"]:
            faults.append(f"{name} reads out: {shown['read']}")
        choices = sum(len(chart[which]) for which in ("axes", "views") if len(chart[which]) > 1)
        if shown["views"] != [True] * choices:
            faults.append(f"{name}: not every view and axis is drawn: {shown['views']}")
    # The answer and its curve stand on the first screen
    curve = next(iter(found["charts"].values()), None)
    if found["answered"] and curve:
        screen = 900 if width > 1000 else 1400
        if max(found["answered"], curve["bottom"]) > screen:
            faults.append(
                f"the answer ends at {found['answered']:.0f}, its curve at {curve['bottom']:.0f} pixels"
            )
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
    "choice": (
        [("chosen[name] = Number(select.value)", "Number(select.value)")],
        ["not every view and axis"],
    ),
    "low": ([("<header>", '<header><div style="height:1500px"></div>')], ["the answer ends at"]),
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
