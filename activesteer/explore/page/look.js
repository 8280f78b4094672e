// Colours of the page and of the runs, light or dark.
const data = JSON.parse(document.getElementById("data").textContent);
const root = document.documentElement;
const watchers = [];
const store = (() => { try { return sessionStorage; } catch { return null; } })(); // light or dark, until the tab is closed

export const { courses, mostControllers, systems } = data;
export const small = matchMedia("(max-width: 760px), (max-height: 450px)"); // a telephone, upright or on its side
export const onTheme = (watcher) => watchers.push(watcher);
export const dark = () => root.classList.contains("dark");
export const paint = (name) => getComputedStyle(root).getPropertyValue(`--${name}`).trim();
export const colourCount = data.light.length;
export const runColour = (place) => (dark() ? data.dark : data.light)[place];

// How slippery a road looks: 0 for dry asphalt to 1 for packed snow.
export const slippery = (mu) => Math.min(1, Math.max(0, (0.9 - mu) / 0.6));

function show(isDark) {
  root.classList.toggle("dark", isDark);
  for (const watcher of watchers) watcher();
}

export function setTheme(isDark) {
  store?.setItem("dark", isDark);
  show(isDark);
}

// The colours follow the system until the reader has chosen.
const systemDark = matchMedia("(prefers-color-scheme: dark)"), chosenDark = () => JSON.parse(store?.getItem("dark") ?? "null");
systemDark.addEventListener("change", () => { if (chosenDark() == null) show(systemDark.matches); });
show(chosenDark() ?? systemDark.matches);

export const element = (name, attributes = {}, ...children) => {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  made.append(...children);
  return made;
};

// A name of the package in words; a file keeps its name.
export const inWords = (name) => (name.includes(".") ? name : name.replaceAll("_", " "));
// The beginning of the title of a controller, such as `active rear steering`, or what its title says beyond its name.
export function meaning(name, titles) {
  const [first, ...rest] = (titles[name] ?? "").split(/[:;] | \(/);
  const title = first.toLowerCase() === inWords(name) ? rest.join(": ") : first;
  return title.replace(/^[A-Z](?=[a-z ])/, (letter) => letter.toLowerCase());
}
// A controller with its meaning, such as `ars: active rear steering`.
export const explained = (name, titles) => [name, meaning(name, titles)].filter(Boolean).join(": ");
// A finger on a slider that turns out to scroll has moved nothing.
export function undoScroll(slider, moved) {
  let before = null;
  slider.addEventListener("pointerdown", () => { before = slider.value; });
  slider.addEventListener("pointercancel", () => { slider.value = before ?? slider.value; moved(); });
}
export const option = (name, text = inWords(name)) => element("option", { value: name }, text);
// Choose a name in a list; the program answers a name that it does not know.
export function offer(list, name) {
  if (![...list.options].some((option) => option.value === name)) list.append(option(name));
  list.value = name;
}
export { number } from "./number.js";
