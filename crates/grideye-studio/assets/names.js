// Names beside one another: of those that would lie on one another only the most important stays.

// How wide a letter is, of its height.
const WIDTH = 0.58;

/** Those of `{ at, words, weight }` that have room, with `size` the height of a letter; `at` is the middle of the baseline. */
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

/** What is chosen before all, then sensors, people and things. */
export function weightOf({ kind }, chosen) {
  return chosen ? 4 : WEIGHTS[kind];
}
