// Tasks, the jitter of their releases, and its histogram.

import { byId, colour, duration, make, period, sheet, write } from "./document.js";

const LEFT = 6;
const RIGHT = 6;
const TOP = 12;
const AXIS = 18;

export class Tasks {
  constructor() {
    this.cards = new Map();
    this.jitter = { tasks: {}, first_class: 100, classes_per_decade: 10 };
    window.addEventListener("resize", () => this.redraw());
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.redraw());
  }

  /** The tasks as the node describes them. */
  describe(tasks, isThere) {
    this.isThere = isThere;
    for (const name of [...this.cards.keys()]) {
      if (tasks.some(task => task.name === name)) continue;
      this.cards.get(name).element.remove();
      this.cards.delete(name);
    }
    for (const task of tasks) {
      const card = this.cards.get(task.name) ?? this.card(task.name);
      const facts = [`every ${period(task.period_ns)}`, `cycle ${task.last_cycle ?? "–"} · `];
      write(card.facts, isThere ? facts.join(" · ") : facts[0]);
      for (const what of ["missed", "overruns"]) {
        write(card[what], isThere ? `${what} ${task[what]}` : "");
        card[what].className = task[what] > 0 ? "bad count" : "quiet count";
      }
      const stands = isThere && task.stands_ns ? ` stands for ${Math.floor(task.stands_ns / 1e9)} s` : "";
      write(card.stands, stands);
    }
  }

  card(name) {
    const facts = make("span", { className: "quiet" });
    const [missed, overruns] = [make("span"), make("span")];
    const stands = make("b", { className: "bad" });
    const canvas = make("canvas", { role: "img" });
    canvas.setAttribute("aria-label", `histogram of the release jitter of ${name}`);
    const cells = {};
    const row = (key, label) => {
      cells[key] = ["p50", "p99", "max", "count"].map(() => make("td", {}, "–"));
      return make("tr", {}, make("th", { scope: "row" }, label), ...cells[key]);
    };
    const heading = ["release jitter", "p50", "p99", "max", "cycles"].map(text => make("th", { scope: "col" }, text));
    const table = make("table", {}, make("thead", {}, make("tr", {}, ...heading)),
      make("tbody", {}, row("second", "last second"), row("all", "all seen")));
    const note = make("p", { className: "quiet" });
    const element = make("div", { className: "task" }, make("h3", {}, name), facts, missed, " ", overruns, stands, table, canvas, note);
    const card = { element, facts, missed, overruns, stands, canvas, cells, note };
    this.cards.set(name, card);
    byId("task-list").append(element);
    return card;
  }

  take(jitter) {
    this.jitter = jitter;
    for (const [name, shown] of Object.entries(jitter.tasks)) {
      const card = this.cards.get(name);
      if (!card) continue;
      for (const key of ["second", "all"]) {
        const [p50, p99, max, count] = card.cells[key];
        write(p50, duration(shown[key].p50));
        write(p99, duration(shown[key].p99));
        write(max, duration(shown[key].max));
        write(count, String(shown[key].count));
      }
      write(card.note, shown.every_cycle || !this.isThere ? "" : "Some cycles only: telemetry shows at most 50 a second.");
      card.canvas.setAttribute("aria-label", `histogram of the release jitter of ${name}: p50 ${duration(shown.all.p50)}, ` +
        `p99 ${duration(shown.all.p99)}, max ${duration(shown.all.max)}`);
    }
    this.redraw();
  }

  redraw() {
    requestAnimationFrame(() => {
      const { tasks, first_class: first, classes_per_decade: perDecade } = this.jitter;
      for (const [name, { canvas }] of this.cards) {
        if (tasks[name]?.classes?.length) drawHistogram(canvas, tasks[name].classes, first, perDecade);
      }
    });
  }
}

/** Bars over a logarithmic axis of times; their heights are logarithmic, too, so that one late cycle of a million shows. */
function drawHistogram(canvas, classes, first, perDecade) {
  const area = sheet(canvas);
  if (!area) return;
  const { context, width, height } = area;
  const bottom = height - AXIS;
  const most = Math.max(1, ...classes);
  const decades = Math.max(1, Math.ceil(Math.log10(most)));
  const x = at => LEFT + (width - LEFT - RIGHT) * at / classes.length;
  const y = count => bottom - (bottom - TOP) * (Math.log10(count) + 0.25) / (decades + 0.25);
  context.strokeStyle = colour("--faint");
  context.fillStyle = colour("--quiet");
  context.textBaseline = "top";
  context.beginPath();
  for (let at = 0; at <= classes.length; at += perDecade) {
    const place = Math.round(x(at)) + 0.5;
    context.moveTo(place, TOP);
    context.lineTo(place, bottom);
    // Where there is no room for all, every second one.
    if (width * perDecade / classes.length < 48 && (at / perDecade) % 2 === 1) continue;
    const text = period(first * 10 ** (at / perDecade));
    context.textAlign = at === 0 ? "left" : at === classes.length ? "right" : "center";
    context.fillText(text, at === 0 ? 0 : at === classes.length ? width : place, bottom + 5);
  }
  for (let power = 0; power <= decades; power++) {
    const place = Math.round(y(10 ** power)) + 0.5;
    context.moveTo(LEFT, place);
    context.lineTo(width - RIGHT, place);
  }
  context.stroke();
  context.textAlign = "right";
  context.textBaseline = "bottom";
  context.fillText(`${(10 ** decades).toLocaleString("en")} cycles`, width - RIGHT, y(10 ** decades));
  context.fillStyle = colour("--bar");
  classes.forEach((count, at) => {
    if (count > 0) context.fillRect(x(at) + 0.5, y(count), Math.max(1, x(at + 1) - x(at) - 1), bottom - y(count));
  });
}
