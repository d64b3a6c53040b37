// The plan: drag moves an item, the round handle turns it, the background pans, the wheel zooms.

import { CoverageHatch } from "./hatch.js";
import { weightOf, withRoom } from "./names.js";
import { centerOf, directionOf, handleOf, isOf, isSame, onGrid, outlineOf, placeOf, reachTowards, turnOf, turnTowards, turnable } from "./things.js";

const SVG = "http://www.w3.org/2000/svg";
// Margin, as a share of the longer side of the room.
const MARGIN = 0.06;
// Screen pixels.
const DOT = 7;
const POINT = 6;
const HANDLE = 9;
const LETTERS = 12;
const ARM = 34;
// The mark in front of a person: its distance and its size.
const [FRONT_GAP, FRONT] = [4, 8];
const ZOOM_STEP = 1.25;
const ZOOM_MAX = 20;

export class FloorPlan {
  #svg;
  #layers = {};
  #hatch = new CoverageHatch();
  #scene = null;
  #chosen = null;
  #view = null;
  #home = null;
  #unit = 1;
  #held = null;
  #on;

  /**
   * Calls `on.choose` with what was pressed, `on.move(held, place)` and `on.turn(degrees)` with the time of the event while it
   * is dragged, and `on.drop` at the end.
   */
  constructor(svg, on) {
    this.#svg = svg;
    this.#on = on;
    for (const name of ["ground", "cover", "things", "names", "handles"]) this.#layers[name] = element("g", { class: name });
    svg.replaceChildren(this.#hatch.patterns, ...Object.values(this.#layers));
    svg.addEventListener("pointerdown", (event) => this.#press(event));
    svg.addEventListener("pointermove", (event) => this.#drag(event));
    for (const end of ["pointerup", "pointercancel"]) svg.addEventListener(end, (event) => this.#release(event));
    svg.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    new ResizeObserver(() => this.#draw()).observe(svg);
  }

  /** Draws a scene with the selection marked. */
  show(scene, chosen) {
    const other = this.#scene === null || scene === null || String(scene.room.outline_m) !== String(this.#scene.room.outline_m);
    this.#scene = scene;
    this.#chosen = chosen;
    if (scene === null) this.#clear();
    else if (other) this.home();
    else this.#draw();
  }

  #clear() {
    for (const layer of Object.values(this.#layers)) layer.replaceChildren();
  }

  /** Draws the coverage map; null removes it. */
  cover(map) {
    this.#hatch.draw(this.#layers.cover, map);
    this.#svg.dataset.covered = map !== null;
  }

  /** Fits the room. */
  home() {
    if (this.#scene === null) return;
    const [xs, ys] = [0, 1].map((axis) => this.#scene.room.outline_m.map((corner) => corner[axis]));
    const [left, right, front, back] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const margin = MARGIN * Math.max(right - left, back - front);
    this.#home = [left - margin, -back - margin, right - left + 2 * margin, back - front + 2 * margin];
    this.#view = [...this.#home];
    this.#draw();
  }

  /** Zooms about the middle. */
  zoom(nearer) {
    if (this.#view === null) return;
    const [x, y, width, height] = this.#view;
    this.#zoomAbout([x + width / 2, y + height / 2], nearer ? 1 / ZOOM_STEP : ZOOM_STEP);
  }

  /** Measures a screen pixel in meters. */
  #measure() {
    const box = this.#svg.getBoundingClientRect();
    const [, , width, height] = this.#view;
    this.#unit = Math.max(width / Math.max(1, box.width), height / Math.max(1, box.height));
  }

  #draw() {
    if (this.#scene === null || this.#view === null) return;
    const { items, room, drawing } = this.#scene;
    for (const [kind, color] of Object.entries(drawing.colors)) this.#svg.style.setProperty(`--${kind}`, color);
    // Measured before anything changes: later it would force another layout of the page.
    this.#measure();
    this.#svg.setAttribute("viewBox", this.#view.join(" "));
    this.#hatch.scale(this.#unit);
    this.#layers.ground.replaceChildren(polygon("room", room.outline_m));
    const bodies = items.filter(({ kind }) => kind !== "sensor").flatMap((item) => this.#bodies(item));
    const sensors = items.filter(({ kind }) => kind === "sensor");
    const views = sensors.filter((sensor) => sensor.in_view_m).flatMap((sensor) => this.#viewOf(sensor));
    const ways = items.filter(({ way }) => way).flatMap((item) => this.#way(item));
    const shade = element("g", { class: "shade" });
    shade.append(...sensors.filter(({ reach_m: outline }) => outline?.length > 2).map((sensor) => polygon("", sensor.reach_m)));
    this.#layers.things.replaceChildren(...bodies, shade, ...views, ...ways, ...sensors.filter(({ at_m: at }) => at).map((sensor) => this.#sensor(sensor)));
    const people = items.filter(({ kind, bodies }) => kind === "agent" && bodies?.length > 0).map(boxOf);
    const names = withRoom(items.flatMap((item) => this.#name(item)), LETTERS * this.#unit, people);
    this.#layers.names.replaceChildren(...names.map(({ kind, words, at }) => this.#text(kind, words, at, 1)));
    this.#layers.handles.replaceChildren(...this.#handles());
  }

  #bodies(item) {
    const chosen = this.#is(item);
    if (item.keys.person && item.bodies) return this.#person(item, chosen);
    return (item.bodies ?? []).map(({ outline_m: outline }) => this.#colored(polygon(`${item.kind} body${chosen}`, outline), item));
  }

  /** A shape of an item in the color that it has in every drawing. */
  #colored(shape, item) {
    const color = this.#scene.drawing.shapes.find((one) => isOf(item, one))?.color;
    if (color) shape.style.setProperty("--color", color);
    return marked(shape, item);
  }

  /** A person is one shape, with a mark in front of it. */
  #person(item, chosen) {
    const outlines = item.bodies.map(({ outline_m: outline }) => `M${onPage(outline)}Z`);
    const body = this.#colored(element("path", { class: `agent body person${chosen}`, d: outlines.join("") }), item);
    const [x, y] = item.at_m;
    const [across, along] = directionOf(item.faces_deg);
    const at = (ahead, aside) => [x + ahead * across - aside * along, y + ahead * along + aside * across];
    const from = reachTowards(item, item.faces_deg) + FRONT_GAP * this.#unit;
    const size = FRONT * this.#unit;
    const front = marked(polygon(`front${chosen}`, [at(from + size, 0), at(from, 0.8 * size), at(from, -0.8 * size)]), item);
    front.dataset.faces = item.faces_deg;
    return [body, front];
  }

  #is(item) {
    return isSame(this.#chosen, { kind: item.kind, index: item.index }) ? " chosen" : "";
  }

  /** The field of view as far as the walls, and what it covers of the floor. */
  #viewOf(sensor) {
    const shapes = [["reach", sensor.reach_m], ["view", sensor.in_view_m]];
    return shapes.filter(([, outline]) => outline.length > 2).map(([kind, outline]) => {
      const shape = polygon(`${kind}${this.#is(sensor)}`, outline);
      shape.dataset.sensor = sensor.name;
      return shape;
    });
  }

  /** A square, so that its shape differs from a waypoint, with a line in its direction. */
  #sensor(sensor) {
    const [x, y] = sensor.at_m;
    const size = DOT * this.#unit;
    const group = marked(element("g", { class: `sensor${this.#is(sensor)}` }), sensor);
    const [forward] = sensor.axes;
    const reach = 3 * size;
    group.append(
      element("line", { x1: x, y1: -y, x2: x + forward[0] * reach, y2: -y - forward[1] * reach }),
      element("rect", { x: x - size, y: -y - size, width: 2 * size, height: 2 * size }),
    );
    return group;
  }

  #way(item) {
    const points = item.way.points_m;
    const dots = points.map(([x, y], row) => {
      const chosen = isSame(this.#chosen, { kind: item.kind, index: item.index, row }) ? " chosen" : "";
      const dot = element("circle", { class: `waypoint${chosen}`, cx: x, cy: -y, r: POINT * this.#unit });
      dot.dataset.row = row;
      const number = this.#text("number", row + 1, [x, -y + 0.33 * LETTERS * this.#unit], 0.8);
      return [marked(dot, item, `waypoint ${row + 1} of ${item.name}`), number];
    });
    return [line("way", points), ...dots.flat()];
  }

  #name(item) {
    const at = item.at_m ?? middle(item.bodies?.[0]?.outline_m);
    if (!at) return [];
    const chosen = this.#is(item);
    const [x, y] = [at[0], -at[1]];
    const { top, bottom } = outlineOf(item).length > 0 ? boxOf(item) : { top: y, bottom: y };
    const [above, below] = [[x, top - 0.35 * LETTERS * this.#unit], [x, bottom + 1.1 * LETTERS * this.#unit]];
    const [first, ...others] = item.kind === "agent" ? [below, above] : [[x, y + underOf(item) * this.#unit], below, above];
    return [{ kind: `name${chosen}`, words: item.name, at: first, others, weight: weightOf(item, chosen !== "") }];
  }

  /** The round handle that turns the selection. */
  #handles() {
    const item = turnable(this.#scene, this.#chosen);
    if (item === null) return [];
    const [[x, y], [handleX, handleY]] = [centerOf(item), handleOf(item, ARM * this.#unit)];
    const handle = element("circle", { class: "turn", cx: handleX, cy: -handleY, r: HANDLE * this.#unit });
    handle.dataset.turns = "true";
    return [element("line", { class: "arm", x1: x, y1: -y, x2: handleX, y2: -handleY }), handle];
  }

  #text(kind, words, [x, y], size) {
    const text = element("text", { class: kind, x, y, "font-size": LETTERS * size * this.#unit, "text-anchor": "middle" });
    text.textContent = words;
    return text;
  }

  #press(event) {
    if (!event.isPrimary || event.button !== 0 || this.#scene === null) return;
    const [at, target] = [this.#at(event), event.target.closest("[data-turns], [data-kind]")];
    if (target?.dataset.turns) {
      this.#held = { turns: true, center: centerOf(turnable(this.#scene, this.#chosen)) };
    } else if (target) {
      const { kind, index, row } = target.dataset;
      const chosen = { kind, index: Number(index), ...(row === undefined ? {} : { row: Number(row) }) };
      this.#on.choose(chosen);
      const item = this.#scene.items.find((one) => one.kind === kind && one.index === chosen.index);
      this.#held = { item, row: chosen.row, from: placeOf(item, chosen.row), at, moved: false };
    } else {
      this.#held = { pans: true, at: [event.clientX, event.clientY], view: [...this.#view], moved: false };
    }
    this.#svg.setPointerCapture(event.pointerId);
    this.#svg.focus({ preventScroll: true });
    event.preventDefault();
  }

  #drag(event) {
    const held = this.#held;
    if (held === null || !event.isPrimary) return;
    if (held.turns) {
      this.#on.turn(turnTowards(held.center, this.#at(event), event.shiftKey), event.timeStamp);
    } else if (held.pans) {
      const unit = this.#unit;
      const [x, y, width, height] = held.view;
      this.#view = [x - (event.clientX - held.at[0]) * unit, y - (event.clientY - held.at[1]) * unit, width, height];
      held.moved ||= Math.hypot(event.clientX - held.at[0], event.clientY - held.at[1]) > 3;
      this.#draw();
    } else if (held.from !== null) {
      const [x, y] = this.#at(event);
      const [dx, dy] = [(x - held.at[0]) * 1000, (y - held.at[1]) * 1000];
      // An unsteady click moves nothing.
      held.moved ||= Math.hypot(dx, dy) / 1000 > 3 * this.#unit;
      if (!held.moved) return;
      const [toX, toY] = onGrid([held.from[0] + dx, held.from[1] + dy], event.altKey);
      this.#on.move(held, [toX, toY, held.from[2]], event.timeStamp);
    }
  }

  #release(event) {
    if (this.#held === null || !event.isPrimary) return;
    const held = this.#held;
    this.#held = null;
    if (held.pans && !held.moved) this.#on.choose(null);
    this.#on.drop();
    this.#draw();
  }

  #wheel(event) {
    if (this.#view === null) return;
    event.preventDefault();
    const [x, y] = this.#at(event);
    this.#zoomAbout([x, -y], ZOOM_STEP ** (event.deltaY > 0 ? 0.5 : -0.5));
  }

  /** Zooms by a factor about a fixed point. */
  #zoomAbout([atX, atY], factor) {
    const [x, y, width, height] = this.#view;
    const wanted = Math.min(this.#home[2] * 2, Math.max(this.#home[2] / ZOOM_MAX, width * factor));
    const by = wanted / width;
    this.#view = [atX - (atX - x) * by, atY - (atY - y) * by, wanted, height * by];
    this.#draw();
  }

  /** The pointer in the room, meters. */
  #at(event) {
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(this.#svg.getScreenCTM().inverse());
    return [at.x, -at.y];
  }
}

export function element(name, attributes) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

/** Marks a shape with its item. */
function marked(shape, { kind, index, name }, words = name) {
  shape.dataset.kind = kind;
  shape.dataset.index = index;
  shape.dataset.name = name;
  const title = element("title", {});
  title.textContent = words;
  shape.append(title);
  return shape;
}

/** Right is right, back is up. */
const onPage = (points) => points.map(([x, y]) => `${x},${-y}`).join(" ");
const polygon = (kind, points) => element("polygon", { class: kind, points: onPage(points) });
const line = (kind, points) => element("polyline", { class: kind, points: onPage(points) });

/** How far below an item its name is, so that it covers neither the item nor its handle. */
function underOf(item) {
  if (item.kind !== "sensor") return 0.35 * LETTERS;
  return turnOf(item) < 0 ? -1.1 * LETTERS : DOT + LETTERS;
}

/** The box around all outlines of an item on the page. */
function boxOf(item) {
  const [xs, ys] = [0, 1].map((axis) => outlineOf(item).map((corner) => corner[axis]));
  return { left: Math.min(...xs), right: Math.max(...xs), top: -Math.max(...ys), bottom: -Math.min(...ys) };
}

function middle(points) {
  if (!points) return null;
  const sum = points.reduce(([sumX, sumY], [x, y]) => [sumX + x, sumY + y], [0, 0]);
  return sum.map((total) => total / points.length);
}
