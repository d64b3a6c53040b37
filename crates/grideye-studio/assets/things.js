// What can be taken hold of in a scene, and the edits that move, turn and tilt it.

// A hand places to the centimeter; fields take any length.
const GRID_MM = 10;
// A hand turns by whole degrees, with Shift by more.
const [TURN_STEP, TURN_STEP_COARSE] = [1, 15];
// How much of a thing's reach its handle goes around, meters.
const REACH_MAX_M = 1;
const TURNED = { object: "yaw_deg", agent: "yaw_deg", sensor: "azimuth_deg" };

/** The item that a choice names: `{ kind, index }`, of an agent's way `row` as well. */
export function itemOf(scene, chosen) {
  return scene?.items.find(({ kind, index }) => chosen !== null && kind === chosen.kind && index === chosen.index) ?? null;
}

export function isSame(one, other) {
  return one?.kind === other?.kind && one?.index === other?.index && one?.row === other?.row;
}

/** Whatever can be chosen, in the order of the list. */
export function choices(scene) {
  const all = (scene?.items ?? []).flatMap(({ kind, index, way }) => {
    const points = way?.points_m ?? [];
    return [{ kind, index }, ...points.map((_, row) => ({ kind, index, row }))];
  });
  return [{ kind: "room", index: 0 }, ...all];
}

export function pathOf({ kind, index }, ...rest) {
  return kind === "room" ? ["room", ...rest] : [kind, index, ...rest];
}

/** Where a thing is, in millimeters; of a way-point its place, of one who walks where the way begins. */
export function placeOf(item, row) {
  const points = item.way?.points_m;
  if (points) return points[row ?? 0].map((meters) => meters * 1000);
  return item.keys.position_mm ?? null;
}

/** The edits that put a thing at another place; a whole way goes with the one who goes it. */
export function moved(item, row, from, to) {
  const rounded = to.map((length, axis) => (length === from[axis] ? length : Math.round(length * 1000) / 1000));
  if (!item.way) return [{ does: "set", path: pathOf(item, "position_mm"), to: rounded }];
  const { file } = item.way;
  if (row !== undefined) return [{ does: "move-way-point", file, row, to_mm: rounded }];
  return [{ does: "shift-way", file, by_mm: rounded.map((length, axis) => length - from[axis]) }];
}

/** The nearest place of the hand's grid. */
export function onGrid(lengths, fine) {
  const step = fine ? 1 : GRID_MM;
  return lengths.map((length) => Math.round(length / step) * step);
}

/** The key by which a thing is turned about the vertical, or null. */
export function turnKey(item) {
  return TURNED[item.kind] ?? null;
}

export function turnOf(item) {
  return item.keys[turnKey(item)] ?? 0;
}

/** What a thing is turned about, in meters. */
export function centerOf(item) {
  return item.at_m ?? placeOf(item).map((length) => length / 1000);
}

/** Where the handle of a thing is that turns it: whither it is turned, so many meters beside it, on its level. */
export function handleOf(item, beside) {
  const [x, y, z] = centerOf(item);
  const angle = (turnOf(item) * Math.PI) / 180;
  const outline = item.bodies?.flatMap((body) => body.outline_m) ?? [];
  const reach = Math.max(0, ...outline.map(([cornerX, cornerY]) => Math.hypot(cornerX - x, cornerY - y)));
  const arm = Math.min(reach, REACH_MAX_M) + beside;
  return [x + Math.cos(angle) * arm, y + Math.sin(angle) * arm, z];
}

/** Degrees to which a handle that is pulled to a place turns a thing. */
export function turnTowards(center, at, coarse) {
  const step = coarse ? TURN_STEP_COARSE : TURN_STEP;
  const degrees = (Math.atan2(at[1] - center[1], at[0] - center[0]) * 180) / Math.PI;
  return Math.round(degrees / step) * step;
}

/** What is chosen, if it has a handle: a thing that turns, and no way-point; or null. */
export function turnable(scene, chosen) {
  const item = itemOf(scene, chosen);
  if (item === null || chosen.row !== undefined || turnKey(item) === null) return null;
  return item.at_m || placeOf(item) !== null ? item : null;
}

/** The edit that turns a thing to an angle, from -180 to 180. */
export function turned(item, degrees) {
  return [{ does: "set", path: pathOf(item, turnKey(item)), to: withinHalfTurns(degrees) }];
}

export function withinHalfTurns(degrees) {
  const within = ((((degrees + 180) % 360) + 360) % 360) - 180;
  const rounded = Math.round(within * 100) / 100;
  return rounded === -180 ? 180 : rounded;
}

/** What a thing is called, and of a way-point which one. */
export function titleOf(scene, chosen) {
  if (chosen?.kind === "room") return "room";
  const item = itemOf(scene, chosen);
  if (item === null) return "nothing";
  const name = `${WORDS[item.kind]} ${item.name}`;
  return chosen.row === undefined ? name : `way-point ${chosen.row + 1} of ${item.name}`;
}

export const WORDS = { room: "room", object: "object", mosaic: "mosaic", agent: "person", sensor: "sensor" };

/** A name that nothing in the scene has. */
export function freeName(scene, kind, stem) {
  const taken = new Set(scene.items.map(({ name }) => name));
  // A sensor's name goes into its recordings, and has no blank.
  const between = kind === "sensor" ? "-" : " ";
  for (let number = 1; ; number += 1) {
    const name = `${stem}${between}${number}`;
    if (!taken.has(name)) return name;
  }
}
