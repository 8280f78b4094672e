"use strict";
// Draws a study from the JSON in #data. Every picture is an SVG with axes and units; the script fetches nothing.
const data = JSON.parse(document.getElementById("data").textContent);
const colourOf = data.places.map((place) => `var(--run-${place})`);
const at = (id) => document.getElementById(id);
const NS = "http://www.w3.org/2000/svg";

function element(parent, name, attributes, text) {
  const made = document.createElementNS(NS, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  parent.appendChild(made);
  return made;
}

function html(parent, name, text) {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  parent.appendChild(made);
  return made;
}

function ticks(low, high, count) {
  const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((f) => f * power).find((s) => s >= raw);
  const found = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i++) found.push(i * step);
  return found;
}

const short = (value) => String(Number(value.toPrecision(4))).replace("-", "−");
const withUnit = (label, unit) => (unit && unit !== "-" ? `${label} [${unit}]` : label);

function range(values) {
  let low = Infinity, high = -Infinity;
  for (const v of values) if (v !== null && v !== undefined) { if (v < low) low = v; if (v > high) high = v; }
  if (!(low <= high)) return [0, 1];
  const margin = (high - low) * 0.04 || Math.abs(low) * 0.1 || 1;
  return [low - margin, high + margin];
}

// Width that a picture may have on this screen.
const widthOf = () => Math.max(240, at("distribution").clientWidth || Infinity) - 2;
const LETTER = 6.2, LINE = 14;
const textWidth = (text) => LETTER * text.length;

// A text in lines that fit into the room [px]; a word that is longer stays whole.
function wrapped(text, room) {
  const lines = [];
  for (const word of text.split(" ")) {
    const longer = `${lines.at(-1)} ${word}`;
    if (lines.length && textWidth(longer) <= room) lines[lines.length - 1] = longer;
    else lines.push(word);
  }
  return lines;
}

function picture(parent, width, height, label) {
  return element(parent, "svg", { width, height, viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label });
}

// A frame with axes; returns the svg and the scales. An axis is {label, range} or {label, levels}. Labels of any length fit.
function frame(parent, wanted, height, x, y, most = widthOf()) {
  const least = Math.min(wanted, most);
  const marks = (axis, count) => axis.levels ? axis.levels.map((level, i) => [i, String(level)]) : ticks(...axis.range, count).map((v) => [v, short(v)]);
  const right = 12, top = 10, beside = marks(y, 5);
  const named = wrapped(y.label, height - top - 42), widest = Math.max(0, ...beside.map(([, text]) => textWidth(text)));
  const left = Math.max(62, LINE * named.length + 12 + widest), width = Math.min(Math.max(least, left + least - 62), most);
  const below = wrapped(x.label, width - 8), bottom = 28 + LINE * below.length;
  const svg = picture(parent, width, height, `${y.label} over ${x.label}`);
  const span = (axis) => (axis.levels ? [-0.5, axis.levels.length - 0.5] : axis.range);
  const [x0, x1] = span(x), [y0, y1] = span(y);
  const sx = (v) => left + ((v - x0) / (x1 - x0)) * (width - left - right);
  const sy = (v) => height - bottom - ((v - y0) / (y1 - y0)) * (height - top - bottom);
  element(svg, "rect", { x: left, y: top, width: width - left - right, height: height - top - bottom, fill: "none", stroke: "#888" });
  for (const [v, text] of marks(x, width < 320 ? 4 : 5)) {
    element(svg, "line", { x1: sx(v), x2: sx(v), y1: height - bottom, y2: height - bottom + 4, stroke: "#888" });
    element(svg, "text", { x: sx(v), y: height - bottom + 16, "text-anchor": "middle" }, text);
  }
  for (const [v, text] of beside) {
    element(svg, "line", { x1: left - 4, x2: left, y1: sy(v), y2: sy(v), stroke: "#888" });
    element(svg, "text", { x: left - 7, y: sy(v) + 4, "text-anchor": "end" }, text);
  }
  below.forEach((line, i) => element(svg, "text", { x: width / 2, y: height - bottom + 34 + LINE * i, "text-anchor": "middle" }, line));
  named.forEach((line, i) => element(svg, "text", { transform: `translate(${13 + LINE * i} ${(top + height - bottom) / 2}) rotate(-90)`, "text-anchor": "middle" }, line));
  return { svg, sx, sy };
}

const metricAxis = (metric) => withUnit(metric.label, metric.unit);

function histogram(parent, metric, found, width, height) {
  const { edges, counts } = found.histogram;
  const shares = counts.map((part) => { const n = part.reduce((a, b) => a + b, 0) || 1; return part.map((c) => (100 * c) / n); });
  const top = Math.max(...shares.flat());
  const f = frame(parent, width, height, { label: metricAxis(metric), range: [edges[0], edges[edges.length - 1]] },
    { label: "share of the runs [%]", range: [0, top * 1.05 || 1] });
  shares.forEach((part, c) => {
    let path = `M${f.sx(edges[0])} ${f.sy(0)}`;
    part.forEach((share, i) => { path += `V${f.sy(share)}H${f.sx(edges[i + 1])}`; });
    element(f.svg, "path", { d: `${path}V${f.sy(0)}`, fill: colourOf[c], "fill-opacity": 0.15, stroke: colourOf[c], "stroke-width": 1.5 });
  });
}

const factorTitle = (factor) => withUnit(factor.label, factor.unit);

function factorAxis(factor) {
  const label = factorTitle(factor);
  if (!factor.numeric) return { axis: { label, levels: factor.levels }, value: (v) => factor.levels.indexOf(String(v)) };
  return { axis: { label, range: range(data.rows.factors[factor.key]) }, value: (v) => v };
}

function rowsOf(group) {
  const found = [];
  data.rows.group.forEach((g, i) => { if (g === group) found.push(i); });
  return found;
}

function scatter(parent, factor, points, label) {
  const { axis, value } = factorAxis(factor);
  const f = frame(parent, 380, 260, axis, { label, range: range(points.map((p) => p.y)) });
  for (const p of points) {
    if (p.y === null || p.x === null || p.x === undefined) continue;
    const dot = element(f.svg, "circle", { cx: f.sx(value(p.x)), cy: f.sy(p.y), r: 2.2, fill: colourOf[p.c], "fill-opacity": 0.6 });
    element(dot, "title", {}, `run ${p.run}: ${short(p.y)}`);
  }
}

const shade = (depth) => `hsl(210 60% ${97 - 37 * depth}%)`;

// The colours of heat maps, with the values that they stand for.
function colourBar(parent, low, high, label) {
  const width = 80, height = 300, top = 10, bottom = 42, steps = 60, tall = height - top - bottom;
  const svg = picture(parent, width, height, `colours of ${label}: ${short(low)} to ${short(high)}`);
  const sy = (v) => height - bottom - ((v - low) / (high - low)) * tall;
  for (let i = 0; i < steps; i++) element(svg, "rect", { x: 4, y: top + (tall * i) / steps, width: 16, height: tall / steps, fill: shade(1 - (i + 0.5) / steps), "shape-rendering": "crispEdges" });
  for (const v of ticks(low, high, 5)) element(svg, "text", { x: 25, y: sy(v) + 4 }, short(v));
}

function heat(parent, metric, found, keyed) {
  const all = found.heat.maps.flat(2).filter((v) => v !== null), low = Math.min(...all), high = Math.max(...all);
  if (!(high - low > 1e-3 * Math.max(Math.abs(low), Math.abs(high)))) {
    html(parent, "p", all.length ? `${metricAxis(metric)} is ${short(low)} in every field, within 0.1 %.` : `${metricAxis(metric)} has no value in any field.`);
    return;
  }
  found.heat.maps.forEach((map, c) => {
    const axes = found.heat.keys.map((key, i) => ({ label: factorTitle(keyed[key]), levels: found.heat.levels[i] }));
    const box = html(parent, "div");
    html(box, "div", `${data.controllers[c]}: ${metricAxis(metric)}, mean`);
    const f = frame(box, 400, 300, axes[0], axes[1]);
    map.forEach((line, i) => line.forEach((v, j) => {
      if (v === null) return;
      const depth = (v - low) / (high - low);
      element(f.svg, "rect", { x: f.sx(i - 0.5), y: f.sy(j + 0.5), width: f.sx(0.5) - f.sx(-0.5), height: f.sy(-0.5) - f.sy(0.5), fill: shade(depth), "shape-rendering": "crispEdges" });
      if (map.length <= 12) element(f.svg, "text", { x: f.sx(i), y: f.sy(j) + 4, "text-anchor": "middle", class: "on-shade" }, short(v));
    }));
  });
  const box = html(parent, "div");
  html(box, "div", "mean");
  colourBar(box, low, high, metricAxis(metric));
}

// The mean in fields of the first two numeric factors, for designs without grids.
function binned(rows, values) {
  const pair = data.factors.filter((factor) => factor.numeric).slice(0, 2);
  if (pair.length < 2 || rows.length < 4 * data.controllers.length) return null;
  const count = Math.min(8, Math.max(2, Math.round(Math.sqrt(rows.length / data.controllers.length / 3))));
  const ends = pair.map(({ key }) => { const all = rows.map((i) => data.rows.factors[key][i]).filter((v) => v != null); return [Math.min(...all), Math.max(...all)]; });
  if (ends.some(([low, high]) => !(high > low))) return null;
  const place = (k, v) => Math.min(count - 1, Math.floor(((v - ends[k][0]) / (ends[k][1] - ends[k][0])) * count));
  const sums = data.controllers.map(() => Array.from({ length: count }, () => Array.from({ length: count }, () => [0, 0])));
  for (const i of rows) {
    const [a, b] = pair.map(({ key }) => data.rows.factors[key][i]);
    if (a == null || b == null || values[i] == null) continue;
    const field = sums[data.rows.controller[i]][place(0, a)][place(1, b)];
    field[0] += values[i]; field[1]++;
  }
  const levels = ends.map(([low, high]) => Array.from({ length: count }, (_, i) => short(low + ((i + 0.5) / count) * (high - low))));
  return { keys: pair.map(({ key }) => key), levels, maps: sums.map((map) => map.map((line) => line.map(([sum, n]) => (n ? sum / n : null)))) };
}

function bars(parent, controller, found, metric, [bottom, top]) {
  const names = [...new Set(found.map((index) => index[1]))], factors = [...new Set(found.map((index) => index[0]))];
  const labelled = factors.map((key) => factorTitle(data.factors.find((factor) => factor.key === key)));
  const box = html(parent, "div");
  html(box, "div", data.controllers[controller]);
  const label = names[0] === "mu*" ? withUnit("mu*", metric.unit) : `${names.join(" (light), ")}${names.length > 1 ? " (dark)" : ""} [-]`;
  const f = frame(box, Math.max(300, 90 + Math.max(130, ...labelled.map(textWidth)) * factors.length), 240, { label: "factor", levels: labelled }, { label, range: [bottom * 1.05, top * 1.05 || 1] }, Infinity);
  element(f.svg, "line", { x1: f.sx(-0.5), x2: f.sx(factors.length - 0.5), y1: f.sy(0), y2: f.sy(0), stroke: "#888" });
  for (const [factor, name, value, confidence, spread] of found) {
    const n = names.indexOf(name), width = 0.6 / names.length, x = factors.indexOf(factor) - 0.3 + n * width;
    const bar = element(f.svg, "rect", { x: f.sx(x), width: f.sx(width) - f.sx(0), y: f.sy(Math.max(value, 0)), height: Math.abs(f.sy(value) - f.sy(0)), fill: colourOf[controller], "fill-opacity": n === 0 && names.length > 1 ? 0.45 : 0.85 });
    element(bar, "title", {}, `${name} ${short(value)} ± ${short(confidence)}${spread === null ? "" : `, spread ${short(spread)}`}`);
    const middle = f.sx(x + width / 2);
    element(f.svg, "line", { x1: middle, x2: middle, y1: f.sy(value - confidence), y2: f.sy(value + confidence), stroke: "currentColor", "stroke-width": 1.5 });
  }
}

function parallel(parent, metric, rows) {
  const axes = data.factors.map((factor) => { const { axis, value } = factorAxis(factor); return { ...axis, of: (i) => value(data.rows.factors[factor.key][i]) }; });
  const values = data.rows.metrics[metric.name];
  axes.push({ label: metricAxis(metric), range: range(rows.map((i) => values[i])), of: (i) => values[i] });
  const step = Math.max(190, ...axes.map((axis) => textWidth(axis.label)));
  const margin = 0.5 * Math.max(160, ...axes.map((axis) => textWidth(axis.label)));
  const width = Math.max(420, step * (axes.length - 1) + 2 * margin), height = 320, top = 30, bottom = 20;
  const svg = picture(parent, width, height, "parallel coordinates");
  const x = (n) => margin + (n * (width - 2 * margin)) / Math.max(axes.length - 1, 1);
  const y = (axis, v) => { const [low, high] = axis.levels ? [-0.5, axis.levels.length - 0.5] : axis.range; return height - bottom - ((v - low) / (high - low)) * (height - top - bottom); };
  for (const i of rows.slice(0, 600)) {
    const points = axes.map((axis, n) => [x(n), axis.of(i)]);
    if (points.some(([, v]) => v === null || v === undefined)) continue;
    element(svg, "polyline", { points: points.map(([px, v], n) => `${px},${y(axes[n], v)}`).join(" "), fill: "none", stroke: colourOf[data.rows.controller[i]], "stroke-opacity": 0.35 });
  }
  axes.forEach((axis, n) => {
    element(svg, "line", { x1: x(n), x2: x(n), y1: top, y2: height - bottom, stroke: "currentColor" });
    element(svg, "text", { x: x(n), y: 16, "text-anchor": "middle" }, axis.label);
    const marks = axis.levels ? axis.levels.map((level, i) => [i, String(level)]) : ticks(...axis.range, 5).map((v) => [v, short(v)]);
    for (const [v, text] of marks) element(svg, "text", { x: x(n) - 5, y: y(axis, v) + 4, "text-anchor": "end", class: "over" }, text);
  });
}

function tableOf(parent, header, lines) {
  const table = html(parent, "table"), first = html(html(table, "thead"), "tr"), body = html(table, "tbody");
  table.className = "findings cards";
  header.forEach((text) => html(first, "th", text));
  for (const line of lines) {
    const row = html(body, "tr");
    line.forEach((cell, i) => { const made = html(row, "td", cell instanceof Node ? "" : cell); made.setAttribute("data-title", header[i]); if (cell instanceof Node) made.appendChild(cell); });
  }
}

function replayLine(command) {
  if (!command) return document.createTextNode("the manoeuvre or the vehicle has no file");
  const box = document.createElement("details");
  html(box, "summary", "show");
  const button = html(box, "button", "copy");
  const line = html(box, "code", ` ${command}`);
  line.className = "line";
  button.addEventListener("click", () => {
    const chosen = document.createRange();
    chosen.selectNodeContents(line);
    getSelection().removeAllRanges();
    getSelection().addRange(chosen);
    if (navigator.clipboard) navigator.clipboard.writeText(command).catch(() => document.execCommand("copy"));
    else document.execCommand("copy");
  });
  return box;
}

function draw() {
  for (const id of ["distribution", "quantiles", "scatter", "paired", "paired-table", "heat", "indices", "parallel", "extremes", "all"]) at(id).replaceChildren();
  const group = Number(at("group").value), metric = data.metrics.find((m) => m.name === at("metric").value);
  const found = data.by_group[group][metric.name], keyed = Object.fromEntries(data.factors.map((factor) => [factor.key, factor]));
  for (const id of ["paired-part", "heat-part", "indices-part"]) at(id).hidden = true;
  if (!found) { html(at("distribution"), "p", "No run of this manoeuvre has this metric."); return; }
  const rows = rowsOf(group), values = data.rows.metrics[metric.name];
  const number = (v) => (v === null || v === undefined ? "-" : short(v));
  histogram(at("distribution"), metric, found, 640, 320);
  tableOf(at("quantiles"), ["controller", ...["5 %", "median", "95 %"].map((text) => withUnit(text, metric.unit))],
    data.controllers.map((name, c) => [name, ...(found.quantiles[c] || [null, null, null]).map(number)]));
  at("shown").textContent = data.all > data.rows.run.length ? `Points are ${data.rows.run.length} of ${data.all} runs; everything else uses all runs.` : "";
  for (const factor of data.factors) scatter(at("scatter"), factor, rows.map((i) => ({ x: data.rows.factors[factor.key][i], y: values[i], c: data.rows.controller[i], run: data.rows.run[i] })), metricAxis(metric));
  if (found.paired.some((pair) => pair)) {
    at("paired-part").hidden = false;
    const first = new Map();
    for (const i of rows) if (data.rows.controller[i] === 0) first.set(data.rows.sample[i], values[i]);
    const pairs = rows.filter((i) => data.rows.controller[i] > 0 && values[i] !== null && first.get(data.rows.sample[i]) != null);
    for (const factor of data.factors) scatter(at("paired"), factor, pairs.map((i) => ({ x: data.rows.factors[factor.key][i], y: values[i] - first.get(data.rows.sample[i]), c: data.rows.controller[i], run: data.rows.run[i] })), `difference from ${data.controllers[0]}: ${metricAxis(metric)}`);
    tableOf(at("paired-table"), [`difference from ${data.controllers[0]}`, ...["5 %", "median", "95 %"].map((text) => withUnit(text, metric.unit)), "smaller in magnitude [%]"],
      found.paired.map((pair, n) => [data.controllers[n + 1], ...(pair ? [...pair.quantiles.map(number), short(100 * pair.smaller)] : ["-", "-", "-", "-"])]));
  }
  const map = found.heat || binned(rows, values);
  if (map) { at("heat-part").hidden = false; heat(at("heat"), metric, { heat: map }, keyed); }
  if (found.indices.length) {
    at("indices-part").hidden = false;
    // All controllers have the same scale, so that they can be compared.
    const ends = found.indices.flat().flatMap(([, , value, confidence]) => [value - (confidence || 0), value + (confidence || 0)]);
    const scale = [Math.min(...ends, 0), Math.max(...ends, 0)];
    found.indices.forEach((part, c) => { if (part.length) bars(at("indices"), c, part, metric, scale); });
  }
  parallel(at("parallel"), metric, rows);
  tableOf(at("extremes"), ["controller", "run", metricAxis(metric), "command to drive and replay it"],
    found.extremes.flatMap((part, c) => part.map(([run, value, command]) => [data.controllers[c], String(run), short(value), replayLine(command)])));
  const constant = [];
  for (const other of data.metrics) {
    if (!data.by_group[group][other.name]) continue;
    const all = rows.map((i) => data.rows.metrics[other.name][i]).filter((v) => v != null), low = Math.min(...all), high = Math.max(...all);
    if (high - low > 1e-3 * Math.max(Math.abs(low), Math.abs(high))) histogram(at("all"), other, data.by_group[group][other.name], 300, 190);
    else constant.push(`${other.label} ${all.length ? short(all[0]) : "-"} ${other.unit === "-" ? "" : other.unit}`.trim());
  }
  at("constant").textContent = constant.length ? `The same in all runs, within 0.1 %: ${constant.join(", ")}.` : "";
}

data.groups.forEach((text, place) => { html(at("group"), "option", text).value = place; });
for (const metric of data.metrics) html(at("metric"), "option", metric.label).value = metric.name;
data.controllers.forEach((name, c) => {
  const colour = html(at("legend"), "span");
  colour.className = "colour";
  colour.style.background = colourOf[c];
  at("legend").append(name);
});
// Select a metric that the manoeuvre has: the shown one, else the most common one.
function choose() {
  const has = data.by_group[Number(at("group").value)];
  if (has[at("metric").value]) return;
  const names = data.metrics.map((metric) => metric.name).filter((name) => has[name]);
  const asked = names.find((name) => ["sideslip_peak_abs_rad", "sideslip_peak_rad", "yaw_rate_peak_radps"].includes(name));
  if (names.length) at("metric").value = asked || names[0];
}

if (data.metrics.length) {
  at("group").addEventListener("change", () => { choose(); draw(); });
  at("metric").addEventListener("change", draw);
  at("metric").value = "sideslip_peak_abs_rad";
  choose();
  draw();
}

// A phone that is turned has another width.
if (data.metrics.length && typeof addEventListener === "function") {
  let width = at("distribution").clientWidth;
  addEventListener("resize", () => { if (at("distribution").clientWidth !== width) { width = at("distribution").clientWidth; draw(); } });
}
