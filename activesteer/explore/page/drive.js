// The tab Drive: keys, gamepad and touch in; the car, gauges and cones out.
import { courses, element, number } from "./look.js";
import { Scene } from "./scene.js";

const $ = (id) => document.getElementById(id);
const KEYS = { ArrowLeft: "left", a: "left", ArrowRight: "right", d: "right", ArrowUp: "throttle", w: "throttle", ArrowDown: "brake", s: "brake", " ": "brake" };
const SWITCH = ["none", "ars", "afs", "lqr", "esc"], DEAD = 0.06;

export class Drive {
  constructor(socket, say) {
    this.socket = socket;
    this.say = say;
    this.pressed = new Set();
    this.shown = this.running = false;
    this.number = 0;
    this.sent = new Map();
    this.last = "";
    this.touch = { steer: 0, throttle: 0, brake: 0 };
    $("course").replaceChildren(...Object.entries(courses).map(([name, title]) => element("option", { value: name }, title)));
    $("start").addEventListener("click", () => (this.running ? this.end() : this.start()));
    $("hold").addEventListener("change", () => this.act({ hold: $("hold").checked }));
    $("drive-controller").addEventListener("change", () => { if (this.running) this.act({ controller: $("drive-controller").value }); });
    addEventListener("keydown", (event) => this.key(event, true));
    addEventListener("keyup", (event) => this.key(event, false));
    addEventListener("blur", () => { this.pressed.clear(); this.hands(); });
    $("touch-steer").addEventListener("input", () => { this.touch.steer = -$("touch-steer").value; this.hands(); });
    for (const end of ["change", "pointerup", "pointercancel"]) $("touch-steer").addEventListener(end, () => { $("touch-steer").value = this.touch.steer = 0; this.hands(); });
    for (const pedal of ["brake", "throttle"]) {
      const press = (value) => (event) => { event.preventDefault(); this.touch[pedal] = value; this.hands(); };
      $(`touch-${pedal}`).addEventListener("pointerdown", press(1));
      for (const end of ["pointerup", "pointerleave", "pointercancel"]) $(`touch-${pedal}`).addEventListener(end, press(0));
    }
    window.activesteerDrive = this; // for tests and the curious
  }

  offer(names) {
    $("drive-vehicle").replaceChildren(...names.vehicles.map((name) => element("option", { value: name }, name)));
    $("drive-vehicle").value = "compact";
    $("drive-controller").replaceChildren(...names.controllers.map((name) => element("option", { value: name }, name)));
    $("drive-controller").value = "none";
  }

  show(shown) {
    this.shown = shown;
    this.scene ??= new Scene($("drive-view"));
    this.scene.fit();
    if (!shown && this.running) this.end();
  }

  start() {
    this.say("");
    $("driven").textContent = "getting the car ready …";
    this.latencies = [];
    this.socket.send({ kind: "start", maneuver: $("course").value, vehicle: $("drive-vehicle").value, controllers: [$("drive-controller").value] });
  }

  failed() { $("driven").textContent = ""; }

  begin(header, arrays) {
    this.running = true;
    this.scene.setShape(header.shape, arrays);
    this.scene.car("you", 2);
    this.scene.setCourse(header.cones, header.lanes, header.radius_m);
    this.struck = 0;
    this.previous = null;
    $("start").textContent = "End";
    $("start").blur();
    $("drive-hint").hidden = true;
    $("driven").textContent = header.title;
    this.act({ hold: $("hold").checked });
  }

  key(event, down) {
    if (!this.shown || !this.running || event.ctrlKey || event.metaKey || event.altKey) return;
    if (down && event.key === "Escape") { this.end(); return; }
    const place = Number(event.key) - 1;
    if (down && SWITCH[place]) { $("drive-controller").value = SWITCH[place]; this.act({ controller: SWITCH[place] }); return; }
    const what = KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!what) return;
    event.preventDefault();
    if (down) this.pressed.add(what); else this.pressed.delete(what);
    this.hands();
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
    this.last = text;
    this.sent.set(++this.number, performance.now());
    this.act({ ...hands, number: this.number });
  }

  act(message) { if (this.running) this.socket.send({ kind: "act", ...message }); }
  end() { this.socket.send({ kind: "end" }); }

  frame(header, [poses]) {
    if (!this.running) return;
    this.latest = header;
    this.scene.place("you", poses);
    this.scene.grow("you");
    for (const cone of header.cones) { this.struck += 1; this.scene.knock(cone, header.yaw_rate_degps < 0 ? -1.2 : 1.2); }
    const dt = this.previous ? header.time_s - this.previous.time_s : 0.016;
    if (dt > 0) this.scene.follow("you", dt, this.previous ? [(poses[0] - this.previous.x) / dt, (poses[1] - this.previous.y) / dt] : [1, 0]);
    this.previous = { time_s: header.time_s, x: poses[0], y: poses[1] };
    if (this.sent.has(header.seen)) { this.answered = this.sent.get(header.seen); this.sent.clear(); }
    this.gauges(header);
  }

  gauges(header) {
    const rows = [
      ["speed", `${number(header.speed_kmh, 0)} km/h`], ["sideslip", `${number(header.sideslip_deg, 1)}°`], ["yaw rate", `${number(header.yaw_rate_degps, 0)} °/s`],
      ["lateral acc.", `${number(header.ay_mps2, 1)} m/s²`], ["rear wheels", `${number(header.rear_deg, 1)}°`], ["added in front", `${number(header.superposition_deg, 1)}°`],
      ["friction used", `${number(100 * header.friction_use, 0)} %`], ["control", header.controller], ["time", `${number(header.time_s, 1)} s`],
      ["lap or gates", header.last_lap_s == null ? `${number(header.lap_s, 1)} s` : `${number(header.last_lap_s, 2)} s`], ["cones hit", `${this.struck}`],
    ];
    $("gauges").replaceChildren(...rows.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)]));
    $("wheel").firstElementChild.setAttribute("transform", `rotate(${-header.steering_wheel_deg})`);
  }

  draw() {
    this.hands();
    this.scene.draw();
    if (this.answered != null) { this.latencies.push(performance.now() - this.answered); this.answered = null; }
  }

  ended(header) {
    this.running = false;
    this.sent.clear();
    this.last = "";
    $("start").textContent = "Start";
    const sorted = [...this.latencies].sort((a, b) => a - b), middle = sorted[Math.floor(sorted.length / 2)];
    const latency = middle == null ? "" : ` Input to picture: ${Math.round(middle)} ms in the median, ${Math.round(sorted.at(-1))} ms at most.`;
    $("driven").textContent = `${number(header.time_s, 1)} s driven, ${header.behind_s < 0.05 ? "in real time" : `${number(header.behind_s, 1)} s behind the clock`}; saved as ${header.file} in ${header.folder}.${latency} Look at it again: activesteer replay ${header.file}`;
    if (header.error) this.say(header.error);
  }
}
