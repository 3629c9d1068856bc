// Charts of a report: curves with a read-out, zoom by dragging a box, by buttons and keys. The data stand in the page as JSON:
// {charts: [{id, title, axes: [{name, unit, values}], views: [{name, unit, series: [{name, y} or {name, x, y, axis, mark}]}]}]}
// A series without an x of its own has a value for each of the axes' values; one with `axis` is drawn over that axis only.
"use strict";
(() => {
const PREFIXES = [[1e-18, "a"], [1e-15, "f"], [1e-12, "p"], [1e-9, "n"], [1e-6, "\u00b5"], [1e-3, "m"], [1, ""], [1e3, "k"], [1e6, "M"],
   [1e9, "G"], [1e12, "T"]];
const SVG = "http://www.w3.org/2000/svg";

const isNumber = value => typeof value === "number" && Number.isFinite(value);

/** Factor and unit with the prefix that suits the largest magnitude; areas by the square of it, pure numbers and per cent as they are. */
function scaleOf(unit, largest) {
   if (unit === "1" || unit === "" || unit === "%") return {factor: 1, unit: unit === "1" ? "" : unit};
   const power = unit === "m2" ? 2 : 1, plain = unit === "m2" ? "m\u00b2" : unit;
   let best = largest > 0 ? PREFIXES[0] : [1, ""];
   for (const prefix of PREFIXES) if (largest >= prefix[0] ** power) best = prefix;
   return {factor: best[0] ** power, unit: best[1] + plain};
}

function written(value, digits = 5) {
   if (!isNumber(value)) return "\u2013";
   if (value === 0) return "0";
   const size = Math.abs(value);
   return size >= 1e-4 && size < 1e7 ? String(Number(value.toPrecision(digits))) : value.toExponential(digits - 1);
}

/** Round numbers between two limits, about so many. */
function ticks(low, high, count) {
   const rough = (high - low) / Math.max(count, 1), power = 10 ** Math.floor(Math.log10(rough));
   const step = [1, 2, 5, 10].map(n => n * power).find(one => one >= rough * (1 - 1e-9));
   const found = [];
   for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; n++) found.push(n * step);
   return found.map(value => Number(value.toPrecision(10)));
}

function extent(values) {
   let low = Infinity, high = -Infinity;
   for (const value of values) if (isNumber(value)) { low = Math.min(low, value); high = Math.max(high, value); }
   return low <= high ? [low, high] : [0, 1];
}

function element(parent, name, attributes = {}, text = null) {
   const made = document.createElementNS(SVG, name);
   for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
   if (text !== null) made.textContent = text;
   parent.append(made);
   return made;
}

class Chart {
   constructor(place, spec) {
      Object.assign(this, {place, spec, axis: 0, view: 0, hidden: new Set(), zoom: null, at: null, drag: null});
      this.tools = document.createElement("div");
      this.tools.className = "tools";
      const title = document.createElement("h3");
      title.textContent = spec.title;
      this.tools.append(title);
      this.choice("over", spec.axes, n => { this.axis = n; });
      this.choice("show", spec.views, n => { this.view = n; this.hidden.clear(); });
      this.button("\u2212", "Zoom out", () => this.scaleBy(2));
      this.button("+", "Zoom in", () => this.scaleBy(0.5));
      this.button("whole", "Show the whole curve", () => { this.zoom = null; this.draw(); });
      this.svg = document.createElementNS(SVG, "svg");
      this.svg.setAttribute("tabindex", "0");
      this.svg.setAttribute("role", "img");
      this.legend = document.createElement("div");
      this.legend.className = "legend";
      this.readout = document.createElement("output");
      this.readout.textContent = "Point at the curve to read it.";
      place.prepend(this.tools, this.svg, this.legend, this.readout);
      this.listen();
      this.width = 0;
      new ResizeObserver(() => { if (this.svg.clientWidth !== this.width) this.draw(); }).observe(place);
      this.draw();
   }

   choice(word, options, chosen) {
      if (options.length < 2) return;
      const select = document.createElement("select");
      select.setAttribute("aria-label", `${word}: ${this.spec.title}`);
      options.forEach((option, n) => select.add(new Option((word === "over" ? "over " : "") + option.name, n)));
      select.addEventListener("change", () => { chosen(Number(select.value)); this.zoom = null; this.at = null; this.draw(); });
      this.tools.append(select);
   }

   button(text, label, act) {
      const made = document.createElement("button");
      made.type = "button";
      made.textContent = text;
      made.title = label;
      made.setAttribute("aria-label", label);
      made.addEventListener("click", act);
      this.tools.append(made);
   }

   listen() {
      const svg = this.svg;
      svg.addEventListener("pointerdown", event => {
         if (event.button !== 0 || !this.inside(event)) return;
         this.drag = {from: this.place_of(event), to: null};
         svg.setPointerCapture(event.pointerId);
      });
      svg.addEventListener("pointermove", event => {
         const here = this.place_of(event);
         if (this.drag && Math.hypot(here[0] - this.drag.from[0], here[1] - this.drag.from[1]) > 6) this.drag.to = here;
         if (this.drag && this.drag.to) this.drawBox();
         else this.point(here);
      });
      svg.addEventListener("pointerup", () => {
         const drag = this.drag;
         this.drag = null;
         if (!drag || !drag.to) return;
         // A flat box zooms along one axis only
         const [x, y] = [0, 1].map(k => [drag.from[k], drag.to[k]].sort((a, b) => a - b));
         const now = this.limits, flatX = x[1] - x[0] < 12, flatY = y[1] - y[0] < 12;
         const [x0, y1] = this.value_at(x[0], y[0]), [x1, y0] = this.value_at(x[1], y[1]);
         this.zoom = [flatX ? now[0] : x0, flatX ? now[1] : x1, flatY ? now[2] : y0, flatY ? now[3] : y1];
         this.draw();
      });
      svg.addEventListener("pointercancel", () => { this.drag = null; this.draw(); });
      svg.addEventListener("dblclick", () => { this.zoom = null; this.draw(); });
      svg.addEventListener("wheel", event => { // with Ctrl, which a pinch on a touch pad has too; without it the page scrolls
         if (!event.ctrlKey) return;
         event.preventDefault();
         this.scaleBy(event.deltaY > 0 ? 1.25 : 0.8, this.value_at(...this.place_of(event)));
      }, {passive: false});
      svg.addEventListener("keydown", event => {
         const move = {ArrowRight: 1, ArrowLeft: -1}[event.key];
         if (move) this.step(move * (event.shiftKey ? 10 : 1));
         else if (event.key === "+" || event.key === "=") this.scaleBy(0.5);
         else if (event.key === "-") this.scaleBy(2);
         else if (event.key === "0" || event.key === "Escape") { this.zoom = null; this.draw(); }
         else return;
         event.preventDefault();
      });
   }

   /** Those of the view that this axis has, with their points. */
   series() {
      const x = this.spec.axes[this.axis].values;
      return this.spec.views[this.view].series.map((one, n) => ({...one, number: n, own: Boolean(one.x), x: one.x || x}))
         .filter(one => !one.own || (one.axis || 0) === this.axis);
   }

   shown() { return this.series().filter(one => !this.hidden.has(one.number)); }

   place_of(event) {
      const box = this.svg.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
   }

   inside(event) {
      const [x, y] = this.place_of(event), p = this.plot;
      return x >= p.left && x <= p.right && y >= p.top && y <= p.bottom;
   }

   value_at(x, y) {
      const [x0, x1, y0, y1] = this.limits, p = this.plot;
      return [x0 + (x - p.left) / (p.right - p.left) * (x1 - x0), y0 + (p.bottom - y) / (p.bottom - p.top) * (y1 - y0)];
   }

   pixel_of(x, y) {
      const [x0, x1, y0, y1] = this.limits, p = this.plot;
      return [p.left + (x - x0) / (x1 - x0) * (p.right - p.left), p.bottom - (y - y0) / (y1 - y0) * (p.bottom - p.top)];
   }

   scaleBy(factor, about = null) {
      const [x0, x1, y0, y1] = this.limits, at = this.at === null ? null : this.values_at(this.at);
      const [cx, cy] = about || (at && at[0] >= x0 && at[0] <= x1 && at[1] >= y0 && at[1] <= y1 ? at : [(x0 + x1) / 2, (y0 + y1) / 2]);
      this.zoom = [cx + (x0 - cx) * factor, cx + (x1 - cx) * factor, cy + (y0 - cy) * factor, cy + (y1 - cy) * factor];
      this.draw();
   }

   whole() {
      const shown = this.shown(), [x0, x1] = extent(shown.flatMap(one => one.x));
      let [y0, y1] = extent(shown.flatMap(one => one.y));
      if (y0 === y1) [y0, y1] = [Math.min(y0, 0), Math.max(y1, 0)];
      if (y0 === y1) y1 = 1;
      const edge = 0.04 * (y1 - y0), side = 0.02 * ((x1 - x0) || 1);
      return [x0 - side, x1 + side, y0 - edge, y1 + edge];
   }

   draw() {
      const svg = this.svg, view = this.spec.views[this.view], axis = this.spec.axes[this.axis];
      this.width = svg.clientWidth;
      const width = Math.max(this.width, 240), height = Math.round(Math.min(Math.max(0.6 * width, 260), 440));
      svg.setAttribute("height", height);
      svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
      svg.setAttribute("aria-label", `${this.spec.title}: ${view.name} over ${axis.name}`);
      svg.replaceChildren();
      this.limits = this.zoom || this.whole();
      const [x0, x1, y0, y1] = this.limits, full = this.whole();
      // Units as the whole curve has them, so that they stay while one zooms
      const xs = this.xs = scaleOf(axis.unit, Math.max(Math.abs(full[0]), Math.abs(full[1])));
      const ys = this.ys = scaleOf(view.unit, Math.max(Math.abs(full[2]), Math.abs(full[3])));
      const yTicks = ticks(y0 / ys.factor, y1 / ys.factor, height / 60).map(value => [value, written(value, 6)]);
      const left = 30 + 7.5 * Math.max(1, ...yTicks.map(one => one[1].length));
      const p = this.plot = {left, right: width - 12, top: 10, bottom: height - 44};
      for (const [value, text] of yTicks) {
         const y = this.pixel_of(0, value * ys.factor)[1];
         element(svg, "line", {class: "grid", x1: p.left, x2: p.right, y1: y, y2: y});
         element(svg, "text", {x: p.left - 6, y: y + 4, "text-anchor": "end"}, text);
      }
      for (const value of ticks(x0 / xs.factor, x1 / xs.factor, (p.right - p.left) / 80)) {
         const x = this.pixel_of(value * xs.factor, 0)[0];
         element(svg, "line", {class: "grid", x1: x, x2: x, y1: p.top, y2: p.bottom});
         element(svg, "text", {x, y: p.bottom + 17, "text-anchor": "middle"}, written(value, 6));
      }
      const label = (name, unit) => name + (unit ? ` [${unit}]` : "");
      element(svg, "text", {x: (p.left + p.right) / 2, y: height - 6, "text-anchor": "middle"}, label(axis.name, xs.unit));
      element(svg, "text", {x: 0, y: 0, transform: `translate(13 ${(p.top + p.bottom) / 2}) rotate(-90)`, "text-anchor": "middle"},
         label(view.name, ys.unit));
      const clip = `clip-${this.spec.id}`;
      element(element(svg, "clipPath", {id: clip}), "rect",
         {x: p.left, y: p.top, width: p.right - p.left, height: p.bottom - p.top});
      const curves = element(svg, "g", {"clip-path": `url(#${clip})`});
      for (const one of this.shown()) this.curve(curves, one);
      element(svg, "rect", {class: "frame", x: p.left, y: p.top, width: p.right - p.left, height: p.bottom - p.top});
      this.over = element(svg, "g");
      this.drawLegend();
      if (this.at !== null) this.read();
   }

   curve(parent, one) {
      const color = `var(--c${one.number % 8})`;
      if (one.mark === "points") {
         one.x.forEach((x, n) => {
            const [cx, cy] = this.pixel_of(x, one.y[n]);
            element(parent, "circle", {cx: cx.toFixed(1), cy: cy.toFixed(1), r: 3.5, fill: color});
         });
         return;
      }
      let path = "", pen = false;
      one.x.forEach((x, n) => {
         if (!isNumber(x) || !isNumber(one.y[n])) { pen = false; return; }
         const [px, py] = this.pixel_of(x, one.y[n]);
         path += `${pen ? "L" : "M"}${px.toFixed(1)} ${py.toFixed(1)}`;
         pen = true;
      });
      element(parent, "path", {d: path, fill: "none", stroke: color, "stroke-width": one.own ? 1.5 : 2, "stroke-linejoin": "round",
         ...(one.mark === "dashed" || one.number >= 8 ? {"stroke-dasharray": "6 4"} : {})});
   }

   drawLegend() {
      this.legend.replaceChildren(...this.series().map(one => {
         const label = document.createElement("label"), box = document.createElement("input"), line = document.createElement("i");
         box.type = "checkbox";
         box.checked = !this.hidden.has(one.number);
         box.addEventListener("change", () => {
            if (box.checked) this.hidden.delete(one.number); else this.hidden.add(one.number);
            this.draw();
         });
         line.style.background = `var(--c${one.number % 8})`;
         label.append(box, line, one.name);
         return label;
      }));
   }

   drawBox() {
      const {from, to} = this.drag, p = this.plot;
      const [x0, x1] = [from[0], to[0]].map(x => Math.min(Math.max(x, p.left), p.right)).sort((a, b) => a - b);
      const [y0, y1] = [from[1], to[1]].map(y => Math.min(Math.max(y, p.top), p.bottom)).sort((a, b) => a - b);
      this.over.replaceChildren();
      element(this.over, "rect", {class: "box", x: x0, y: y0, width: x1 - x0, height: y1 - y0});
   }

   /** The first curve that has a value for each of the axes' values: the read-out goes along it. */
   main() { return this.shown().find(one => !one.own); }

   values_at(n) { const one = this.main(); return one ? [one.x[n], one.y[n]] : null; }

   point([x, y]) {
      const one = this.main();
      if (!one) return;
      let best = Infinity;
      one.x.forEach((value, n) => {
         if (!isNumber(value) || !isNumber(one.y[n])) return;
         const [px, py] = this.pixel_of(value, one.y[n]);
         const far = Math.hypot(px - x, 0.3 * (py - y)); // along x first of all
         if (far < best) { best = far; this.at = n; }
      });
      this.read();
   }

   step(count) {
      const one = this.main();
      if (!one) return;
      this.at = Math.min(Math.max((this.at ?? -1) + count, 0), one.x.length - 1);
      this.read();
   }

   read() {
      const one = this.main();
      this.over.replaceChildren();
      if (!one || this.at === null) return;
      const n = this.at, x = one.x[n], y = one.y[n], p = this.plot;
      if (isNumber(x) && isNumber(y)) {
         const [px, py] = this.pixel_of(x, y);
         if (px >= p.left && px <= p.right) element(this.over, "line", {class: "cross", x1: px, x2: px, y1: p.top, y2: p.bottom});
         if (px >= p.left && px <= p.right && py >= p.top && py <= p.bottom)
            element(this.over, "circle", {cx: px, cy: py, r: 4.5, fill: `var(--c${one.number % 8})`});
      }
      const say = (name, value, unit) => {
         const scale = scaleOf(unit, Math.abs(value));
         return `${name} ${written(value / scale.factor)}${scale.unit ? " " + scale.unit : ""}`;
      };
      const parts = this.spec.axes.map(axis => say(axis.name, axis.values[n], axis.unit));
      for (const other of this.shown()) {
         const value = other.own ? between(other.x, other.y, x) : other.y[n];
         if (isNumber(value)) parts.push(say(`${other.name}:`, value, this.spec.views[this.view].unit));
      }
      this.readout.textContent = parts.join("; ");
   }
}

/** A curve at x, by straight lines; x rises along it. */
function between(xs, ys, x) {
   for (let n = 1; n < xs.length; n++)
      if (xs[n - 1] <= x && x <= xs[n]) {
         const share = xs[n] > xs[n - 1] ? (x - xs[n - 1]) / (xs[n] - xs[n - 1]) : 0;
         return ys[n - 1] + share * (ys[n] - ys[n - 1]);
      }
   return null;
}

for (const spec of JSON.parse(document.getElementById("data").textContent).charts)
   new Chart(document.getElementById(spec.id), spec);

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
