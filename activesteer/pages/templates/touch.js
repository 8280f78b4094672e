// A gap narrower than a pixel, where an angle jumps by a turn, would be drawn across.
const wideGaps = (_plot, _series, _first, _last, gaps) => gaps.map(([from, to]) => [from - 2 * devicePixelRatio, to + 2 * devicePixelRatio]);
// Titles of the plots that a standing car leaves out, in words.
const zeroTold = (titles) => (titles.length ? `Zero throughout, at rest: ${titles.map((title) => title[0].toLowerCase() + title.slice(1)).join(", ")}.` : "");

// One finger reads values, two zoom in time, a double tap shows all; up and down the page still scrolls.
function touchable(u, zoom) {
  const over = u.over, fingers = new Map();
  let start = null, tapped = 0;
  const at = (event) => event.clientX - over.getBoundingClientRect().left;
  over.addEventListener("pointerdown", (event) => {
    if (event.pointerType !== "touch") return;
    fingers.set(event.pointerId, at(event));
    if (fingers.size === 2) {
      const [a, b] = [...fingers.values()].sort((p, q) => p - q);
      start = { a: u.posToVal(a, "x"), b: u.posToVal(b, "x") };
    } else if (fingers.size === 1) {
      if (event.timeStamp - tapped < 300) zoom(null);
      tapped = event.timeStamp;
    }
  });
  over.addEventListener("pointermove", (event) => {
    if (!fingers.has(event.pointerId)) return;
    fingers.set(event.pointerId, at(event));
    if (fingers.size === 1) u.setCursor({ left: at(event), top: event.clientY - over.getBoundingClientRect().top }, true, true);
    if (fingers.size !== 2 || !start) return;
    const [a, b] = [...fingers.values()].sort((p, q) => p - q);
    if (b - a < 10) return;
    const scale = (start.b - start.a) / (b - a), min = start.a - a * scale;
    zoom({ min, max: min + over.clientWidth * scale });
  });
  for (const name of ["pointerup", "pointercancel"]) {
    over.addEventListener(name, (event) => { fingers.delete(event.pointerId); if (fingers.size < 2) start = null; });
  }
}
