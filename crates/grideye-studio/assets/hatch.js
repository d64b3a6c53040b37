// The coverage map on the floor. Each kind of cell has its own hatch, so that it does not rely on color.

import { pathOf } from "./solids.js";

// Side of a tile, screen pixels.
const TILE = 9;
const HATCHING = 0.75;

/** Letter of a cell in the map: words, the color of the look, how much it hides, and lines of the 9 by 9 tile. */
export const KINDS = new Map([
  ["d", { words: "detected", color: "good", hides: 0.28, lines: "" }],
  ["w", { words: "in view, too faint", color: "warn", hides: 0.14, lines: "M0 4.5H9" }],
  ["h", { words: "hidden by an object", color: "bad", hides: 0.12, lines: "M0 0L9 9M9 0L0 9" }],
  ["o", { words: "out of view", color: "bad", hides: 0.12, lines: "M0 9L9 0" }],
]);

/** A tile of a kind of cell, repeated `times` to either side. */
export function tile(letter, look, times = 1) {
  const size = TILE * devicePixelRatio;
  const canvas = Object.assign(document.createElement("canvas"), { className: "swatch", width: size * times, height: size * times });
  const context = canvas.getContext("2d");
  const { color, hides, lines } = KINDS.get(letter);
  context.fillStyle = look[color];
  context.globalAlpha = hides;
  context.fillRect(0, 0, canvas.width, canvas.height);
  context.globalAlpha = HATCHING;
  context.strokeStyle = look.text;
  context.scale(devicePixelRatio, devicePixelRatio);
  for (let place = 0; place < times ** 2; place += 1) {
    const at = new DOMMatrix().translate(TILE * (place % times), TILE * Math.floor(place / times));
    const moved = new Path2D();
    moved.addPath(new Path2D(lines), at);
    context.stroke(moved);
  }
  return canvas;
}

/** Draws a map on the floor. */
export function hatch(context, { columns, low_m: low, cell_m: [width, depth], cells }, eye, look) {
  for (const letter of KINDS.keys()) {
    const all = new Path2D();
    [...cells].forEach((cell, index) => {
      if (cell !== letter) return;
      const [left, front] = [low[0] + (index % columns) * width, low[1] + Math.floor(index / columns) * depth];
      const corners = [[left, front], [left + width, front], [left + width, front + depth], [left, front + depth]];
      all.addPath(pathOf(corners.map(([x, y]) => eye.see([x, y, 0]))));
    });
    context.fillStyle = context.createPattern(tile(letter, look), "repeat");
    context.fill(all);
  }
}
