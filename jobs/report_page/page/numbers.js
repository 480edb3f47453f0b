// Figures for people: about three digits; exactly, for tooltips, by exact().

const kDash = "\u2013";
const kGroups = new Intl.NumberFormat("en", { maximumFractionDigits: 20 });

function threeDigits(x) {
  const size = Math.abs(x);
  if (size === 0 || size >= 99.95) return x.toFixed(0);
  return x.toFixed(size >= 9.995 ? 1 : size >= 0.0995 ? 2 : size >= 0.00995 ? 3 : 4);
}

function withSuffix(x, base, suffixes) {
  let k = 0;
  while (k + 1 < suffixes.length && Math.abs(x) >= base * 0.9995) {
    x /= base;
    k += 1;
  }
  return (k === 0 && Number.isInteger(x) ? String(x) : threeDigits(x)) + suffixes[k];
}

/** 4,988; 34.8 k; 1.23 M. */
function people(n) {
  if (n === null || n === undefined) return kDash;
  if (Number.isInteger(n) && Math.abs(n) < 10000) return kGroups.format(n);
  return withSuffix(n, 1000, ["", "\u00a0k", "\u00a0M", "\u00a0G", "\u00a0T", "\u00a0P"]);
}

function bytes(n) {
  if (n === null || n === undefined) return kDash;
  return withSuffix(n, 1024, ["\u00a0B", "\u00a0KiB", "\u00a0MiB", "\u00a0GiB", "\u00a0TiB"]);
}

/** 0.83 s; 12.5 s; 3 min 20 s; 2 h 05 min; 3 d 4 h. */
function duration(s) {
  if (s === null || s === undefined) return kDash;
  if (s < 59.95) return threeDigits(s) + "\u00a0s";
  const two = (a, unit, b, small) =>
    a + "\u00a0" + unit + "\u00a0" + String(b).padStart(2, "0") + "\u00a0" + small;
  const whole = Math.round(s);
  if (whole < 3600) return two(Math.floor(whole / 60), "min", whole % 60, "s");
  const minutes = Math.round(s / 60);
  if (minutes < 1440) return two(Math.floor(minutes / 60), "h", minutes % 60, "min");
  const hours = Math.round(s / 3600);
  return Math.floor(hours / 24) + "\u00a0d\u00a0" + (hours % 24) + "\u00a0h";
}

function percent(share, digits) {
  if (share === null || share === undefined) return kDash;
  const value = 100 * share;
  // What isn't all must not be rounded to all.
  const text = value.toFixed(digits);
  return Number(text) === 100 && value < 100 ? (100 - 10 ** -digits).toFixed(digits) : text;
}

function fixed(x, digits) {
  return x === null || x === undefined ? kDash : x.toFixed(digits);
}

/** Every digit there is. */
function exact(n, unit) {
  if (n === null || n === undefined) return "unknown";
  return kGroups.format(n) + (unit ? " " + unit : "");
}

function plural(n, one, many) {
  return kGroups.format(n) + "\u00a0" + (n === 1 ? one : many || one + "s");
}

function dateTime(seconds) {
  if (seconds === null || seconds === undefined) return kDash;
  return new Date(1000 * seconds).toLocaleString("en-GB", {
    day: "numeric", month: "short", year: "numeric", hour: "2-digit", minute: "2-digit",
    second: "2-digit" });
}

function clock(seconds, withSeconds) {
  return new Date(1000 * seconds).toLocaleTimeString("en-GB", withSeconds
    ? { hour: "2-digit", minute: "2-digit", second: "2-digit" }
    : { hour: "2-digit", minute: "2-digit" });
}

/** An element: el("p.note", {title: "..."}, "text", child, ...). Text is never taken for HTML. */
function el(what, attributes, ...children) {
  const [tag, ...classes] = what.split(".");
  const node = document.createElement(tag);
  if (classes.length > 0) node.className = classes.join(" ");
  for (const [name, value] of Object.entries(attributes || {})) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
    else node.setAttribute(name, value === true ? "" : value);
  }
  node.append(...children.filter((c) => c !== null && c !== undefined));
  return node;
}
