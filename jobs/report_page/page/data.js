// The scans as objects, and what the table's columns are.

const data = JSON.parse(document.getElementById("data").textContent);
const totals = data.totals;
const kStatusOrder = ["defect", "resource", "unusable", "interrupted", "running", "pending", "done"];
const kStatusWords = {
  done: "done", unusable: "unusable", resource: "resources", defect: "defect",
  interrupted: "interrupted", running: "running", pending: "pending" };
const kFailed = new Set(["defect", "resource", "unusable"]);

/** Two folders may lie between the page and a file, and any character in their names. */
function linkTo(path) {
  return path.split("/").map(encodeURIComponent).join("/");
}

const scans = data.rows.map((row, place) => {
  const scan = { place };
  data.columns.forEach((name, k) => { scan[name] = row[k]; });
  scan.status = data.statuses[scan.status];
  scan.link = scan.link || linkTo(scan.id);
  scan.folder = "report/" + scan.link + "/";
  scan.repairs = scan.repairs || [];
  scan.warnings = scan.warnings || [];
  scan.outputs = scan.outputs || (scan.status === "done" ? [[scan.id, scan.link]] : []);
  scan.quad_share = scan.faces > 0 ? scan.quads / scan.faces : null;
  scan.rate = scan.triangles !== null && scan.seconds > 0 ? scan.triangles / scan.seconds : null;
  const most = (a, b) => (a === null || b === null ? null : Math.max(a, b));
  const ofDiagonal = (d) => (d !== null && scan.diagonal > 0 ? d / scan.diagonal : null);
  scan.distance_max = ofDiagonal(most(scan.to_max, scan.from_max));
  scan.distance_rms = ofDiagonal(most(scan.to_rms, scan.from_rms));
  scan.repair_sum = scan.status === "done" ? scan.repairs.reduce((sum, r) => sum + r[1], 0) : null;
  scan.warning_count = scan.status === "done" ? scan.warnings.length : null;
  const slash = scan.id.lastIndexOf("/");
  scan.name = scan.id.slice(slash + 1);
  scan.parent = scan.id.slice(0, slash + 1);
  // Without the scan's name, which stands beside it.
  scan.reason = scan.sentence || "No reason was given.";
  if (scan.reason.startsWith(scan.scan + ": ")) {
    const rest = scan.reason.slice(scan.scan.length + 2);
    scan.reason = rest.charAt(0).toUpperCase() + rest.slice(1);
  }
  scan.text = (scan.id + "\n" + scan.scan + "\n" + (scan.sentence || "")).toLowerCase();
  return scan;
});

// key: what it is called in the filter and of the scan's figure; width in pixels.
const columns = [
  { key: "name", title: "Scan", width: 234, text: (s) => s.id, sort: (s) => s.id.toLowerCase(),
    about: "Output below the batch's folder" },
  { key: "status", title: "Status", width: 94, text: (s) => kStatusWords[s.status],
    sort: (s) => kStatusOrder.indexOf(s.status), about: "What became of it" },
  { key: "triangles", title: "Triangles", width: 80, unit: "triangles", show: people,
    about: "Triangles of the scan, as repaired" },
  { key: "faces", title: "Faces", width: 70, unit: "faces", show: people,
    about: "Faces of the remesh" },
  { key: "quads", title: "Quads", sub: "%", width: 60, figure: "quad_share",
    show: (v) => percent(v, 1), scale: 100,
    tip: (s) => exact(s.quads, "quads of ") + exact(s.faces, "faces"),
    about: "Quads, of all faces of the remesh" },
  { key: "irregular", title: "Irregular", sub: "vertices", width: 72, unit: "irregular vertices",
    show: people, about: "Vertices inside the remesh where other than four edges meet" },
  { key: "singularities", title: "Singular", width: 72, sub: "triangles",
    unit: "singular triangles", show: people,
    about: "Triangles of the scan where the parameterization is singular" },
  { key: "stretch", title: "Stretch", width: 66, show: (v) => fixed(v, 3),
    about: "How unevenly large quads are: 1 for equal squares" },
  { key: "shear", title: "Shear", width: 60, show: (v) => fixed(v, 3),
    about: "How far quads are from rectangles: 0 for right angles" },
  { key: "distance_max", title: "Distance", sub: "max, % diag.", width: 80, alias: ["distance"],
    show: (v) => (v === null ? kDash : threeDigits(100 * v)), scale: 100,
    tip: (s) => "to the scan " + exact(s.to_max) + ", from the scan " + exact(s.from_max),
    about: "Largest distance between remesh and scan, in % of the scan's diagonal" },
  { key: "distance_rms", title: "Distance", sub: "rms, % diag.", width: 80, alias: ["rms"],
    show: (v) => (v === null ? kDash : threeDigits(100 * v)), scale: 100,
    tip: (s) => "to the scan " + exact(s.to_rms) + ", from the scan " + exact(s.from_rms),
    about: "Root mean square distance between remesh and scan, in % of the scan's diagonal" },
  { key: "seconds", title: "Time", width: 86, unit: "s", show: duration, alias: ["time"],
    about: "Wall time of the last attempt" },
  { key: "rate", title: "Speed", sub: "triangles/s", width: 80, unit: "triangles/s", show: people,
    alias: ["speed"], about: "Triangles of the scan for each second of wall time" },
  { key: "peak_rss", title: "Memory", sub: "peak", width: 78, unit: "bytes", show: bytes,
    alias: ["memory", "peak"], about: "Most memory that the process filled" },
  { key: "repairs", title: "Repairs", width: 70, figure: "repair_sum", show: people,
    tip: (s) => s.repairs.map(([name, n]) => exact(n) + " " + name.replace(/_/g, " ")).join(", ") ||
      (s.repair_sum === null ? "unknown" : "none"),
    about: "Defects of the scan that were repaired" },
  { key: "warnings", title: "Warnings", width: 84, figure: "warning_count", show: people,
    tip: (s) => s.warnings.join("\n") || (s.warning_count === null ? "unknown" : "none"),
    about: "Warnings of the run" },
];
for (const column of columns) {
  const figure = column.figure || column.key;
  column.numeric = !column.sort;
  if (column.numeric) {
    column.value = (s) => s[figure];
    column.sort = column.value;
    column.text = (s) => column.show(s[figure]);
    column.tip = column.tip || ((s) => exact(s[figure], column.unit));
  }
}

/** Order of the scans by a column: unknown figures last, equal ones by name. */
function sorted(list, column, descending) {
  const keyed = list.map((scan) => [column.sort(scan), scan]);
  const sign = descending ? -1 : 1;
  keyed.sort(([a, s], [b, t]) => {
    if (a === b) return s.place - t.place;
    if (a === null) return 1;
    if (b === null) return -1;
    return a < b ? -sign : sign;
  });
  return keyed.map(([, scan]) => scan);
}
