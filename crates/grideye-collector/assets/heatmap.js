// The heat map: 64 pixels, a cursor, and a region of interest.

import { SIDE, UPRIGHT, pixelAt, placeOf } from "./orientation.js";
import { paintPixel, shadeOf } from "./scale.js";
import { between } from "./smooth.js";

const CELL_MAX = SIDE * SIDE - 1;
// A cell smaller than this many device pixels has no room for its number.
const NUMBER_CELL_MIN = 30;
const POINTS_MIN = 64;
const POINTS_MAX = 256;

export class HeatMap {
  #canvas;
  #small = document.createElement("canvas");
  #celsius = null;
  #range = null;
  #look = { colors: null, method: "cells", numbers: false };
  #orientation = UPRIGHT;
  #cell = null;
  #region = null;
  #people = new Set();
  #anchor = null;
  #seen = true;
  #on;

  /**
   * `on.cell` gets the pixel under the cursor, 0 to 63, or null; `on.region` the pixels of the region, or null. Without
   * `on.region` no region can be marked.
   */
  constructor(canvas, on) {
    this.#canvas = canvas;
    this.#on = on;
    canvas.addEventListener("pointermove", (event) => this.#drag(event));
    canvas.addEventListener("pointerdown", (event) => this.#press(event));
    canvas.addEventListener("pointerup", () => { this.#anchor = null; });
    canvas.addEventListener("pointerleave", () => this.#point(null));
    canvas.addEventListener("blur", () => this.#point(null));
    canvas.addEventListener("keydown", (event) => this.#key(event));
    new ResizeObserver(() => this.#fit()).observe(canvas);
    new IntersectionObserver(([entry]) => this.#uncover(entry.isIntersecting)).observe(canvas);
  }

  get cell() {
    return this.#cell;
  }

  /** Marks the cell under another image's cursor. */
  mark(cell) {
    if (this.#cell === cell) return;
    this.#cell = cell;
    this.#paint();
  }

  show(celsius, range) {
    this.#celsius = celsius;
    this.#range = range;
    this.#paint();
  }

  /** Shows nothing. */
  clear() {
    this.#celsius = null;
    this.#canvas.getContext("2d").clearRect(0, 0, this.#canvas.width, this.#canvas.height);
  }

  /** Palette, method and numbers; `text` formats numbers that are no temperatures. */
  look(look) {
    this.#look = look;
    this.#paint();
  }

  orient(orientation) {
    this.#orientation = orientation;
    this.#paint();
  }

  /** Two opposite corners as pixels, or null. */
  set region(corners) {
    this.#region = corners;
    this.#paint();
    this.#on.region(corners === null ? null : pixelsWithin(corners));
  }

  get region() {
    return this.#region;
  }

  /** The pixels of people, 0 to 63. */
  set people(pixels) {
    if (pixels.length === this.#people.size && pixels.every((pixel) => this.#people.has(pixel))) return;
    this.#people = new Set(pixels);
    this.#paint();
  }

  /** Matches the screen's device pixels in whole cells, so that edges are sharp. */
  #fit() {
    const wanted = this.#canvas.clientWidth * devicePixelRatio;
    const side = Math.max(1, Math.round(wanted / SIDE)) * SIDE;
    if (this.#canvas.width === side) return;
    this.#canvas.width = side;
    this.#canvas.height = side;
    this.#paint();
  }

  #uncover(seen) {
    this.#seen = seen;
    this.#paint();
  }

  #paint() {
    if (this.#celsius === null || this.#look.colors === null || !this.#seen) return;
    const context = this.#canvas.getContext("2d");
    this.#fill(context);
    const cell = this.#canvas.width / SIDE;
    if (this.#look.numbers && cell >= NUMBER_CELL_MIN) this.#write(context, cell);
    if (this.#people.size > 0) this.#surround(context, cell);
    if (this.#region !== null) this.#outline(context, cell, this.#region, [6, 4]);
    if (this.#cell !== null) this.#outline(context, cell, [this.#cell, this.#cell], []);
  }

  #fill(context) {
    const turned = new Float32Array(SIDE * SIDE);
    for (let pixel = 0; pixel <= CELL_MAX; pixel += 1) {
      const [column, row] = placeOf(pixel, this.#orientation);
      turned[row * SIDE + column] = this.#celsius[pixel];
    }
    const { method, colors } = this.#look;
    const raw = method === "cells";
    const points = raw ? SIDE : Math.min(POINTS_MAX, Math.max(POINTS_MIN, this.#canvas.width / 4));
    const side = Math.round(points);
    const field = raw ? turned : between(turned, method, side);
    if (this.#small.width !== side) Object.assign(this.#small, { width: side, height: side });
    const small = this.#small.getContext("2d");
    const image = small.createImageData(side, side);
    field.forEach((celsius, pixel) => paintPixel(image.data, pixel, colors, shadeOf(celsius, this.#range)));
    small.putImageData(image, 0, 0);
    context.imageSmoothingEnabled = !raw;
    context.drawImage(this.#small, 0, 0, this.#canvas.width, this.#canvas.height);
  }

  #write(context, cell) {
    context.font = `${Math.round(cell * 0.28)}px system-ui, sans-serif`;
    context.textAlign = "center";
    context.textBaseline = "middle";
    this.#celsius.forEach((celsius, pixel) => {
      const [column, row] = placeOf(pixel, this.#orientation);
      const shade = shadeOf(celsius, this.#range) * 3;
      const [red, green, blue] = this.#look.colors.subarray(shade, shade + 3);
      // Rec. 709 luma decides between black and white.
      context.fillStyle = 0.2126 * red + 0.7152 * green + 0.0722 * blue > 128 ? "#000" : "#fff";
      const decimals = cell >= 56 ? 2 : 1;
      const text = this.#look.text?.(celsius, decimals) ?? celsius.toFixed(decimals);
      context.fillText(text, (column + 0.5) * cell, (row + 0.5) * cell);
    });
  }

  /** The edge of the pixels of people. */
  #surround(context, cell) {
    const places = new Set([...this.#people].map((pixel) => String(placeOf(pixel, this.#orientation))));
    const path = new Path2D();
    for (const place of places) {
      const [column, row] = place.split(",").map(Number);
      for (const [right, down, from, to] of [[-1, 0, [0, 0], [0, 1]], [1, 0, [1, 0], [1, 1]], [0, -1, [0, 0], [1, 0]], [0, 1, [0, 1], [1, 1]]]) {
        if (places.has(`${column + right},${row + down}`)) continue;
        path.moveTo((column + from[0]) * cell, (row + from[1]) * cell);
        path.lineTo((column + to[0]) * cell, (row + to[1]) * cell);
      }
    }
    const width = Math.max(1, cell / 20);
    for (const [color, wide] of [["#000", 3 * width], ["#fff", width]]) {
      Object.assign(context, { strokeStyle: color, lineWidth: wide, lineCap: "square" });
      context.stroke(path);
    }
  }

  #outline(context, cell, corners, dashes) {
    const places = corners.map((pixel) => placeOf(pixel, this.#orientation));
    const [left, top] = [0, 1].map((axis) => Math.min(...places.map((place) => place[axis])) * cell);
    const [right, bottom] = [0, 1].map((axis) => (Math.max(...places.map((place) => place[axis])) + 1) * cell);
    const width = Math.max(1, Math.round(Math.min(cell / 16, 3 * devicePixelRatio)));
    for (const [color, inset, pattern] of [["#000", width / 2, []], ["#fff", width * (dashes.length > 0 ? 0.5 : 1.5), dashes]]) {
      context.strokeStyle = color;
      context.lineWidth = width;
      context.setLineDash(pattern.map((length) => length * width));
      context.strokeRect(left + inset, top + inset, right - left - 2 * inset, bottom - top - 2 * inset);
    }
    context.setLineDash([]);
  }

  #cellAt(event) {
    const box = this.#canvas.getBoundingClientRect();
    const column = Math.floor(((event.clientX - box.left) / box.width) * SIDE);
    const row = Math.floor(((event.clientY - box.top) / box.height) * SIDE);
    const inside = column >= 0 && column < SIDE && row >= 0 && row < SIDE;
    return inside ? pixelAt([column, row], this.#orientation) : null;
  }

  #press(event) {
    this.#anchor = event.isPrimary ? this.#cellAt(event) : null;
    this.#point(this.#cellAt(event));
  }

  /** Dragging marks a region. */
  #drag(event) {
    const cell = this.#cellAt(event);
    this.#point(cell);
    if (!this.#on.region || event.buttons === 0 || this.#anchor === null || cell === null || cell === this.#anchor) return;
    this.region = [this.#anchor, cell];
  }

  #key(event) {
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
    const from = this.#cell;
    if (event.key === "Escape" && (from !== null || this.#region !== null)) {
      if (this.#region !== null) this.region = null;
      this.#point(null);
    } else if (event.key === "Home" || event.key === "End") {
      this.#point(pixelAt(event.key === "Home" ? [0, 0] : [SIDE - 1, SIDE - 1], this.#orientation));
    } else if (steps[event.key]) {
      const next = from === null ? pixelAt([0, 0], this.#orientation) : this.#beside(from, steps[event.key]);
      if (event.shiftKey && from !== null && this.#on.region) this.region = [this.#region?.[0] ?? from, next];
      this.#point(next);
    } else {
      return;
    }
    event.preventDefault();
    event.stopPropagation();
  }

  #beside(pixel, [right, down]) {
    const [column, row] = placeOf(pixel, this.#orientation);
    const within = (index) => Math.min(SIDE - 1, Math.max(0, index));
    return pixelAt([within(column + right), within(row + down)], this.#orientation);
  }

  #point(cell) {
    if (this.#cell === cell) return;
    this.#cell = cell;
    this.#paint();
    this.#on.cell(cell);
  }
}

/** Every pixel of the rectangle between two opposite corners. */
export function pixelsWithin([one, other]) {
  const rows = [one, other].map((pixel) => Math.floor(pixel / SIDE)).sort((a, b) => a - b);
  const columns = [one, other].map((pixel) => pixel % SIDE).sort((a, b) => a - b);
  const pixels = [];
  for (let row = rows[0]; row <= rows[1]; row += 1) {
    for (let column = columns[0]; column <= columns[1]; column += 1) pixels.push(row * SIDE + column);
  }
  return pixels;
}
