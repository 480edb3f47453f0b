// Puts the page together.

const byId = (id) => document.getElementById(id);

function overview() {
  const done = totals.done;
  document.title = `${kGroups.format(done)} of ${kGroups.format(totals.scans)} scans \u2013 Rattan`;
  byId("where").replaceChildren(data.directory);
  byId("made").replaceChildren(el("time", { datetime: data.created },
    dateTime(Date.parse(data.created) / 1000)));
  byId("foot").replaceChildren("Made by Rattan " + data.rattan.version + " (" +
    data.rattan.commit + "). The same figures are in ",
  el("a", { href: "report.json" }, "report.json"), ".");
  const failed = totals.defect + totals.resource + totals.unusable;
  byId("headline").replaceChildren(
    el("b", {}, done === totals.scans ? "All " + plural(done, "scan") + " done"
      : `${kGroups.format(done)} of ${plural(totals.scans, "scan")} done`),
    ...(failed > 0 ? [", ", el("span.bad", {}, kGroups.format(failed) + " failed")] : []),
    ...["interrupted", "running", "pending"].filter((s) => totals[s] > 0)
      .map((s) => `, ${kGroups.format(totals[s])} ${kStatusWords[s]}`));
  byId("shares").replaceChildren(...["done", ...kStatusOrder.slice(0, -1)]
    .filter((s) => totals[s] > 0)
    .map((s) => el("span." + s, { style: `flex-grow:${totals[s]}`,
      title: kGroups.format(totals[s]) + " " + kStatusWords[s] })));
  const quads = totals.faces > 0 ? percent(totals.quads / totals.faces, 1) + " % quads" : null;
  const busy = totals.wall_seconds > 0 ? totals.cpu_seconds / totals.wall_seconds : null;
  const tile = (key, name, value, tip, note) => el("div", { "data-key": key },
    el("dt", {}, name), el("dd", { title: tip }, value, note ? el("small", {}, note) : null));
  byId("tiles").replaceChildren(
    tile("triangles", "Triangles in", people(totals.triangles), exact(totals.triangles)),
    tile("faces", "Faces out", people(totals.faces), exact(totals.faces), quads),
    tile("triangles_per_second", "Throughput", people(totals.triangles_per_second) + "/s",
      exact(totals.triangles_per_second, "triangles a second"), "triangles"),
    tile("wall_seconds", "Time", duration(totals.wall_seconds),
      exact(totals.wall_seconds, "s in which anything was at work")),
    tile("cpu_seconds", "Processor time", duration(totals.cpu_seconds),
      exact(totals.cpu_seconds, "s, of all attempts"),
      busy === null ? null : threeDigits(busy) + " processors busy"),
    tile("peak_rss_bytes", "Peak memory of a scan", bytes(totals.peak_rss_bytes),
      exact(totals.peak_rss_bytes, "bytes")),
    tile("output_bytes", "Written", bytes(totals.output_bytes),
      exact(totals.output_bytes, "bytes of remeshes")));
}

/** Failures, those alike together: alike are sentences that differ in names and numbers only. */
function failures(open) {
  const failed = scans.filter((s) => kFailed.has(s.status));
  byId("failures").hidden = failed.length === 0;
  const groups = new Map();
  for (const scan of failed) {
    let like = scan.reason;
    for (const name of [scan.scan, scan.id, scan.name].filter((n) => n !== "")) like = like.split(name).join("\u2026");
    like = scan.status + like.replace(/[0-9][0-9.,]*/g, "#");
    groups.set(like, [...(groups.get(like) || []), scan]);
  }
  const ordered = [...groups.values()].sort((a, b) =>
    kStatusOrder.indexOf(a[0].status) - kStatusOrder.indexOf(b[0].status) || b.length - a.length);
  const item = (scan) => el("li", {},
    el("div.who", {}, el("button.name", { type: "button", onclick: () => open(scan) }, scan.id),
      scan.has_log ? el("a", { href: scan.link + ".log" }, "log") : null),
    el("p", {}, scan.reason));
  const badge = (status) => el("span.status." + status, {}, kStatusWords[status]);
  const group = (list) => {
    if (list.length === 1) {
      return el("div.failure", {}, badge(list[0].status), el("ul", {}, item(list[0])));
    }
    const all = el("ul");
    const box = el("details", { open: list.length <= 3 && ordered.length <= 6 },
      el("summary", {}, el("b", {}, plural(list.length, "scan")), " ",
        el("span", {}, list[0].reason)), all);
    const fill = () => {
      if (box.open && all.childElementCount === 0) all.append(...list.map(item));
    };
    box.addEventListener("toggle", fill);
    fill();
    return el("div.failure", {}, badge(list[0].status), box);
  };
  byId("failure-list").replaceChildren(...ordered.map(group));
  byId("failures-title").textContent = plural(failed.length, "scan") + " failed";
}

function start() {
  overview();
  let list = scans;
  const details = new Details(byId("details"), () => list);
  const table = new ScanTable(byId("box"), (scan) => details.show(scan));
  failures((scan) => details.show(scan));
  let status = null;
  const chips = byId("chips");
  const query = byId("query");
  const apply = () => {
    const begun = performance.now();
    let test = () => true;
    byId("query-error").textContent = "";
    try {
      test = parseQuery(query.value);
    } catch (error) {
      byId("query-error").textContent = error.message;
    }
    query.toggleAttribute("aria-invalid", byId("query-error").textContent !== "");
    list = sorted(scans.filter((s) =>
      (status === null || s.status === status) && test(s)), table.sortBy, table.descending);
    table.show(list);
    byId("shown").textContent = list.length === scans.length ? plural(scans.length, "scan")
      : kGroups.format(list.length) + " of " + plural(scans.length, "scan");
    byId("box").dataset.milliseconds = (performance.now() - begun).toFixed(1);
  };
  table.onsort = apply;
  const present = kStatusOrder.filter((s) => scans.some((scan) => scan.status === s));
  if (present.length > 1) {
    const chip = (of, words, n) => el("button", { type: "button", "data-status": of || "all",
      "aria-pressed": String(status === of), onclick: (event) => {
        status = of;
        for (const other of chips.children) {
          other.setAttribute("aria-pressed", String(other === event.currentTarget));
        }
        apply();
      } }, of ? el("i." + of) : null, words, " ", el("small", {}, kGroups.format(n)));
    chips.replaceChildren(chip(null, "all", scans.length), ...present.map((s) =>
      chip(s, kStatusWords[s], scans.filter((scan) => scan.status === s).length)));
  }
  let waiting = 0;
  query.addEventListener("input", () => {
    clearTimeout(waiting);
    waiting = setTimeout(apply, scans.length > 20000 ? 150 : 0);
  });
  byId("query-help").replaceChildren(
    el("p", {}, "Words in a name, scan path or sentence; a word with - before it must not occur; " +
      "quotes keep words together."),
    el("p", {}, "Figures: ", el("code", {}, "faces>5k quads<95 time>2min memory>1GiB warnings>0"),
      ". Columns: " + columns.filter((c) => c.numeric).map((c) => (c.alias || [c.key])[0])
        .join(", ") + ". Distances are in % of the diagonal."));
  apply();
  const chart = () => {
    if (data.throughput.length > 0 && totals.triangles_per_second > 0) {
      byId("throughput").hidden = false;
      byId("throughput-note").textContent = "triangles a second";
      drawChart(byId("chart"));
    }
  };
  chart();
  let width = byId("chart").clientWidth;
  new ResizeObserver(() => {
    if (byId("chart").clientWidth !== width) {
      width = byId("chart").clientWidth;
      chart();
    }
  }).observe(byId("chart"));
  document.addEventListener("keydown", (event) => {
    const typing = /^(INPUT|TEXTAREA|SELECT)$/.test(document.activeElement.tagName);
    if (event.key === "/" && !typing && !byId("details").open) {
      event.preventDefault();
      query.focus();
    }
  });
  document.documentElement.dataset.ready = performance.now().toFixed(0);
}

start();
