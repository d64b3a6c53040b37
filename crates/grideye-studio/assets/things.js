// What can be selected in a scene, and the edits that move and turn it.

// Dragging snaps to a centimeter; fields take any length.
const GRID_MM = 10;
// The handle turns by whole degrees, with Shift by more.
const [TURN_STEP, TURN_STEP_COARSE] = [1, 15];
// The handle clears an item's outline up to this distance from its center, meters.
const REACH_MAX_M = 1;
const TURNED = { object: "yaw_deg", agent: "yaw_deg", sensor: "azimuth_deg" };

/** The item of a selection `{ kind, index }`, with `row` for a waypoint. */
export function itemOf(scene, chosen) {
  return scene?.items.find(({ kind, index }) => chosen !== null && kind === chosen.kind && index === chosen.index) ?? null;
}

/** Whether a shape of the drawing is one of an item: the cells of a mosaic are objects there. */
export function isOf(item, shape) {
  return item.name === shape.name && (item.kind === shape.kind || (item.kind === "mosaic" && shape.kind === "object"));
}

export function isSame(one, other) {
  return one?.kind === other?.kind && one?.index === other?.index && one?.row === other?.row;
}

/** Everything selectable, in list order. */
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

/** The position of an item or waypoint, millimeters; a walking person is at the first waypoint. */
export function placeOf(item, row) {
  const points = item.way?.points_m;
  if (points) return points[row ?? 0].map((meters) => meters * 1000);
  return item.keys.position_mm ?? null;
}

/** The edits that move an item. A person takes the whole trajectory along. */
export function moved(item, row, from, to) {
  const rounded = to.map((length, axis) => (length === from[axis] ? length : Math.round(length * 1000) / 1000));
  if (!item.way) return [{ does: "set", path: pathOf(item, "position_mm"), to: rounded }];
  const { file } = item.way;
  if (row !== undefined) return [{ does: "move-way-point", file, row, to_mm: rounded }];
  return [{ does: "shift-way", file, by_mm: rounded.map((length, axis) => length - from[axis]) }];
}

/** The nearest point of the drag grid. */
export function onGrid(lengths, fine) {
  const step = fine ? 1 : GRID_MM;
  return lengths.map((length) => Math.round(length / step) * step);
}

/** The key that turns an item about the vertical, or null; a walking person faces its way. */
export function turnKey(item) {
  const facesWay = item.keys.person && item.way && item.keys.faces !== "fixed";
  return facesWay ? null : (TURNED[item.kind] ?? null);
}

export function turnOf(item) {
  return item.keys[turnKey(item)] ?? 0;
}

/** The center of rotation, meters. */
export function centerOf(item) {
  return item.at_m ?? placeOf(item).map((length) => length / 1000);
}

/** How far an item reaches from its position towards an angle, meters. */
export function reachTowards(item, degrees) {
  const [x, y] = item.at_m;
  const [across, along] = directionOf(degrees);
  return Math.max(0, ...outlineOf(item).map(([cornerX, cornerY]) => (cornerX - x) * across + (cornerY - y) * along));
}

export function directionOf(degrees) {
  const angle = (degrees * Math.PI) / 180;
  return [Math.cos(angle), Math.sin(angle)];
}

/** The corners of all outlines of an item, meters. */
export function outlineOf(item) {
  return item.bodies?.flatMap((body) => body.outline_m) ?? [];
}

/** Where the turn handle is: in the direction the item faces, `beside` meters outside it, on its level. */
export function handleOf(item, beside) {
  const [x, y, z] = centerOf(item);
  const [across, along] = directionOf(turnOf(item));
  const outline = outlineOf(item);
  const reach = Math.max(0, ...outline.map(([cornerX, cornerY]) => Math.hypot(cornerX - x, cornerY - y)));
  const arm = Math.min(reach, REACH_MAX_M) + beside;
  return [x + across * arm, y + along * arm, z];
}

/** The angle when the handle is dragged to a point, degrees. */
export function turnTowards(center, at, coarse) {
  const step = coarse ? TURN_STEP_COARSE : TURN_STEP;
  const degrees = (Math.atan2(at[1] - center[1], at[0] - center[0]) * 180) / Math.PI;
  return Math.round(degrees / step) * step;
}

/** The selected item if it has a turn handle (waypoints have none), or null. */
export function turnable(scene, chosen) {
  const item = itemOf(scene, chosen);
  if (item === null || chosen.row !== undefined || turnKey(item) === null) return null;
  return item.at_m || placeOf(item) !== null ? item : null;
}

/** The edit that turns an item to an angle, which it wraps to -180 to 180 degrees. */
export function turned(item, degrees) {
  return [{ does: "set", path: pathOf(item, turnKey(item)), to: withinHalfTurns(degrees) }];
}

export function withinHalfTurns(degrees) {
  const within = ((((degrees + 180) % 360) + 360) % 360) - 180;
  const rounded = Math.round(within * 100) / 100;
  return rounded === -180 ? 180 : rounded;
}

/** An item in words: kind and name, or the number of a waypoint. */
export function titleOf(scene, chosen) {
  if (chosen?.kind === "room") return "room";
  const item = itemOf(scene, chosen);
  if (item === null) return "nothing";
  const name = `${WORDS[item.kind]} ${item.name}`;
  return chosen.row === undefined ? name : `waypoint ${chosen.row + 1} of ${item.name}`;
}

export const WORDS = { room: "room", object: "object", mosaic: "mosaic", agent: "person", sensor: "sensor" };

/** A name that is not taken. */
export function freeName(scene, kind, stem) {
  const taken = new Set(scene.items.map(({ name }) => name));
  // A sensor's name goes into recordings, so it has no space.
  const between = kind === "sensor" ? "-" : " ";
  for (let number = 1; ; number += 1) {
    const name = `${stem}${between}${number}`;
    if (!taken.has(name)) return name;
  }
}
