// Verdicts in tables, which begin with a mark, look as in the reports.
for (const cell of document.querySelectorAll(".md-typeset td")) {
  const kind = { "\u2713": "passed", "\u2717": "failed", "\u2260": "known" }[cell.textContent.trim()[0]];
  if (!kind || cell.childElementCount) continue;
  const chip = document.createElement("span");
  chip.className = `chip ${kind}`;
  chip.textContent = cell.textContent.trim();
  cell.replaceChildren(chip);
}
