// The picture: 64 cells as the sensor sent them, without smoothing, and a cursor over them.

import { colourOf, css } from "./palette.js";

const SIDE = 8;
const CELL_MAX = SIDE * SIDE - 1;

export class HeatMap {
  #canvas;
  #celsius = null;
  #range = null;
  #cell = null;
  #onCell;

  /** `onCell` is told the cell under the cursor, 0 to 63, or null. */
  constructor(canvas, onCell) {
    this.#canvas = canvas;
    this.#onCell = onCell;
    canvas.addEventListener("pointermove", (event) => this.#point(this.#cellAt(event)));
    canvas.addEventListener("pointerdown", (event) => this.#point(this.#cellAt(event)));
    canvas.addEventListener("pointerleave", () => this.#point(null));
    canvas.addEventListener("blur", () => this.#point(null));
    canvas.addEventListener("keydown", (event) => this.#key(event));
    new ResizeObserver(() => this.#fit()).observe(canvas);
  }

  get cell() {
    return this.#cell;
  }

  show(celsius, range) {
    this.#celsius = celsius;
    this.#range = range;
    this.#paint();
  }

  /** As many device pixels as the screen has, in whole cells, so that every edge is sharp. */
  #fit() {
    const wanted = this.#canvas.clientWidth * devicePixelRatio;
    const side = Math.max(1, Math.round(wanted / SIDE)) * SIDE;
    if (this.#canvas.width === side) return;
    this.#canvas.width = side;
    this.#canvas.height = side;
    this.#paint();
  }

  #paint() {
    if (this.#celsius === null) return;
    const context = this.#canvas.getContext("2d");
    const cell = this.#canvas.width / SIDE;
    this.#celsius.forEach((celsius, index) => {
      context.fillStyle = css(colourOf(celsius, this.#range));
      context.fillRect((index % SIDE) * cell, Math.floor(index / SIDE) * cell, cell, cell);
    });
    if (this.#cell !== null) this.#outline(context, cell);
  }

  #outline(context, cell) {
    const width = Math.max(1, Math.round(cell / 16));
    const left = (this.#cell % SIDE) * cell;
    const top = Math.floor(this.#cell / SIDE) * cell;
    for (const [colour, inset] of [["#000", width / 2], ["#fff", width * 1.5]]) {
      context.strokeStyle = colour;
      context.lineWidth = width;
      context.strokeRect(left + inset, top + inset, cell - 2 * inset, cell - 2 * inset);
    }
  }

  #cellAt(event) {
    const box = this.#canvas.getBoundingClientRect();
    const column = Math.floor(((event.clientX - box.left) / box.width) * SIDE);
    const row = Math.floor(((event.clientY - box.top) / box.height) * SIDE);
    const inside = column >= 0 && column < SIDE && row >= 0 && row < SIDE;
    return inside ? row * SIDE + column : null;
  }

  #key(event) {
    const from = this.#cell;
    const steps = {
      ArrowLeft: (cell) => (cell % SIDE === 0 ? cell : cell - 1),
      ArrowRight: (cell) => (cell % SIDE === SIDE - 1 ? cell : cell + 1),
      ArrowUp: (cell) => (cell < SIDE ? cell : cell - SIDE),
      ArrowDown: (cell) => (cell > CELL_MAX - SIDE ? cell : cell + SIDE),
      Home: () => 0,
      End: () => CELL_MAX,
      Escape: () => null,
    };
    const step = steps[event.key];
    if (!step) return;
    event.preventDefault();
    this.#point(from === null && event.key !== "Escape" ? 0 : step(from));
  }

  #point(cell) {
    if (this.#cell === cell) return;
    this.#cell = cell;
    this.#paint();
    this.#onCell(cell);
  }
}
