"use strict";
// The page of a study: tables, and panels by `charts.js`, of the chosen manoeuvre and metric.
const all = element("div"), chosenGroup = element("select"), chosenMetric = element("select");
const SHOWN_RUNS = 600, FIELDS = 8, SHADES = 10, APART = 0.16, NAME_ROOM = 0.3, SPARSE = 24, FEW = 3, MIXED = 0.25, DARK_BELOW = 0.43; // black and white have the same contrast with this shade
let body = all;
const PANEL = { x: "", y: "", title: "", curves: [], areas: [], limits: [], names: [], notes: [], log: "", x_range: null, y_range: null, zero: false, equal: false, legend: null, above: null };
const panelOf = (x, y, parts) => ({ ...PANEL, x, y, ...parts });
const colourOf = (controller) => `run-${DATA.places[controller]}`;
const curveOf = (controller, x, y, parts) => ({ x, y, label: DATA.controllers[controller], colour: colourOf(controller), dashes: null, width: 1, marker: "o", size: 4.5, shade: null, turns: true, ...parts });
const withUnit = (label, unit) => (unit && unit !== "-" ? `${label} [${unit}]` : label);
const axisOf = (each) => withUnit(each.label, each.unit);
const firstPlace = (name) => (DATA.first.indexOf(name) + 1 || 99);
const number = (value) => (value == null ? "-" : short(value));
const endsOf = (values) => { let low = Infinity, high = -Infinity; for (const v of values) if (v != null) { low = Math.min(low, v); high = Math.max(high, v); } return [low, high]; };
const constantIn = (low, high) => !(high - low > 1e-3 * Math.max(Math.abs(low), Math.abs(high)));

function begin(title, ...texts) { body = all.appendChild(element("section", { class: "part" })); body.append(element("h2", {}, title), ...texts.filter(Boolean).map((text) => element("p", {}, text))); }

function show(id, panels, scale = null) {
  // On a phone, many plots are folded, as on every page.
  const folds = (panels.length >= MANY && id !== "all") || id === "parallel" ? element("details", { class: "rows narrow", ...(NARROW.matches ? {} : { open: "" }) }, element("summary", {}, `${panels.length} plots`)) : null;
  if (folds) body.append(folds);
  const box = (folds ?? body).appendChild(element("div", { class: "plots", "data-picture": id }));
  drawPicture(box, { panels, scale }, id);
}

function histogram(metric, { edges, counts }) {
  const x = edges.flatMap((edge) => [edge, edge]);
  const alpha = counts.length > 1 ? 0 : 0.15; // filled areas that overlap would make a colour without a name
  const areas = counts.map((part, c) => {
    const all = part.reduce((a, b) => a + b, 0) || 1, shares = part.map((count) => (100 * count) / all);
    const high = [0, ...shares.flatMap((share) => [share, share]), 0];
    return { x, low: high.map(() => 0), high, label: DATA.controllers[c], colour: colourOf(c), alpha, edge: colourOf(c), shade: null };
  });
  return panelOf(axisOf(metric), "share of the runs [%]", { areas, y_range: [0, null] });
}

// Place of a value of a factor on its axis: the value, or the number of its level.
const placeOf = (factor, value) => (value == null || factor.numeric ? value : factor.levels.indexOf(String(value)));

// The factors that vary in some rows; others belong to other manoeuvres.
const varied = (rows) => DATA.factors.filter(({ key }) => rows.some((i) => DATA.rows.factors[key][i] != null));

// Few points are large, so that they are seen. Points of controllers stand side by side where few values of a factor would put them on one line. Few runs over one factor are joined.
function scatter(factor, label, rows, valueOf, joined = false) {
  const driven = [...new Set(rows.map((i) => DATA.rows.factors[factor.key][i]).filter((value) => value != null))], [low, high] = endsOf(driven);
  const step = !factor.numeric ? 1 : joined || driven.length > FEW ? 0 : (high - low) / FEW;
  const beside = (c) => APART * step * (c - (DATA.controllers.length - 1) / 2);
  const curves = DATA.controllers.map((_, c) => {
    const own = rows.filter((i) => DATA.rows.controller[i] === c && valueOf(i) != null && DATA.rows.factors[factor.key][i] != null);
    if (joined) own.sort((i, k) => DATA.rows.factors[factor.key][i] - DATA.rows.factors[factor.key][k]);
    return curveOf(c, own.map((i) => placeOf(factor, DATA.rows.factors[factor.key][i]) + beside(c)), own.map(valueOf), { ...(joined ? { dashes: [], width: 1.5, size: 7 } : own.length <= SPARSE ? { size: 7 } : { alpha: 0.6 }), told: own.map((i) => `${short(valueOf(i))} (run ${DATA.rows.run[i]})`) });
  });
  return panelOf(axisOf(factor), label, { title: factor.label, curves: curves.filter((curve) => curve.x.length), x_levels: factor.numeric ? null : factor.levels });
}

// The mean in fields of the first two numeric factors, for designs without two grids: by value if a factor has few values
// that return, else in equal stretches of its range.
function binned(rows, values) {
  const pair = varied(rows).filter((factor) => factor.numeric).slice(0, 2), runs = rows.length / DATA.controllers.length;
  if (pair.length < 2 || runs < 4) return null;
  const count = Math.min(FIELDS, Math.max(2, Math.round(Math.sqrt(runs / 3))));
  const axes = pair.map(({ key }) => {
    const of = (i) => DATA.rows.factors[key][i], driven = [...new Set(rows.map(of))].filter((v) => v != null).sort((a, b) => a - b);
    if (driven.length <= FIELDS && 2 * driven.length <= runs) return { key, levels: driven, place: (i) => driven.indexOf(of(i)) };
    const [low, high] = [driven[0], driven.at(-1)], edges = Array.from({ length: count + 1 }, (_, i) => low + (i / count) * (high - low));
    return { key, edges, place: (i) => (of(i) == null ? -1 : Math.min(count - 1, Math.floor(((of(i) - low) / (high - low)) * count))) };
  });
  const [columns, lines] = axes.map(({ levels, edges }) => levels?.length ?? edges.length - 1);
  if (columns < 2 || lines < 2) return null;
  const sums = DATA.controllers.map(() => Array.from({ length: columns }, () => Array.from({ length: lines }, () => [0, 0])));
  for (const i of rows) {
    const field = sums[DATA.rows.controller[i]][axes[0].place(i)]?.[axes[1].place(i)];
    if (!field || values[i] == null) continue;
    field[0] += values[i]; field[1]++;
  }
  return { axes, maps: sums.map((map) => map.map((line) => line.map(([sum, n]) => (n ? sum / n : null)))) };
}

// Further factors whose mean differs between the fields by more than a share of their range: the map shows their effect, too.
function mixed(axes, rows) {
  return varied(rows).filter(({ key, numeric }) => numeric && !axes.some((axis) => axis.key === key)).filter(({ key }) => {
    const fields = new Map(), known = rows.filter((i) => DATA.rows.factors[key][i] != null), of = (i) => DATA.rows.factors[key][i];
    for (const i of known) { const field = axes.map((axis) => axis.place(i)).join(); fields.set(field, [...(fields.get(field) ?? []), of(i)]); }
    const [least, most] = endsOf([...fields.values()].map((own) => own.reduce((a, b) => a + b) / own.length)), [low, high] = endsOf(known.map(of));
    return most - least > MIXED * (high - low);
  });
}

function heat(metric, { axes, maps }) {
  const [low, high] = endsOf(maps.flat(2));
  if (constantIn(low, high)) {
    body.append(element("p", {}, low <= high ? `${axisOf(metric)} is ${short(low)} in every field, within 0.1 %.` : `${axisOf(metric)} has no value in any field.`));
    return;
  }
  const [x, y] = axes.map(({ key }) => axisOf(DATA.factors.find((factor) => factor.key === key)));
  const [x_levels, y_levels] = axes.map(({ levels }) => levels?.map((level) => (typeof level === "number" ? short(level) : String(level))) ?? null);
  const [x_range, y_range] = axes.map(({ edges }) => (edges ? [edges[0], edges.at(-1)] : null));
  const endsAt = (axis, i) => (axis.edges ? [axis.edges[i], axis.edges[i + 1]] : [i - 0.5, i + 0.5]);
  const panels = maps.map((map, c) => {
    const areas = [], notes = [];
    map.forEach((line, i) => line.forEach((value, j) => {
      if (value === null) return;
      const shade = (value - low) / (high - low), [left, right] = endsAt(axes[0], i), [below, above] = endsAt(axes[1], j);
      areas.push({ x: [left, right], low: [below, below], high: [above, above], label: "", colour: "", alpha: 1, edge: "", shade });
      if (map.length <= FIELDS) notes.push([(left + right) / 2, (below + above) / 2, short(value), shade > DARK_BELOW ? "#000000" : "#ffffff"]);
    }));
    return panelOf(x, y, { title: DATA.controllers[c], areas, notes, x_levels, y_levels, x_range, y_range });
  });
  show("heat", panels, [`${axisOf(metric)}, mean:`, low, high]);
}

// Indices of all controllers side by side: a point for each, a line for its 95 % confidence.
function sensitivity(metric, found) {
  const keys = [...new Set(found.flat().map(([key]) => key))], kinds = [...new Set(found.flat().map(([, kind]) => kind))];
  const lines = found.length * kinds.length, row_px = 34 + 9 * lines;
  const curves = found.flatMap((part, c) => kinds.flatMap((kind, k) => {
    const own = part.filter((index) => index[1] === kind);
    const y = own.map(([key]) => keys.indexOf(key) + (9 / row_px) * (c * kinds.length + k));
    const told = own.map(([, , value, confidence, spread]) => `${kind} ${short(value)} ± ${short(confidence ?? 0)}${spread == null ? "" : `, spread ${short(spread)}`}`);
    const ends = own.flatMap(([, , value, confidence]) => [value - (confidence ?? 0), value + (confidence ?? 0), null]);
    return [
      curveOf(c, own.map((index) => index[2]), y, { told, dashes: null, marker: k ? "D" : "o" }),
      curveOf(c, ends, y.flatMap((each) => [each, each, each]), { dashes: [], marker: "", width: 1 }),
    ];
  }));
  const label = kinds[0] === "mu*" ? withUnit("mu*", metric.unit) : `${kinds.join(" (circle), ")}${kinds.length > 1 ? " (diamond)" : ""} [-]`;
  const names = keys.map((key) => DATA.factors.find((factor) => factor.key === key)).map(axisOf);
  show("indices", [panelOf(label, "", { curves, names, row_px, y_range: [null, names.length - 1 + (9 / row_px) * (lines + 1)] })]);
}

// Every run as a line through its factors and the metric, each between its least and its greatest value, in the colour
// of its metric. Controllers drive the same samples, so each has a panel. An axis is a strip that holds its name: a line
// enters and leaves it at the same place.
function parallel(metric, rows) {
  const values = DATA.rows.metrics[metric.name];
  const axes = [...varied(rows).map((factor) => ({ factor, of: (i) => placeOf(factor, DATA.rows.factors[factor.key][i]) })), { factor: { ...metric, numeric: true }, of: (i) => values[i] }]
    .map((axis) => ({ ...axis, ends: axis.factor.numeric ? endsOf(rows.map(axis.of)) : [0, axis.factor.levels.length - 1] }));
  const names = axes.map(({ factor, ends }) => `${axisOf(factor)}: ${factor.numeric ? ends.map(number).join(" to ") : factor.levels.join(", ")}`);
  const along = ({ of, ends: [low, high] }, i) => (of(i) == null ? null : high > low ? (of(i) - low) / (high - low) : 0.5);
  const every = Math.ceil(rows.length / SHOWN_RUNS), drawnRows = rows.filter((i, place) => place % every === 0 && values[i] != null);
  const shadeOf = (i) => Math.round(SHADES * along(axes.at(-1), i)) / SHADES, shades = [...new Set(drawnRows.map(shadeOf))].sort((a, b) => a - b);
  const panels = DATA.controllers.map((title, c) => {
    const curves = shades.map((shade) => {
      const own = drawnRows.filter((i) => DATA.rows.controller[i] === c && shadeOf(i) === shade);
      const x = own.flatMap((i) => axes.flatMap((axis) => [along(axis, i), null, along(axis, i)]).slice(2).concat(null));
      return curveOf(c, x, own.flatMap(() => [...axes.keys()].flatMap((row) => [row - NAME_ROOM, null, row]).slice(2).concat(null)), { label: "", shade, dashes: [], marker: "", alpha: 0.7 });
    });
    const areas = names.map((_, row) => ({ x: [-0.08, 1.08], low: [row - NAME_ROOM, row - NAME_ROOM], high: [row, row], label: "", colour: "#888888", alpha: 0.2, edge: "", shade: null }));
    return panelOf("", "", { title, curves, areas, names, x_levels: ["least", "greatest"], x_range: [-0.08, 1.08], y_range: [-NAME_ROOM, names.length - 0.95], row_px: 80 });
  });
  show("parallel", panels, [`${axisOf(metric)}:`, ...axes.at(-1).ends]);
}

// Numbers are aligned to the right, and a long table can be folded, as on every page.
const NUMBER = /^[+−]?\d[\d.]*(e[+-]?\d+)?$|^-$/;
function tableOf(header, lines, folded = lines.length > 15 && NARROW.matches, told = "rows") {
  const sides = header.map((_, i) => (lines.some((line) => line[i] instanceof Element) ? "controls" : i && lines.every((line) => NUMBER.test(line[i])) ? "number" : ""));
  const rows = lines.map((line) => element("tr", {}, ...line.map((cell, i) => element(i ? "td" : "th", { class: sides[i], "data-title": header[i] }, cell))));
  const head = element("tr", {}, ...header.map((text, i) => element("th", { class: sides[i] }, text)));
  const box = element("div", { class: "scrolling", tabindex: 0 }, element("table", { class: "findings cards" }, element("thead", {}, head), element("tbody", {}, ...rows)));
  body.append(folded ? element("details", { class: "rows" }, element("summary", {}, `${lines.length} ${told}`), box) : box);
}

function replayLine(command) {
  if (!command) return "the manoeuvre or the vehicle has no file";
  const button = element("button", { type: "button" }, "copy"), line = element("code", { class: "line" }, ` ${command}`);
  button.addEventListener("click", () => {
    const chosen = document.createRange();
    chosen.selectNodeContents(line);
    getSelection().removeAllRanges();
    getSelection().addRange(chosen);
    if (navigator.clipboard) navigator.clipboard.writeText(command).catch(() => document.execCommand("copy"));
    else document.execCommand("copy");
  });
  return element("details", {}, element("summary", {}, "show"), button, line);
}

function drawAll() {
  for (const chart of drawn.splice(0)) chart.plot.destroy();
  all.replaceChildren();
  drawGroup();
  addContents();
}

function drawGroup() {
  const group = Number(chosenGroup.value), metric = DATA.metrics.find((each) => each.name === chosenMetric.value);
  const found = DATA.by_group[group][metric.name];
  begin(found?.few ? "Range" : "Distribution", found ? "" : "No run of this manoeuvre has this metric.");
  if (!found) return;
  const rows = [...DATA.rows.group.keys()].filter((i) => DATA.rows.group[i] === group), values = DATA.rows.metrics[metric.name];
  const { few } = found, factors = varied(rows), joined = few && factors.length === 1 && factors[0].numeric;
  const quantiles = (few ? ["least", "median", "largest"] : ["5 %", "median", "95 %"]).map((text) => withUnit(text, metric.unit)), first = DATA.controllers[0];
  tableOf(["controller", ...quantiles], DATA.controllers.map((name, c) => [name, ...(found.quantiles[c] || [null, null, null]).map(number)]));
  if (!few) show("distribution", [histogram(metric, found.histogram)]);
  begin("Metric over factors", DATA.all > DATA.rows.run.length ? `Points are ${DATA.rows.run.length} of ${DATA.all} runs; everything else uses all runs.` : "");
  show("scatter", factors.map((factor) => scatter(factor, axisOf(metric), rows, (i) => values[i], joined)));
  if (found.paired.some((pair) => pair)) {
    const base = new Map(rows.filter((i) => DATA.rows.controller[i] === 0).map((i) => [DATA.rows.sample[i], values[i]]));
    const pairs = rows.filter((i) => DATA.rows.controller[i] > 0 && values[i] != null && base.get(DATA.rows.sample[i]) != null);
    begin(`Difference from ${first}`, "Both drive the same sample.");
    tableOf([`difference from ${first}`, ...quantiles, "smaller in magnitude [%]"],
      found.paired.map((pair, n) => [DATA.controllers[n + 1], ...(pair ? [...pair.quantiles.map(number), short(100 * pair.smaller)] : ["-", "-", "-", "-"])]));
    show("paired", varied(pairs).map((factor) => scatter(factor, `difference: ${axisOf(metric)}`, pairs, (i) => values[i] - base.get(DATA.rows.sample[i]), joined)));
  }
  const map = found.heat || binned(rows, values);
  if (map) {
    const others = found.heat ? [] : mixed(map.axes, rows).map(({ label }) => label);
    begin("Mean over two factors", others.length ? `The fields also differ in ${others.join(", ")}.` : "");
    heat(metric, map);
  }
  if (found.indices.length) {
    begin("Sensitivity", "Points are indices, lines their 95 % confidence. S1: share of the variance due to the factor alone; ST: share with all its interactions; mu*: mean magnitude of the change over the whole range of the factor, in the unit of the metric.");
    sensitivity(metric, found.indices);
  }
  if (!few) { begin("Parallel coordinates"); parallel(metric, rows); }
  begin("Largest and smallest magnitudes");
  // The row of each run that the page has, because a page of many runs has some of them only.
  const place = new Map(rows.map((i) => [DATA.rows.run[i], i]));
  const driven = ({ key }, run) => { const value = DATA.rows.factors[key][place.get(run)]; return typeof value === "number" ? short(value) : String(value ?? "-"); };
  tableOf(["controller", "run", axisOf(metric), ...factors.map(axisOf), "command to drive and replay it"],
    found.extremes.flatMap((part, c) => part.map(([run, value, command]) => [DATA.controllers[c], String(run), short(value), ...factors.map((factor) => driven(factor, run)), replayLine(command)])), true, "runs, with factors and commands");
  const constant = [], others = [];
  for (const other of DATA.metrics) {
    if (other === metric || !DATA.by_group[group][other.name]) continue; // the chosen one is above
    const known = rows.map((i) => DATA.rows.metrics[other.name][i]).filter((value) => value != null);
    const claim = /^claim_(\w+)$/.exec(other.name);
    if (other.name === "claims_failed") continue; // the claims themselves follow
    if (claim && constantIn(...endsOf(known))) constant.push(`claim ${claim[1]} ${known[0] ? "reproduced" : "not reproduced"}`);
    else if (constantIn(...endsOf(known))) constant.push(`${other.label} ${known.length ? short(known[0]) : "-"} ${other.unit === "-" ? "" : other.unit}`.trim());
    else {
      const panel = few && factors.length ? scatter(factors[0], other.unit === "-" ? "" : other.unit, rows, (i) => DATA.rows.metrics[other.name][i], joined) : histogram(other, DATA.by_group[group][other.name].histogram);
      others.push({ ...panel, title: other.label, name: other.name });
    }
  }
  if (!constant.length && !others.length) return;
  begin("Other metrics", constant.length ? `The same in all runs, within 0.1 %: ${constant.join(", ")}.` : "");
  others.sort((a, b) => firstPlace(a.name) - firstPlace(b.name));
  show("first", others.splice(0, others.filter(({ name }) => DATA.first.includes(name)).length || 4));
  if (others.length) body = body.appendChild(element("details", { class: "rows" }, element("summary", {}, `${others.length} more metrics`)));
  show("all", others);
}

// Select a metric that the manoeuvre has: the shown one, else a common one.
function choose() {
  const has = DATA.by_group[Number(chosenGroup.value)];
  if (has[chosenMetric.value]) return;
  const names = DATA.metrics.map((metric) => metric.name).filter((name) => has[name]);
  if (names.length) chosenMetric.value = names.sort((a, b) => firstPlace(a) - firstPlace(b))[0];
}

document.querySelector("#study > .drawn").replaceChildren(
  element("p", { class: "choices" }, element("label", {}, "manoeuvre, vehicle ", chosenGroup), element("label", {}, "metric ", chosenMetric)), all);
DATA.groups.forEach((text, place) => chosenGroup.append(element("option", { value: place }, text)));
for (const metric of DATA.metrics) chosenMetric.append(element("option", { value: metric.name }, metric.label));
if (DATA.metrics.length) {
  chosenGroup.addEventListener("change", () => { choose(); drawAll(); });
  chosenMetric.addEventListener("change", drawAll);
  chosenMetric.value = "sideslip_peak_abs_rad";
  choose();
  drawAll();
}
