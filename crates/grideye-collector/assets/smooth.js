// Interpolation between the 8 x 8 measured pixels, for display only.

import { SIDE } from "./orientation.js";

/** The ways to draw; all but the first interpolate. */
export const METHODS = new Map([
  ["cells", { title: "Pixels, as measured" }],
  ["bilinear", { title: "Bilinear (interpolated)", taps: 2, weight: linear }],
  ["bicubic", { title: "Bicubic (interpolated)", taps: 4, weight: catmullRom }],
]);

function linear(distance) {
  return Math.max(0, 1 - Math.abs(distance));
}

// Keys, "Cubic convolution interpolation for digital image processing", 1981, with a = -1/2.
function catmullRom(distance) {
  const x = Math.abs(distance);
  if (x < 1) return 1.5 * x ** 3 - 2.5 * x ** 2 + 1;
  return x < 2 ? -0.5 * x ** 3 + 2.5 * x ** 2 - 4 * x + 2 : 0;
}

const weightsBefore = new Map();

/** The rows or columns, and their weights, that make each of `points` places along a side. */
function weightsOf(method, points) {
  const key = `${method} ${points}`;
  if (!weightsBefore.has(key)) {
    const { taps, weight } = METHODS.get(method);
    const rows = Array.from({ length: points }, (_, point) => {
      // A value belongs to its pixel's middle; the edge extends beyond the outermost middles.
      const at = ((point + 0.5) / points) * SIDE - 0.5;
      const first = Math.floor(at) - taps / 2 + 1;
      return Array.from({ length: taps }, (_, tap) => {
        const index = Math.min(SIDE - 1, Math.max(0, first + tap));
        return [index, weight(at - (first + tap))];
      });
    });
    weightsBefore.set(key, rows);
  }
  return weightsBefore.get(key);
}

/** `points` x `points` interpolated temperatures, row by row. */
export function between(celsius, method, points) {
  const weights = weightsOf(method, points);
  const wide = new Float32Array(SIDE * points);
  for (let row = 0; row < SIDE; row += 1) {
    for (let point = 0; point < points; point += 1) {
      let sum = 0;
      for (const [column, weight] of weights[point]) sum += weight * celsius[row * SIDE + column];
      wide[row * points + point] = sum;
    }
  }
  const field = new Float32Array(points * points);
  for (let line = 0; line < points; line += 1) {
    for (const [row, weight] of weights[line]) {
      for (let point = 0; point < points; point += 1) field[line * points + point] += weight * wide[row * points + point];
    }
  }
  return field;
}
