// Curves over time and tracks from above, of the present runs and, pale, of the previous ones.
import { element, number, onTheme, paint, runColour, slippery } from "./look.js";

const FONT = "12px system-ui, -apple-system, 'Segoe UI', Roboto, Arial, sans-serif";
const HEIGHT = 170, LEAST = 130, HEAD = 30, SLIP = "Slip angle of the axles", CAR_PX = 36, LEAST_CAR_PX = 24, GHOST = "59";

function padded(low, high, least) {
  if (low == null) return [0, least];
  const half = 0.55 * Math.max(high - low, least), middle = (low + high) / 2;
  return [middle - half, middle + half];
}

export class Curves {
  // pointed: a time that the reader points at; zoomed: whether the curves show a part of the run.
  constructor(box, pointed, zoomed) {
    this.box = box;
    this.pointed = pointed;
    this.zoomed = zoomed;
    this.plots = new Map();
    this.tall = { count: 0, height: HEIGHT };
    new ResizeObserver(() => this.fit()).observe(box);
    onTheme(() => this.draw());
  }

  // runs: name -> {place, dashes, plots}; ghosts: the same of before.
  show(runs, ghosts) {
    this.runs = runs;
    this.ghosts = ghosts;
    this.draw();
  }

  draw() {
    if (!this.runs) return;
    for (const { plot, figure } of this.runs.size ? [] : this.plots.values()) { plot.destroy(); figure.remove(); }
    if (!this.runs.size) this.plots.clear();
    const all = [...[...this.ghosts].map(([name, run]) => [name, run, true]), ...[...this.runs].map(([name, run]) => [name, run, false])].filter(([, run]) => run.plots);
    if (!all.length) return;
    const longest = all.reduce((a, b) => (a[1].plots.samples * a[1].plots.step_s >= b[1].plots.samples * b[1].plots.step_s ? a : b))[1].plots;
    const time = Array.from({ length: longest.samples }, (_, i) => longest.start_s + i * longest.step_s);
    const titles = [...new Set(all.flatMap(([, run]) => run.plots.panels.filter((panel) => panel.series.length).map((panel) => panel.title)))];
    for (const [title, { figure, plot }] of this.plots) if (!titles.includes(title)) { plot.destroy(); figure.remove(); this.plots.delete(title); }
    for (const title of titles) {
      const lines = [], data = [time];
      let panelOf = null;
      for (const [name, run, ghost] of all) {
        const panel = run.plots.panels.find((other) => other.title === title);
        if (!panel) continue;
        if (!panelOf || panel.note.length > panelOf.note.length) panelOf = panel;
        for (const series of panel.series) {
          if (ghost && series.dotted && panel.series.length > 1) continue;
          lines.push({ name, ghost, place: run.place, dash: series.dotted ? [1.5, 3] : run.dashes.map((d) => 1.5 * d), dotted: series.dotted });
          data.push(on(time, run.plots, series.values));
        }
      }
      this.panel(title, panelOf, lines, data);
    }
    this.tellSlip();
    this.zero ??= element("p", { class: "quiet" });
    this.zero.textContent = zeroTold([...new Set(all.flatMap(([, run]) => run.plots.zero ?? []))].filter((title) => !titles.includes(title)));
    this.zero.hidden = !this.zero.textContent;
    this.box.append(this.zero); // below all curves
    this.again();
  }

  // Let a table be as high as some rows of curves, and the curves beside it as high as the table.
  besides(table) {
    this.table = table;
    this.fit();
  }

  fit() {
    const columns = getComputedStyle(this.box).gridTemplateColumns?.split(" ").length, high = this.table?.firstElementChild.offsetHeight + 16 || 0; // with its margins
    const rows = Math.max(1, Math.floor(high / (LEAST + HEAD)));
    if (this.table) this.table.style.gridRow = columns > 1 ? `span ${3 * rows}` : "";
    this.tall = { count: columns > 1 && high ? rows * (columns - 1) : 0, height: rows > 1 ? Math.floor(high / rows) - HEAD : Math.max(HEIGHT, high - HEAD) };
    [...this.plots.values()].forEach(({ plot, holder }, i) => plot.setSize({ width: holder.clientWidth, height: this.height(i) }));
  }

  height(place) { return place < this.tall.count ? this.tall.height : HEIGHT; }

  // New curves have their scales in the next frame.
  again() { requestAnimationFrame(() => { if (this.time != null) this.at(this.time); }); }

  // Mark a time on all curves, which share their cursor.
  at(time) {
    this.time = time;
    const plot = this.plots.values().next().value?.plot;
    if (!plot) return;
    this.marking = true;
    plot.setCursor({ left: plot.valToPos(time, "x"), top: 1 }, true, true);
    this.marking = false;
  }

  // Say when the rear axle of each run, or only its front axle, is beyond the slip angle of the largest side force,
  // which is shaded.
  tellSlip() {
    const shown = this.plots.get(SLIP), limit = this.limit();
    if (!shown) return;
    const rear = [], front = [];
    for (const [name, run] of this.runs) {
      const series = run.plots?.panels.find(({ title }) => title === SLIP)?.series ?? [];
      const of = (is) => firstBeyond(series.find(({ dotted }) => dotted === is)?.values ?? [], limit);
      const at = of(false) < 0 ? of(true) : of(false);
      if (at >= 0) (of(false) < 0 ? front : rear).push(`${name} from ${number(run.plots.start_s + at * run.plots.step_s, 2)} s`);
    }
    shown.told ??= shown.figure.appendChild(element("p", { class: "quiet told" }));
    const most = `eyond ${number(limit, 1)} deg${rear.length || front.length ? ":" : ","} more slip gives the rear tyres less side force.`;
    const which = [["Rear axle", rear], ["Only the front axle", front]].filter(([, names]) => names.length).map(([axle, names]) => ` ${axle} beyond it: ${names.join(", ")}.`).join("");
    shown.told.textContent = limit == null ? "" : which ? `Shaded, b${most}${which}` : `B${most} All axles stay below.`;
  }

  limit() { return [...this.runs.values()].find((run) => run.plots)?.plots.slip_limit_deg ?? null; }

  // Shade the slip angles beyond that of the largest side force, and mark where each rear axle passes it.
  shade(u) {
    const limit = this.limit(), { ctx, bbox } = u;
    if (limit == null) return;
    const y = (value) => Math.min(Math.max(u.valToPos(value, "y", true), bbox.top), bbox.top + bbox.height);
    ctx.save();
    ctx.fillStyle = paint("failed");
    ctx.globalAlpha = 0.12;
    ctx.fillRect(bbox.left, bbox.top, bbox.width, y(limit) - bbox.top);
    ctx.fillRect(bbox.left, y(-limit), bbox.width, bbox.top + bbox.height - y(-limit));
    ctx.globalAlpha = 1;
    for (const run of this.runs.values()) {
      const rear = run.plots?.panels.find(({ title }) => title === SLIP)?.series.find(({ dotted }) => !dotted)?.values ?? [], at = firstBeyond(rear, limit);
      if (at < 0) continue;
      const x = u.valToPos(run.plots.start_s + at * run.plots.step_s, "x", true);
      if (x < bbox.left || x > bbox.left + bbox.width) continue;
      ctx.fillStyle = runColour(run.place);
      ctx.beginPath(); ctx.arc(x, y(rear[at]), 4 * devicePixelRatio, 0, 7); ctx.fill();
    }
    ctx.restore();
  }

  // Shade the times when a wheel of a run is on another friction than at the start: the darker, the more runs.
  patches(u) {
    const { ctx, bbox } = u, runs = [...this.runs.values()].filter((run) => run.patches_s);
    ctx.save();
    ctx.fillStyle = paint("patch");
    ctx.globalAlpha = 1 / Math.max(runs.length, 1);
    for (const [from, to] of runs.flatMap((run) => run.patches_s)) {
      const [left, right] = [from, to].map((time) => Math.min(Math.max(u.valToPos(time, "x", true), bbox.left), bbox.left + bbox.width));
      ctx.fillRect(left, bbox.top, right - left, bbox.height);
    }
    ctx.restore();
  }

  // Borders of phases, and instants of a standard.
  marks(u) {
    const { ctx, bbox } = u;
    ctx.save();
    ctx.strokeStyle = paint("quiet");
    ctx.lineWidth = devicePixelRatio;
    ctx.setLineDash([2 * devicePixelRatio, 3 * devicePixelRatio]);
    for (const { time_s } of this.marked()) {
      const x = u.valToPos(time_s, "x", true);
      ctx.beginPath(); ctx.moveTo(x, bbox.top); ctx.lineTo(x, bbox.top + bbox.height); ctx.stroke();
    }
    ctx.restore();
  }

  marked() { return [...this.runs.values()].find((run) => run.plots)?.plots.marks ?? []; }

  // The words of the marks, in the first plot. They lie over the curves.
  words(u) {
    if (u !== this.plots.values().next().value?.plot) return;
    const { ctx, bbox } = u;
    let free = -Infinity; // where the words of the mark before end
    ctx.save();
    Object.assign(ctx, { fillStyle: paint("quiet"), strokeStyle: paint("paper"), lineWidth: 3 * devicePixelRatio, font: FONT.replace("12px", `${11 * devicePixelRatio}px`), textAlign: "left" });
    for (const { time_s, text } of this.marked()) {
      const x = u.valToPos(time_s, "x", true) + 3 * devicePixelRatio;
      if (x < free) continue;
      for (const ink of ["strokeText", "fillText"]) ctx[ink](text, x, bbox.top + 11 * devicePixelRatio);
      free = x + ctx.measureText(text).width;
    }
    ctx.restore();
  }

  panel(title, panel, lines, data) {
    const key = JSON.stringify(lines);
    let shown = this.plots.get(title);
    const zoomed = shown && zoomOf(shown.plot), told = (one) => {
      one.unit.textContent = [panel.unit, panel.note].filter(Boolean).join(", ");
      one.unit.parentElement.className = lines.some(({ dotted }) => dotted) ? "many" : ""; // values have a line for themselves
    };
    if (shown) told(shown);
    if (shown && shown.key === key) {
      shown.plot.setData(data);
      if (zoomed) shown.plot.setScale("x", zoomed);
      return;
    }
    if (!shown) {
      const values = element("span", { class: "quiet" }), holder = element("div", { role: "img", "aria-label": `${title} over time` });
      const said = element("span", { class: "unit" }), figure = element("div", {}, element("p", {}, element("b", {}, title), said, values), holder);
      this.box.append(figure);
      shown = { figure, holder, values, unit: said };
      this.plots.set(title, shown);
      told(shown);
      holder.addEventListener("mouseleave", () => this.again()); // back to the time of the pictures
    } else shown.plot.destroy();
    shown.key = key;
    const axis = (size, unit = "") => ({ values: (_, ticks) => ticks.map((tick) => (tick == null ? "" : `${+tick.toPrecision(9)}`.replace("-", "−") + unit)), stroke: () => paint("quiet"), font: FONT, size, gap: 4, grid: { stroke: () => paint("grid"), width: 1 }, ticks: { show: false } });
    shown.plot = new uPlot({
      width: shown.holder.clientWidth || 380, height: this.height([...this.plots.keys()].indexOf(title)), legend: { show: false }, padding: [6, 14, 0, 0],
      cursor: { y: false, sync: { key: "explore", scales: ["x", null] }, drag: { x: true, y: false } },
      scales: { x: { time: false }, y: { range: (_, low, high) => padded(low, high, panel.min_span) } },
      axes: [{ ...axis(30, " s"), gap: 8 }, axis(50)],
      series: [{}, ...lines.map((line) => ({ stroke: () => runColour(line.place) + (line.ghost ? GHOST : ""), width: line.ghost ? 1.4 : line.dotted ? 1.2 : 2, dash: line.dash, gaps: wideGaps, points: { show: false } }))],
      hooks: { drawAxes: [(u) => this.patches(u), (u) => this.marks(u), ...(title === SLIP ? [(u) => this.shade(u)] : [])], draw: [(u) => this.words(u)], setScale: [(u, key) => { if (key === "x" && u.data?.[0]?.length) this.zoomed(!!zoomOf(u)); }], setCursor: [(u) => {
        const i = u.cursor.idx;
        const valueOf = (line, k) => element("span", { style: `border-bottom: 2px ${line.dotted ? "dotted" : "solid"} ${runColour(line.place)}` }, number(u.data[k + 1][i]));
        shown.values.replaceChildren(...(i == null ? [] : [`${number(u.data[0][i], 2)} s: `, ...lines.flatMap((line, k) => (line.ghost ? [] : [valueOf(line, k), " "]))]));
        if (i != null && u.cursor.event && !this.marking) this.pointed(this.time = u.data[0][i]);
      }] },
    }, data, shown.holder);
    if (zoomed) shown.plot.setScale("x", zoomed);
    touchable(shown.plot, (range) => this.zoom(range));
    for (const name of ["pointerdown", "pointermove"]) shown.plot.over.addEventListener(name, (event) => {
      if (event.pointerType === "touch" && event.isPrimary) this.pointed(this.time = shown.plot.data[0][shown.plot.cursor.idx ?? 0]);
    });
  }

  // Show some of the time, or the whole run if it is all of it.
  zoom(range) {
    const [{ plot: { data: [time] } }] = this.plots.values();
    if (!range || (range.min <= time[0] && range.max >= time.at(-1))) this.whole();
    else for (const { plot } of this.plots.values()) plot.setScale("x", { min: Math.max(range.min, time[0]), max: Math.min(range.max, time.at(-1)) });
    this.again();
  }

  // Show the whole run again.
  whole() { for (const { plot } of this.plots.values()) plot.setData(plot.data); }
}

// The first value beyond a limit, by its number, or -1.
export function firstBeyond(values, limit) { return limit == null ? -1 : values.findIndex((value) => value != null && Math.abs(value) > limit); }

// The times that a plot shows, or null if it shows all.
function zoomOf({ data: [time], scales: { x: { min, max } } }) {
  return min > time[0] || max < time.at(-1) ? { min, max } : null;
}

// Values of a run at other instants.
function on(time, plots, values) {
  if (plots.samples === time.length) return values;
  return time.map((t) => values[Math.round((t - plots.start_s) / plots.step_s)] ?? null);
}

export class Track {
  constructor(canvas) {
    this.canvas = canvas;
    this.runs = new Map();
    this.ghosts = new Map();
    this.time = 0;
    new ResizeObserver(() => this.draw()).observe(canvas.parentElement);
    onTheme(() => this.draw());
  }

  show(runs, ghosts) {
    this.runs = runs;
    this.ghosts = ghosts;
    this.draw();
  }

  at(time) { this.time = time; this.draw(); }

  draw() {
    const scale = devicePixelRatio, width = this.canvas.clientWidth, height = this.canvas.clientHeight;
    if (!width || !height) return;
    this.canvas.width = width * scale;
    this.canvas.height = height * scale;
    const pen = this.canvas.getContext("2d");
    pen.scale(scale, scale);
    const tracks = [...this.ghosts.values(), ...this.runs.values()].map((run) => run.plots?.track).filter(Boolean);
    if (!tracks.length) return;
    const mu = [...this.runs.values()].find((run) => run.plots)?.mu ?? 1;
    pen.globalAlpha = slippery(mu);
    pen.fillStyle = paint("patch");
    pen.fillRect(0, 0, width, height);
    pen.globalAlpha = 1;
    const points = tracks.flatMap((track) => track.tracks.flatMap(({ x, y }) => x.map((v, i) => [v, y[i]]).filter(([a, b]) => a != null && b != null)));
    const course = tracks.at(-1), all = [...points, ...course.cones.map((cone) => [cone[0], cone[1]])];
    let [left, right, low, high] = [Infinity, -Infinity, Infinity, -Infinity];
    for (const [x, y] of all) { left = Math.min(left, x); right = Math.max(right, x); low = Math.min(low, y); high = Math.max(high, y); }
    [left, right, low, high] = [left - 6, right + 6, low - 3, high + 3];
    pen.font = FONT;
    const frictions = [...new Set([mu, ...course.patches.map((patch) => patch.mu)])].filter((one) => slippery(one)).slice(0, 3);
    const words = [`from above, ${Math.round(right - left)} m`, [...this.runs.values()].some((run) => run.plots?.track?.cones.some((cone) => cone[2])) && "red cross: hit cone", course.path && "dashed: path of the course", frictions.length && `blue: friction ${frictions.join(", ")}`, ...new Set(course.obstacles.map(({ text }) => text))].filter(Boolean);
    const inRows = (parts) => parts.reduce((rows, part) => (rows.length && pen.measureText(`${rows.at(-1)}; ${part}`).width <= width - 20 ? [...rows.slice(0, -1), `${rows.at(-1)}; ${part}`] : [...rows, part]), []);
    const foot = 15 * inRows([...words, "cars and widths are 1.0 times larger"]).length;
    // A car has its shape. Widths have the scale of the cars, so that their distances from cones and lanes are true.
    const ends = tracks.flatMap((track) => track.tracks).find(({ car }) => car)?.car.ends ?? [0, 4], length = ends[1] - ends[0];
    const fit = (height - foot - 20) / (high - low), zoomX = Math.min((width - 20 - CAR_PX) / (right - left), fit), zoomY = Math.min(fit, Math.max(zoomX, CAR_PX / length));
    const zoom = Math.max(zoomY, LEAST_CAR_PX / length);
    const place = (x, y) => [width / 2 + (x - (left + right) / 2) * zoomX, (height - foot) / 2 - (y - (low + high) / 2) * zoomY];
    const line = (xs, ys) => { pen.beginPath(); xs.forEach((x, i) => { if (x != null && ys[i] != null) pen.lineTo(...place(x, ys[i])); }); pen.stroke(); };
    pen.fillStyle = paint("patch");
    for (const { corners, mu } of course.patches) { pen.globalAlpha = slippery(mu); pen.beginPath(); for (const [x, y] of corners) pen.lineTo(...place(x, y)); pen.fill(); }
    pen.globalAlpha = 1;
    pen.fillStyle = paint("lane");
    pen.strokeStyle = paint("quiet");
    for (const { corners } of course.obstacles) { pen.beginPath(); for (const [x, y] of corners) pen.lineTo(...place(x, y)); pen.closePath(); pen.fill(); pen.stroke(); }
    for (const lane of course.lanes) {
      const [start, end] = lane.x, [below, above] = lane.y;
      pen.beginPath();
      for (const [x, y] of [[start, below], [end, below], [end, above], [start, above]]) pen.lineTo(...place(x, y));
      pen.fill();
    }
    if (course.path) {
      pen.strokeStyle = paint("quiet");
      pen.lineWidth = 1;
      pen.setLineDash([5, 4]);
      line(course.path.x, course.path.y);
      pen.setLineDash([]);
    }
    // A cone that any of the cars hits is crossed out.
    course.cones.forEach(([x, y], i) => {
      const [across, up] = place(x, y), hit = [...this.runs.values()].some((run) => run.plots?.track?.cones[i]?.[2]);
      pen.fillStyle = pen.strokeStyle = paint(hit ? "failed" : "cone");
      pen.beginPath(); pen.arc(across, up, 2.4, 0, 7); pen.fill();
      if (!hit) return;
      pen.lineWidth = 1.6;
      for (const way of [-1, 1]) { pen.beginPath(); pen.moveTo(across - 5, up - 5 * way); pen.lineTo(across + 5, up + 5 * way); pen.stroke(); }
    });
    for (const [runs, tail, thick] of [[this.ghosts, GHOST, 1.2], [this.runs, "", 2]]) {
      for (const run of runs.values()) for (const track of run.plots?.track?.tracks ?? []) {
        pen.strokeStyle = runColour(run.place) + tail;
        pen.lineWidth = thick;
        line(track.x, track.y);
      }
    }
    // As in three dimensions, the first car is on top. Each is along its direction on the map.
    for (const run of [...this.runs.values()].reverse()) for (const track of run.plots?.track?.tracks ?? []) {
      const i = Math.min(Math.round((this.time - run.plots.start_s) / run.plots.step_s), track.x.length - 1);
      if (!track.yaw || track.x[i] == null) continue;
      const [x, y] = place(track.x[i], track.y[i]);
      const yaw = Math.atan2(Math.sin(track.yaw[i]) * zoomY, Math.cos(track.yaw[i]) * zoomX);
      carFromAbove({ ...track, x: { [i]: 0 }, y: { [i]: 0 }, yaw: { [i]: yaw } }, i).forEach((polygon, part) => {
        pen.fillStyle = part ? paint("ink") : runColour(run.place);
        pen.beginPath();
        for (const [ahead, left] of polygon) pen.lineTo(x + zoom * ahead, y - zoom * left);
        pen.fill();
      });
    }
    pen.fillStyle = paint("quiet");
    const stretch = zoomY / zoomX;
    inRows([...words, ...(stretch > 1.05 ? [`cars and widths are ${stretch.toFixed(1)} times larger`] : [])]).reverse().forEach((row, i) => pen.fillText(row, 10, height - 7 - 15 * i));
  }
}
