// A number as text: with digits, or by its size; a dash for a missing one, and no minus sign before a zero.
export function number(value, digits) {
  if (value == null) return "–";
  const text = value.toFixed(digits ?? (Math.abs(value) < 10 ? 2 : Math.abs(value) < 1000 ? 1 : 0));
  return text.replace("-", Number(text) === 0 ? "" : "−");
}
