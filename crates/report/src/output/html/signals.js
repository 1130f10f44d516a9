"use strict";
// Reads values out of the buckets that the page carries, and draws an interval of them over the picture.
const { begin, end, left, right, width, tasks, signals, panes } =
  JSON.parse(document.getElementById("data").textContent);
const [figure, cursor, chosen, all, time] =
  ["figure", "#cursor", "#chosen", "#all", "#time"].map(it => document.querySelector(it));
const picture = figure.querySelector("svg");
const rows = [...document.querySelectorAll("tbody tr")].map(row => row.querySelectorAll("td"));
const shortest = Math.min(...signals.map(it => tasks[it.task].period));
// The interval that is drawn, and where a drag began.
let view = { begin, end }, from = null, zoomed = null;

const number = value => Number(value.toPrecision(9)).toString();
const shown = {
  BOOL: value => value ? "TRUE" : "FALSE",
  WORD: value => "16#" + value.toString(16).toUpperCase().padStart(4, "0"),
};

function show(bucket, { type, unit }) {
  if (bucket === undefined) return "";
  if (bucket === null) return "NaN or infinite";
  const [low, high, odd] = [bucket].flat();
  const text = shown[type] ?? number;
  const values = (high ?? low) === low ? text(low) : `${text(low)} … ${text(high)}`;
  return values + (unit && ` ${unit}`) + (odd ? ", and NaN or infinite" : "");
}

// The bucket of an instant: its number, and its first and last row.
function bucketAt(task, at) {
  const bucket = Math.floor((at - task.begin) / task.period / task.rowsPerBucket + 1e-9);
  const first = bucket * task.rowsPerBucket;
  return { bucket, first, last: Math.min(first + task.rowsPerBucket, task.rows) - 1 };
}

const range = (first, last, text) => last > first ? `${text(first)} … ${text(last)}` : text(first);

// The instant under the pointer, within the picture; null beside it.
function instant(event, isClamped) {
  const box = picture.getBoundingClientRect();
  const part = ((event.clientX - box.left) / box.width * width - left) / (right - left);
  if (!isClamped && (part < 0 || part >= 1)) return null;
  return view.begin + Math.min(Math.max(part, 0), 1) * (view.end - view.begin);
}

const column = at => left + (at - view.begin) / (view.end - view.begin) * (right - left);

function place(element, at, until = at) {
  const box = picture.getBoundingClientRect(), scale = box.width / width;
  element.style.left = `${box.left - figure.getBoundingClientRect().left - figure.clientLeft + column(at) * scale}px`;
  element.style.width = `${Math.max((column(until) - column(at)) * scale, 1)}px`;
  element.hidden = false;
}

function read(at) {
  const fastest = signals.map(it => tasks[it.task]).find(it => it.period === shortest);
  const { first, last } = bucketAt(fastest, at);
  time.textContent = range(first, last, row => `${number(fastest.begin + row * fastest.period)} s`);
  signals.forEach((signal, index) => {
    const { bucket, first, last } = bucketAt(tasks[signal.task], at);
    const [value, cycle] = rows[index];
    value.textContent = show(signal.buckets[bucket], signal);
    cycle.textContent = signal.buckets[bucket] === undefined ? "" : range(first, last, String);
  });
  place(cursor, at);
}

function element(name, attributes, text = "") {
  const made = zoomed.appendChild(document.createElementNS("http://www.w3.org/2000/svg", name));
  Object.entries(attributes).forEach(([key, value]) => made.setAttribute(key, value));
  made.textContent = text;
}

// Labels at round numbers, as the picture has them.
function timeLabels() {
  const span = view.end - view.begin, least = span / ((right - left) / 80), power = 10 ** Math.floor(Math.log10(least));
  const step = [1, 2, 5, 10].map(it => it * power).find(it => it >= least * (1 - 1e-9));
  const largest = Math.max(Math.abs(view.begin), Math.abs(view.end));
  const fits = ([, size]) => step < size * 1e3 && largest / size < 1e4;
  const [unit, size] = [["ns", 1e-9], ["us", 1e-6], ["ms", 1e-3]].find(fits) ?? ["s", 1];
  const decimals = Math.min(Math.max(Math.ceil(-Math.log10(step / size) - 1e-9), 0), 9);
  const labels = [];
  for (let index = Math.ceil(view.begin / step - 1e-6); index * step <= view.end + step * 1e-6; index++) {
    labels.push([index * step, (index * step / size + 0).toFixed(decimals)]);
  }
  return { unit, labels };
}

function drawTrace({ high, low, axis, levels }, { signal, colour, dash }, bar) {
  const { task, buckets } = signals[signal], { begin, period, rowsPerBucket, rows } = tasks[task];
  const y = value => {
    const [first, last] = levels ? [0, axis.length - 1] : axis;
    const part = last > first ? ((levels ? axis.indexOf(value) : value) - first) / (last - first) : 0.5;
    return (low - part * (low - high)).toFixed(1);
  };
  const { bucket: first } = bucketAt({ begin, period, rowsPerBucket, rows }, view.begin);
  let path = "", before = null;
  for (let index = Math.max(first, 0); index < buckets.length; index++) {
    const at = begin + index * rowsPerBucket * period;
    if (at >= view.end) break;
    const until = begin + Math.min((index + 1) * rowsPerBucket, rows) * period;
    if (until <= view.begin + period * 1e-6) continue;
    const [x, end] = [at, until].map(it => Math.min(Math.max(column(it), left), right).toFixed(1));
    const bucket = buckets[index];
    if (bucket === null || bucket[2]) {
      const width = Math.min(Math.max(end - x, 4), right - x);
      element("rect", { x, y: bar, width, height: 4, fill: colour, "shape-rendering": "crispEdges" });
    }
    if (bucket === null) { before = null; continue; }
    const ends = [bucket].flat().slice(0, 2).map(y);
    if (before !== null && Math.abs(ends.at(-1) - before) < Math.abs(ends[0] - before)) ends.reverse();
    path += `${before === null ? "M" : "L"}${x} ${ends[0]}V${ends.at(-1)}H${end}`;
    before = ends.at(-1);
  }
  element("path", { d: path, fill: "none", stroke: colour, "stroke-width": 2, "stroke-dasharray": dash });
}

// Draws the interval over the picture, whose axes of values stay.
function draw() {
  zoomed?.remove();
  zoomed = null;
  cursor.hidden = true;
  all.disabled = view.begin === begin && view.end === end;
  if (all.disabled) return;
  zoomed = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  zoomed.setAttribute("viewBox", picture.getAttribute("viewBox"));
  zoomed.setAttribute("class", "zoomed");
  cursor.before(zoomed);
  const bottom = panes.at(-1).bottom, { unit, labels } = timeLabels();
  element("rect", { x: 0, y: bottom + 1, width, height: 44, fill: "#fff" });
  element("text", { x: (left + right) / 2, y: bottom + 35, class: "label" }, `time in ${unit}`);
  labels.forEach(([at, says]) => element("text", { x: column(at), y: bottom + 18, class: "label" }, says));
  for (const pane of panes) {
    const { top, bottom } = pane;
    element("rect", { x: left - 2, y: top - 1, width: right - left + 4, height: bottom - top + 5, fill: "#fff" });
    labels.forEach(([at]) => element("path", { d: `M${column(at)} ${top}V${bottom}`, stroke: "#e4e4e4" }));
    pane.grid.forEach(y => element("path", { d: `M${left} ${y}H${right}`, stroke: "#e4e4e4" }));
    let bar = top;
    for (const trace of pane.traces) {
      drawTrace(pane, trace, bar);
      bar += signals[trace.signal].buckets.some(it => it === null || it[2]) ? 4 : 0;
    }
    element("path", { d: `M${left} ${top}V${bottom}H${right}`, fill: "none", stroke: "#969696", class: "frame" });
  }
}

figure.addEventListener("pointerdown", event => {
  from = event.button === 0 ? instant(event) : null;
  if (from === null) return;
  figure.setPointerCapture(event.pointerId);
  read(from);
});
figure.addEventListener("pointermove", event => {
  const at = instant(event, from !== null);
  if (at === null) return;
  read(Math.min(at, view.end - (view.end - view.begin) * 1e-6));
  if (from !== null) place(chosen, Math.min(from, at), Math.max(from, at));
});
figure.addEventListener("pointerup", event => {
  const at = instant(event, true);
  chosen.hidden = true;
  if (from !== null && Math.abs(column(at) - column(from)) > 8) {
    // No closer than a few cycles.
    const half = Math.max(Math.abs(at - from), 4 * shortest) / 2, middle = (at + from) / 2;
    view = { begin: Math.max(middle - half, begin), end: Math.min(middle + half, end) };
    draw();
  }
  from = null;
});
figure.addEventListener("pointercancel", () => { from = null; chosen.hidden = true; });
function showAll() {
  view = { begin, end };
  draw();
}
figure.addEventListener("dblclick", showAll);
all.addEventListener("click", showAll);
