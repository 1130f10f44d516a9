// Making and changing elements. Texts of the node become text, never markup.

export const byId = id => document.getElementById(id);

/** An element with properties and children; texts are text. */
export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name in element) element[name] = value;
    else element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

/** Changes a text only if it is another: what is selected stays selected. */
export function write(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** A long name that keeps its end, that of the block and the pin, which say more than its middle. */
export function ends(name) {
  const [SHORT, LONGEST, END, OF_BLOCK] = [20, 24, 16, 8];
  const dot = name.lastIndexOf(".");
  // Blocks of one kind differ in the last letters of their names.
  const pin = dot > 0 && name.length - dot <= LONGEST ? Math.max(0, dot - OF_BLOCK) : name.length - END;
  const cut = name.length > SHORT ? pin : name.length;
  const whole = make("span", { className: "ends", title: name });
  whole.append(make("span", {}, name.slice(0, cut)), make("span", {}, name.slice(cut)));
  return whole;
}

/** A number with at most six digits. */
export function number(value) {
  if (value === null || value === undefined) return "–";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-4 || size >= 1e9)) return value.toExponential(4).replace(/\.?0+e/, "e");
  return String(Number(value.toPrecision(6)));
}

/** The unit behind a value of a signal; times are written with their own. */
export function unitOf(signal) {
  return signal.type === "TIME" || signal.role === "age" ? "" : signal.unit ?? "";
}

/** A time in ns with three digits and its unit. */
export function duration(ns) {
  if (ns === null || ns === undefined) return "–";
  for (const [size, unit] of [[1e9, "s"], [1e6, "ms"], [1e3, "us"]]) {
    if (ns >= size * 0.9995) {
      const value = ns / size;
      return `${value.toFixed(value < 9.995 ? 2 : value < 99.95 ? 1 : 0)} ${unit}`;
    }
  }
  return `${Math.round(ns)} ns`;
}

/** A period in ns, without digits that say nothing. */
export const period = ns => duration(ns).replace(/(\.\d*?)0+ /, "$1 ").replace(". ", " ");

/** The time of day. */
export const clock = () => new Date().toTimeString().slice(0, 8);

/** Seconds as days, hours, minutes and seconds; the two greatest of them. */
export function span(seconds) {
  const parts = [[86400, "d"], [3600, "h"], [60, "min"], [1, "s"]];
  let rest = Math.max(0, Math.floor(seconds));
  const words = [];
  for (const [size, unit] of parts) {
    const count = Math.floor(rest / size);
    rest -= count * size;
    if (count > 0 || (unit === "s" && words.length === 0)) words.push(`${count} ${unit}`);
  }
  return words.slice(0, 2).join(" ");
}

/** A colour of the page, which differs between light and dark. */
export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/** The context of a canvas in CSS pixels, and its size; nothing while it is not shown. */
export function sheet(canvas) {
  const { width, height } = canvas.getBoundingClientRect();
  if (width === 0 || height === 0) return null;
  const ratio = window.devicePixelRatio || 1;
  const [w, h] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== w || canvas.height !== h) [canvas.width, canvas.height] = [w, h];
  const context = canvas.getContext("2d");
  context.setTransform(w / width, 0, 0, h / height, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = "11px system-ui, sans-serif";
  context.lineWidth = 1;
  return { context, width, height };
}
