// How many sensors share a screen.

// With more sensors than this, each shows only its image, minimum, mean and maximum.
const DETAILED_MAX = 2;
// So many fill one screen, in two rows.
const ON_A_SCREEN_MAX = 9;

/** Puts the cards of sensors on a wall. */
export function putOn(wall, cards) {
  const same = cards.length === wall.children.length && cards.every((card, index) => card === wall.children[index]);
  if (!same) wall.replaceChildren(...cards);
  wall.dataset.count = cards.length;
  wall.dataset.dense = cards.length > DETAILED_MAX;
  wall.dataset.few = cards.length > DETAILED_MAX && cards.length <= ON_A_SCREEN_MAX;
  wall.style.setProperty("--columns", Math.max(3, Math.ceil(cards.length / 2)));
}
