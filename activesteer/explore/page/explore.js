// The page: messages of the worker, the tab Explore, and the tabs themselves.
import { Asking, untickBeyond } from "./asking.js";
import { Curves, Track } from "./curves.js";
import { Drive } from "./drive.js";
import { colourCount, dark, element, inWords, meaning, mostControllers, number, offer, onTheme, option, runColour, setTheme, small, systems, undoScroll } from "./look.js";
import { Scene } from "./scene.js";
import { Socket } from "./socket.js";

const $ = (id) => document.getElementById(id);
const TOLD_MS = 100; // time between two readings of the curves while they play
const FIRST = { maneuver: "sine_with_dwell", vehicle: "compact", driver: "typical", controllers: ["none", "ars", "afs"] };

export function say(text, hint = false) {
  state.hinted = hint && !!text;
  $("message").textContent = text;
  $("alert").classList.toggle("hint", hint);
  $("alert").hidden = !text;
}

// A hint is gone with the next thing that the reader does.
function unhint() { if (state.hinted) say(""); }

const curves = new Curves($("curves"), (time) => { player.show(time, true); player.pause(); }, (is) => { $("whole").hidden = !is; });
const track = new Track($("track"));
const scene = new Scene($("view"));
const state = { id: 0, runs: new Map(), ghosts: new Map(), values: {}, sliders: [], wanted: {}, asked: 0, curves };
window.activesteer = state; // for tests and the curious

const socket = new Socket((header, arrays) => (hear[header.kind] ?? (() => {}))(header, arrays), (text) => { without(text, false); drive.lost(); });
const drive = new Drive(socket, say, unhint);

const NAMED = ["maneuver", "vehicle", "driver"];
const places = new Map(); // name of a controller -> place of its colour
const swatches = new Map(); // name of a controller -> its colour beside its box
const boxes = () => [...$("controllers").querySelectorAll("input")];
const chosen = () => boxes().filter((box) => box.checked).map((box) => box.value);
const choice = () => ({ ...Object.fromEntries(NAMED.map((id) => [id, $(id).value])), controllers: chosen() });

function describe(ticked) {
  const unticked = untickBeyond(mostControllers, boxes(), ticked);
  if (!chosen().length) { without(); return; }
  say(unticked.length ? `${unticked.join(", ")} is not driven: ${mostControllers} controllers are the most. Untick another one first.` : "", true);
  if (unticked.includes(ticked?.value)) return;
  asking.stop();
  // Another controller leaves the sliders where they are; they apply where the new choice has them.
  if (ticked) state.wanted = state.values;
  else curves.whole();
  usable(false);
  $("state").textContent = "driving …";
  $("sliders").inert = $("reset").disabled = true; // those of the choice before
  state.values = {};
  state.runs = new Map();
  state.ghosts = new Map();
  socket.send({ kind: "describe", id: ++state.id, ...choice() });
}

// The address names the choice, so that it can be opened again: #maneuver=slalom&controllers=none,lqr&speed_kmh=70
function readAddress() {
  const wanted = Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
  const explore = wanted.drive == null ? wanted : {};
  for (const id of NAMED) offer($(id), explore[id] ?? FIRST[id]);
  const names = explore.controllers?.split(",").filter(Boolean) ?? FIRST.controllers;
  for (const name of names) if (!boxes().some((box) => box.value === name)) addBox(name);
  for (const box of boxes()) box.checked = names.includes(box.value);
  state.wanted = explore;
  state.addressed = wanted.drive == null;
  describe();
  if (wanted.drive != null) {
    const told = drive.choose(wanted);
    show("drive");
    if (told) say(told, true);
  } else if (drive.shown) show("explore");
}

function writeAddress() {
  if (drive.shown) return; // it has its own
  const { controllers, ...names } = choice();
  history.replaceState(null, "", `#${new URLSearchParams({ ...names, controllers: controllers.join(","), ...state.values })}`);
  $("reset").disabled = !Object.keys(state.values).length;
  if ($("driver").disabled) names.driver = "no driver";
  $("chosen").textContent = [...Object.values(names).map(inWords), controllers.join(", ")].join(" · ");
}

function addBox(name) {
  const box = element("input", { type: "checkbox", value: name });
  box.addEventListener("change", () => describe(box));
  swatches.set(name, element("i", { class: "swatch" }));
  // A long name breaks after its file.
  const [file, ...rest] = name.split(/(?<=:)/);
  $("controllers").append(element("label", { title: state.titles[name] ?? "" }, box, swatches.get(name), element("span", {}, file, ...rest.flatMap((part) => [element("wbr"), part]), element("span", { class: "quiet" }, ` ${meaning(name, state.titles)}`))));
}

function without(text = "Choose at least one controller.", hint = true) {
  asking.stop();
  say(text, hint);
  $("state").textContent = "";
  usable(false, true);
}

// Whether the results are those of the choice. Others, of before a run that failed, are pale, and cannot be saved.
function usable(is, old = false) {
  for (const id of ["save", "report", "copy-command", "copy-python"]) $(id).disabled = !is;
  $("results").classList.toggle("old", old);
}

const asking = new Asking((dragging) => {
  if (!chosen().length) { without(); return; }
  if (!dragging || !state.dragged) keepGhosts();
  state.dragged = dragging;
  state.released = false;
  state.asked = performance.now();
  $("saved").textContent = ""; // other runs
  state.first = null;
  state.coming = []; // runs of this value, until they are shown
  writeAddress();
  $("state").textContent = "driving …";
  usable(false);
  if (drive.shown) return;
  socket.send({ kind: "run", id: ++state.id, ...choice(), dragging, values: state.values });
});

// The result before this change stays as a pale curve until the slider is let go and moved again.
function keepGhosts() {
  if (!state.released) return;
  state.ghosts = new Map(state.runs);
}

const hear = {
  ready(header) {
    for (const [id, names] of [["maneuver", header.maneuvers], ["vehicle", header.vehicles], ["driver", header.drivers]]) {
      $(id).replaceChildren(...names.map((name) => option(name)));
    }
    $("controllers").querySelectorAll("label").forEach((label) => label.remove());
    state.titles = header.titles;
    header.controllers.forEach(addBox);
    drive.offer(header);
    readAddress();
  },

  description(header, arrays) {
    if (header.id !== state.id) return;
    showTitle(header.title);
    $("note").textContent = "";
    state.sliders = header.sliders;
    const told = [];
    for (const { key, label, unit, low, high } of header.sliders) if (key in state.wanted) {
      const text = state.wanted[key], value = text === "" ? NaN : +text;
      if (!Number.isFinite(value)) { told.push(`${key}=${text} is not a number, so the value of the file is driven.`); continue; }
      state.values[key] = Math.min(high, Math.max(low, value));
      if (state.values[key] !== value) told.push(`${label} ${text} is outside ${low} to ${`${high} ${unit}`.trim()}. The nearest value is driven.`);
    }
    // A slider may be missing for another controller; a key of an address must mean something.
    const unknown = state.addressed ? Object.keys(state.wanted).filter((key) => ![...NAMED, "controllers"].includes(key) && !header.sliders.some((slider) => slider.key === key)) : [];
    const meant = (key) => {
      const full = header.sliders.filter((slider) => slider.key.endsWith(`.${key}`)).map((slider) => slider.key);
      return full.length ? `${key} (there is ${full.join(", ")})` : key;
    };
    if (unknown.length) told.push(`The address has ${unknown.length > 1 ? "keys" : "a key"} without a slider here: ${unknown.map(meant).join(", ")}.`);
    state.addressed = false;
    if (told.length) say(told.join(" "), true);
    state.wanted = {};
    $("sliders").inert = false;
    showSliders();
    scene.setShape(header.shape, arrays);
    // A driver follows a path; an own one may do more.
    $("driver").disabled = header.steered && ![...$("driver").options].some(({ value }) => value.includes("."));
    $("steered").textContent = $("driver").disabled ? "No driver: this manoeuvre steers itself." : "";
    if ($("driver").disabled) $("driver").value = FIRST.driver;
    asking.ask(false);
  },

  run(header, arrays) {
    if (header.id !== state.id) return;
    if (state.first == null) state.first = performance.now() - state.asked;
    if (header.error) { state.failed = state.id; say(`${header.name}: ${header.error}`); }
    state.coming.push([header, arrays]);
    // The runs of the value before stay until all of the new value are there: what is compared has the same value.
    if ([...state.runs.values()].every((run) => run.id === state.id)) showComing();
  },

  finished(header) {
    if (header.id !== state.id) return;
    showComing();
    state.released = !state.dragged;
    state.all = performance.now() - state.asked;
    if (state.failed != null && state.failed !== state.id) { state.failed = null; say(""); } // its cause is gone
    usable(!!header.command);
    $("state").textContent = `driven in ${number(state.all / 1000, 1)} s${state.a_deg != null && /\d A\b/.test($("title").textContent) ? `; A: ${number(state.a_deg, 1)}\u00a0deg, steering wheel at 0.3\u00a0g` : ""}`;
    $("command").textContent = header.command;
    $("python").textContent = header.python;
    asking.finished();
  },

  saved(header) { $("saved").textContent = header.files.length ? `saved ${header.files.join(", ")} in ${header.folder}` : `these runs are already saved: ${header.exist.join(", ")} in ${header.folder}`; },
  report() { window.open("report", "_blank"); },
  error(header) {
    if (["run", "describe"].includes(header.about) && header.id !== state.id) return; // of an older choice
    say(header.text);
    $("state").textContent = "";
    if (header.about === "start") drive.failed();
    if (header.about === "run" || header.about === "describe") {
      state.failed = header.about === "run" ? state.id : null;
      if (!state.runs.size) redraw(); // of another choice
      usable(false, true);
      $("command").textContent = $("python").textContent = "";
    }
    if (header.about === "run") asking.finished();
    if (header.about === "save") $("saved").textContent = header.text;
  },
  drive: (header, arrays) => drive.begin(header, arrays),
  frame: (header, arrays) => drive.frame(header, arrays),
  going: () => drive.going(),
  driven: (header) => drive.ended(header),
};

function showComing() {
  if (!state.coming.length) return;
  for (const [header, arrays] of state.coming.splice(0)) {
    showTitle(header.title);
    state.a_deg = header.a_deg;
    if (header.ground_m != null) scene.setSurface(arrays.slice(1), header.ground_m);
    state.runs.set(header.name, { ...header, place: placeOf(header), poses: arrays[0] });
  }
  const runs = [...state.runs.values()], remarks = [...new Set(runs.map(({ remark }) => remark).filter(Boolean))];
  $("note").textContent = [runs.at(-1).note, ...remarks.map((remark) => `${runs.filter((run) => run.remark === remark).map(shortName).join(", ")}: ${remark}`)].filter(Boolean).join(" ");
  redraw();
}

function redraw() {
  curves.show(state.runs, state.ghosts);
  track.show(state.runs, state.ghosts);
  const drawn = [...state.runs.values()].filter((run) => run.poses);
  $("figures").hidden = !drawn.length;
  for (const name of [...scene.cars.keys()]) if (!state.runs.has(name)) scene.remove(name);
  for (const run of drawn) scene.car(run.name, run.place);
  const course = drawn[0]?.plots.track;
  if (course && state.course !== state.id) {
    state.course = state.id;
    const lanes = course.lanes.map((lane) => ({ start_x_m: lane.x[0], end_x_m: lane.x[1], right_y_m: lane.y[0], left_y_m: lane.y[1] }));
    scene.setCourse({ cones: course.cones, lanes, patches: course.patches, mu: drawn[0].mu ?? undefined });
  }
  player.length();
  showFigures();
}

// A controller keeps its colour when another one is ticked. The three systems always have theirs.
function placeOf({ name, place }) {
  if (systems.includes(name)) return place;
  const taken = chosen().filter((other) => other !== name).map((other) => (systems.includes(other) ? systems.indexOf(other) : places.get(other)));
  const spare = Array.from({ length: colourCount }, (_, i) => (i + systems.length) % colourCount); // the systems' own colours last
  places.set(name, [places.get(name), place, ...spare].find((one) => one != null && !taken.includes(one)));
  return places.get(name);
}

// A piece of the line of a run, with its colour and its dashes.
function strokeOf(run) {
  let at = 0;
  const parts = (run.dashes ?? []).map((length, i) => `${i % 2 ? "transparent" : runColour(run.place)} ${at}px ${at += 1.5 * length}px`);
  return parts.length ? `repeating-linear-gradient(90deg, ${parts.join(", ")})` : runColour(run.place);
}
const swatchOf = (run) => element("i", { class: "swatch", style: `background:${strokeOf(run)}` });
const shortName = (run) => run.name.replace(/^.*:|\?.*|\.toml$/g, "");

// Colours stay in sight beside the sliders: at the boxes of the controllers, on a phone in a line of its own, which also
// says which car fails, since the table is far below.
function showColours() {
  for (const [name, swatch] of swatches) {
    const run = state.runs.get(name);
    swatch.setAttribute("style", run ? `background:${strokeOf(run)}` : "visibility:hidden"); // its place stays
  }
  $("legend").replaceChildren(...[...state.runs.values()].map((run) => element("span", {}, swatchOf(run), shortName(run), run.losses?.length ? element("b", {}, " fails") : "")));
}

// On a phone the heading is out of sight while a slider moves.
function showTitle(title) {
  const held = /^(.*) \((.*until you let go)\)$/.exec(title);
  $("title").textContent = small.matches && held ? held[1] : title;
  $("held").textContent = held?.[2] ?? "";
}

function showFigures() {
  showColours();
  const runs = [...state.runs.values()].filter((run) => run.figures), known = new Map(runs.flatMap((run) => run.figures.filter(({ value, lost }) => value != null || lost).map((figure) => [figure.title, figure])));
  const head = element("tr", {}, element("th", { class: "quiet" }, state.ghosts.size ? "small: change since the pale curves" : runs.length > 1 ? `small: difference from ${shortName(runs[0])}` : ""), ...runs.map((run) => element("th", {}, swatchOf(run), shortName(run))));
  const rows = [...known.values()].map(({ title, unit }) => element("tr", {}, element("th", {}, title, element("span", { class: "quiet" }, ` ${unit}`)), ...runs.map((run) => {
    const of = (other) => other?.figures?.find((figure) => figure.title === title), now = of(run), before = of(state.ghosts.size ? state.ghosts.get(run.name) : runs[0]);
    const change = now?.value != null && before?.value != null ? now.value - before.value : 0, shown = number(change, now?.digits);
    return element("td", {}, now?.lost ? "lost" : number(now?.value, now?.digits), element("span", {}, /[1-9]/.test(shown) ? `${change > 0 ? "+" : ""}${shown}` : ""));
  })));
  const failed = runs.filter((run) => run.losses.length);
  rows.unshift(...failed.map((run) => element("tr", { class: "fails" }, element("td", { colspan: runs.length + 1 }, swatchOf(run), `${shortName(run)} fails: ${run.losses.join("; ")}`))));
  $("figures").classList.toggle("many", runs.length > 2);
  $("figures").replaceChildren(head, ...rows);
  curves.besides($("figures").parentElement);
}

function showSliders() {
  const groups = [...new Set(state.sliders.map((slider) => slider.group))];
  // The groups of a phone are all open, and say nothing of a wide window.
  const open = new Set([...$("sliders").querySelectorAll(state.single ? "none" : "details[open]")].map((box) => box.dataset.group)), known = new Set([...$("group").options].map(({ value }) => value));
  $("sliders").replaceChildren(...groups.map((group, i) => {
    const box = element("details", { "data-group": group }, element("summary", {}, group));
    box.open = open.size ? open.has(group) || !known.has(group) : i !== 1;
    for (const slider of state.sliders.filter((other) => other.group === group)) box.append(sliderOf(slider));
    return box;
  }));
  const before = $("group").value;
  $("group").replaceChildren(...groups.map((group) => element("option", { value: group }, `Sliders: ${group}`)));
  if (groups.includes(before)) $("group").value = before;
  state.single = small.matches;
  if (state.single) showGroup();
}

// A phone has room for one group of sliders above the results.
function showGroup() {
  for (const box of $("sliders").children) {
    box.hidden = box.dataset.group !== $("group").value;
    box.open = true;
  }
}

// Units whose values have many digits -> factor and unit in which a slider shows them.
const BIGGER = { Pa: [1e-6, "MPa"], "N/m": [1e-3, "kN/m"] };
const wayOf = (event) => ({ ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10 })[event.key];

function sliderOf(slider) {
  const shown = element("input", { class: "value", inputmode: "decimal", autocomplete: "off", "aria-label": `${slider.group}: ${slider.label}, value` }), input = element("input", { type: "range", min: slider.low, max: slider.high, step: "any", "aria-label": `${slider.group}: ${slider.label}`, "data-key": slider.key, title: `--set ${slider.key}=…; double-click for the value of the file` });
  const [factor, unit] = BIGGER[slider.unit] ?? [1, slider.unit], digits = Math.max(0, -Math.floor(Math.log10(slider.step * factor)));
  const box = element("div", { class: "slider" }, element("span", {}, slider.label), element("span", {}, shown, ` ${unit}`), input);
  const write = () => {
    const changed = slider.key in state.values, value = (changed ? state.values[slider.key] : slider.value) * factor, exact = +value.toPrecision(6);
    shown.value = changed && +exact.toFixed(digits) !== exact ? `${exact}`.replace("-", "−") : number(value, digits);
    box.classList.toggle("changed", changed);
  };
  const take = (value, dragging) => {
    if (Math.abs(value - slider.value) < 1e-9) delete state.values[slider.key];
    else state.values[slider.key] = +value.toPrecision(9);
    write();
    asking.ask(dragging);
  };
  const moved = (dragging) => {
    unhint();
    take(Math.min(slider.high, Math.max(slider.low, slider.low + Math.round((input.value - slider.low) / slider.step) * slider.step)), dragging);
  };
  // A typed value needs no step of the slider.
  shown.addEventListener("change", () => {
    const text = shown.value.replace("−", "-").replace(",", ".").replaceAll("\u202f", ""), value = text.trim() === "" ? NaN : text / factor, { low, high } = slider;
    unhint();
    if (!Number.isFinite(value)) { write(); if (text.trim()) say(`${slider.label}: ${text} is not a number. The value stays.`, true); return; }
    input.value = Math.min(high, Math.max(low, value));
    if (value < low || value > high) say(`${slider.label} ${text} is outside ${+(low * factor).toPrecision(6)} to ${`${+(high * factor).toPrecision(6)} ${unit}`.trim()}. The nearest value is driven.`, true);
    take(+input.value, false);
  });
  input.value = state.values[slider.key] ?? slider.value;
  undoScroll(input, () => moved(false));
  input.addEventListener("input", () => moved(true));
  input.addEventListener("change", () => moved(false));
  input.addEventListener("dblclick", () => { input.value = slider.value; moved(false); });
  // Without this, a step of the keyboard is a hundredth of the range, whatever the step of the slider.
  input.addEventListener("keydown", (event) => {
    const way = wayOf(event);
    if (!way) return;
    event.preventDefault();
    input.value = +input.value + way * slider.step;
    moved(true);
  });
  input.addEventListener("keyup", (event) => { if (wayOf(event)) moved(false); });
  write();
  return box;
}

// Time on the pictures: it plays, or follows the slider or the pointer on a curve.
const player = {
  time: 0, end: 1, playing: true, last: null, told: 0,
  length() {
    this.end = Math.max(...[...state.runs.values()].filter((run) => run.plots).map((run) => run.plots.step_s * (run.plots.samples - 1)), 0.1);
    $("time").max = this.end;
    this.show(Math.min(this.time, this.end));
  },
  show(time, pointed = false) {
    if (time < this.time) scene.heading = null;
    this.time = time;
    $("time").value = time;
    $("clock").textContent = `${number(time, 2)} s`;
    track.at(time);
    const now = performance.now();
    if (!pointed && (!this.playing || now - this.told > TOLD_MS)) { this.told = now; curves.at(time); }
    const names = [], velocity = [0, 0];
    for (const run of state.runs.values()) {
      if (!run.poses || !scene.cars.has(run.name)) continue;
      const size = 7 * scene.shape.bodies.length, rows = run.poses.length / size, exact = Math.min(time / run.pose_step_s, rows - 1), row = Math.floor(exact);
      scene.place(run.name, run.poses, row, exact - row);
      scene.trail(run.name, run.poses, row + 1);
      const a = Math.max(0, row - 1) * size, b = Math.min(row + 1, rows - 1) * size, s = Math.max((b - a) / size, 1) * run.pose_step_s;
      names.push(run.name);
      for (const k of [0, 1]) velocity[k] += (run.poses[b + k] - run.poses[a + k]) / s;
    }
    scene.follow(names, velocity);
  },
  pause() { this.playing = false; $("play").textContent = "Play"; },
  tick(now) {
    requestAnimationFrame((next) => this.tick(next));
    const dt = this.last == null ? 0 : (now - this.last) / 1000;
    this.last = now;
    if (drive.shown) { drive.draw(); return; }
    if (this.playing && state.runs.size) this.show(this.time + dt > this.end ? 0 : this.time + dt);
    scene.draw();
  },
};

new ResizeObserver(() => document.documentElement.style.setProperty("--tuning", `${$("tuning").offsetHeight}px`)).observe($("tuning")); // below it stays the head of the table
const fit = () => { $("choice").open = !small.matches; showSliders(); };
small.addEventListener("change", fit);
fit();
addEventListener("hashchange", readAddress);
// On a phone, the choice makes room for its results.
for (const id of NAMED) $(id).addEventListener("change", () => {
  if (small.matches) $("choice").open = false;
  if (id !== "maneuver") state.wanted = state.values; // another car or driver leaves the sliders where they are
  describe();
});
$("group").addEventListener("change", showGroup);
$("fold").addEventListener("click", () => {
  const folded = $("tuning").classList.toggle("folded");
  $("fold").textContent = folded ? "Show sliders" : "Hide";
  $("fold").setAttribute("aria-expanded", String(!folded));
});
$("reset").addEventListener("click", () => { unhint(); state.values = {}; showSliders(); asking.ask(false); });
$("play").addEventListener("click", () => { player.playing = !player.playing; $("play").textContent = player.playing ? "Pause" : "Play"; });
$("whole").addEventListener("click", () => curves.whole());
$("time").addEventListener("input", () => { player.pause(); player.show(+$("time").value); });
$("save").addEventListener("click", () => { unhint(); $("saved").textContent = "saving …"; socket.send({ kind: "save" }); });
$("report").addEventListener("click", () => socket.send({ kind: "report" }));
for (const what of ["command", "python"]) {
  $(`copy-${what}`).addEventListener("click", async ({ target }) => {
    await navigator.clipboard.writeText($(what).textContent);
    target.textContent = "Copied";
    setTimeout(() => { target.textContent = "Copy"; }, 1500);
  });
}
$("close").addEventListener("click", () => say(""));
$("theme").addEventListener("click", () => setTheme(!dark()));
onTheme(showFigures);

function show(name) {
  for (const other of ["explore", "drive"]) { $(other).hidden = other !== name; $(`tab-${other}`).setAttribute("aria-selected", String(other === name)); }
  drive.show(name === "drive");
  scene.fit();
  if (name === "drive") return;
  if (asking.busy) asking.ask(false);
  else writeAddress();
}
for (const name of ["explore", "drive"]) $(`tab-${name}`).addEventListener("click", () => show(name));
requestAnimationFrame((now) => player.tick(now));
