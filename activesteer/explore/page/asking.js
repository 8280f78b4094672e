// What the page asks for, and when. Nothing here touches the page, so that tests need no browser.

// While a slider moves, the runs in progress end and are shown; then the newest values are driven.
export class Asking {
  constructor(send) {
    this.send = send;
    this.stop();
  }

  // A slider at rest does not wait: its runs replace those in progress.
  ask(dragging) {
    if (this.busy && dragging) { this.again = true; return; }
    this.again = false;
    this.busy = true;
    this.send(dragging);
  }

  finished() {
    this.busy = false;
    if (this.again) this.ask(true);
  }

  stop() { this.busy = this.again = false; }
}

// Untick the controllers beyond the limit, first the one that was ticked last, and return their names.
export function untickBeyond(most, boxes, ticked) {
  const on = boxes.filter((box) => box.checked && box !== ticked);
  if (ticked?.checked) on.push(ticked);
  const beyond = on.slice(most);
  for (const box of beyond) box.checked = false;
  return beyond.map((box) => box.value);
}
