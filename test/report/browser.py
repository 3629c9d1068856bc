"""Opens pages in headless Chromium and says what it finds there.

Each page is given a script of the test's own and stands in a frame of its width, for browsers have a least
width of their own. The script tells the page around it what it finds, which writes it where --dump-dom shows
it. One browser opens all of them."""

import html
import json
import re
import subprocess
import tempfile
from pathlib import Path

before = """<script>
window.faults = [];
addEventListener("error", event => faults.push(String(event.message || (event.target.outerHTML || "").slice(0, 100))), true);
addEventListener("unhandledrejection", event => faults.push(String(event.reason)));
addEventListener("securitypolicyviolation", event => faults.push("refused: " + event.blockedURI));
const said = console.error; console.error = (...words) => { faults.push(words.join(" ")); said(...words); };
</script>"""

after = """<script>
addEventListener("load", () => setTimeout(() => {
   const found = {width: innerWidth, page: document.documentElement.scrollWidth, charts: {}, images: [], small: []};
   for (const one of document.querySelectorAll("details")) one.open = true;
   found.opened = document.documentElement.scrollWidth;
   for (const image of document.images)
      found.images.push({id: (image.closest("figure, article") || image).id, natural: image.naturalWidth, shown: image.clientWidth});
   for (const one of document.querySelectorAll("p, td, th, li, dd, dt, figcaption, a, pre, text, output, label, summary"))
      if (one.textContent.trim() && parseFloat(getComputedStyle(one).fontSize) < 11)
         found.small.push(one.tagName + ": " + one.textContent);
   for (const place of document.querySelectorAll(".chart")) {
      const plot = place.querySelector(".js-plotly-plot");
      if (!plot) continue;
      const box = plot.getBoundingClientRect(), chart = found.charts[place.id] = {};
      const titles = () => [...plot.querySelectorAll(".xtitle, .ytitle")].map(text => text.textContent).join("|");
      const drawn = () => plot.querySelectorAll(".scatterlayer .js-line").length;
      chart.wide = box.width;
      chart.high = box.height;
      chart.top = box.top + scrollY;
      chart.bottom = box.bottom + scrollY;
      chart.curves = plot.data.filter(one => one.mode === "lines").map(one => one.y.filter(value => value !== null).length);
      chart.drawn = [drawn(), plot.data.filter(one => one.mode === "lines" && one.visible === true).length];
      chart.labels = titles();
      Plotly.Fx.hover(plot, [{curveNumber: 0, pointNumber: plot.data[0].y.findIndex(value => value !== null)}]);
      chart.read = [...plot.querySelectorAll(".hoverlayer text")].map(text => text.textContent).join(" ");
      chart.views = [];
      for (const select of place.querySelectorAll("select"))
         for (const option of [...select.options].reverse()) {
            select.value = option.value;
            select.dispatchEvent(new Event("change"));
            chart.views.push(titles().includes(option.textContent.replace("over ", "")) && drawn() > 0);
         }
   }
   const answers = document.querySelector("#answer .facts");
   found.answered = answers ? answers.getBoundingClientRect().bottom + scrollY : null;
   found.fetched = performance.getEntriesByType("resource").map(entry => entry.name).filter(name => !name.startsWith("data:"));
   found.faults = faults;
   parent.postMessage([NUMBER, JSON.stringify(found)], "*");
}, 300));
</script>"""

frames = """<!DOCTYPE html><title>frames</title><style>iframe {{ border: 0; height: 900px; display: block }}</style>
{places}
<script>addEventListener("message", event => {{
   document.getElementById("found-" + event.data[0]).textContent = event.data[1];
}});</script>
{frames}"""


def look(chromium, pages):
    """pages: (path, width in pixels); for each what was found, None where nothing came back."""
    with tempfile.TemporaryDirectory(dir=".") as folder:
        folder = Path(folder).resolve()
        places, inside = "", ""
        for number, (page, width) in enumerate(pages):
            text = Path(page).read_text(encoding="utf-8")
            text = text.replace("<head>", "<head>" + before, 1).replace(
                "</body>", after.replace("NUMBER", str(number)) + "</body>", 1
            )
            (folder / f"{number}.html").write_text(text, encoding="utf-8")
            places += f'<pre id="found-{number}"></pre>'
            inside += f'<iframe style="width: {width}px" src="{number}.html"></iframe>'
        (folder / "frames.html").write_text(frames.format(places=places, frames=inside))
        done = subprocess.run(
            [
                chromium,
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-dev-shm-usage",
                "--no-first-run",
                f"--user-data-dir={folder / 'profile'}",
                "--window-size=1700,1000",
                "--virtual-time-budget=60000",
                "--dump-dom",
                (folder / "frames.html").as_uri(),
            ],
            capture_output=True,
            text=True,
        )
    found = [
        re.search(rf'<pre id="found-{number}">(.+?)</pre>', done.stdout, re.S) for number in range(len(pages))
    ]
    if not any(found):
        raise SystemExit(f"the browser shows nothing: {done.stderr[-2000:]}")
    return [one and json.loads(html.unescape(one[1])) for one in found]
