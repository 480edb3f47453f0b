// Throughput over time as bars; time in which nothing was at work is left out.

function svg(tag, attributes, ...children) {
  const node = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  node.append(...children);
  return node;
}

/** A round step so that about `wanted` of them reach `most`. */
function roundStep(most, wanted) {
  const raw = most / wanted;
  const power = 10 ** Math.floor(Math.log10(raw));
  return power * ([1, 2, 2.5, 5, 10].find((f) => f * power >= raw * 0.999) || 10);
}

function drawChart(box) {
  const steps = data.throughput;
  const width = Math.max(280, box.clientWidth);
  const height = 176;
  const left = 58, right = 10, top = 12, bottom = 24;
  const inner = width - left - right;
  const tall = height - top - bottom;
  const most = Math.max(...steps.map((s) => s.triangles_per_second), 1);
  const tick = roundStep(most, 4);
  const high = Math.max(most * 1.02, tick);
  const long = steps.reduce((sum, s) => sum + s.seconds, 0);
  const y = (v) => top + tall * (1 - v / high);

  const root = svg("svg", { width, height, viewBox: `0 0 ${width} ${height}`, role: "img" });
  root.append(svg("title", {}));
  root.firstChild.textContent = "Throughput between " + dateTime(steps[0].time) + " and " +
    dateTime(steps.at(-1).time + steps.at(-1).seconds) + ": at most " + people(most) +
    " triangles a second, " + people(totals.triangles_per_second) + " on average.";
  for (let v = 0; v <= high; v += tick) {
    root.append(svg("line", { x1: left, x2: width - right, y1: y(v), y2: y(v),
      class: v === 0 ? "axis" : "grid" }));
    const label = svg("text", { x: left - 8, y: y(v) + 4, class: "tick end" });
    label.textContent = people(v);
    root.append(label);
  }
  // Bars, and a mark where time is left out.
  const gap = inner / steps.length > 4 ? 1 : 0;
  let at = 0;
  let labelled = -Infinity;
  const sameDay = new Date(1000 * steps[0].time).toDateString() ===
    new Date(1000 * steps.at(-1).time).toDateString();
  const bars = svg("g", { class: "bars" });
  const shown = steps.map((step, k) => {
    const x = left + inner * at / long;
    const wide = inner * step.seconds / long;
    at += step.seconds;
    bars.append(svg("rect", { x: x.toFixed(2), width: Math.max(wide - gap, 0.5).toFixed(2),
      y: y(step.triangles_per_second).toFixed(2), rx: wide > 8 ? 2 : 0,
      height: Math.max(top + tall - y(step.triangles_per_second), 0).toFixed(2) }));
    const before = steps[k - 1];
    const broken = before && step.time > before.time + before.seconds + 1;
    if (broken) {
      root.append(svg("line", { x1: x, x2: x, y1: top, y2: top + tall + 6, class: "break" }));
    }
    if ((broken || x - labelled > 90) && x < width - 60 && (k === 0 || x - labelled > 60)) {
      labelled = x;
      const label = svg("text", { x, y: height - 6, class: "tick" });
      label.textContent = clock(step.time, long < 600) +
        (sameDay ? "" : " " + new Date(1000 * step.time).toLocaleDateString("en-GB",
          { day: "numeric", month: "short" }));
      root.append(label);
    }
    return { x, wide, step };
  });
  root.append(bars);
  const mean = totals.triangles_per_second;
  root.append(svg("line", { x1: left, x2: width - right, y1: y(mean), y2: y(mean), class: "mean" }));
  const tip = el("p.tip", { hidden: true });
  root.addEventListener("pointermove", (event) => {
    const x = event.clientX - root.getBoundingClientRect().left;
    const k = shown.findIndex((b) => x < b.x + b.wide);
    const bar = x >= left && k >= 0 ? shown[k] : null;
    tip.hidden = bar === null;
    [...bars.children].forEach((rect, i) => rect.classList.toggle("on", bar !== null && i === k));
    if (bar === null) return;
    const { step } = bar;
    tip.replaceChildren(
      el("b", {}, people(step.triangles_per_second) + " triangles/s"),
      el("span", {}, clock(step.time, true) + " \u2013 " + clock(step.time + step.seconds, true)),
      el("span", {}, plural(step.scans, "scan") + " ended"));
    const middle = bar.x + bar.wide / 2;
    tip.style.left = Math.min(Math.max(middle, 80), width - 80) + "px";
  });
  root.addEventListener("pointerleave", () => {
    tip.hidden = true;
    for (const rect of bars.children) rect.classList.remove("on");
  });
  box.replaceChildren(root, tip);
}
