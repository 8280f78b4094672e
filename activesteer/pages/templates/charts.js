// Plots of a page: shared parts, and charts of the panels of a picture, from `model.py`.
"use strict";
const FONT = "12px system-ui, -apple-system, 'Segoe UI', Roboto, Arial, sans-serif";
// Colours of the stylesheet, light or dark; read again when the scheme changes.
const PAINTS = ["paper", "quiet", "grid", "lane", "patch", "cone", "struck", "path", "failed", "ink", "link", ...Array.from({ length: 6 }, (_, i) => `run-${i}`)];
const paint = {};
const mix = () => { const style = getComputedStyle(document.documentElement); for (const name of PAINTS) paint[name] = style.getPropertyValue(`--${name}`).trim(); };
mix();
const PLOT_HEIGHT = 190, TRACK_HEIGHT = 290, PLOT_HEAD = 24, PLOT_GAP = 18;
// Least size of a cone [px], otherwise cones and cars have their true size; distance between drawn cars [px].
const LEAST_CONE = 2, CARS_APART = 110;
// Least height of a track to one scale [px]; stretch beyond which no car is drawn along it.
const LEAST_TRACK_HEIGHT = 120, MOST_STRETCH = 2.5;
// Plots of a picture from which on four stand in a row on a wide screen, unless they are over time.
const MANY = 6;
// Height of a row with a name below which its texts are small [px].
const LOW_ROW = 26;
// Instants of the slider; most values at a plot if those of dotted lines are among them.
const INSTANTS = 1000, MOST_TOLD = 6;
// Width of paper between its margins [CSS px], less the gap, for the two columns of a printed page.
const PRINTED = 660, PRINTED_GAP = 16, PRINTED_PLOT_HEIGHT = 100, PRINTED_TRACK_HEIGHT = 150, PRINTED_MOST = 920;

const SVG = "http://www.w3.org/2000/svg";
const element = (name, attributes = {}, ...children) => {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
};
// Axis labels with a real minus sign and without rounding errors.
const labels = (unit) => (_, ticks) => ticks.map((tick) => (tick == null ? "" : `${+tick.toPrecision(9)}`.replace("-", "−") + unit));
// Distance between labels that leaves room for the longest one [px].
const labelRoom = (_, __, low, high, width) => {
  const step = (60 * (high - low)) / width, digits = Math.max(0, Math.min(9, Math.ceil(-Math.log10(step))));
  return 22 + 7 * Math.max(...[low, high].map((end) => `${+end.toFixed(digits)}`.length));
};
// Distance between the labels of a vertical axis: a low plot, as on paper, needs more than one, too [px].
const sideRoom = (_, __, ___, ____, height) => (height < 100 ? 17 : 30);
const axis = (size, unit = "") => ({ values: labels(unit), stroke: () => paint.quiet, font: FONT, size, gap: 4, grid: { stroke: () => paint.grid, width: 1 }, ticks: { show: false } });
// A number with a real minus sign, and none before zero.
const shown = (number) => {
  if (number == null) return "–";
  const text = number.toFixed(Math.abs(number) < 10 ? 2 : Math.abs(number) < 1000 ? 1 : 0);
  return text.replace("-", Number(text) ? "−" : "");
};

const dashed = (run, width) => run.dashes.map((length) => length * width);
// Later runs lie over earlier ones; thinner and dashed, they leave these visible.
const lineWidth = (run) => Math.max(1.5, 2.6 - 0.4 * run);

// Limits of a vertical axis, with some room, and no closer than `least`.
function padded(low, high, least) {
  if (low == null) return [0, least];
  const half = 0.55 * Math.max(high - low, least), middle = (low + high) / 2;
  return [middle - half, middle + half];
}

const DARK = matchMedia("(prefers-color-scheme: dark)"), NARROW = matchMedia("(max-width: 760px), (max-height: 450px)"); // a telephone, upright or on its side
// All that is drawn anew for another colour scheme, another width, or paper.
const drawn = [];

const POINTS = { o: "M13 3a1 1 0 1 0 2 0a1 1 0 1 0-2 0z", D: "M14 1.5l1.5 1.5-1.5 1.5-1.5-1.5z", x: "M11.5 .5l5 5m0-5l-5 5" };
// A swatch of a line, of a point, or of an area with the opacity `filled`.
function swatchOf(colour, dashes, marker = "", filled = null, width = 0) {
  const swatch = document.createElementNS(SVG, "svg");
  swatch.setAttribute("class", "swatch");
  swatch.setAttribute("viewBox", "0 0 28 6");
  swatch.style.setProperty("--run", colour);
  const line = swatch.appendChild(document.createElementNS(SVG, "path"));
  if (filled != null) { line.setAttribute("d", "M.5 .5h27v5h-27z"); Object.assign(line.style, { fill: colour, fillOpacity: filled, strokeWidth: 1 }); return swatch; }
  if (width > 3) line.style.strokeWidth = 5; // a wide line beneath a thin one
  line.setAttribute("d", marker ? POINTS[marker] ?? POINTS.o : "M0 3h28");
  if (marker) line.style.fill = colour; else line.setAttribute("stroke-dasharray", dashes.join(" "));
  return swatch;
}

const onDark = () => DARK.matches && !document.documentElement.classList.contains("paper");
const channels = (colour) => [1, 3, 5].map((start) => parseInt(colour.slice(start, start + 2), 16));
const blend = (one, other, share) => `#${one.map((part, i) => Math.round(part + share * (other[i] - part)).toString(16).padStart(2, "0")).join("")}`;
const VIRIDIS = ["#440154", "#3b528b", "#21918c", "#5ec962", "#fde725"].map(channels);

function scaleColour(shade) {
  const at = Math.min(3, Math.floor(4 * shade));
  return blend(VIRIDIS[at], VIRIDIS[at + 1], 4 * shade - at);
}

// A colour of a picture on this page: a run's, a shade of the scale, or another, lighter in the dark.
function inkOf(colour, shade) {
  if (shade != null) colour = scaleColour(shade);
  if (colour.startsWith("run-")) return paint[colour];
  if (!onDark() || !colour.startsWith("#")) return colour;
  // In the dark, a pale colour recedes unless it is one of the scale, and a dark one comes forward.
  const parts = channels(colour), pale = parts[0] + parts[1] + parts[2] > 480;
  if (pale && shade != null) return colour;
  return blend(parts, pale ? [22, 24, 27] : [255, 255, 255], pale ? 0.55 : 0.35);
}

// A panel: axes, zoom and cursor by uPlot; curves of any shape, areas, limits and notes by this class.
class Chart {
  constructor(box, panel, picture) {
    this.panel = panel;
    this.picture = picture;
    this.values = element("span", { class: "values" });
    const named = panel.title ? [element("b", {}, panel.title), element("span", { class: "quiet" }, panel.y)] : [element("b", {}, panel.y)];
    this.holder = element("div", { role: "img", "aria-label": `${panel.title} ${panel.y} over ${panel.x}` });
    const below = element("p", { class: "abscissa quiet" }, panel.x + (panel.above ? `; above: ${panel.above.label}` : ""));
    box.append(element("figure", { class: `plot${picture.panels.length === 1 && !panel.equal ? " wide" : ""}` }, element("figcaption", {}, ...named, this.values), this.holder, below));
    this.limits = { x: this.ends("x"), y: this.ends("y") };
    this.make();
    drawn.push(this);
    new ResizeObserver(() => this.fit()).observe(this.holder);
  }

  get height() { return this.panel.names.length ? 60 + (this.panel.row_px ?? (this.panel.notes.length > this.panel.names.length ? 40 : NARROW.matches ? 35 : 30)) * this.panel.names.length : this.panel.equal ? Math.min(480, this.holder.clientWidth || 360) : NARROW.matches ? PLOT_HEIGHT : 230; }

  // Least and greatest value of all that is drawn, with some room, unless the panel gives them.
  ends(key) {
    const { curves, areas, limits, names, log } = this.panel, given = this.panel[`${key}_range`] || [null, null];
    if (key === "y" && names.length) return [given[0] ?? -0.9, given[1] ?? names.length - 0.3];
    const levels = this.panel[`${key}_levels`];
    if (levels) return [given[0] ?? -0.5, given[1] ?? levels.length - 0.5];
    const all = [...curves.flatMap((curve) => curve[key]), ...(key === "x" ? areas.flatMap((area) => area.x) : [...areas.flatMap((area) => [...area.low, ...area.high]), ...limits.map(([value]) => value)])];
    const logged = log.includes(key);
    let low = Infinity, high = -Infinity;
    for (const value of all) if (value != null && (!logged || value > 0)) { low = Math.min(low, value); high = Math.max(high, value); }
    if (!(low <= high)) [low, high] = [0, 1];
    if (logged) { const room = key === "y" ? (high / low) ** 0.06 : 1; return [given[0] ?? low / room, given[1] ?? high * room]; }
    const room = key === "x" && this.panel.zero ? 0 : 0.05 * (high - low) || 0.1 * Math.abs(high) || 1;
    return [given[0] ?? low - room, given[1] ?? high + room];
  }

  make() {
    const { panel } = this, log = (key) => (panel.log.includes(key) ? { distr: 3 } : {});
    const plain = { ...axis(26), space: labelRoom }, side = { ...axis(52), space: sideRoom, size: (u, ticks) => Math.max(34, 12 + 7 * Math.max(0, ...(ticks || []).map((tick) => `${tick}`.length))) };
    // Names stand above their rows, where there is room for them at any width.
    if (panel.names.length) Object.assign(side, { size: 8, values: () => [], splits: () => panel.names.map((_, i) => i) });
    for (const [axis, levels, room] of [[plain, panel.x_levels, 60], [side, panel.y_levels, 14]]) {
      if (!levels) continue;
      axis.splits = () => levels.map((_, i) => i);
      axis.values = (u) => { const every = Math.ceil((levels.length * room) / (axis === plain ? u.width : u.height)); return levels.map((level, i) => (i % every ? "" : level)); };
    }
    // uPlot names powers of ten only; a short axis needs more.
    for (const [key, axis] of [["x", plain], ["y", side]]) {
      const [low, high] = this.limits[key];
      const named = high / low < 12 ? /^[123457]e/ : /^[125]e/;
      if (panel.log.includes(key)) delete axis.space;
      if (panel.log.includes(key) && high / low < 300) axis.filter = (_, ticks) => ticks.map((tick) => (named.test((+tick.toPrecision(6)).toExponential()) ? tick : null));
    }
    const axes = [plain, side];
    if (panel.above) axes.push({ ...axis(26), side: 0, scale: "x", grid: { show: false }, values: (_, ticks) => labels("")(_, ticks.map((tick) => +between(tick, panel.above.first, panel.above.second).toPrecision(2))) });
    this.plot = new uPlot({
      width: this.holder.clientWidth || 360, height: this.height, padding: [8, 14, 0, 0], legend: { show: false },
      cursor: { sync: { key: `${this.picture.place} ${panel.x}`, scales: ["x", null] }, drag: { x: true, y: true, uni: 20 }, points: { show: false }, y: false },
      scales: { x: { time: false, ...log("x"), range: (u) => this.range(u, "x") }, y: { ...log("y"), dir: panel.names.length ? -1 : 1, range: (u) => this.range(u, "y") } },
      axes, series: [{}, { paths: () => null, points: { show: false } }],
      hooks: { drawAxes: [(u) => this.draw(u)], setCursor: [(u) => this.read(u)] },
    }, [this.limits.x, this.limits.y], this.holder);
    touchable(this.plot, (range) => (range ? this.plot.setScale("x", range) : this.whole()));
  }

  range(u, key) {
    const { x, y } = this.limits, { width, height } = u.bbox;
    if (!this.panel.equal || !width || !height) return [...this.limits[key]];
    const scale = Math.max((x[1] - x[0]) / width, (y[1] - y[0]) / height);
    const [ends, pixels] = key === "x" ? [x, width] : [y, height], middle = (ends[0] + ends[1]) / 2, half = (scale * pixels) / 2;
    return [middle - half, middle + half];
  }

  whole() { this.plot.batch(() => { for (const key of ["x", "y"]) { const [min, max] = this.range(this.plot, key); this.plot.setScale(key, { min, max }); } }); }

  fit(width = null) {
    const columns = this.holder.parentElement.classList.contains("wide") ? 1 : this.picture.panels.length === 3 ? 3 : 2;
    const room = width == null ? this.holder.clientWidth : (width - (columns - 1) * PRINTED_GAP) / columns;
    // Rows with names keep their height on paper, as far as it goes, because their texts have their size there too.
    const share = this.panel.equal ? 0.75 : this.panel.row_px ? 0.55 : this.panel.names.length ? 1 : 0.5;
    const height = width == null ? this.height : Math.min(Math.round(share * this.height), PRINTED_MOST);
    if (room > 0 && (room !== this.plot.width || width != null)) { this.plot.setSize({ width: room, height }); this.whole(); }
  }

  repaint() { this.plot.redraw(false, true); }

  shown() { return this.panel.curves.filter((curve) => !this.picture.hidden.has(curve.label)); }

  draw(u) {
    const { ctx, bbox } = u, dpr = devicePixelRatio, { panel } = this;
    const px = (x) => u.valToPos(x, "x", true), py = (y) => u.valToPos(y, "y", true);
    const level = (y) => { ctx.beginPath(); ctx.moveTo(bbox.left, y); ctx.lineTo(bbox.left + bbox.width, y); ctx.stroke(); };
    ctx.save();
    ctx.beginPath(); ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height); ctx.clip();
    ctx.lineJoin = "round";
    for (const area of panel.areas) {
      if (this.picture.hidden.has(area.label)) continue;
      ctx.beginPath();
      const ends = [...area.x.map((x, i) => [x, area.high[i]]), ...area.x.map((x, i) => [x, area.low[i]]).reverse()];
      for (const [x, y] of ends) if (x != null && y != null) ctx.lineTo(px(x), py(y));
      ctx.closePath();
      ctx.globalAlpha = area.alpha * (onDark() && area.shade == null ? 0.45 : 1);
      ctx.fillStyle = area.shade == null ? inkOf(area.colour) : scaleColour(area.shade);
      ctx.fill();
      ctx.globalAlpha = 1;
      if (area.edge) { ctx.strokeStyle = inkOf(area.edge); ctx.lineWidth = dpr; ctx.setLineDash([]); ctx.stroke(); }
    }
    ctx.strokeStyle = paint.quiet; ctx.lineWidth = 0.7 * dpr; ctx.setLineDash([]);
    if (panel.zero) { level(py(0)); ctx.beginPath(); ctx.moveTo(px(0), bbox.top); ctx.lineTo(px(0), bbox.top + bbox.height); ctx.stroke(); }
    for (const curve of this.shown()) {
      ctx.strokeStyle = ctx.fillStyle = inkOf(curve.colour, curve.shade);
      ctx.globalAlpha = curve.alpha ?? 1;
      ctx.lineWidth = 1.25 * curve.width * dpr;
      ctx.setLineDash((curve.dashes || []).map((length) => 1.25 * length * curve.width * dpr));
      ctx.beginPath();
      let pen = false;
      curve.x.forEach((x, i) => {
        if (x == null || curve.y[i] == null) { pen = false; return; }
        const at = [px(x), py(curve.y[i])];
        if (curve.dashes) { if (pen) ctx.lineTo(...at); else ctx.moveTo(...at); }
        pen = true;
        if (!curve.marker) return;
        const r = Math.max(1.2, 0.6 * curve.size) * dpr;
        if (curve.marker === "x") { ctx.moveTo(at[0] - r, at[1] - r); ctx.lineTo(at[0] + r, at[1] + r); ctx.moveTo(at[0] - r, at[1] + r); ctx.lineTo(at[0] + r, at[1] - r); }
        else if (curve.marker === "D") { for (const [a, b] of [[0, -1], [1, 0], [0, 1], [-1, 0]]) ctx[b === -1 ? "moveTo" : "lineTo"](at[0] + 1.2 * a * r, at[1] + 1.2 * b * r); ctx.closePath(); ctx.fill(); }
        else { ctx.moveTo(at[0] + r, at[1]); ctx.arc(at[0], at[1], r, 0, 2 * Math.PI); }
      });
      if (curve.marker && curve.marker !== "x") ctx.fill();
      if (curve.dashes || curve.marker === "x") ctx.stroke();
    }
    ctx.globalAlpha = 1;
    ctx.strokeStyle = paint.failed; ctx.lineWidth = 1.2 * dpr; ctx.setLineDash([5 * dpr, 3 * dpr]);
    for (const [value] of panel.limits) level(py(value));
    // Names and values of low rows, as on paper, are small, so that they do not meet.
    const low = panel.names.length && py(1) - py(0) < (panel.row_px ? 2.5 : 1) * LOW_ROW * dpr;
    ctx.fillStyle = paint.ink; ctx.font = FONT.replace("12px", `${(low ? 9 : 12) * dpr}px`);
    ctx.textAlign = "center"; ctx.textBaseline = "top";
    for (const [x, y, text, colour] of panel.notes) {
      ctx.fillStyle = colour || paint.ink;
      // The value of a field is in its middle; another note hangs below its point.
      ctx.textBaseline = colour ? "middle" : "top";
      if (!panel.names.length) {
        if (!colour) { ctx.strokeStyle = paint.paper; ctx.lineWidth = 3 * dpr; ctx.setLineDash([]); ctx.strokeText(text, px(x), py(y) + 5 * dpr); } // a line behind it ends at it
        ctx.fillText(text, px(x), py(y) + (colour ? 1 : 5) * dpr);
        continue;
      }
      // A point in a row has its value beside it, where there is room.
      const before = px(x) > bbox.left + 0.8 * bbox.width;
      ctx.textAlign = before ? "right" : "left"; ctx.textBaseline = "middle";
      ctx.fillText(text, px(x) + (before ? -7 : 7) * dpr, py(y));
    }
    ctx.fillStyle = paint.ink;
    ctx.textAlign = "left"; ctx.textBaseline = "bottom";
    panel.names.forEach((name, i) => ctx.fillText(name, bbox.left + 4 * dpr, py(i) - (!low ? 7 : panel.row_px ? 2 : 5) * dpr, bbox.width - 8 * dpr));
    ctx.restore();
  }

  // Tell the values of the curves at the cursor: by abscissa, or of the nearest point of a curve that turns back.
  read(u) {
    const { left, top } = u.cursor;
    this.values.replaceChildren();
    if (left == null || left < 0) return;
    const x = u.posToVal(left, "x"), found = [];
    for (const curve of this.shown().filter((curve) => curve.told || !this.panel.names.length)) {
      let best = Infinity, at = null;
      for (let i = 0; i < curve.x.length; i++) {
        if (curve.x[i] == null || curve.y[i] == null) continue;
        const away = curve.turns ? Math.hypot(u.valToPos(curve.x[i], "x") - left, u.valToPos(curve.y[i], "y") - (top ?? 0)) : Math.abs(curve.x[i] - x);
        if (away < best) { best = away; at = i; }
      }
      if (at != null) found.push([curve, at]);
    }
    if (!found.length) return;
    if (!this.panel.names.length) this.values.append(this.panel.x_levels ? this.panel.x_levels[Math.round(x)] ?? "" : short(x));
    for (const [curve, at] of found.slice(0, 6)) this.values.append(" ", element("span", { style: `--run: ${inkOf(curve.colour, curve.shade)}`, title: curve.label }, curve.told?.[at] ?? shown(curve.y[at])));
  }
}

// A button that plays curves over time, and a slider for the instant. `show` gets its number, 0 to `last`.
class Player {
  constructor(last, step_s, start_s, show) {
    Object.assign(this, { first: 0, last, step_s, start_s, show, playing: false, held: false });
    this.button = element("button", { type: "button", class: "play" }, "Play");
    this.slider = element("input", { type: "range", class: "time", min: 0, max: last, value: 0, "aria-label": "Time" });
    this.clock = element("output", { class: "quiet" });
    this.row = element("div", { class: "player" }, this.button, this.slider, this.clock);
    this.button.addEventListener("click", () => this.play(!this.playing));
    this.slider.addEventListener("input", () => { this.play(false); this.held = true; show(+this.slider.value); });
    this.tell(0);
  }

  play(on) {
    this.playing = on;
    this.button.textContent = on ? "Pause" : "Play";
    if (!on) return;
    this.reveal?.();
    this.held = true;
    let exact = +this.slider.value < this.last ? Math.max(this.first, +this.slider.value) : this.first, before = null;
    const step = (now) => {
      if (!this.playing) return;
      if (before != null) exact += (now - before) / 1000 / this.step_s;
      before = now;
      this.show(Math.min(Math.floor(exact), this.last));
      if (exact >= this.last) this.play(false); else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }

  // Play the instants that a zoom shows.
  limit(first, last) {
    Object.assign(this, { first, last });
    Object.assign(this.slider, { min: first, max: last });
  }

  tell(i) { this.slider.value = i; this.clock.textContent = `${(this.start_s + i * this.step_s).toFixed(2).replace("-", "−")} s`; }
}

const short = (value) => `${+value.toPrecision(3)}`.replace("-", "−");

function between(x, first, second) {
  const rising = first[0] <= first.at(-1) ? [first, second] : [[...first].reverse(), [...second].reverse()];
  const after = Math.min(Math.max(rising[0].findIndex((value) => value >= x), 1), first.length - 1);
  const [x0, x1, y0, y1] = [rising[0][after - 1], rising[0][after], rising[1][after - 1], rising[1][after]];
  return y0 + (y1 - y0) * ((x - x0) / (x1 - x0 || 1));
}

// The legend of the picture before. Pictures of a section with a name in common share one.
let legend = null;

// The panels of a picture with a legend, whose entries hide what they name.
function drawPicture(box, picture, place) {
  const names = picture.panels.flatMap(({ curves, areas, limits }) => [...curves, ...areas].map(({ label }) => label).concat(limits.map(([, label]) => label))).filter(Boolean);
  const section = box.closest("section"), shared = legend?.section === section && legend.bar.isConnected && names.some((label) => legend.seen.has(label));
  const own = shared ? legend : { section, bar: element("div", { class: "toolbar legend" }), seen: new Set(), hidden: new Set(), charts: [] };
  const { bar, seen, hidden, charts } = own;
  if (names.length) legend = own;
  bar.classList.toggle("shared", shared);
  Object.assign(picture, { place, hidden });
  const entry = (label, colour, dashes, marker, filled = null, width = 0) => {
    if (!label || seen.has(label)) return;
    seen.add(label);
    const button = element("button", { type: "button", "aria-pressed": "true" }, swatchOf(colour, dashes, marker, filled, width), label);
    button.addEventListener("click", () => {
      const hide = !hidden.delete(label);
      if (hide) hidden.add(label);
      button.setAttribute("aria-pressed", String(!hide));
      for (const chart of charts) chart.plot.redraw(false);
    });
    bar.append(button);
  };
  for (const panel of picture.panels) {
    if (panel.legend && !seen.has(panel.legend)) bar.append(element("span", { class: "scale" }, panel.legend));
    seen.add(panel.legend);
    for (const curve of panel.curves) entry(curve.label, curve.colour.startsWith("run-") ? `var(--${curve.colour})` : inkOf(curve.colour, curve.shade), (curve.dashes || []).map((length) => 2 * length), curve.dashes ? "" : curve.marker, null, curve.width);
    for (const area of panel.areas) entry(area.label, inkOf(area.colour), [], "", area.alpha || null); // an area without a filling is its edge
    for (const [, label] of panel.limits) entry(label, "var(--failed)", [6, 4]);
  }
  if (picture.scale) {
    const [label, low, high] = picture.scale;
    const shades = element("span", { class: "shades" });
    // Lines and dots of the scale are lighter in the dark; areas are not.
    if (picture.panels.some(({ curves }) => curves.some(({ shade }) => shade != null))) shades.style.background = `linear-gradient(90deg, ${VIRIDIS.map((_, i) => inkOf("", i / 4)).join(", ")})`;
    bar.append(element("span", { class: "scale" }, label), element("span", { class: "scale" }, `${short(low)} `, shades, ` ${short(high)}`));
  }
  box.replaceChildren();
  box.classList.toggle("many", picture.panels.length >= MANY && !picture.panels[0].x.startsWith("time"));
  const made = picture.panels.map((panel) => new Chart(box, panel, picture));
  charts.push(...made);
  // Pictures below each other with one abscissa name it once, below the last.
  const next = box.nextElementSibling?.matches(".plots") && DATA.pictures?.[place + 1];
  if (next && next.panels.length === made.length && made.every(({ panel }, i) => panel.x === next.panels[i].x && !panel.above)) for (const below of box.querySelectorAll(".abscissa")) below.hidden = true;
  if (bar.childNodes.length && !shared) box.before(bar);
  return made;
}

// One button and one slider for all curves over time of a page, which stay in sight.
function addPlayer(charts) {
  const timed = charts.filter(({ panel }) => panel.x.startsWith("time") && panel.curves.length <= MOST_TOLD);
  if (2 * timed.length < charts.length || !timed.length) return; // not what the page shows
  let start_s = Infinity, end_s = -Infinity;
  for (const time_s of timed.flatMap(({ panel }) => panel.curves.flatMap((curve) => curve.x))) if (time_s != null) { start_s = Math.min(start_s, time_s); end_s = Math.max(end_s, time_s); }
  if (!(end_s > start_s)) return;
  const step_s = (end_s - start_s) / INSTANTS;
  const player = new Player(INSTANTS, step_s, start_s, (i) => {
    player.tell(i);
    for (const { plot } of timed) {
      const left = plot.valToPos(start_s + i * step_s, "x");
      plot.setCursor({ left: left > plot.over.clientWidth ? -10 : left, top: 1 }, true, false); // zoomed in elsewhere, it reads nothing
    }
  });
  // What moves is in sight, also where tables stand before the curves.
  const inSight = ({ top, height }) => top + height / 2 > 0 && top + height / 2 < innerHeight;
  player.reveal = () => { if (!timed.some(({ holder }) => inSight(holder.getBoundingClientRect()))) timed[0].holder.scrollIntoView({ block: "center" }); };
  timed[0].holder.closest("section").before(player.row);
}

// Links to the sections of a long page. They stay in sight and mark the section that is read.
const LEAST_SECTIONS = 3;
let reading = null;
function addContents() {
  document.querySelector(".jump")?.remove();
  reading?.disconnect();
  const sections = [...document.querySelectorAll("main section:has(> h2)")];
  if (sections.length < LEAST_SECTIONS) return;
  sections.forEach((section, i) => { section.id ||= `part-${i + 1}`; });
  const links = sections.map((section) => element("a", { href: `#${section.id}` }, section.querySelector("h2").textContent));
  const bar = element("nav", { class: "jump", "aria-label": "Contents" }, element("a", { href: "#contents" }, "Top"), ...links);
  document.querySelector("#contents").after(bar);
  // On a wide screen the links take as many lines as they need; what stays in sight below them follows.
  new ResizeObserver(() => document.querySelector("main").style.setProperty("--jump", `${bar.offsetHeight}px`)).observe(bar);
  reading = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      const link = links[sections.indexOf(target)];
      link.setAttribute("aria-current", isIntersecting);
      if (isIntersecting) bar.scrollTo({ left: link.offsetLeft - bar.offsetLeft - 40 });
    }
  }, { rootMargin: "-15% 0px -84% 0px" });
  for (const section of sections) reading.observe(section);
}

const repaintAll = () => { mix(); for (const each of drawn) each.repaint(); };
DARK.addEventListener("change", repaintAll);
addEventListener("beforeprint", () => {
  document.documentElement.classList.add("paper");
  repaintAll();
  for (const details of document.querySelectorAll("details.printed, details.rows")) details.open = true;
  for (const each of drawn) each.fit(PRINTED);
});
addEventListener("afterprint", () => { document.documentElement.classList.remove("paper"); repaintAll(); for (const each of drawn) each.fit(); });

// Long tables are folded on a phone, and open on paper.
if (NARROW.matches) for (const details of document.querySelectorAll("details.rows")) details.open = false;
const DATA = JSON.parse(document.getElementById("data")?.textContent ?? "{}");
addPlayer((DATA.pictures ?? []).flatMap((picture, place) => drawPicture(document.querySelector(`.plots[data-picture="${place}"]`), picture, place)));
addContents();
