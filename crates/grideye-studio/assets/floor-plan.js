// The scene from above, to take hold of: drag moves, the round handle turns, the ground pans, the wheel zooms.

import { CoverageHatch } from "./hatch.js";
import { weightOf, withRoom } from "./names.js";
import { centerOf, handleOf, isSame, onGrid, placeOf, turnOf, turnTowards, turnable } from "./things.js";

const SVG = "http://www.w3.org/2000/svg";
// Of the room's longer side, around it.
const MARGIN = 0.06;
// In pixels of the screen.
const DOT = 7;
const POINT = 6;
const HANDLE = 9;
const LETTERS = 12;
const ARM = 34;
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
   * `on.choose` is told what was taken hold of, `on.move(place)` and `on.turn(degrees)` where it goes, with the time of the
   * event, and `on.drop` that it was let go.
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

  /** Draws a scene, and what of it is chosen. */
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

  /** Lays a map of what is seen over the floor, or with `null` none. */
  cover(map) {
    this.#hatch.draw(this.#layers.cover, map);
  }

  /** The whole room. */
  home() {
    if (this.#scene === null) return;
    const [xs, ys] = [0, 1].map((axis) => this.#scene.room.outline_m.map((corner) => corner[axis]));
    const [left, right, front, back] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const margin = MARGIN * Math.max(right - left, back - front);
    this.#home = [left - margin, -back - margin, right - left + 2 * margin, back - front + 2 * margin];
    this.#view = [...this.#home];
    this.#draw();
  }

  /** Nearer or farther, about the middle. */
  zoom(nearer) {
    if (this.#view === null) return;
    const [x, y, width, height] = this.#view;
    this.#zoomAbout([x + width / 2, y + height / 2], nearer ? 1 / ZOOM_STEP : ZOOM_STEP);
  }

  /** A pixel of the screen in meters. */
  #measure() {
    const box = this.#svg.getBoundingClientRect();
    const [, , width, height] = this.#view;
    this.#unit = Math.max(width / Math.max(1, box.width), height / Math.max(1, box.height));
  }

  #draw() {
    if (this.#scene === null || this.#view === null) return;
    const { items, room } = this.#scene;
    // Once, before anything changes: to measure in between would lay out the page again each time.
    this.#measure();
    this.#svg.setAttribute("viewBox", this.#view.join(" "));
    this.#hatch.scale(this.#unit);
    this.#layers.ground.replaceChildren(polygon("room", room.outline_m));
    const bodies = items.filter(({ kind }) => kind !== "sensor").flatMap((item) => this.#bodies(item));
    const sensors = items.filter(({ kind }) => kind === "sensor");
    const views = sensors.filter((sensor) => sensor.in_view_m).map((sensor) => this.#view_of(sensor));
    const ways = items.filter(({ way }) => way).flatMap((item) => this.#way(item));
    this.#layers.things.replaceChildren(...views, ...bodies, ...ways, ...sensors.filter(({ at_m: at }) => at).map((sensor) => this.#sensor(sensor)));
    const names = withRoom(items.flatMap((item) => this.#name(item)), LETTERS * this.#unit);
    this.#layers.names.replaceChildren(...names.map(({ kind, words, at }) => this.#text(kind, words, at, 1)));
    this.#layers.handles.replaceChildren(...this.#handles());
  }

  #bodies(item) {
    const chosen = this.#is(item);
    return (item.bodies ?? []).map(({ outline_m: outline }) => marked(polygon(`${item.kind} body${chosen}`, outline), item));
  }

  #is(item) {
    return isSame(this.#chosen, { kind: item.kind, index: item.index }) ? " chosen" : "";
  }

  #view_of(sensor) {
    return polygon(`view${this.#is(sensor)}`, sensor.in_view_m);
  }

  /** A square, so that it differs from a way-point by more than color, with a line to where it heads. */
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
      const dot = element("circle", { class: `way-point${chosen}`, cx: x, cy: -y, r: POINT * this.#unit });
      dot.dataset.row = row;
      const number = this.#text("number", row + 1, [x, -y + 0.33 * LETTERS * this.#unit], 0.8);
      return [marked(dot, item), number];
    });
    return [line("way", points), ...dots.flat()];
  }

  #name(item) {
    const at = item.at_m ?? middle(item.bodies?.[0]?.outline_m);
    if (!at) return [];
    const chosen = this.#is(item);
    return [{ kind: `name${chosen}`, words: item.name, at: [at[0], -at[1] + underOf(item) * this.#unit], weight: weightOf(item, chosen !== "") }];
  }

  /** The round handle that turns what is chosen. */
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
      // A click that trembles moves nothing.
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

  /** By a factor, about a place that stays. */
  #zoomAbout([atX, atY], factor) {
    const [x, y, width, height] = this.#view;
    const wanted = Math.min(this.#home[2] * 2, Math.max(this.#home[2] / ZOOM_MAX, width * factor));
    const by = wanted / width;
    this.#view = [atX - (atX - x) * by, atY - (atY - y) * by, wanted, height * by];
    this.#draw();
  }

  /** Where in the room the pointer is, meters. */
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

/** Says of a shape what it is a part of. */
function marked(shape, { kind, index, name }) {
  shape.dataset.kind = kind;
  shape.dataset.index = index;
  shape.dataset.name = name;
  const title = element("title", {});
  title.textContent = name;
  shape.append(title);
  return shape;
}

/** Right is right, back is up. */
const onPage = (points) => points.map(([x, y]) => `${x},${-y}`).join(" ");
const polygon = (kind, points) => element("polygon", { class: kind, points: onPage(points) });
const line = (kind, points) => element("polyline", { class: kind, points: onPage(points) });

/** How far below a thing its name is: beside what a hand takes hold of there, and not on the side of its handle. */
function underOf(item) {
  if (item.way) return -1.1 * LETTERS;
  if (item.kind !== "sensor") return 0.35 * LETTERS;
  return turnOf(item) < 0 ? -1.1 * LETTERS : DOT + LETTERS;
}

function middle(points) {
  if (!points) return null;
  const sum = points.reduce(([sumX, sumY], [x, y]) => [sumX + x, sumY + y], [0, 0]);
  return sum.map((total) => total / points.length);
}
