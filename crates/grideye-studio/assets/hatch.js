// The coverage map over the plan. Each kind of cell has its own hatch, so that it does not rely on color.

const SVG = "http://www.w3.org/2000/svg";
// Side of a pattern tile, screen pixels.
const TILE = 9;

/** Letter of a cell in the map, class, words, and lines of the 9 by 9 tile. */
export const KINDS = new Map([
  ["d", { id: "seen", words: "detected", lines: [] }],
  ["w", { id: "weak", words: "in view, too faint", lines: ["M0 4.5H9"] }],
  ["h", { id: "hidden", words: "hidden by an object", lines: ["M0 0L9 9", "M9 0L0 9"] }],
  ["o", { id: "out", words: "out of view", lines: ["M0 9L9 0"] }],
]);

export class CoverageHatch {
  patterns = make("defs", {});
  #patterns = [];

  constructor() {
    for (const { id, lines } of KINDS.values()) this.patterns.append(this.#pattern(id, lines));
  }

  #pattern(id, lines) {
    const pattern = make("pattern", { id: `hatch-${id}`, width: TILE, height: TILE, patternUnits: "userSpaceOnUse" });
    pattern.append(make("rect", { class: `tile ${id}`, width: TILE, height: TILE }));
    for (const path of lines) pattern.append(make("path", { class: "hatching", d: path }));
    this.#patterns.push(pattern);
    return pattern;
  }

  /** Keeps tiles at one size on the screen; `unit` is a pixel in meters. */
  scale(unit) {
    for (const pattern of this.#patterns) pattern.setAttribute("patternTransform", `scale(${unit})`);
  }

  /** Draws a map into a group; null clears it. */
  draw(group, map) {
    group.replaceChildren(...(map === null ? [] : runsOf(map).map((run) => this.#run(map, run))));
  }

  #run({ low_m: [left, front], cell_m: [width, depth] }, { row, from, to, letter }) {
    const { id } = KINDS.get(letter);
    const shape = make("rect", {
      class: "cell", x: left + from * width, y: -(front + (row + 1) * depth), width: (to - from) * width, height: depth, fill: `url(#hatch-${id})`,
    });
    shape.dataset.cover = id;
    return shape;
  }
}

/** Merges neighbors of one kind in a row. */
function runsOf({ columns, rows, cells }) {
  const runs = [];
  for (let row = 0; row < rows; row += 1) {
    for (let column = 0; column < columns; column += 1) {
      const letter = cells[row * columns + column];
      if (!KINDS.has(letter)) continue;
      const last = runs.at(-1);
      if (last?.row === row && last.to === column && last.letter === letter) last.to += 1;
      else runs.push({ row, from: column, to: column + 1, letter });
    }
  }
  return runs;
}

/** A swatch for the legend. */
export function swatch(letter) {
  const svg = make("svg", { class: "swatch", viewBox: "0 0 18 18", "aria-hidden": "true" });
  const { id, lines } = KINDS.get(letter);
  svg.append(make("rect", { class: `tile ${id}`, width: 18, height: 18 }));
  for (const [x, y] of [[0, 0], [9, 0], [0, 9], [9, 9]]) {
    for (const path of lines) svg.append(make("path", { class: "hatching", d: path, transform: `translate(${x} ${y})` }));
  }
  return svg;
}

function make(name, attributes) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}
