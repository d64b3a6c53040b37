// A room in 3-D, with what each pixel sees in its color. A drag turns it, two fingers or the wheel zoom. In the editor a drag
// moves an item on its level, with Shift up and down, and the round handle turns it. As a plan it is seen from above: the
// background is dragged along, and Shift moves nothing up.

import { weightOf, withRoom } from "./names.js";
import { Eye, facing, farToNear, flat, pathOf, round, shaded } from "./solids.js";
import { centerOf, directionOf, handleOf, isOf, isSame, onGrid, outlineOf, placeOf, reachTowards, turnTowards, turnable } from "./things.js";

const FIRST = { azimuth: -115, elevation: 32, nearer: 1 };
const ABOVE = { azimuth: -90, elevation: 90, nearer: 1, over: [0, 0] };
const NEARER = 1.1;
const ELEVATION_MAX = 89;
const TURN_STEP = 10;
const ZOOM_STEP = 1.15;
const [NEARER_MIN, NEARER_MAX] = [0.4, 20];
const DEGREES_A_PIXEL = 0.4;
const DOT = 6;
const LETTERS = 12;
// The mark in front of a person: its distance and its size.
const [FRONT_GAP, FRONT] = [4, 8];
// How much a footprint hides of its surface, and what is in view of the plan.
const [FOOTPRINT, VIEW] = [0.85, 0.25];
// The arm keeps a minimum length when seen at a flat angle.
const [HANDLE, ARM, ARM_MIN] = [9, 34, 26];
// A drawing that takes longer than the first waits until nothing has moved for the second.
const [QUICK_MS, REST_MS] = [6, 120];

export class RoomView {
  #canvas;
  #scene = null;
  #chosen = null;
  #first;
  #camera;
  #shapes = [];
  #held = null;
  #on;
  #isPlan;
  #cover = null;
  #asked = null;
  #rests = false;
  #tookMs = 0;
  #colors = [];
  #fingers = new Map();

  /**
   * Calls `on.choose` with what was pressed, `on.move(held, place)` and `on.turn(degrees)` with the time of the event while it
   * is dragged, and `on.drop` at the end; without `on` nothing can be moved.
   */
  constructor(canvas, { on = null, isPlan = false } = {}) {
    this.#canvas = canvas;
    this.#on = on;
    this.#isPlan = isPlan;
    // Without handles there is no need for room around it.
    this.#first = isPlan ? ABOVE : { ...FIRST, nearer: on === null ? NEARER : FIRST.nearer };
    this.home();
    canvas.addEventListener("pointerdown", (event) => this.#press(event));
    canvas.addEventListener("pointermove", (event) => this.#drag(event));
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => this.#release(event));
    canvas.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    // The keys of the editor move what is chosen on the plan.
    if (!isPlan) canvas.addEventListener("keydown", (event) => this.#key(event));
    new ResizeObserver(() => this.#fit()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.#later());
  }

  show(scene, chosen) {
    if (this.#isPlan && String(scene?.room.outline_m) !== String(this.#scene?.room.outline_m)) this.home();
    this.#scene = scene;
    this.#chosen = chosen;
    this.#later();
  }

  /** The color of each pixel of each sensor, in the scene's order: lists of CSS colors, or null for a sensor without a frame. */
  color(colors) {
    this.#colors = colors;
    this.#later();
  }

  /** Draws on the floor with `draw(context, eye, look)`; null for nothing. */
  cover(draw) {
    this.#cover = draw;
    this.#later();
  }

  /**
   * Draws once for many requests: before the next paint, or in the editor if drawing is slow, once the pointer rests, so that
   * plan and frames never wait for it. Who turns the view sees it turn.
   */
  #later(waits = this.#on !== null && !this.#isPlan) {
    const isSlow = waits && this.#tookMs > QUICK_MS;
    if (this.#asked !== null && !isSlow && !this.#rests) return;
    clearTimeout(this.#asked);
    this.#rests = isSlow;
    this.#asked = setTimeout(() => requestAnimationFrame(() => {
      this.#asked = null;
      const began = performance.now();
      this.#draw();
      this.#tookMs = performance.now() - began;
    }), isSlow ? REST_MS : 0);
  }

  #fit() {
    const [width, height] = [this.#canvas.clientWidth, this.#canvas.clientHeight].map((side) => Math.max(1, Math.round(side * devicePixelRatio)));
    if (this.#canvas.width === width && this.#canvas.height === height) return;
    Object.assign(this.#canvas, { width, height });
    // A canvas of another size is blank, and must not be painted so.
    this.#draw();
  }

  #draw() {
    const context = this.#canvas.getContext("2d");
    context.clearRect(0, 0, this.#canvas.width, this.#canvas.height);
    if (this.#scene === null) return;
    const look = this.look;
    const eye = new Eye(this.#scene.drawing.room, this.#camera, this.#canvas);
    context.lineJoin = "round";
    this.#room(context, eye, look);
    const { items, drawing } = this.#scene;
    if (this.#cover !== null) this.#cover(context, eye, look);
    else if (this.#isPlan) this.#views(context, drawing.sensors, eye, look);
    for (const { corners_m: corners, footprints } of drawing.sides) {
      if (facing(corners, eye) > 0) this.#footprints(context, footprints, eye);
    }
    const owners = drawing.shapes.map((shape) => items.find((item) => isOf(item, shape)) ?? null);
    this.#shapes = [];
    const outlined = new Set();
    farToNear(drawing, eye, (drawn) => {
      const [shape, item] = [drawing.shapes[drawn.shape], owners[drawn.shape]];
      if (drawn.corners_m) {
        const face = flat(drawn, shape.is_closed, eye);
        this.#flat(context, face, shape, item, look);
        if (face !== null) this.#footprints(context, drawn.footprints, eye);
        return;
      }
      if (!outlined.has(item)) this.#outline(context, drawing.rounds.filter((one) => owners[one.shape] === item), item, eye, look);
      outlined.add(item);
      const seen = round(drawn, eye);
      this.#round(context, seen, shape, item);
      if (drawn.footprints.length === 0) return;
      context.save();
      context.clip(seen.path);
      this.#footprints(context, drawn.footprints, eye);
      context.restore();
    });
    if (this.#isPlan) for (const item of items) this.#front(context, item, eye, look);
    for (const item of items) this.#lines(context, item, eye, look);
    this.#names(context, items, eye, look);
    this.#handle(context, eye, look);
    this.#canvas.dataset.second = this.#scene.at_s ?? "";
    const { azimuth, elevation, nearer } = this.#camera;
    const [left, top] = eye.see([0, 0, 0]).map((side) => side / devicePixelRatio);
    this.#canvas.dataset.drawn = this.#isPlan ? `${left} ${top} ${eye.meter([0, 0, 0]) / devicePixelRatio}` : `${azimuth} ${elevation} ${nearer.toFixed(2)}`;
    this.#canvas.dataset.faces = items.filter(({ faces_deg: faces }) => faces !== undefined).map(({ name, faces_deg: faces }) => `${name}: ${faces}`).join("\n");
  }

  /** All that sensors have in view, on the floor and the walls; where they overlap it is not darker. */
  #views(context, sensors, eye, look) {
    const all = new Path2D();
    for (const { view_m: view } of sensors) for (const face of view) all.addPath(pathOf(face.map((corner) => eye.see(corner))));
    context.globalAlpha = VIEW;
    context.fillStyle = look.view;
    context.fill(all);
    context.globalAlpha = 1;
  }

  /** The mark in front of a person. */
  #front(context, item, eye, look) {
    if (item.faces_deg === undefined) return;
    const [x, y, z] = item.at_m;
    const [across, along] = directionOf(item.faces_deg);
    const pixel = devicePixelRatio / eye.meter(item.at_m);
    const from = reachTowards(item, item.faces_deg) + FRONT_GAP * pixel;
    const size = FRONT * pixel;
    const corners = [[from + size, 0], [from, 0.8 * size], [from, -0.8 * size]];
    const path = pathOf(corners.map(([ahead, aside]) => eye.see([x + ahead * across - aside * along, y + ahead * along + aside * across, z])));
    context.fillStyle = this.#is(item) ? look.accent : look.text;
    context.fill(path);
    this.#shapes.push({ path, item });
  }

  /** What pixels see of a surface, each in its color; what faces away from the eye is hidden. */
  #footprints(context, footprints, eye) {
    context.globalAlpha = FOOTPRINT;
    for (const [sensor, pixel, corners] of footprints) {
      const color = this.#colors[sensor]?.[pixel];
      if (color === undefined || facing(corners, eye) <= 0) continue;
      context.fillStyle = color;
      context.beginPath();
      for (const corner of corners) context.lineTo(...eye.see(corner));
      context.fill();
    }
    context.globalAlpha = 1;
  }

  /** The colors of the scheme, which the canvas's style has, and the letters. */
  get look() {
    const style = getComputedStyle(this.#canvas);
    return {
      text: style.color, accent: style.caretColor, view: this.#scene?.drawing.colors.view, edge: this.#scene?.drawing.colors["view-edge"], faint: style.textEmphasisColor, ground: style.backgroundColor,
      letters: `600 ${LETTERS * devicePixelRatio}px system-ui, sans-serif`,
      numbers: `600 ${0.8 * LETTERS * devicePixelRatio}px system-ui, sans-serif`,
      good: style.columnRuleColor, warn: style.textDecorationColor, bad: style.webkitTextStrokeColor,
    };
  }

  #room(context, eye, look) {
    const { room: { outline_m: outline }, drawing: { room: { low_m: low, sides_m: sides } } } = this.#scene;
    const floor = pathOf(outline.map(([x, y]) => eye.see([x, y, low[2]])));
    context.fillStyle = look.ground;
    context.fill(floor);
    context.strokeStyle = look.faint;
    context.lineWidth = devicePixelRatio;
    for (const side of sides) context.stroke(pathOf(side.map((corner) => eye.see(corner))));
    context.strokeStyle = look.text;
    context.lineWidth = 2 * devicePixelRatio;
    context.stroke(floor);
  }

  #flat(context, face, { kind, color }, item, look) {
    if (face === null) return;
    const { path, lines, shade } = face;
    const chosen = item !== null && this.#is(item);
    context.fillStyle = shaded(color, shade);
    // What is behind a wall that juts into the room shows through.
    context.globalAlpha = kind === "wall" ? 0.3 : 1;
    context.fill(path);
    context.globalAlpha = 1;
    // Covers the seams between faces.
    context.strokeStyle = context.fillStyle;
    context.lineWidth = 0.5 * devicePixelRatio;
    if (kind !== "wall") context.stroke(path);
    context.strokeStyle = chosen ? look.accent : kind === "wall" ? look.faint : shaded(color, 0.5);
    context.lineWidth = (chosen ? 2 : 0.7) * devicePixelRatio;
    context.stroke(lines);
    if (item !== null) this.#shapes.push({ path, item });
  }

  /** Outlines a person: its segments, drawn over it, leave the outline of the whole body. */
  #outline(context, segments, item, eye, look) {
    const chosen = this.#is(item);
    context.strokeStyle = chosen ? look.accent : look.faint;
    context.lineWidth = (chosen ? 5 : 2) * devicePixelRatio;
    for (const segment of segments) context.stroke(round(segment, eye).path);
  }

  /** A segment of a person, brightest where it faces the light. */
  #round(context, { path, ellipse: { at: [x, y], half: [long, short], turn }, light, place: [across, down] }, { color }, item) {
    const [bright, dark] = light.map((shade) => shaded(color, shade));
    context.save();
    context.translate(x, y);
    context.rotate(turn);
    context.scale(long, short);
    const shades = context.createRadialGradient(across, down, 0, across, down, 1 + Math.hypot(across, down));
    shades.addColorStop(0, bright);
    shades.addColorStop(1, dark);
    context.fillStyle = shades;
    context.beginPath();
    context.arc(0, 0, 1, 0, 2 * Math.PI);
    context.fill();
    context.restore();
    this.#shapes.push({ path, item });
  }

  /** Trajectories and fields of view. */
  #lines(context, item, eye, look) {
    const chosen = this.#is(item);
    context.lineWidth = (chosen ? 2 : 1) * devicePixelRatio;
    context.strokeStyle = chosen ? look.accent : look.edge;
    if (item.kind === "sensor" && item.at_m) {
      context.setLineDash([5 * devicePixelRatio, 4 * devicePixelRatio]);
      const from = eye.see(item.at_m);
      const { rays_m: rays, view_m: view } = this.#scene.drawing.sensors.find(({ name }) => name === item.name);
      for (const end of rays) context.stroke(pathOf([from, eye.see(end)], false));
      for (const face of view) context.stroke(pathOf(face.map((corner) => eye.see(corner))));
      context.setLineDash([]);
      this.#dot(context, item, from, look, "square");
    }
    if (!item.way) return;
    const points = item.way.points_m.map((point) => eye.see(point));
    context.strokeStyle = look.text;
    context.setLineDash([2 * devicePixelRatio, 4 * devicePixelRatio]);
    context.stroke(pathOf(points, false));
    context.setLineDash([]);
    if (this.#on !== null) points.forEach((point, row) => this.#dot(context, item, point, look, "round", row));
  }

  #dot(context, item, [x, y], look, form, row) {
    const size = DOT * devicePixelRatio;
    const path = new Path2D();
    if (form === "square") path.rect(x - size, y - size, 2 * size, 2 * size);
    else path.arc(x, y, size, 0, 2 * Math.PI);
    const chosen = isSame(this.#chosen, { kind: item.kind, index: item.index, ...(row === undefined ? {} : { row }) });
    context.fillStyle = chosen ? look.accent : form === "square" ? look.view : look.ground;
    context.strokeStyle = look.text;
    context.lineWidth = 2 * devicePixelRatio;
    context.fill(path);
    context.stroke(path);
    this.#shapes.push({ path, item, row });
    if (row === undefined || !this.#isPlan) return;
    context.fillStyle = chosen ? look.ground : look.text;
    Object.assign(context, { font: look.numbers, textAlign: "center" });
    context.fillText(row + 1, x, y + 0.3 * LETTERS * devicePixelRatio);
  }

  /** Names stand above what they name, or else below it, and cover no person. */
  #names(context, items, eye, look) {
    const letters = LETTERS * devicePixelRatio;
    const boxes = new Map(items.map((item) => [item, boxOf(item, eye)]).filter(([, box]) => box !== null));
    const labels = [...boxes].map(([item, { left, right, top, bottom }]) => {
      const above = item.kind === "sensor" ? 0.75 * letters : 0.35 * letters;
      const [x, under] = [(left + right) / 2, bottom + above + 0.75 * letters];
      return { item, words: item.name, at: [x, top - above], others: [[x, under]], weight: weightOf(item, this.#is(item)) };
    });
    const people = [...boxes].filter(([{ kind }]) => kind === "agent").map(([, box]) => box);
    Object.assign(context, { font: look.letters, textAlign: "center", lineWidth: 3 * devicePixelRatio, strokeStyle: look.ground });
    for (const { item, words, at: [x, y] } of withRoom(labels, letters, this.#on === null ? [] : people)) {
      context.fillStyle = this.#is(item) ? look.accent : look.text;
      context.strokeText(words, x, y);
      context.fillText(words, x, y);
    }
  }

  /** The round handle that turns the selection, on its level. */
  #handle(context, eye, look) {
    if (this.#on === null) return;
    delete this.#canvas.dataset.handle;
    const item = turnable(this.#scene, this.#chosen);
    if (item === null) return;
    const from = eye.see(centerOf(item));
    const meter = eye.meter(centerOf(item)) / devicePixelRatio;
    const short = eye.see(handleOf(item, ARM / meter));
    const seen = Math.hypot(short[0] - from[0], short[1] - from[1]) / devicePixelRatio;
    const at = seen < ARM_MIN ? from.map((side, axis) => side + ((short[axis] - side) * ARM_MIN) / Math.max(1, seen)) : short;
    const path = new Path2D();
    path.arc(at[0], at[1], HANDLE * devicePixelRatio, 0, 2 * Math.PI);
    Object.assign(context, { strokeStyle: look.accent, fillStyle: look.accent, lineWidth: 2 * devicePixelRatio });
    context.stroke(pathOf([from, at], false));
    context.fill(path);
    context.strokeStyle = look.ground;
    context.stroke(path);
    this.#shapes.push({ path, item, turns: true });
    this.#canvas.dataset.handle = `${at[0] / devicePixelRatio} ${at[1] / devicePixelRatio}`;
  }

  #is({ kind, index }) {
    return this.#chosen?.kind === kind && this.#chosen.index === index;
  }

  #press(event) {
    this.#fingers.set(event.pointerId, event);
    if (!event.isPrimary || event.button !== 0 || this.#scene === null) return;
    const hit = this.#on && this.#under(event);
    this.#held = hit ? this.#grip(hit, this.#pixel(event)) : { pans: true, at: [event.clientX, event.clientY], camera: { ...this.#camera }, moved: false };
    this.#canvas.setPointerCapture(event.pointerId);
    this.#canvas.focus({ preventScroll: true });
    event.preventDefault();
  }

  /** What is under the pointer: the shape drawn last is in front. */
  #under(event) {
    const [x, y] = this.#pixel(event);
    const context = this.#canvas.getContext("2d");
    return this.#shapes.findLast(({ path }) => context.isPointInPath(path, x, y));
  }

  #grip({ item, row, turns }, at) {
    if (turns) return this.#gripHandle(item);
    const chosen = { kind: item.kind, index: item.index, ...(row === undefined ? {} : { row }) };
    this.#on.choose(chosen);
    const from = placeOf(item, row);
    const eye = new Eye(this.#scene.drawing.room, this.#camera, this.#canvas);
    const level = from === null ? 0 : from[2] / 1000;
    return { item, row, from, eye, level, start: at, ground: eye.onLevel(at, level), moved: false };
  }

  #gripHandle(item) {
    const center = centerOf(item);
    return { turns: true, center, eye: new Eye(this.#scene.drawing.room, this.#camera, this.#canvas) };
  }

  #drag(event) {
    if (this.#pinch(event)) return;
    const held = this.#held;
    if (held === null && this.#on !== null && this.#scene !== null) this.#name(this.#under(event));
    if (held === null || !event.isPrimary) return;
    const [x, y] = this.#pixel(event);
    if (held.pans) {
      const [dx, dy] = [event.clientX - held.at[0], event.clientY - held.at[1]];
      held.moved ||= Math.hypot(dx, dy) > 3;
      if (this.#isPlan) this.#shift(held.camera, dx, dy);
      else this.#turn(held.camera, -dx * DEGREES_A_PIXEL, dy * DEGREES_A_PIXEL);
      return;
    }
    if (held.turns) {
      const now = held.eye.onLevel([x, y], held.center[2]);
      if (now !== null) this.#on.turn(turnTowards(held.center, now, event.shiftKey), event.timeStamp);
      return;
    }
    held.moved ||= Math.hypot(x - held.start[0], y - held.start[1]) > 3 * devicePixelRatio;
    if (!held.moved || held.from === null) return;
    const to = event.shiftKey && !this.#isPlan ? this.#lifted(held, y) : this.#along(held, [x, y], event.altKey);
    if (to !== null) this.#on.move(held, to, event.timeStamp);
  }

  /** Names what the pointer rests on. */
  #name(hit) {
    const words = hit?.row === undefined ? hit?.item.name : `waypoint ${hit.row + 1} of ${hit.item.name}`;
    this.#canvas.title = hit?.turns ? "" : (words ?? "");
  }

  #along(held, at, fine) {
    const now = held.eye.onLevel(at, held.level);
    if (now === null || held.ground === null) return null;
    const to = [0, 1].map((axis) => held.from[axis] + (now[axis] - held.ground[axis]) * 1000);
    return [...onGrid(to, fine), held.from[2]];
  }

  #lifted(held, y) {
    const meters = held.eye.height(held.from.map((length) => length / 1000), held.start[1] - y);
    return [held.from[0], held.from[1], ...onGrid([held.from[2] + meters * 1000], false)];
  }

  /** Two fingers zoom by how far apart they are. */
  #pinch(event) {
    if (!this.#fingers.has(event.pointerId)) return false;
    const apart = () => {
      const [one, other] = [...this.#fingers.values()];
      return Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
    };
    if (this.#fingers.size !== 2) return false;
    const before = apart();
    this.#fingers.set(event.pointerId, event);
    this.#zoom(apart() / Math.max(1, before));
    return true;
  }

  #release(event) {
    this.#fingers.delete(event.pointerId);
    if (this.#held === null || !event.isPrimary) return;
    const held = this.#held;
    this.#held = null;
    if (held.pans && !held.moved) this.#on?.choose(null);
    this.#on?.drop();
  }

  #wheel(event) {
    event.preventDefault();
    this.zoom(event.deltaY < 0, this.#pixel(event));
  }

  /** A step nearer or farther; on the plan what is at a pixel stays there. */
  zoom(nearer, at = [this.#canvas.width / 2, this.#canvas.height / 2]) {
    const under = () => new Eye(this.#scene.drawing.room, this.#camera, this.#canvas).onLevel(at, 0);
    const before = this.#isPlan && this.#scene !== null ? under() : null;
    this.#zoom(nearer ? ZOOM_STEP : 1 / ZOOM_STEP);
    if (before === null) return;
    const now = under();
    this.#camera.over = this.#camera.over.map((side, axis) => side + before[axis] - now[axis]);
  }

  #zoom(by) {
    this.#camera.nearer = Math.min(NEARER_MAX, Math.max(NEARER_MIN, this.#camera.nearer * by));
    this.#later(false);
  }

  /** Drags the plan along by screen pixels. */
  #shift({ over }, dx, dy) {
    if (this.#scene === null) return;
    const pixel = devicePixelRatio / new Eye(this.#scene.drawing.room, this.#camera, this.#canvas).meter([0, 0, 0]);
    this.#camera.over = [over[0] - dx * pixel, over[1] + dy * pixel];
    this.#later(false);
  }

  #turn(from, azimuth, elevation) {
    this.#camera.azimuth = Math.round((from.azimuth + azimuth) * 10) / 10;
    this.#camera.elevation = Math.round(Math.min(ELEVATION_MAX, Math.max(-5, from.elevation + elevation)) * 10) / 10;
    this.#later(false);
  }

  #key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const turns = { ArrowLeft: [-TURN_STEP, 0], ArrowRight: [TURN_STEP, 0], ArrowUp: [0, TURN_STEP], ArrowDown: [0, -TURN_STEP] };
    if (turns[event.key]) this.#turn(this.#camera, ...turns[event.key]);
    else if (event.key === "+" || event.key === "-") this.zoom(event.key === "+");
    else if (event.key === "0") this.home();
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** Fits the room. */
  home() {
    this.#camera = { ...this.#first };
    this.#later(false);
  }

  #pixel(event) {
    const box = this.#canvas.getBoundingClientRect();
    return [(event.clientX - box.left) * devicePixelRatio, (event.clientY - box.top) * devicePixelRatio];
  }
}

/** The box on the canvas around the top of an item, or around a sensor; null without a place. */
function boxOf(item, eye) {
  const top = item.kind === "sensor" ? item.at_m : item.top_m;
  if (!top) return null;
  const corners = [top, ...outlineOf(item).map(([x, y]) => [x, y, top[2]])].map((corner) => eye.see(corner));
  const [xs, ys] = [0, 1].map((axis) => corners.map((corner) => corner[axis]));
  return { left: Math.min(...xs), right: Math.max(...xs), top: Math.min(...ys), bottom: Math.max(...ys) };
}
