// The table of scans: only the rows in sight are in the page, whatever their number.

class ScanTable {
  constructor(box, open) {
    this.box = box;
    this.open = open;
    this.list = [];
    this.sortBy = columns[0];
    this.descending = false;
    this.onsort = () => {};
    this.headers = columns.map((column) => this.header(column));
    this.before = el("tbody", { "aria-hidden": "true" });
    this.body = el("tbody");
    this.after = el("tbody", { "aria-hidden": "true" });
    this.table = el("table", { "aria-colcount": columns.length },
      el("caption.unseen", {}, "Scans of the batch. Activate a column's head to sort by it, a " +
        "scan's name for its figures and its 3D view."),
      el("colgroup", {}, ...columns.map((c) => el("col", { style: `width:${c.width}px` }))),
      el("thead", {}, el("tr", { "aria-rowindex": 1 }, ...this.headers)),
      this.before, this.body, this.after);
    this.table.style.minWidth = columns.reduce((sum, c) => sum + c.width, 0) + "px";
    box.replaceChildren(this.table);
    box.addEventListener("scroll", () => this.draw(), { passive: true });
    new ResizeObserver(() => this.draw(this.rowHeight() !== this.height)).observe(box);
    box.addEventListener("keydown", (event) => this.key(event));
    this.body.addEventListener("click", (event) => {
      const row = event.target.closest("tr[data-place]");
      if (row && !event.target.closest("button, a") && String(getSelection()) === "") {
        this.open(scans[Number(row.dataset.place)]);
      }
    });
    window.addEventListener("beforeprint", () => this.draw(true, true));
    window.addEventListener("afterprint", () => this.draw(true));
  }

  header(column) {
    const button = el("button", { type: "button", title: column.about,
      onclick: () => this.sort(column, this.sortBy === column ? !this.descending : column.numeric) },
      el("span", {}, column.title, column.sub ? el("small", {}, column.sub) : null));
    return el("th" + (column.numeric ? ".number" : ""), { scope: "col", "data-key": column.key },
      button);
  }

  sort(column, descending) {
    this.sortBy = column;
    this.descending = descending;
    this.onsort();
  }

  show(list) {
    this.list = list;
    this.headers.forEach((th, k) => {
      if (columns[k] === this.sortBy) {
        th.setAttribute("aria-sort", this.descending ? "descending" : "ascending");
      } else {
        th.removeAttribute("aria-sort");
      }
    });
    this.table.setAttribute("aria-rowcount", list.length + 1);
    this.box.scrollTop = 0;
    this.draw(true);
  }

  rowHeight() {
    return Number.parseFloat(getComputedStyle(this.box).getPropertyValue("--row")) || 64;
  }

  draw(anew, all) {
    const height = this.rowHeight();
    const kMostPrinted = 3000;
    const spare = 8;
    let first = Math.max(0, Math.floor(this.box.scrollTop / height) - spare);
    let end = Math.min(this.list.length,
      Math.ceil((this.box.scrollTop + this.box.clientHeight) / height) + spare);
    first = Math.min(first, end);
    if (all) {
      first = 0;
      end = Math.min(this.list.length, kMostPrinted);
    }
    if (!anew && first === this.first && end === this.end) return;
    const kept = new Map();
    if (!anew) {
      for (const row of this.body.children) kept.set(Number(row.ariaRowIndex) - 2, row);
    }
    const focused = document.activeElement && this.body.contains(document.activeElement)
      ? document.activeElement.closest("tr").dataset.place : null;
    const rows = [];
    for (let i = first; i < end; ++i) rows.push(kept.get(i) || this.row(i));
    this.body.replaceChildren(...rows);
    this.first = first;
    this.height = height;
    this.end = end;
    const space = (n) => (n > 0 ? [el("tr", {}, el("td", { colspan: columns.length,
      style: `height:${n * height}px` }))] : []);
    this.before.replaceChildren(...space(all ? 0 : first));
    this.after.replaceChildren(...space(all ? 0 : this.list.length - end));
    if (focused !== null) {
      const again = this.body.querySelector(`tr[data-place="${focused}"] .name`);
      if (again && document.activeElement !== again) again.focus({ preventScroll: true });
    }
  }

  row(i) {
    const scan = this.list[i];
    // The reason takes the room of the figures that there are none of.
    const reason = scan.sentence && scan.status !== "done" && scan.triangles === null;
    const span = columns.findIndex((c) => c.key === "seconds") - 2;
    const cells = columns.map((column, k) => {
      if (reason && k === 2) {
        return el("td.reason", { colspan: span, title: scan.sentence }, el("span", {}, scan.reason));
      }
      if (reason && k > 2 && k < 2 + span) return "";
      if (column.key === "name") return this.nameCell(scan);
      if (column.key === "status") {
        return el("td", {}, el("span.status." + scan.status, {}, column.text(scan)));
      }
      const value = column.value(scan);
      const kind = value === null ? ".none" :
        value > 0 && (column.key === "warnings" || column.key === "repairs") ? ".mark" : "";
      return el("td.number" + kind, { title: column.tip(scan), "data-key": column.key },
        column.text(scan));
    });
    return el("tr", { "aria-rowindex": i + 2, "data-place": scan.place,
      class: kFailed.has(scan.status) ? "failed" : null }, ...cells);
  }

  nameCell(scan) {
    const picture = scan.thumbnails.length > 0
      ? el("button.picture", { type: "button", tabindex: "-1", onclick: () => this.open(scan),
        title: scan.viewers.length > 0 ? "3D view" : "Figures",
        "aria-label": "3D view of " + scan.id },
        el("img", { src: scan.folder + linkTo(scan.thumbnails[0]), alt: "", loading: "lazy",
          decoding: "async", width: 76, height: 57 }))
      : el("span.picture.empty." + scan.status, { "aria-hidden": "true" });
    const line = scan.parent ? el("span.parent", { title: scan.parent }, scan.parent) : null;
    return el("th.scan", { scope: "row" }, el("div", {}, picture,
      el("div.words", {},
        el("button.name", { type: "button", title: scan.id, onclick: () => this.open(scan) },
          scan.name),
        line)));
  }

  key(event) {
    const row = event.target.closest("tbody tr[data-place]");
    const step = { ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10 }[event.key];
    if (!row || !step) return;
    event.preventDefault();
    const i = Math.min(Math.max(Number(row.ariaRowIndex) - 2 + step, 0), this.list.length - 1);
    this.reveal(i);
    const name = this.body.querySelector(`tr[aria-rowindex="${i + 2}"] .name`);
    if (name) name.focus({ preventScroll: true });
  }

  /** Scrolls so that a row is in sight below the head. */
  reveal(i) {
    const height = this.rowHeight();
    const head = this.table.tHead.offsetHeight;
    const top = i * height;
    const low = this.box.clientHeight - head - height;
    if (top < this.box.scrollTop) this.box.scrollTop = top;
    if (top > this.box.scrollTop + low) this.box.scrollTop = top - low;
    this.draw();
  }
}
