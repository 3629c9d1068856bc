// Charts of a report, drawn by plotly.js (plotly-basic.min.js). The data stand in the page as JSON:
// {charts: [{id, title, axes: [{name, unit, values}], views: [{name, unit, series: [{name, y} or {name, x, y, axis, mark}]}]}]}
// A series without an x of its own has a value for each of the axes' values; one with `axis` is drawn over that axis only.
"use strict";
(() => {
const PREFIXES = [[1e-18, "a"], [1e-15, "f"], [1e-12, "p"], [1e-9, "n"], [1e-6, "\u00b5"], [1e-3, "m"], [1, ""], [1e3, "k"], [1e6, "M"],
   [1e9, "G"], [1e12, "T"]];
const DASHES = ["solid", "dash", "dot", "dashdot"];

/** Factor and unit with the prefix that suits the largest magnitude; areas by the square of it, pure numbers and per cent as they are. */
function scaleOf(unit, values) {
   const largest = values.reduce((most, value) => Math.max(most, Math.abs(value) || 0), 0);
   if (unit === "1" || unit === "" || unit === "%") return {factor: 1, unit: unit === "1" ? "" : unit};
   const power = unit === "m2" ? 2 : 1, plain = unit === "m2" ? "m\u00b2" : unit;
   let best = largest > 0 ? PREFIXES[0] : [1, ""];
   for (const prefix of PREFIXES) if (largest >= prefix[0] ** power) best = prefix;
   return {factor: best[0] ** power, unit: best[1] + plain};
}

const style = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const label = (name, unit) => name + (unit ? ` [${unit}]` : "");
const scaled = (values, factor) => values.map(value => value === null ? null : value / factor);

/** Limits of values with some room on both sides; plotly gives lines none. */
function around(values) {
   const known = values.filter(value => value !== null), low = known.reduce((a, b) => Math.min(a, b), Infinity);
   const high = known.reduce((a, b) => Math.max(a, b), -Infinity), room = 0.03 * (high - low) || 0.1 * Math.abs(high) || 1;
   return low <= high ? [low - room, high + room] : [0, 1];
}

/** What plotly draws of a view over an axis. */
function traces(spec, axis, view) {
   const x = spec.axes[axis].values;
   const shown = spec.views[view].series.map((one, n) => ({...one, number: n}))
      .filter(one => !one.x || (one.axis || 0) === axis);
   const xs = scaleOf(spec.axes[axis].unit, shown.flatMap(one => one.x || x));
   const ys = scaleOf(spec.views[view].unit, shown.flatMap(one => one.y));
   const data = shown.map(one => ({
      type: "scatter", name: one.name, visible: one.hidden ? "legendonly" : true, x: scaled(one.x || x, xs.factor), y: scaled(one.y, ys.factor),
      mode: one.mark === "points" ? "markers" : "lines", marker: {size: 7, color: style(`--c${one.number % 8}`)},
      line: {color: style(`--c${one.number % 8}`), width: one.x ? 1.5 : 2,
         dash: one.mark === "dashed" ? "dash" : DASHES[Math.floor(one.number / 8) % 4]},
      hovertemplate: `%{x:.5g} ${xs.unit}, %{y:.5g} ${ys.unit}<extra>%{fullData.name}</extra>`,
   }));
   const seen = data.filter(one => one.visible === true);
   return {data, ranges: [around(seen.flatMap(one => one.x)), around(seen.flatMap(one => one.y))], x: label(spec.axes[axis].name, xs.unit), y: label(spec.views[view].name, ys.unit)};
}

function layout(made, width, curves) {
   const line = {gridcolor: style("--line"), linecolor: style("--quiet"), mirror: true, showline: true, zeroline: false,
      automargin: true, exponentformat: "power"};
   return {
      width, height: Math.round(Math.min(Math.max(0.55 * width, 260), 420)) + 20 * curves, autosize: false,
      margin: {l: 10, r: 14, t: 8, b: 10}, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: {family: getComputedStyle(document.body).fontFamily, size: 13, color: style("--text")},
      xaxis: {...line, title: {text: made.x}, range: made.ranges[0]}, yaxis: {...line, title: {text: made.y}, range: made.ranges[1]},
      modebar: {bgcolor: "rgba(0,0,0,0)", color: style("--quiet"), activecolor: style("--link")}, hovermode: "closest", dragmode: "zoom",
      showlegend: true, legend: {orientation: "h", yref: "container", y: 0, yanchor: "bottom", x: 0},
      hoverlabel: {namelength: -1},
   };
}

/** A chart with the choice of its axis and of what is shown. */
function chart(spec) {
   const place = document.getElementById(spec.id), tools = document.createElement("div"), plot = document.createElement("div");
   const chosen = {axis: 0, view: 0}, title = document.createElement("h3");
   title.textContent = spec.title;
   tools.className = "tools";
   plot.className = "plot";
   tools.append(title);
   const draw = () => {
      const made = traces(spec, chosen.axis, chosen.view);
      Plotly.react(plot, made.data, layout(made, plot.clientWidth, made.data.length), {displaylogo: false, responsive: false,
         displayModeBar: plot.clientWidth > 500, modeBarButtons: [["zoom2d", "pan2d", "zoomIn2d", "zoomOut2d", "resetScale2d"]]});
   };
   const choice = (word, name, options) => {
      if (options.length < 2) return;
      const select = document.createElement("select");
      select.setAttribute("aria-label", `${word}: ${spec.title}`);
      options.forEach((option, n) => select.add(new Option((word === "over" ? "over " : "") + option.name, n)));
      select.addEventListener("change", () => { chosen[name] = Number(select.value); draw(); });
      tools.append(select);
   };
   choice("over", "axis", spec.axes);
   choice("show", "view", spec.views);
   place.prepend(tools, plot);
   draw();
   addEventListener("resize", draw);
   matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
}

for (const spec of JSON.parse(document.getElementById("data").textContent).charts) chart(spec);

/** The snapshots of a run as one picture with a slider. */
const frames = document.querySelector("#frames .frames");
if (frames) {
   const pictures = [...frames.children], said = document.querySelector("#frames output");
   const slider = document.createElement("input");
   Object.assign(slider, {type: "range", min: 0, max: pictures.length - 1, step: 1});
   slider.setAttribute("aria-label", "snapshot");
   const show = () => {
      pictures.forEach((picture, n) => { picture.style.display = n === Number(slider.value) ? "" : "none"; });
      said.textContent = pictures[Number(slider.value)].dataset.place;
   };
   slider.value = Math.max(0, pictures.findIndex(picture => picture.dataset.start));
   slider.addEventListener("input", show);
   frames.before(slider);
   show();
}
})();
