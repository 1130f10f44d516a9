// The strips of the chosen signals.

import { byId, clock, ends, make, number, unitOf, write } from "./document.js";
import { BROKEN, MISSED, Scale, draw, firstShown, range } from "./chart.js";

// What a page may show, and what is kept of a curve.
export const MOST = 16;
const KEPT = 1900;

export class Curves {
  /** `changed` is called when other signals are chosen. */
  constructor(changed) {
    this.changed = changed;
    this.strips = new Map();
    this.isLive = false;
    this.now = 0;
    this.seconds = 30;
    this.refused = {};
    // When the picture was stopped, by the button or with the connection; null: it goes on.
    [this.pausedAt, this.lostAt] = [null, null];
    byId("span").addEventListener("change", event => {
      this.seconds = Number(event.target.value);
      this.redraw();
    });
    byId("pause").addEventListener("click", event => {
      this.pausedAt = this.pausedAt ? null : this.lostAt ?? clock();
      const isPaused = this.pausedAt !== null;
      for (const strip of this.strips.values()) strip.frozen = isPaused ? [...strip.intervals] : null;
      event.target.setAttribute("aria-pressed", String(isPaused));
      write(event.target, isPaused ? "Go on" : "Pause");
      this.redraw();
    });
    window.addEventListener("resize", () => this.redraw());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
  }

  names() {
    return [...this.strips.keys()];
  }

  has(name) {
    return this.strips.has(name);
  }

  /** Adds a signal or removes it; whether it could. */
  toggle(signal, isShown) {
    if (isShown === this.has(signal.name)) return true;
    if (isShown && this.strips.size >= MOST) return false;
    if (isShown) this.add(signal);
    else this.remove(signal.name);
    this.changed();
    return true;
  }

  add(signal) {
    const canvas = make("canvas", { role: "img" });
    canvas.setAttribute("aria-label", `curve of ${signal.name}`);
    const value = make("output");
    const shown = make("span", { className: "range quiet" });
    const why = make("p", { className: "bad", hidden: true });
    const close = make("button", { type: "button", title: "remove this curve" }, "×");
    close.setAttribute("aria-label", `remove the curve of ${signal.name}`);
    close.addEventListener("click", () => this.toggle(signal, false));
    const label = make("span", { className: "label" }, ends(signal.name));
    const head = make("div", { className: "head" }, label, shown, value, close);
    const element = make("div", { className: "strip" }, head, canvas, why);
    const strip = { signal, element, canvas, value, shown, why, intervals: [], scale: new Scale(signal.type === "BOOL") };
    this.strips.set(signal.name, strip);
    byId("strips").append(element);
    this.arrange();
  }

  remove(name) {
    this.strips.get(name)?.element.remove();
    this.strips.delete(name);
    this.arrange();
  }

  /** Only the lowest strip has the axis of time. */
  arrange() {
    const strips = [...this.strips.values()];
    strips.forEach((strip, at) => strip.canvas.classList.toggle("last", at === strips.length - 1));
    byId("no-curves").hidden = strips.length > 0;
    this.redraw();
  }

  /** The node has these signals now: strips of those that are gone end. */
  keep(signals) {
    for (const [name, strip] of [...this.strips]) {
      const signal = signals.get(name);
      if (!signal || signal.type !== strip.signal.type) this.remove(name);
    }
  }

  /** A connection begins: what was drawn comes again. */
  begin() {
    this.lostAt = null;
    for (const strip of this.strips.values()) strip.intervals = [];
  }

  /** The connection is lost: the picture stands. */
  lose() {
    this.isLive = false;
    this.lostAt = clock();
    this.redraw();
  }

  take({ now, curves }) {
    for (const [name, intervals] of Object.entries(curves)) {
      const strip = this.strips.get(name);
      if (!strip) continue;
      strip.intervals.push(...intervals);
      if (strip.intervals.length > KEPT) strip.intervals.splice(0, strip.intervals.length - KEPT);
    }
    if (this.pausedAt) return;
    this.now = now;
    this.redraw();
  }

  /** Why some signals have no curve, by name. */
  refuse(refused) {
    this.refused = refused;
    for (const [name, strip] of this.strips) {
      strip.why.hidden = !refused[name];
      write(strip.why, refused[name] ?? "");
    }
  }

  /** The newest values, as the table has them. */
  tell(lines) {
    for (const [name, strip] of this.strips) {
      const line = lines.get(name);
      write(strip.value, `${line?.marks ?? ""} ${line?.value ?? "–"} ${unitOf(strip.signal)}`.trim());
      strip.value.className = /[!?]/.test(line?.marks ?? "") ? "bad" : line?.marks ? "forced" : "";
    }
  }

  redraw() {
    if (this.isDue) return;
    this.isDue = true;
    requestAnimationFrame(() => {
      this.isDue = false;
      if (this.now === 0) return;
      for (const { canvas, intervals: newest, frozen, scale, shown, signal } of this.strips.values()) {
        const intervals = frozen ?? newest;
        const axis = canvas.classList.contains("last") ? this.pausedAt ?? this.lostAt ?? "now" : "";
        draw(canvas, { intervals, now: this.now, seconds: this.seconds, scale, axis, isLive: this.isLive });
        const [least, greatest, flags] = range(intervals, firstShown(this.now, this.seconds));
        const isShown = least <= greatest && signal.type !== "BOOL";
        const said = [flags & MISSED ? "cycles missed" : "", flags & BROKEN ? "cycles not received" : "",
          isShown ? `min ${number(least)} · max ${number(greatest)}` : ""];
        write(shown, said.filter(Boolean).join(" · "));
      }
    });
  }
}
