// One scan: its 3D view and all its figures.

class Details {
  constructor(dialog, list) {
    this.dialog = dialog;
    this.list = list;  // of the scans that the table shows, for going on to the next
    this.view = null;
    this.canvas = el("canvas", { tabindex: "0", role: "img",
      "aria-label": "3D view of the remesh. Arrow keys turn it, plus and minus zoom, 0 resets, " +
        "e shows or hides edges." });
    this.poster = el("img.poster", { alt: "" });
    this.note = el("p.note", { role: "status" });
    this.edges = el("button", { type: "button", "aria-pressed": "true", title: "Edges (e)",
      onclick: () => this.view && this.view.toggleEdges() }, "Edges");
    this.canvas.addEventListener("edges", () =>
      this.edges.setAttribute("aria-pressed", String(this.view.edges)));
    const tool = (label, title, action) => el("button", { type: "button", title,
      "aria-label": title, onclick: () => this.view && this.view.head && action(this.view) }, label);
    this.tools = el("div.tools", { role: "group", "aria-label": "3D view" },
      tool("\u2212", "Zoom out (-)", (v) => v.magnify(1 / 1.3)),
      tool("+", "Zoom in (+)", (v) => v.magnify(1.3)),
      tool("Reset", "Reset the view (0)", (v) => v.reset()), this.edges);
    this.sizes = el("div.sizes", { role: "group", "aria-label": "Which remesh" });
    this.stage = el("div.stage", {}, this.poster, this.canvas, this.tools, this.sizes, this.note);
    this.title = el("h2", { id: "details-title" });
    this.place = el("p.place");
    this.previous = el("button", { type: "button", title: "Previous scan",
      "aria-label": "Previous scan", onclick: () => this.go(-1) }, "\u2039");
    this.next = el("button", { type: "button", title: "Next scan", "aria-label": "Next scan",
      onclick: () => this.go(1) }, "\u203a");
    this.close = el("button.close", { type: "button", title: "Close (Esc)", "aria-label": "Close",
      onclick: () => dialog.close() }, "\u00d7");
    this.facts = el("div.facts");
    dialog.append(el("header", {}, el("div", {}, this.title, this.place),
      el("nav", { "aria-label": "Scans" }, this.previous, this.next, this.close)),
    el("div.content", {}, this.stage, this.facts));
    dialog.addEventListener("click", (event) => {
      if (event.target === dialog) dialog.close();
    });
    // The event comes late: the next scan may have been opened by then.
    dialog.addEventListener("close", () => { if (!dialog.open) this.scan = null; });
  }

  go(step) {
    const list = this.list();
    const i = list.indexOf(this.scan) + step;
    if (list[i]) this.show(list[i]);
  }

  show(scan) {
    this.scan = scan;
    const list = this.list();
    const i = list.indexOf(scan);
    this.previous.disabled = i <= 0;
    this.next.disabled = i < 0 || i + 1 >= list.length;
    this.title.replaceChildren(scan.name);
    this.place.replaceChildren(el("span.status." + scan.status, {}, kStatusWords[scan.status]),
      " ", scan.parent);
    this.facts.replaceChildren(...this.sections(scan));
    this.sizes.replaceChildren(...(scan.viewers.length > 1 ? scan.viewers.map((name, k) =>
      el("button", { type: "button", "aria-pressed": String(k === 0),
        onclick: () => this.load(scan, k) },
        name.replace(/^view-?/, "").replace(/\.js$/, "") || String(k + 1))) : []));
    if (!this.dialog.open) {
      this.dialog.showModal();
      this.close.focus();
    }
    this.dialog.querySelector(".content").scrollTop = 0;
    this.stage.hidden = scan.viewers.length + scan.thumbnails.length === 0;
    this.load(scan, 0);
  }

  async load(scan, k) {
    [...this.sizes.children].forEach((b, i) => b.setAttribute("aria-pressed", String(i === k)));
    this.poster.hidden = scan.thumbnails.length === 0;
    if (scan.thumbnails.length > 0) {
      this.poster.src = scan.folder + linkTo(scan.thumbnails[Math.min(k, scan.thumbnails.length - 1)]);
    }
    this.canvas.hidden = true;
    this.tools.hidden = true;
    this.canvas.removeAttribute("data-drawn");
    if (scan.viewers.length === 0) {
      this.note.textContent = "There is no 3D view of this scan.";
      return;
    }
    this.note.textContent = "Loading\u2026";
    try {
      const head = await loadView(scan.folder + linkTo(scan.viewers[k]));
      if (this.scan !== scan) return;
      this.canvas.hidden = false;
      this.view = this.view || new View3d(this.canvas);
      this.view.show(head);
      this.tools.hidden = false;
      if (document.activeElement === this.close) this.canvas.focus({ preventScroll: true });
      this.poster.hidden = true;
      const faces = this.view.shown;
      this.note.textContent = faces === head.faces
        ? matchMedia("(pointer: coarse)").matches ? "Drag to turn, pinch to zoom and move"
          : "Drag to turn, wheel to zoom, shift-drag to move"
        : "Reduced for viewing: " + people(faces) + " of " + people(head.faces) + " faces";
    } catch (error) {
      if (this.scan === scan) this.note.textContent = error.message;
    }
  }

  sections(s) {
    const facts = (title, rows) => {
      const known = rows.filter(([, value]) => value !== null);
      return known.length === 0 ? null : el("section", {}, el("h3", {}, title),
        el("dl", {}, ...known.map(([name, value, tip]) =>
          el("div", {}, el("dt", {}, name), el("dd", { title: tip }, value)))));
    };
    const figure = (name, value, show, unit) =>
      [name, value === null ? null : show(value), exact(value, unit)];
    const distance = (name, d) => [name, d === null ? null : el("span", {}, threeDigits(d),
      s.diagonal > 0 ? el("small", {}, " " + threeDigits(100 * d / s.diagonal) + " %") : null),
    exact(d, "in the file's units") + (s.diagonal > 0 ? ", " + exact(100 * d / s.diagonal) +
      " % of the diagonal" : "")];
    const file = (address, words) => el("a", { href: address }, words);
    const files = [
      ...s.outputs.map((o) => (Array.isArray(o) ? file(o[1], o[0]) : file(linkTo(o), o))),
      s.has_report ? file(s.folder + "report.json", "report.json") : null,
      s.has_log ? file(s.link + ".log", "log") : null].filter((f) => f !== null);
    return [
      s.sentence && s.status !== "done" ? el("p.why", {}, s.sentence) : null,
      s.warnings.length > 0 ? el("section", {},
        el("h3", {}, plural(s.warnings.length, "warning")),
        el("ul.warnings", {}, ...s.warnings.map((w) => el("li", {}, w)))) : null,
      facts("Remesh", [
        figure("Faces", s.faces, people, "faces"),
        s.target_faces === null ? ["", null] : ["Asked for", people(Math.round(s.target_faces)) +
          (s.target_met === false ? " (missed)" : ""), exact(s.target_faces, "faces")],
        ["Quads", s.quad_share === null ? null : percent(s.quad_share, 1) + " %",
          exact(s.quads, "quads")],
        figure("Irregular vertices", s.irregular, people),
        figure("Singular triangles", s.singularities, people),
        figure("Stretch", s.stretch, (v) => fixed(v, 3)),
        figure("Shear", s.shear, (v) => fixed(v, 3)),
        figure("Mean scaled Jacobian", s.jacobian, (v) => fixed(v, 3)),
        figure("Output", s.output_bytes, bytes, "bytes")]),
      facts("Distance", [
        distance("To the scan, max", s.to_max), distance("To the scan, rms", s.to_rms),
        distance("From the scan, max", s.from_max), distance("From the scan, rms", s.from_rms),
        figure("Diagonal of the scan", s.diagonal, threeDigits, "in the file's units")]),
      facts("Scan", [
        figure("Triangles", s.triangles, people, "triangles"),
        figure("Vertices", s.vertices, people, "vertices"),
        ...s.repairs.map(([name, n]) => [name.replace(/_/g, " "), people(n), exact(n)]),
        ["File", s.scan || null, s.scan]]),
      facts("Run", [
        figure("Time", s.seconds, duration, "s"),
        figure("Processor time", s.cpu_seconds, duration, "s"),
        ["Speed", s.rate === null ? null : people(s.rate) + " triangles/s",
          exact(s.rate, "triangles/s")],
        figure("Peak memory", s.peak_rss, bytes, "bytes"),
        ["Attempts", s.attempts > 0 ? String(s.attempts) : null],
        ["Began", s.started === null ? null : dateTime(s.started)],
        ["Ended", s.ended === null ? null : dateTime(s.ended)],
        ["Exit code", s.exit === null ? null : String(s.exit)],
        ["Host", s.host], ["Slurm task", s.slurm],
        ["Options", s.options || "default"]]),
      files.length > 0 ? el("section", {}, el("h3", {}, "Files"),
        el("ul.files", {}, ...files.map((f) => el("li", {}, f)))) : null,
    ].filter((part) => part !== null);
  }
}
