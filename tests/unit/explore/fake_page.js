// Just enough of a page to run explore.js without a browser; `sent` has the messages to the program.
import { Socket as Connection } from "./socket.mjs";

class FakeElement {
  constructor(name) { Object.assign(this, { name, attributes: {}, children: [], listeners: {}, dataset: {}, value: "", checked: false, hidden: false, options: [], textContent: "" }); this.classList = { toggle: () => (this.toggled = !this.toggled) }; }
  setAttribute(key, value) { this.attributes[key] = value; if (["value", "type"].includes(key)) this[key] = String(value); }
  append(...children) { this.words = [this.words ?? "", ...children.filter((child) => typeof child === "string")].join(""); this.children.push(...children.filter((child) => child instanceof FakeElement)); }
  replaceChildren(...children) { this.children = children; }
  addEventListener(kind, act) { (this.listeners[kind] ??= []).push(act); }
  fire(kind, about = {}) { for (const act of this.listeners[kind] ?? []) act({ preventDefault() {}, ...about }); }
  all() { return this.children.flatMap((child) => [child, ...child.all()]); }
  querySelectorAll(what) { return this.all().filter((one) => (what === "details[open]" ? false : one.name === what)); }
  remove() {}
  focus() {}
  blur() {}
  prepend() {}
  style = { setProperty() {} };
  get previousElementSibling() { return (this.before ??= new FakeElement("output")); }
  get firstElementChild() { return (this.children[0] ??= new FakeElement("g")); }
  get lastElementChild() { return this.children.at(-1); }
}
const named = new Map();
export const $ = (id) => { if (!named.has(id)) named.set(id, new FakeElement(id)); return named.get(id); };
Object.defineProperty(globalThis, "navigator", { value: {} });
Object.assign(globalThis, {
  window: globalThis, location: { hash: "", href: "http://127.0.0.1:1/token/" }, requestAnimationFrame() {}, addEventListener(kind, act) { $("window").addEventListener(kind, act); }, matchMedia: () => ({ matches: false }),
  history: { replaceState: (_state, _title, address) => { location.hash = address; } },
  document: { body: new FakeElement("body"), querySelectorAll: () => [], getElementById: $, createElement: (name) => new FakeElement(name) },
});
globalThis.ResizeObserver = class { observe() {} };
export const sent = [];
export let hear;
let connection;
class FakeWebSocket { static OPEN = 1; readyState = 1; constructor() { connection = this; } send(text) { sent.push(JSON.parse(text)); } }
Object.defineProperty(globalThis, "WebSocket", { value: FakeWebSocket });
export class Socket extends Connection { constructor(heard, lost) { super(heard, lost); hear = heard; } }
export function disconnect(reason) { connection.readyState = 3; connection.onclose({ reason }); }
export class Curves { show() {} at() {} whole() {} besides() {} }
export class Track { show() {} at() {} }
export class Scene { cars = new Map(); cones = []; setShape() {} setSurface() {} setCourse() {} fit() {} tint() {} car() {} place() {} grow() {} mark() {} knock() {} lighten() {} moving() {} draw() {} follow() {} }
export const courses = { slalom: { title: "Slalom", goal: "", speed_kmh: 60, mu: 0.9 } };
export class Drive { offer() {} going() {} failed() {} lost() {} draw() {} show() {} choose() {} }
export const small = { matches: false, addEventListener() {} };
export const dark = () => false, onTheme = () => {}, runColour = () => "#333", setTheme = () => {}, paint = () => "#333", undoScroll = () => {}, slippery = () => "#333", mostControllers = 4, colourCount = 6, systems = ["none", "ars", "afs"];
export const element = (name, attributes = {}, ...children) => {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
};
export const offer = (list, name) => { list.value = name; };
export const inWords = (name) => name, explained = inWords, meaning = () => "", option = (name) => element("option", { value: name });
export { number } from "./number.mjs";

export const names = ["none", "ars", "afs", "lqr", "esc"];
export function start() {
  hear({ kind: "ready", maneuvers: ["step_steer"], vehicles: ["compact"], drivers: ["typical"], controllers: names, titles: {} }, []);
  describe();
  finish();
}
export function describe() {
  const { id } = sent.at(-1) ?? {};
  const slider = { key: "speed_kmh", label: "speed", unit: "km/h", group: "manoeuvre", low: 20, high: 160, step: 1, value: 80 };
  hear({ kind: "description", id, title: "Step steer, 80 km/h", sliders: [slider], shape: {} }, [[]]);
}
export function finish(title = "Step steer, 80 km/h") {
  const { id } = sent.at(-1) ?? {};
  hear({ kind: "run", id, name: "none", title, figures: [], losses: [] }, [undefined]);
  hear({ kind: "finished", id, command: "", python: "" }, []);
}
const fields = (range) => $("sliders").querySelectorAll("input").filter((one) => (one.type === "range") === range);
export const slider = () => fields(true)[0];
export function type(text) { const [field] = fields(false); field.value = text; field.fire("change"); return field; }
export function drag(value) { slider().value = value; slider().fire("input"); }
export function tick(name, checked) {
  const box = $("controllers").querySelectorAll("input").find((one) => one.value === name);
  box.checked = checked;
  box.fire("change");
}
