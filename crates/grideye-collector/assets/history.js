// The last minutes of a sensor in one strip: least, mean and greatest temperature, the region's mean, and gaps as gaps.

import { degrees } from "./words.js";

const SPAN_S = 300;
// Frames further apart than this are not joined.
const BRIDGED_S = 3;
const POINTS_MAX = 20_000;
const SPAN_MIN_CELSIUS = 4;

export class History {
  #canvas;
  #points = [];
  #missing = [];

  constructor(canvas) {
    this.#canvas = canvas;
  }

  /** A frame's temperatures, measured at `at` seconds of the page's clock. */
  add(at, { min, mean, max, region }) {
    this.#points.push({ at, min, mean, max, region });
    this.#forget(at);
  }

  /** Puts what was measured before the page was there in front: points as `add` takes them, and moments as `miss` does. */
  precede(points, missing) {
    this.#points = [...points, ...this.#points].slice(-POINTS_MAX);
    this.#missing = [...missing, ...this.#missing].slice(-POINTS_MAX);
  }

  /** Whether there is room to draw in. */
  get isSeen() {
    return this.#canvas.clientWidth > 0;
  }

  /** A frame that could not be read. */
  miss(at) {
    this.#missing.push(at);
    this.#forget(at);
  }

  clear() {
    this.#points = [];
    this.#missing = [];
  }

  #forget(now) {
    const old = this.#points.findIndex(({ at }) => at > now - SPAN_S);
    if (old > SPAN_S || this.#points.length > POINTS_MAX) this.#points.splice(0, Math.max(old, 1));
    while (this.#missing.length > 0 && (this.#missing[0] < now - SPAN_S || this.#missing.length > POINTS_MAX)) this.#missing.shift();
  }

  /** Draws what was measured in the minutes before `now`. */
  draw(now) {
    const canvas = this.#canvas;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((size) => Math.round(size * devicePixelRatio));
    if (width === 0 || height === 0) return;
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
    const context = canvas.getContext("2d");
    context.clearRect(0, 0, width, height);
    const points = this.#points.filter(({ at }) => at > now - SPAN_S);
    if (points.length === 0) return;
    const range = rangeOf(points);
    const x = (at) => (1 - (now - at) / SPAN_S) * width;
    const y = (celsius) => ((range.high - celsius) / (range.high - range.low)) * (height - 2) + 1;
    // Properties of colors are resolved for light and dark, as variables are not.
    const style = getComputedStyle(canvas);
    this.#band(context, points, x, y, style);
    for (const [key, color, dashes] of [["mean", style.color, []], ["region", style.caretColor, [4, 3]]]) {
      this.#line(context, points, key, x, y, color, dashes);
    }
    context.fillStyle = style.columnRuleColor;
    for (const at of this.#missing) context.fillRect(x(at), height - 4 * devicePixelRatio, Math.max(1, devicePixelRatio), 4 * devicePixelRatio);
    const said = `${degrees(range.low)} to ${degrees(range.high)} in the last ${SPAN_S / 60} minutes`;
    canvas.setAttribute("aria-label", `History of minimum, mean and maximum: ${said}`);
    canvas.title = said;
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

/** Points that belong together: a gap ends a run. */
function runsOf(points) {
  const runs = [];
  for (const point of points) {
    const last = runs.at(-1)?.at(-1);
    if (last === undefined || point.at - last.at > BRIDGED_S) runs.push([]);
    runs.at(-1).push(point);
  }
  return runs;
}

function rangeOf(points) {
  let [low, high] = [Infinity, -Infinity];
  for (const { min, max } of points) {
    low = Math.min(low, min);
    high = Math.max(high, max);
  }
  const short = Math.max(0, SPAN_MIN_CELSIUS - (high - low)) / 2;
  return { low: low - short, high: high + short };
}
