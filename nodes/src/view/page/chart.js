// A curve on a canvas: for each interval the line from its least to its greatest value.

import { colour, number, sheet } from "./document.js";

const INTERVALS_PER_SECOND = 30;
const LEFT = 62;
const RIGHT = 6;
const TOP = 6;
const BOTTOM = 6;
const AXIS = 18;
// The newest intervals are still on their way.
const DELAY = 4;

export const BROKEN = 1;
const UNBOUNDED = 2;
export const MISSED = 4;

/** The value range that is drawn. It grows at once and shrinks late, so that the picture does not jump. */
export class Scale {
  constructor(isBinary) {
    this.isBinary = isBinary;
    this.low = null;
  }

  fit(least, greatest) {
    if (this.isBinary) [this.low, this.high] = [-0.15, 1.15];
    if (this.isBinary || least > greatest) return;
    const isOutside = this.low === null || least < this.low || greatest > this.high;
    const isSmall = this.low !== null && greatest - least < 0.4 * (this.high - this.low) && !this.isFlat;
    if (!isOutside && !isSmall) return;
    this.isFlat = greatest === least;
    // Around a value that does not change there is room for its last digits.
    const room = this.isFlat ? Math.max(Math.abs(least) * 0.05, 1e-9) || 1 : (greatest - least) * 0.15;
    [this.low, this.high] = [least - (this.isFlat && least === 0 ? 1 : room), greatest + (this.isFlat && least === 0 ? 1 : room)];
  }
}

/** Steps of 1, 2 or 5 for at most so many lines. */
function step(span, most) {
  const rough = span / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  return [1, 2, 5, 10].map(factor => factor * power).find(size => size >= rough) ?? 10 * power;
}

/** The least and the greatest value since an interval, and all flags. */
export function range(intervals, first) {
  let [least, greatest, all] = [Infinity, -Infinity, 0];
  for (let at = intervals.length - 1; at >= 0 && intervals[at][0] >= first; at--) {
    const [, low, high, , flags] = intervals[at];
    if (low !== null) [least, greatest] = [Math.min(least, low), Math.max(greatest, high)];
    all |= flags;
  }
  return [least, greatest, all];
}

/** The first interval that is on the screen. */
export function firstShown(now, seconds) {
  return now - DELAY - seconds * INTERVALS_PER_SECOND;
}

/**
 * Draws the intervals `[index, least, greatest, last, flags]` of the last seconds before `now`, whose end the axis calls `axis`.
 * A value holds until the next one; where cycles did not come, nothing is drawn and the gap is shaded. Where the task
 * missed cycles its values stayed, and a mark at the upper edge says so.
 */
export function draw(canvas, { intervals, now, seconds, scale, axis, isLive }) {
  const area = sheet(canvas);
  if (!area) return;
  const { context, width, height } = area;
  const end = now - DELAY;
  const first = firstShown(now, seconds);
  const bottom = height - (axis ? AXIS : 0) - BOTTOM;
  const x = index => LEFT + (width - LEFT - RIGHT) * (index - first) / (end - first);
  scale.fit(...range(intervals, first - 1));
  grid(context, { x, bottom, width, seconds, end, axis });
  if (scale.low === null) {
    if (scale.isBinary || intervals.length === 0) scale.fit(0, -1);
    if (scale.low === null) return;
  }
  const y = value => bottom - (bottom - TOP) * (value - scale.low) / (scale.high - scale.low);
  levels(context, { y, scale, width, bottom });
  context.save();
  context.beginPath();
  context.rect(LEFT, 0, width - LEFT - RIGHT, bottom + 1);
  context.clip();
  line(context, { intervals, first, end, x, y, bottom, isBinary: scale.isBinary, isLive });
  context.restore();
}

function grid(context, { x, bottom, width, seconds, end, axis }) {
  const every = step(seconds, width < 500 ? 4 : 8);
  context.strokeStyle = colour("--faint");
  context.fillStyle = colour("--quiet");
  context.textAlign = "center";
  context.textBaseline = "top";
  context.beginPath();
  for (let ago = 0; ago <= seconds; ago += every) {
    const at = Math.round(x(end - ago * INTERVALS_PER_SECOND)) + 0.5;
    context.moveTo(at, TOP);
    context.lineTo(at, bottom);
    if (!axis) continue;
    const text = ago === 0 ? axis : `-${ago} s`;
    const half = context.measureText(text).width / 2;
    context.fillText(text, Math.min(at, width - half), bottom + 5);
  }
  context.stroke();
}

function levels(context, { y, scale, width, bottom }) {
  const every = scale.isBinary ? 1 : step(scale.high - scale.low, 4);
  context.strokeStyle = colour("--faint");
  context.fillStyle = colour("--quiet");
  context.textAlign = "right";
  context.textBaseline = "middle";
  context.beginPath();
  for (let count = Math.ceil(scale.low / every); count * every <= scale.high; count++) {
    const at = Math.round(y(count * every)) + 0.5;
    if (at < TOP + 3 || at > bottom - 2) continue;
    context.moveTo(LEFT, at);
    context.lineTo(width - RIGHT, at);
    const text = scale.isBinary ? ["FALSE", "TRUE"][count] : number(Number((count * every).toPrecision(12)));
    context.fillText(text, LEFT - 5, at, LEFT - 6);
  }
  context.stroke();
}

function line(context, { intervals, first, end, x, y, bottom, isBinary, isLive }) {
  let from = intervals.findIndex(([index]) => index >= first);
  from = from < 0 ? intervals.length - 1 : Math.max(0, from - 1);
  const [gap, bad] = [colour("--gap"), colour("--bad")];
  for (let at = Math.max(from, 0); at < intervals.length; at++) {
    const [index, , , , flags] = intervals[at];
    const before = at > 0 ? intervals[at - 1][0] : index;
    if (flags & BROKEN || (flags & MISSED && index - before > 1)) {
      context.fillStyle = gap;
      context.fillRect(x(before), TOP, Math.max(2, x(index) - x(before)), bottom - TOP);
    }
    if (flags & MISSED) {
      context.fillStyle = bad;
      context.fillRect(x(index) - 1, TOP, 2, 6);
    }
  }
  context.strokeStyle = colour("--curve");
  context.lineWidth = 1.4;
  context.lineJoin = "round";
  context.beginPath();
  let held = null;
  let before = null;
  for (const [index, least, greatest, last, flags] of intervals.slice(Math.max(from, 0))) {
    const at = x(index);
    if (flags & UNBOUNDED) {
      // A NaN or an infinity has no place: a mark on the lower edge shows it.
      context.moveTo(at, bottom);
      context.lineTo(at, bottom - 5);
    }
    if (least === null) {
      [held, before] = [null, null];
      continue;
    }
    const [low, high] = [y(least), y(greatest)];
    if (held === null || flags & BROKEN) {
      context.moveTo(at, low);
    } else {
      if (flags & UNBOUNDED) context.moveTo(x(before), held);
      const near = Math.min(low, Math.max(high, held));
      if (isBinary || index - before > 2) context.lineTo(at, held);
      context.lineTo(at, near);
    }
    // A value that did not change within the interval is a point, which a line without length does not show.
    context.moveTo(at, low);
    context.lineTo(at, Math.min(high, low - 0.7));
    held = last === null ? null : y(last);
    before = index;
    if (held !== null) context.moveTo(at, held);
  }
  if (isLive && held !== null && before < end) context.lineTo(x(end), held);
  context.stroke();
}
