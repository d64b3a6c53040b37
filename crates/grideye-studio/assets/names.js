// Labels on a drawing: where labels overlap, only the most important stays.

// Width of a letter per height.
const WIDTH = 0.58;

/**
 * The labels `{ at, words, weight }` that fit; `size` is the letter height, `at` the middle of the baseline, and `filled` the
 * boxes that no label covers. A label that does not fit at its place stands at the first of its `others` that is free.
 */
export function withRoom(labels, size, filled = []) {
  const taken = [...filled];
  const kept = new Map();
  for (const label of [...labels].sort((one, other) => other.weight - one.weight)) {
    const half = 0.5 * WIDTH * size * label.words.length;
    const boxes = [label.at, ...(label.others ?? [])].map(([x, y]) => ({ at: [x, y], left: x - half, right: x + half, top: y - size, bottom: y }));
    const free = boxes.find((box) => !taken.some((other) => box.left < other.right && other.left < box.right && box.top < other.bottom && other.top < box.bottom));
    if (!free) continue;
    taken.push(free);
    kept.set(label, free.at);
  }
  return labels.filter((label) => kept.has(label)).map((label) => ({ ...label, at: kept.get(label) }));
}

const WEIGHTS = { sensor: 3, agent: 2, object: 1, mosaic: 1 };

/** The selection first, then sensors, people and objects. */
export function weightOf({ kind }, chosen) {
  return chosen ? 4 : WEIGHTS[kind];
}
