// Labels on a drawing: where labels overlap, only the most important stays.

// Width of a letter per height.
const WIDTH = 0.58;

/** The labels `{ at, words, weight }` that fit; `size` is the letter height, `at` the middle of the baseline. */
export function withRoom(labels, size) {
  const taken = [];
  const kept = [...labels].sort((one, other) => other.weight - one.weight).filter(({ at: [x, y], words }) => {
    const half = 0.5 * WIDTH * size * words.length;
    const box = { left: x - half, right: x + half, top: y - size, bottom: y };
    if (taken.some((other) => box.left < other.right && other.left < box.right && box.top < other.bottom && other.top < box.bottom)) return false;
    taken.push(box);
    return true;
  });
  return labels.filter((label) => kept.includes(label));
}

const WEIGHTS = { sensor: 3, agent: 2, object: 1, mosaic: 1 };

/** The selection first, then sensors, people and objects. */
export function weightOf({ kind }, chosen) {
  return chosen ? 4 : WEIGHTS[kind];
}
