// The filter: words that must occur, -words that must not, and comparisons of figures.

const kSuffixes = {
  "": 1, k: 1e3, m: 1e6, g: 1e9, t: 1e12, kib: 1024, mib: 1024 ** 2, gib: 1024 ** 3,
  "%": 1, s: 1, min: 60, h: 3600 };
const kComparisons = {
  "<": (a, b) => a < b, ">": (a, b) => a > b, "<=": (a, b) => a <= b, ">=": (a, b) => a >= b,
  "=": (a, b) => a === b, "!=": (a, b) => a !== b };

function columnNamed(name) {
  const known = columns.filter((c) => c.numeric);
  return known.find((c) => c.key === name || (c.alias || []).includes(name)) ||
    known.find((c) => c.key.startsWith(name));
}

/** A test of a scan; throws an Error with a sentence. */
function parseQuery(text) {
  const tests = [];
  for (const [token] of text.matchAll(/-?"[^"]*"|\S+/g)) {
    const comparison = /^([a-z_]+)(<=|>=|!=|<|>|=)(.*)$/i.exec(token);
    if (comparison) {
      const [, name, sign, number] = comparison;
      const column = columnNamed(name.toLowerCase());
      if (!column) {
        throw new Error("There is no column \u201c" + name + "\u201d. There are " +
          columns.filter((c) => c.numeric).map((c) => (c.alias || [c.key])[0]).join(", ") + ".");
      }
      const value = /^(-?[0-9.]+(?:e-?[0-9]+)?)([a-z%]*)$/i.exec(number.replace(/,/g, ""));
      const factor = value ? kSuffixes[value[2].toLowerCase()] : undefined;
      if (factor === undefined || Number.isNaN(Number(value[1]))) {
        throw new Error("\u201c" + token + "\u201d needs a number, like " + name + sign + "5k.");
      }
      const limit = Number(value[1]) * factor;
      tests.push((s) => {
        const figure = column.value(s);
        return figure !== null && kComparisons[sign](figure * (column.scale || 1), limit);
      });
      continue;
    }
    const not = token.length > 1 && token.startsWith("-");
    const word = (not ? token.slice(1) : token).replace(/^"|"$/g, "").toLowerCase();
    if (word !== "") tests.push((s) => s.text.includes(word) !== not);
  }
  return (scan) => tests.every((test) => test(scan));
}
