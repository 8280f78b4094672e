// A number as text: with digits, or by its size, and large ones in groups of three; a dash for a missing one, and no minus sign before a zero.
export function number(value, digits) {
  if (value == null) return "–";
  const text = value.toFixed(digits ?? (Math.abs(value) < 10 ? 2 : Math.abs(value) < 1000 ? 1 : 0));
  const [whole, rest] = text.split(".");
  const grouped = whole.length > 5 ? whole.replace(/\B(?=(\d{3})+$)/g, "\u202f") : whole;
  return (rest == null ? grouped : `${grouped}.${rest}`).replace("-", Number(text) === 0 ? "" : "−");
}
