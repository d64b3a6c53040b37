// The last minutes of a sensor: minimum, mean and maximum temperature, the region's mean, and missing frames.

import { labelTicks, rangeOf } from "./scale.js";
import { degrees, say } from "./words.js";

// The shortest of these that holds all points is drawn; the last one is also how long points are stored.
const SPANS = [{ span: 60, step: 15 }, { span: 120, step: 30 }, { span: 300, step: 60 }];
const SPAN_MAX_S = SPANS.at(-1).span;
// Frames further apart than this are not joined.
const BRIDGED_S = 3;
const POINTS_MAX = 20_000;
const TICKS_MAX = 4;

export class History {
  #canvas;
  #degrees;
  #times;
  #title;
  #points = [];
  #missing = [];

  constructor(figure) {
    [this.#canvas, this.#degrees, this.#times, this.#title] = ["canvas", ".degree-axis", ".time-axis", "[data-span]"].map((part) => figure.querySelector(part));
  }

  /** A frame's temperatures, measured at `at` seconds of the page's clock. */
  add(at, { min, mean, max, region }) {
    this.#points.push({ at, min, mean, max, region });
    this.#forget(at);
  }

  /** Inserts what was measured before the page opened: points as `add` takes them, and times as `miss` does. */
  precede(points, missing) {
    this.#points = [...points, ...this.#points].slice(-POINTS_MAX);
    this.#missing = [...missing, ...this.#missing].slice(-POINTS_MAX);
  }

  /** Whether there is room to draw. */
  get isSeen() {
    return this.#canvas.clientWidth > 0;
  }

  /** A frame that could not be read. */
  miss(at) {
    this.#missing.push(at);
    this.#forget(at);
  }

  #forget(now) {
    const old = this.#points.findIndex(({ at }) => at > now - SPAN_MAX_S);
    if (old > SPAN_MAX_S || this.#points.length > POINTS_MAX) this.#points.splice(0, Math.max(old, 1));
    while (this.#missing.length > 0 && (this.#missing[0] < now - SPAN_MAX_S || this.#missing.length > POINTS_MAX)) this.#missing.shift();
  }

  /** Draws the minutes before `now`. */
  draw(now) {
    const canvas = this.#canvas;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((size) => Math.round(size * devicePixelRatio));
    if (width === 0 || height === 0) return;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const context = canvas.getContext("2d");
    context.clearRect(0, 0, width, height);
    const points = this.#points.filter(({ at }) => at > now - SPAN_MAX_S);
    if (points.length === 0) return;
    const { span, step } = SPANS.find(({ span }) => points[0].at > now - span) ?? SPANS.at(-1);
    const [least, greatest] = extremesOf(points);
    const range = rangeOf(least, greatest);
    this.#label(span, step, range);
    const x = (at) => (1 - (now - at) / span) * width;
    const y = (celsius) => ((range.high - celsius) / (range.high - range.low)) * (height - 2) + 1;
    // Canvas takes no CSS variables. Computed properties follow the color scheme.
    const style = getComputedStyle(canvas);
    this.#band(context, points, x, y, style);
    for (const [key, color, dashes] of [["mean", style.color, []], ["region", style.caretColor, [4, 3]]]) {
      this.#line(context, points, key, x, y, color, dashes);
    }
    context.fillStyle = style.columnRuleColor;
    for (const at of this.#missing) context.fillRect(x(at), height - 4 * devicePixelRatio, Math.max(1, devicePixelRatio), 4 * devicePixelRatio);
    canvas.setAttribute("aria-label", `History of the last ${inWords(span)}: ${degrees(least)} to ${degrees(greatest)}`);
  }

  #label(span, step, range) {
    labelTicks(this.#degrees, range, String, TICKS_MAX);
    say(this.#title, inWords(span));
    if (this.#times.dataset.span === String(span)) return;
    this.#times.dataset.span = span;
    const ticks = Array.from({ length: span / step + 1 }, (_, index) => span - index * step);
    this.#times.replaceChildren(
      ...ticks.map((ago) => {
        const item = Object.assign(document.createElement("li"), { textContent: ago === 0 ? "now" : `−${inWords(ago)}` });
        item.style.left = `${(1 - ago / span) * 100}%`;
        return item;
      }),
    );
  }

  #band(context, points, x, y, style) {
    context.fillStyle = style.textDecorationColor;
    for (const run of runsOf(points)) {
      context.beginPath();
      for (const point of run) context.lineTo(x(point.at), y(point.max));
      for (const point of run.toReversed()) context.lineTo(x(point.at), y(point.min));
      context.closePath();
      context.fill();
    }
  }

  #line(context, points, key, x, y, color, dashes) {
    context.strokeStyle = color;
    context.lineWidth = Math.max(1, devicePixelRatio);
    context.setLineDash(dashes.map((length) => length * devicePixelRatio));
    for (const run of runsOf(points)) {
      context.beginPath();
      for (const point of run) if (point[key] !== null) context.lineTo(x(point.at), y(point[key]));
      context.stroke();
    }
    context.setLineDash([]);
  }
}

/** Whole minutes from 60 s on, else seconds. */
function inWords(seconds) {
  return seconds % 60 === 0 ? `${seconds / 60} min` : `${seconds} s`;
}

/** Points without a gap between them. */
function runsOf(points) {
  const runs = [];
  for (const point of points) {
    const last = runs.at(-1)?.at(-1);
    if (last === undefined || point.at - last.at > BRIDGED_S) runs.push([]);
    runs.at(-1).push(point);
  }
  return runs;
}

function extremesOf(points) {
  let [least, greatest] = [Infinity, -Infinity];
  for (const { min, max } of points) {
    least = Math.min(least, min);
    greatest = Math.max(greatest, max);
  }
  return [least, greatest];
}
