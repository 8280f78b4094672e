// The tab Drive: keys, gamepad and touch in; the car, its ghost, gauges and cones out.
import { courses, element, explained, inWords, number, offer, option, small, undoScroll } from "./look.js";
import { Scene } from "./scene.js";

const $ = (id) => document.getElementById(id);
const KEYS = { ArrowLeft: "left", a: "left", ArrowRight: "right", d: "right", ArrowUp: "throttle", w: "throttle", ArrowDown: "brake", s: "brake", " ": "brake" };
const SWITCH = ["none", "ars", "afs", "lqr", "esc"], DEAD = 0.06;
const PAD_REACH = 0.4; // distance of the thumb from the middle of the pad for full steering, as a share of its width
const short = matchMedia("(max-height: 450px)");
const PLAIN = ["speed", "sideslip", "grip used", "rear steer", "time", "cones"]; // gauges that a phone shows

const OFF_M = 8; // distance from the line of a course at which a car has left it

// Return where a car that has left its course finds it again: the next cone, the start behind the last one, or the circle.
export function wayBack({ cones, line, radius_m }, x, y) {
  if (radius_m) {
    const out = Math.hypot(x, y - radius_m), share = radius_m / Math.max(out, 1e-3);
    return Math.abs(out - radius_m) > OFF_M ? { x: x * share, y: radius_m + (y - radius_m) * share } : null;
  }
  if (!line.length || line.some((point) => Math.hypot(point[0] - x, point[1] - y) <= OFF_M)) return null;
  const next = nextOf(cones, x) ?? line[0];
  return { x: next[0], y: next[1] };
}

const nextOf = (cones, x) => cones.filter((cone) => cone[0] > x).reduce((a, b) => (a && a[0] <= b[0] ? a : b), null);

// Return the next cone that stands alone, with the side on which the line passes it: 1 left, -1 right.
export function nextSide({ cones, lanes, line }, x) {
  const next = lanes.length ? null : nextOf(cones.filter((cone) => !cones.some((other) => other !== cone && Math.abs(other[0] - cone[0]) < 0.5)), x);
  if (!next) return null;
  const beside = line.reduce((a, b) => (Math.abs(a[0] - next[0]) <= Math.abs(b[0] - next[0]) ? a : b));
  return { x: next[0], y: next[1], side: Math.sign(beside[1] - next[1]) };
}

export class Drive {
  constructor(socket, say, unhint) {
    Object.assign(this, { socket, say, unhint });
    this.pressed = new Set();
    this.shown = this.running = this.held = this.again = false;
    this.number = this.asked = 0;
    this.sent = new Map();
    this.last = this.earlier = ""; // earlier: the last time before a restart
    this.ghosts = new Map(); // setting -> {frames, lap_s} of the last drive, preferably of a complete one
    this.touch = { steer: 0, throttle: 0, brake: 0 };
    $("course").replaceChildren(...Object.entries(courses).map(([name, { title }]) => option(name, title)));
    $("course").addEventListener("change", () => { this.ofCourse(); this.prepare(); });
    $("drive-vehicle").addEventListener("change", () => this.prepare());
    $("drive-controller").addEventListener("change", () => this.control($("drive-controller").value));
    for (const [id, write] of [["drive-speed", () => this.hold()], ["drive-mu", () => { this.scene.tint(+$("drive-mu").value); this.start_mu = +$("drive-mu").value; this.act({ mu: this.start_mu }); this.compared = false; }]]) {
      const moved = () => { this.values(); write(); };
      $(id).addEventListener("input", moved);
      undoScroll($(id), moved);
      $(id).addEventListener("change", () => { if (!this.running) { this.startAt(+$("drive-speed").value, +$("drive-mu").value); this.prepare(); } });
    }
    for (const [id, held] of [["pointerdown", true], ["pointerup", false], ["pointercancel", false]]) $("drive-speed").addEventListener(id, () => { this.held = held; });
    $("hold").addEventListener("change", () => this.hold());
    $("start").addEventListener("click", () => this.act({ go: true }, true));
    $("end").addEventListener("click", () => this.end());
    $("again").addEventListener("click", () => this.restart());
    $("drive-report").addEventListener("click", () => this.socket.send({ kind: "report", drive: true }));
    addEventListener("keydown", (event) => this.key(event, true));
    addEventListener("keyup", (event) => this.key(event, false));
    addEventListener("blur", () => { this.pressed.clear(); this.hands(); });
    $("switch").replaceChildren(...SWITCH.map((name) => element("button", { type: "button" }, name)));
    $("switch").addEventListener("click", ({ target }) => { if (SWITCH.includes(target.textContent)) this.control(target.textContent); });
    const pad = $("touch-steer");
    if (matchMedia("(pointer: coarse)").matches) pad.prepend($("wheel"));
    const slide = (event) => {
      const { left, width } = pad.getBoundingClientRect(), aside = (event.clientX - left) / width - 0.5;
      this.steer(Math.max(-1, Math.min(1, -aside / PAD_REACH)));
    };
    pad.addEventListener("pointerdown", (event) => { pad.setPointerCapture(event.pointerId); slide(event); });
    pad.addEventListener("pointermove", (event) => { if (pad.hasPointerCapture(event.pointerId)) slide(event); });
    pad.addEventListener("lostpointercapture", () => this.steer(0));
    for (const pedal of ["brake", "throttle"]) {
      const button = $(`touch-${pedal}`), press = (value) => (event) => { event.preventDefault(); this.touch[pedal] = value; button.setAttribute("aria-pressed", String(!!value)); this.hands(); };
      button.addEventListener("pointerdown", press(1));
      for (const end of ["pointerup", "pointerleave", "pointercancel"]) button.addEventListener(end, press(0));
    }
    small.addEventListener("change", () => this.fold());
    this.fold();
    window.activesteerDrive = this; // for tests and the curious
  }

  offer(names) {
    $("drive-vehicle").replaceChildren(...names.vehicles.map((name) => option(name)));
    $("drive-controller").replaceChildren(...names.controllers.map((name) => option(name, explained(name, names.titles))));
    this.choose({});
  }

  // Choose what the address names, and return what is wrong with it: #drive=lane_change&vehicle=sedan&controller=ars&speed_kmh=60&mu=0.5
  choose({ drive, vehicle, controller = "none", speed_kmh, mu, ...unknown }) {
    if (courses[drive]) $("course").value = drive;
    this.ofCourse();
    for (const [id, name] of [["drive-vehicle", vehicle ?? (courses[$("course").value].vehicle || "compact")], ["drive-controller", controller]]) offer($(id), name);
    const told = Object.keys(unknown).map((key) => `The address has an unknown key: ${key}.`);
    if (drive && !courses[drive]) told.unshift(`There is no course ${drive}; there are ${Object.keys(courses).join(", ")}.`);
    const inside = (id, key, text) => {
      const { min, max, value } = $(id);
      if (text == null) return +value;
      if (text === "" || !Number.isFinite(+text)) { told.push(`${key}=${text} is not a number, so ${value} is driven.`); return +value; }
      if (+text < +min || +text > +max) told.push(`${key}=${text} is outside ${min} to ${max}. The nearest value is driven.`);
      return Math.min(+max, Math.max(+min, +text));
    };
    this.startAt(inside("drive-speed", "speed_kmh", speed_kmh), inside("drive-mu", "mu", mu));
    return told.join(" ");
  }

  // On a small screen, the choices fold away while the car drives; a short one has no room for them before.
  fold() {
    const driving = this.running || this.again;
    document.body.classList.toggle("driving", driving);
    $("drive-setup").open = !(short.matches || (driving && small.matches));
  }

  show(shown) {
    this.shown = shown;
    this.scene ??= new Scene($("drive-view"));
    this.scene.fit();
    if (shown) this.prepare();
    else this.end();
  }

  get address() {
    return new URLSearchParams({ drive: $("course").value, vehicle: $("drive-vehicle").value, controller: $("drive-controller").value, speed_kmh: this.start_kmh, mu: this.start_mu });
  }

  // Speed and friction of the course, until they are moved, and its car, if it has one.
  ofCourse() {
    const course = courses[$("course").value];
    if (course.vehicle) offer($("drive-vehicle"), course.vehicle);
    for (const goal of document.querySelectorAll(".goal")) goal.textContent = course.goal;
    this.startAt(course.speed_kmh, course.mu);
  }

  // Speed and friction at the start. A restart returns to this speed, and keeps the friction chosen while driving.
  startAt(speed_kmh, mu) {
    this.start_kmh = speed_kmh;
    this.start_mu = mu;
    $("drive-speed").value = speed_kmh;
    $("drive-mu").value = mu;
    this.values();
  }

  values(speed_kmh = +$("drive-speed").value) {
    $("drive-speed").previousElementSibling.textContent = `${number(speed_kmh, 0)} km/h`;
    $("drive-mu").previousElementSibling.textContent = number(+$("drive-mu").value, 2);
    $("drive-chosen").textContent = [courses[$("course").value].title, inWords($("drive-vehicle").value), $("drive-controller").value].filter(Boolean).join(" · ");
  }

  // Put a car at the start, where it waits for the button. A drive ends.
  prepare() {
    this.say("");
    this.again = this.kept = false;
    this.startAt(this.start_kmh, this.start_mu); // the speed may have moved during the drive
    history.replaceState(null, "", `#${this.address}`);
    this.ready = false;
    $("driven").textContent = ""; // of the last drive, perhaps of another course
    $("drive-report").hidden = true;
    $("start").disabled = true;
    $("start").textContent = "Getting the car ready …";
    this.socket.send({ kind: "start", id: ++this.asked, maneuver: $("course").value, vehicle: $("drive-vehicle").value, controllers: [$("drive-controller").value], speed_kmh: this.start_kmh, mu: this.start_mu });
  }

  // Put the car at the start again, where it drives off at once.
  restart() {
    if (!this.ready) return;
    this.prepare();
    this.again = true;
  }

  failed(why = "choose another control or car") {
    this.again = false;
    this.fold();
    $("waiting").hidden = false;
    $("start").textContent = `Cannot drive: ${why}`;
  }

  // The connection has ended, and with it a drive.
  lost() {
    this.running = this.ready = false;
    $("end").hidden = $("again").hidden = $("start").disabled = true;
    this.failed("no connection");
  }

  begin(header, arrays) {
    if (header.id !== this.asked) return;
    this.ready = true;
    this.course = header;
    // Only drives of the same course with the same car, control, speed and friction can be compared.
    this.setting = String(this.address);
    this.timed = header.cones.length > 0 || header.radius_m > 0;
    this.rounds = header.radius_m > 0;
    this.way = this.rounds ? "Last lap" : "First to last gate";
    this.scene.setShape(header.shape, arrays);
    this.scene.car("you", 2);
    this.scene.setCourse({ ...header, radius: header.radius_m });
    this.ghost = this.ghosts.get(this.setting);
    if (this.ghost) this.scene.car("ghost", 0, 0.35);
    this.frames = [];
    this.struck = this.passed = this.penalty_s = 0;
    this.previous = null;
    if (this.again && this.shown) { this.act({ go: true }, true); return; }
    $("waiting").hidden = false;
    $("start").disabled = false;
    $("start").textContent = `Drive at ${number(+$("drive-speed").value, 0)} km/h`;
    $("start").focus({ preventScroll: true });
  }

  going() {
    this.running = this.compared = true;
    this.scene.moving(true);
    this.unhint(); // a hint takes height from the road
    this.again = this.kept = false;
    this.fold();
    this.latencies = [];
    $("start").blur();
    $("waiting").hidden = true;
    $("end").hidden = $("again").hidden = false;
    $("driven").textContent = "";
    $("drive-report").hidden = true;
    this.hold();
  }

  steer(way) {
    this.touch.steer = way;
    $("touch-steer").style.setProperty("--at", -way);
    $("touch-steer").setAttribute("aria-valuenow", -Math.round(100 * way));
    this.hands();
  }

  hold() { this.act({ speed_kmh: $("hold").checked ? +$("drive-speed").value : null }); }

  key(event, down) {
    const what = KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!down) this.pressed.delete(what);
    if (!this.shown || event.ctrlKey || event.metaKey || event.altKey) return;
    // Before the drive, a key that is held counts, but a list or a slider keeps its own keys.
    if (!this.running && (["INPUT", "SELECT"].includes(event.target?.tagName) || event.key === " ")) return;
    if (down && event.key === "Escape") { if (this.running) this.end(); return; }
    if (down && event.key.toLowerCase() === "r") { if (this.running && !event.repeat) this.restart(); return; } // also the way back from off the course
    const place = Number(event.key) - 1;
    if (down && SWITCH[place]) { this.control(SWITCH[place]); return; }
    if (!what) return;
    event.preventDefault();
    if (down) this.pressed.add(what);
    this.hands();
  }

  // Another controller takes over, at the start with a new car.
  control(name) {
    $("drive-controller").value = name;
    this.values();
    if (!this.act({ controller: name })) this.prepare();
  }

  pad() {
    const pad = [...(navigator.getGamepads?.() ?? [])].find((one) => one?.connected);
    if (!pad) return null;
    const steer = -pad.axes[0], throttle = pad.buttons[7]?.value ?? 0, brake = pad.buttons[6]?.value ?? 0;
    return Math.abs(steer) < DEAD && !throttle && !brake ? null : { steer: Math.abs(steer) < DEAD ? 0 : steer, throttle, brake, direct: true };
  }

  hands() {
    if (!this.running) return;
    const keys = { steer: this.pressed.has("left") - this.pressed.has("right"), throttle: +this.pressed.has("throttle"), brake: +this.pressed.has("brake") };
    const hands = this.pad() ?? (keys.steer || keys.throttle || keys.brake ? keys : { ...this.touch, direct: true });
    const text = JSON.stringify(hands);
    if (text === this.last) return;
    this.number += 1;
    if (this.last) this.sent.set(this.number, performance.now()); // the first ones are at rest
    this.last = text;
    this.act({ ...hands, number: this.number });
  }

  act(message, waiting = false) {
    if (!(waiting ? this.ready : this.running)) return false;
    this.socket.send({ kind: "act", ...message });
    return true;
  }

  end() { this.socket.send({ kind: "end" }); }

  frame(header, [poses]) {
    if (!this.ready) return;
    const { time_s } = header, scene = this.scene;
    scene.place("you", poses);
    if (this.ghost) scene.place("ghost", this.running ? this.before(time_s) : poses);
    const dt = this.previous ? time_s - this.previous.time_s : 0;
    scene.follow(["you"], dt ? [(poses[0] - this.previous.x) / dt, (poses[1] - this.previous.y) / dt] : [0, 0]);
    this.previous = { time_s, x: poses[0], y: poses[1] };
    if (this.running || !this.kept) this.gauges(header);
    scene.mark(nextSide(this.course, poses[0]));
    this.showWay(header.last_lap_s != null && !this.rounds ? null : wayBack(this.course, poses[0], poses[1]), poses);
    if (!this.running) return;
    scene.grow("you");
    this.frames.push({ time_s, poses });
    this.lap_s = header.last_lap_s;
    this.missed = header.missed;
    this.penalty_s = header.penalty_s;
    for (const cone of header.cones) { this.struck += 1; scene.knock(cone, header.yaw_rate_degps < 0 ? -1.2 : 1.2); }
    if (header.hold_kmh != null && !this.held) { $("drive-speed").value = header.hold_kmh; this.values(header.hold_kmh); }
    if (this.sent.has(header.seen)) { this.answered = this.sent.get(header.seen); this.sent.clear(); }
  }

  // An arrow that points back to the course, as seen in the picture.
  showWay(way, [x, y]) {
    $("way").hidden = !way;
    if (!way) return;
    const ahead = way.x - x, left = way.y - y;
    $("way").firstElementChild.setAttribute("style", `transform: rotate(${((this.scene.heading ?? 0) - Math.atan2(left, ahead)) * 180 / Math.PI}deg)`);
    $("way").lastElementChild.textContent = `course ${number(Math.hypot(ahead, left), 0)} m`;
  }

  // Return where the last drive was at this time.
  before(time_s) {
    const { frames } = this.ghost;
    while (this.passed < frames.length - 1 && frames[this.passed + 1].time_s <= time_s) this.passed += 1;
    return frames[this.passed].poses;
  }

  gauges(header) {
    if (header.controller !== this.controlled) { this.controlled = header.controller; this.rear = this.front = false; }
    this.rear ||= header.rear_deg != null;
    this.front ||= header.superposition_deg != null;
    const lap = this.rounds ? header.lap_s : header.last_lap_s ?? header.lap_s, before = (this.rounds && header.last_lap_s) || this.ghost?.lap_s;
    const rows = {
      speed: `${number(header.speed_kmh, 0)} km/h`, sideslip: `${number(header.sideslip_deg, 1)}°`, "grip used": this.running ? `${number(Math.min(100, 100 * header.friction_use), 0)} %` : "–",
      time: header.missed ? "missed" : this.timed ? `${number(lap, 1)}${before ? ` / ${number(before, 1)}` : ""} s` : `${number(header.time_s, 1)} s`, cones: this.struck ? `${this.struck} (+${number(header.penalty_s, 0)} s)` : "0",
      "lateral acc.": `${number(header.ay_mps2, 1)} m/s²`, "yaw rate": `${number(header.yaw_rate_degps, 0)} °/s`, "rear steer": this.rear ? `${number(header.rear_deg ?? 0, 1)}°` : "–",
      "front steer added": this.front ? `${number(header.superposition_deg ?? 0, 1)}°` : "–", control: header.controller,
    };
    if (!$("gauges").children.length) {
      $("gauges").replaceChildren(...Object.keys(rows).map((name) => element("div", { class: ["speed", "time"].includes(name) ? "large" : PLAIN.includes(name) ? "" : "more" }, element("dt", {}, name), element("dd", {}))));
    }
    Object.values(rows).forEach((text, i) => { $("gauges").children[i].lastElementChild.textContent = text; });
    const stroke = !before || header.missed ? "" : this.rounds && header.last_lap_s ? " / last lap" : " / ghost";
    const cones = this.scene.cones.length > 0, gauge = (name) => $("gauges").children[Object.keys(rows).indexOf(name)];
    gauge("time").firstElementChild.textContent = `time${stroke}`;
    gauge("cones").hidden = !cones;
    gauge("rear steer").hidden = cones && small.matches; // a phone has no room for both
    for (const button of $("switch").children) button.setAttribute("aria-pressed", String(button.textContent === header.controller));
    const finished = !this.rounds && header.last_lap_s != null;
    $("again").textContent = header.missed ? "Gate missed: restart" : finished ? "Finished: restart" : "Restart";
    $("gauges").title = "grip used: share of its friction that the busiest tyre uses, straight ahead mostly for its toe; rear steer, front steer added: angles at the wheels; cones: hit, with the time that they add. " + (this.timed ? "time: of this lap, or since the first gate, with the cones; behind the stroke, that of the last lap or of the ghost; missed: a gate was missed" : "");
    $("wheel").firstElementChild.setAttribute("transform", `rotate(${-header.steering_wheel_deg})`);
  }

  draw() {
    this.hands();
    const now = performance.now();
    if (this.running) this.scene.lighten(now - this.drawn);
    this.drawn = now;
    this.scene.draw();
    if (this.answered != null) { this.latencies.push(performance.now() - this.answered); this.answered = null; }
  }

  ended(header) {
    const told = `The drive has ended. It is saved as ${header.file}.`;
    if (!this.frames) { this.say(told, true); return; } // a drive of the page before it was loaded again
    this.running = false;
    this.fold();
    if (!this.again) { $("waiting").hidden = false; this.scene.moving(false); }
    this.sent.clear();
    this.last = "";
    $("end").hidden = $("again").hidden = true;
    const same = this.compared && String(this.address) === this.setting, before = same ? this.ghost?.lap_s : null, lap = this.lap_s;
    if (same && this.frames.length && (lap || !before)) this.ghosts.set(this.setting, { frames: this.frames, lap_s: lap });
    const faster = lap && before ? `, ${number(Math.abs(lap - before), 2)}\u00a0s ${lap < before ? "faster" : "slower"} than the ghost` : "";
    const count = ["no\u00a0cone", "1\u00a0cone"][this.struck] ?? `${this.struck}\u00a0cones`;
    const cones = !this.scene.cones.length ? "" : !lap || !this.struck ? `, ${count} hit` : `, with ${number(this.penalty_s, 0)}\u00a0s for ${count}`;
    const timed = lap ? `${this.way}: ${number(lap, 2)}\u00a0s${cones}${faster}. ` : this.missed ? `No time: a gate was missed${cones}. ` : this.rounds ? "No complete lap. " : this.timed ? `No time: ${header.early}${cones}. ` : "";
    const sorted = [...this.latencies].sort((a, b) => a - b), middle = sorted[Math.floor(sorted.length / 2)];
    const latency = middle == null ? "" : ` Input to picture: ${Math.round(middle)}\u00a0ms.`;
    const earlier = this.earlier;
    if (!this.again) this.earlier = "";
    else if (lap) this.earlier = `Before the restart: ${this.way.toLowerCase()} ${number(lap, 2)}\u00a0s, saved as ${header.file}. `;
    if (this.shown && this.ready) this.prepare();
    this.kept = !this.again; // the gauges of the end stay until the next start
    // A small screen has no room for what few want to know.
    const result = `${earlier}${timed}`.trim();
    $("driven").replaceChildren(...(result ? [element("b", {}, result), " "] : []), element("span", { class: "quiet" }, `${number(header.time_s, 1)}\u00a0s driven, ${header.behind_s < 0.05 ? "in real time" : `${number(header.behind_s, 1)}\u00a0s behind the clock`}.`, element("span", { class: "more" }, latency),
      ` Saved as ${header.file}`, element("span", { class: "more" }, ` in ${header.folder}.`)));
    $("drive-report").hidden = !!header.error;
    if (header.error) this.say(header.error);
    else if (!this.shown) this.say(told, true);
  }
}
