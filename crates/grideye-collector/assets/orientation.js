// How an image is turned and mirrored. Pixels keep the sensor's numbers.

export const SIDE = 8;

/** As the sensor sends it: pixel 1 at the top left, pixel 64 at the bottom right. */
export const UPRIGHT = { quarters: 0, mirrored: false };

/** Turned clockwise by another quarter. */
export function turned({ quarters, mirrored }) {
  return { quarters: (quarters + 1) % 4, mirrored };
}

/** Left and right swapped, as drawn. */
export function mirrored({ quarters, mirrored: before }) {
  // Drawing mirrors first and turns second, so a swap of what is drawn reverses the turn.
  return { quarters: (4 - quarters) % 4, mirrored: !before };
}

/** Where a pixel (0 to 63) is drawn: column and row, 0 to 7. */
export function placeOf(pixel, { quarters, mirrored }) {
  let [column, row] = [pixel % SIDE, Math.floor(pixel / SIDE)];
  if (mirrored) column = SIDE - 1 - column;
  for (let turn = 0; turn < quarters; turn += 1) [column, row] = [SIDE - 1 - row, column];
  return [column, row];
}

/** Which pixel (0 to 63) is drawn at a column and row. */
export function pixelAt([column, row], { quarters, mirrored }) {
  for (let turn = 0; turn < quarters; turn += 1) [column, row] = [row, SIDE - 1 - column];
  if (mirrored) column = SIDE - 1 - column;
  return row * SIDE + column;
}

/** In words, for the note under the image. */
export function inWords({ quarters, mirrored }) {
  const parts = [];
  if (mirrored) parts.push("mirrored");
  if (quarters > 0) parts.push(`turned clockwise by ${quarters * 90}°`);
  return parts.join(", then ");
}
