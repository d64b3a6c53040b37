// A whole recording: a lane per sensor with minimum, mean and maximum temperature, hatched gaps, and a playhead to drag.

import { place } from "./words.js";

const SPAN_MIN_CELSIUS = 4;
// CSS pixels. Narrower gaps are drawn this wide, so that none is invisible.
const GAP_WIDTH_MIN = 2;
const LABEL_HEIGHT = 12;

export class Timeline {
  #canvas = document.querySelector("#timeline");
  #scrub = document.querySelector("#scrub");
  #head = document.querySelector("#playhead");
  #tracks = [];
  #length = 0;
  #labels = [];
  #range = null;
  #columns = null;

  /** `seek` gets the seconds that were pointed at. */
  constructor(seek) {
    const follow = (event) => {
      const box = this.#scrub.getBoundingClientRect();
      seek(Math.min(1, Math.max(0, (event.clientX - box.left) / box.width)) * this.#length);
    };
    this.#scrub.addEventListener("pointerdown", (event) => {
      this.#scrub.setPointerCapture(event.pointerId);
      follow(event);
    });
    this.#scrub.addEventListener("pointermove", (event) => {
      if (event.buttons > 0) follow(event);
    });
    new ResizeObserver(() => this.#draw()).observe(this.#canvas);
    // The canvas holds the colors of one color scheme.
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.#draw());
  }

  /** Takes another recording. */
  take(tracks, length) {
    this.#tracks = tracks;
    this.#length = length;
    [this.#labels, this.#range, this.#columns] = [[], null, null];
    this.#scrub.setAttribute("aria-valuemax", length.toFixed(1));
    this.#draw();
  }

  /** Draws labels and the range being marked; both have `from` and `to` in seconds. */
  label(labels, range) {
    if (labels === this.#labels && range?.from === this.#range?.from && range?.to === this.#range?.to) return;
    [this.#labels, this.#range] = [labels, range];
    this.#draw();
  }

  /** Moves the playhead; `said` describes the frame there. */
  point(seconds, said) {
    this.#head.style.left = `${this.#length > 0 ? (seconds / this.#length) * 100 : 0}%`;
    this.#scrub.setAttribute("aria-valuenow", seconds.toFixed(1));
    this.#scrub.setAttribute("aria-valuetext", `${place(seconds)} of ${place(this.#length)}. ${said}`);
  }

  #draw() {
    const canvas = this.#canvas;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((size) => Math.round(size * devicePixelRatio));
    if (width === 0 || height === 0) return;
    Object.assign(canvas, { width, height });
    const context = canvas.getContext("2d");
    const lane = height / Math.max(1, this.#tracks.length);
    // Marking a range redraws often, and the columns do not change meanwhile.
    if (this.#columns?.[0]?.lows.length !== width) this.#columns = this.#tracks.map((track) => columnsOf(track, this.#length, width));
    this.#columns.forEach((columns, index) => {
      drawLane(context, columns, index * lane + 1, lane - 2, getComputedStyle(canvas));
    });
    const x = (seconds) => (seconds / (this.#length || 1)) * width;
    for (const { name, from, to } of this.#labels) drawLabel(context, name, x(from), x(to), height, getComputedStyle(canvas));
    if (this.#range !== null) drawRange(context, x(this.#range.from), x(this.#range.to), height, getComputedStyle(canvas));
  }
}

/** A bar along the lower edge with as much of the name as fits. */
function drawLabel(context, name, from, to, height, style) {
  const [bar, width] = [LABEL_HEIGHT * devicePixelRatio, Math.max(to - from, GAP_WIDTH_MIN * devicePixelRatio)];
  context.save();
  context.beginPath();
  context.rect(from, height - bar, width, bar);
  context.clip();
  context.fillStyle = style.color;
  context.fillRect(from, height - bar, width, bar);
  context.fillStyle = style.backgroundColor;
  context.font = `600 ${bar * 0.8}px system-ui, sans-serif`;
  context.textBaseline = "middle";
  context.fillText(name, from + 3 * devicePixelRatio, height - bar / 2);
  context.restore();
}

/** A dashed box around the range. */
function drawRange(context, from, to, height, style) {
  context.strokeStyle = style.color;
  context.lineWidth = 2 * devicePixelRatio;
  context.setLineDash([4 * devicePixelRatio, 3 * devicePixelRatio]);
  context.strokeRect(from, devicePixelRatio, Math.max(to - from, GAP_WIDTH_MIN * devicePixelRatio), height - 2 * devicePixelRatio);
  context.setLineDash([]);
}

/** For each column: minimum, sum and maximum of its frames' temperatures, their number, and whether frames are missing. */
function columnsOf(track, length, width) {
  const lows = new Float32Array(width).fill(Infinity);
  const highs = new Float32Array(width).fill(-Infinity);
  const sums = new Float32Array(width);
  const counts = new Uint32Array(width);
  const lacks = new Uint8Array(width);
  const { times } = track;
  const column = (seconds) => Math.min(width - 1, Math.max(0, Math.floor((seconds / (length || 1)) * width)));
  lacks.fill(1, 0, Math.max(0, column(times[0]) - 1));
  for (let index = 0; index < times.length; index += 1) {
    const [from, until] = [column(times[index]), column(times[index + 1] ?? length)];
    if (!track.isFrame(index)) {
      // A track that ends with the recording has no gap there.
      if (!track.isEnd(index) || until > from) lacks.fill(1, from, Math.max(until, from + Math.round(GAP_WIDTH_MIN * devicePixelRatio)));
      continue;
    }
    // A frame is as wide as it lasts.
    for (let at = from; at <= Math.max(from, until - 1); at += 1) {
      lows[at] = Math.min(lows[at], track.lows[index]);
      highs[at] = Math.max(highs[at], track.highs[index]);
      sums[at] += track.means[index];
      counts[at] += 1;
    }
  }
  return { lows, highs, sums, counts, lacks };
}

function drawLane(context, { lows, highs, sums, counts, lacks }, top, height, style) {
  let [low, high] = [Math.min(...lows), Math.max(...highs)];
  const short = Math.max(0, SPAN_MIN_CELSIUS - (high - low)) / 2;
  [low, high] = [low - short, high + short];
  const y = (celsius) => top + ((high - celsius) / (high - low)) * height;
  const line = Math.max(1, devicePixelRatio);
  for (let x = 0; x < lows.length; x += 1) {
    if (counts[x] === 0) continue;
    context.fillStyle = style.textDecorationColor;
    context.fillRect(x, y(highs[x]), 1, Math.max(line, y(lows[x]) - y(highs[x])));
    context.fillStyle = style.color;
    context.fillRect(x, y(sums[x] / counts[x]) - line / 2, 1, line);
  }
  for (let x = 0; x < lacks.length; x += 1) {
    if (lacks[x] === 0) continue;
    let end = x;
    while (lacks[end] === 1) end += 1;
    hatch(context, x, top, end - x, height, style.columnRuleColor);
    x = end;
  }
}

/** Stripes and edges, so that a gap differs in form as well as in color. */
function hatch(context, x, y, width, height, color) {
  const step = 6 * devicePixelRatio;
  context.save();
  context.beginPath();
  context.rect(x, y, width, height);
  context.clip();
  context.clearRect(x, y, width, height);
  context.strokeStyle = color;
  context.lineWidth = Math.max(1, devicePixelRatio);
  context.beginPath();
  for (let from = x - height; from < x + width; from += step) {
    context.moveTo(from, y + height);
    context.lineTo(from + height, y);
  }
  context.stroke();
  context.fillStyle = color;
  context.fillRect(x, y, width, 3 * devicePixelRatio);
  context.fillRect(x, y + height - 3 * devicePixelRatio, width, 3 * devicePixelRatio);
  context.restore();
}
