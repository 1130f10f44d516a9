// The table of signals: of thousands, only those that are in sight are in the document, and asked for.

import { byId, ends, make, unitOf, write } from "./document.js";

// Lines above and below those in sight, and most of them altogether.
const BEYOND = 4;
const MOST = 100;

export class Table {
  /** `looked` is called when other signals are in sight, `chosen` with one that is clicked, `plotted` with one that
   * is ticked or not; the latter says whether it can be. */
  constructor({ looked, chosen, plotted }) {
    Object.assign(this, { looked, chosen, plotted });
    this.signals = [];
    this.listed = [];
    this.rows = new Map();
    this.lines = new Map();
    this.isShown = () => false;
    this.box = byId("box");
    this.body = byId("table").tBodies[0];
    this.above = this.space();
    this.below = this.space();
    this.body.append(this.above, this.below);
    this.box.addEventListener("scroll", () => this.arrange());
    window.addEventListener("resize", () => this.arrange());
    byId("search").addEventListener("input", () => this.list(true));
    byId("role").addEventListener("change", () => this.list(true));
  }

  space() {
    const row = make("tr", { className: "space" }, make("td"));
    row.setAttribute("aria-hidden", "true");
    return row;
  }

  set(signals) {
    this.signals = signals;
    for (const row of this.rows.values()) row.remove();
    this.rows.clear();
    // What is known of signals that stay is not told again.
    const names = new Set(signals.map(signal => signal.name));
    for (const name of [...this.lines.keys()]) if (!names.has(name)) this.lines.delete(name);
    this.list(false);
  }

  /** Lists the signals that are searched for. */
  list(fromTop) {
    const words = byId("search").value.toLowerCase().split(/\s+/).filter(Boolean);
    const roles = byId("role").value.split(" ").filter(Boolean);
    this.listed = this.signals.filter(signal => {
      const name = signal.name.toLowerCase();
      return words.every(word => name.includes(word)) && (roles.length === 0 || roles.includes(signal.role));
    });
    const [listed, all] = [this.listed.length, this.signals.length];
    write(byId("count"), listed === all ? `${all} signals` : `${listed} of ${all}`);
    if (fromTop) this.box.scrollTop = 0;
    this.arrange();
  }

  /** Puts the lines in sight into the document. */
  arrange() {
    const height = this.body.querySelector("tr.signal")?.getBoundingClientRect().height || 28;
    const count = Math.min(MOST, Math.ceil(this.box.clientHeight / height) + 2 * BEYOND);
    const first = Math.max(0, Math.min(Math.floor(this.box.scrollTop / height) - BEYOND, this.listed.length - count));
    const shown = this.listed.slice(first, first + count);
    const names = new Set(shown.map(signal => signal.name));
    for (const [name, row] of this.rows) {
      if (names.has(name)) continue;
      row.remove();
      this.rows.delete(name);
    }
    let before = this.above;
    for (const signal of shown) {
      let row = this.rows.get(signal.name);
      if (!row) {
        row = this.row(signal);
        this.rows.set(signal.name, row);
      }
      if (before.nextSibling !== row) before.after(row);
      before = row;
      this.fill(signal.name);
    }
    const rest = Math.max(0, this.listed.length - first - shown.length);
    this.above.firstChild.style.height = `${first * height}px`;
    this.below.firstChild.style.height = `${rest * height}px`;
    this.inSight = [...names];
    this.looked();
  }

  row(signal) {
    const plot = make("input", { type: "checkbox", checked: this.isShown(signal.name) });
    plot.setAttribute("aria-label", `curve of ${signal.name}`);
    plot.addEventListener("change", () => {
      if (!this.plotted(signal, plot.checked)) plot.checked = !plot.checked;
    });
    const name = make("button", { type: "button" }, ends(signal.name));
    name.addEventListener("click", () => this.chosen(signal));
    const unit = unitOf(signal);
    const cell = (kind, ...content) => make("td", { className: kind, role: "cell" }, ...content);
    const row = make("tr", { className: "signal", role: "row" }, cell("plot", plot), cell("marks"), cell("name", name), cell("value", "–"),
      cell("unit", unit), cell("worth"), cell("role", signal.role), cell("type", signal.type));
    row.children[4].title = unit;
    row.signal = signal;
    return row;
  }

  /** Values that are new, by name. */
  take(lines) {
    for (const [name, line] of Object.entries(lines)) {
      this.lines.set(name, line);
      this.fill(name);
    }
  }

  /** No value is known any more. */
  forget() {
    this.lines.clear();
    for (const name of this.rows.keys()) this.fill(name);
  }

  fill(name) {
    const row = this.rows.get(name);
    if (!row) return;
    const line = this.lines.get(name);
    const [plot, marks, , value, , worth] = row.children;
    plot.firstChild.checked = this.isShown(name);
    write(marks, line?.marks ?? "");
    write(value, line?.value ?? "–");
    value.title = line?.value ?? line?.why ?? "";
    const words = [];
    if (row.signal.role === "input" && line?.value) words.push(/!/.test(line.marks) ? "not ok" : "ok");
    if (line?.age) words.push(line.age);
    if (line?.why) words.push(line.why);
    words.push(...(line?.flags ?? []).filter(flag => flag !== "FORCED" || !/F/.test(line.marks)));
    write(worth, words.join(" "));
    worth.title = words.join(" ");
    const kind = /[!?]/.test(line?.marks ?? "") ? "bad" : line?.marks ? "forced" : "";
    for (const cell of [marks, value, worth]) {
      cell.classList.toggle("bad", kind === "bad");
      cell.classList.toggle("forced", kind === "forced");
    }
  }

  /** Marks the chosen signal. */
  mark(name) {
    for (const [of, row] of this.rows) row.classList.toggle("chosen", of === name);
  }
}
