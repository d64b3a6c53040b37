// Adds and duplicates items: finds free space and a free name.

import { freeName, outlineOf, placeOf } from "./things.js";

const STEMS = { object: "object", agent: "person", sensor: "sensor" };
// Places to try, as shares of the width and depth of the room, middle first.
const SHARES = [[0.5, 0.5], [0.25, 0.5], [0.75, 0.5], [0.5, 0.25], [0.5, 0.75], [0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]];
const AHEAD_MM = 600;
const SPEED_MM_PER_S = 800;
// Distance between an item and its copy.
const [ASIDE_MM, GAP_MM] = [200, 100];
const NAMES_MAX = 5;

/** The text of a room of this size with a sensor under the middle of its ceiling. */
export function newRoom([x, y, z]) {
  return `[room]
size_mm = [${x}, ${y}, ${z}]
ambient_c = 21

[[sensor]]
name = "ceiling"
preset = "grid-eye"
position_mm = [${x / 2}, ${y / 2}, ${z}]
elevation_deg = 90
azimuth_deg = -90
`;
}

/** Adds an object, person or sensor; returns whether there was space. */
export async function newThing(draft, kind) {
  const { low_m: low, high_m: high } = draft.scene.drawing.room;
  const name = freeName(draft.scene, kind, STEMS[kind]);
  const level = (kind === "sensor" ? high[2] : low[2]) * 1000;
  const ways = SHARES.map((share) => {
    const [x, y] = share.map((part, axis) => Math.round((low[axis] + part * (high[axis] - low[axis])) * 100) * 10);
    return [{ does: "add", kind, name, at_mm: [x, y, level] }];
  });
  return doBest(draft, ways);
}

/** Adds a waypoint after `row`, or gives a standing person a trajectory; returns the row of the new waypoint, or null. */
export async function newWay(draft, item, row) {
  return item.way ? another(draft, item, row) : first(draft, item);
}

/** Duplicates an item next to it, with a trajectory of its own; returns whether there was space. */
export async function copyOf(draft, item) {
  const { kind, index, name } = item;
  const copied = freeName(draft.scene, kind, name.replace(/[ -]\d+$/, ""));
  const edit = { does: "copy", path: [kind, index], name: copied };
  const copy = [kind, draft.scene.items.filter((one) => one.kind === kind).length];
  const far = Math.max(ASIDE_MM, ...(item.keys.size_mm?.slice(0, 2) ?? sidesOf(item))) + GAP_MM;
  if (!item.way) {
    const places = around(draft, placeOf(item), far);
    return doBest(draft, places.map((to) => [edit, { does: "set", path: [...copy, "position_mm"], to }]));
  }
  const file = filesFor(draft, copied)[0];
  const begins = placeOf(item);
  const ways = around(draft, begins, far).map((place) => {
    const points = item.way.points_m.map((point) => point.map((meters, axis) => meters * 1000 + place[axis] - begins[axis]));
    return [edit, { does: "new-way", file, points_mm: points }, { does: "set", path: [...copy, "trajectory"], to: file }];
  });
  // A person whose trajectory has times shares it: new trajectories have none.
  return doBest(draft, [...ways, [edit]]);
}

async function another(draft, { way: { file, points_m: points } }, row) {
  const after = row ?? points.length - 1;
  const here = points[after].map((meters) => meters * 1000);
  const next = points[after + 1]?.map((meters) => meters * 1000);
  const isFree = (place) => points.every(([x, y]) => Math.hypot(x * 1000 - place[0], y * 1000 - place[1]) > ASIDE_MM);
  const places = next ? [here.map((length, axis) => Math.round((length + next[axis]) / 2))] : around(draft, here, AHEAD_MM).filter(isFree);
  const ways = places.map((place) => [{ does: "add-way-point", file, after, at_mm: place }]);
  return (await doBest(draft, ways)) ? after + 1 : null;
}

async function first(draft, item) {
  const here = placeOf(item);
  const { index } = item;
  // Who is told to stand would glide.
  const walks = item.keys.person?.posture === "stand" ? [{ does: "unset", path: ["agent", index, "person", "posture"] }] : [];
  // A file that exists belongs to something else, so the next name is tried.
  const ways = filesFor(draft, item.name).flatMap((file) => around(draft, here, AHEAD_MM).map((place) => [
    { does: "new-way", file, points_mm: [here, place] },
    { does: "set", path: ["agent", index, "trajectory"], to: file },
    { does: "set", path: ["agent", index, "speed_mm_per_s"], to: SPEED_MM_PER_S },
    { does: "unset", path: ["agent", index, "position_mm"] },
    ...walks,
  ]));
  return (await doBest(draft, ways)) ? 1 : null;
}

/** File names for a person's trajectory, simplest first. */
function filesFor(draft, name) {
  const stem = `trajectories/${slug(draft.name ?? "scene")}-${slug(name)}`;
  return Array.from({ length: NAMES_MAX }, (_, number) => (number === 0 ? `${stem}.csv` : `${stem}-${number + 1}.csv`));
}

/** Applies the best alternative; if all fail, the first, so that its error is shown. */
async function doBest(draft, ways) {
  return draft.apply((await draft.best(ways)) ?? ways[0]);
}

/** Places next to a position, the nearest to the middle of the room first. */
function around(draft, [x, y, z], far) {
  const { low_m: low, high_m: high } = draft.scene.drawing.room;
  const middle = [0, 1].map((axis) => (low[axis] + high[axis]) * 500);
  const places = [[far, 0], [0, far], [-far, 0], [0, -far]].map(([dx, dy]) => [x + dx, y + dy, z]);
  const away = ([placeX, placeY]) => Math.hypot(placeX - middle[0], placeY - middle[1]);
  return places.sort((one, other) => away(one) - away(other));
}

/** Width and depth of an item's outline, millimeters. */
function sidesOf(item) {
  return [0, 1].map((axis) => outlineOf(item).map((corner) => corner[axis])).filter((ends) => ends.length > 0)
    .map((ends) => Math.ceil((Math.max(...ends) - Math.min(...ends)) * 100) * 10);
}

/** Letters and digits that every file system takes. */
function slug(name) {
  return name.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "") || "trajectory";
}
