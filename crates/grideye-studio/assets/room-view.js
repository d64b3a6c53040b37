// The 3-D view: drag moves an item on its level, with Shift up and down, the round handle turns it, the background turns the
// view.

import { weightOf, withRoom } from "./names.js";
import { centerOf, handleOf, isSame, onGrid, placeOf, turnTowards, turnable } from "./things.js";

const FOCAL = 1.5;
const FIRST = { azimuth: -115, elevation: 32, nearer: 1 };
const ELEVATION_MAX = 89;
const TURN_STEP = 10;
const ZOOM_STEP = 1.15;
const [NEARER_MIN, NEARER_MAX] = [0.4, 8];
const DEGREES_A_PIXEL = 0.4;
// Brightness of a face turned away from the light.
const SHADE_MIN = 0.55;
const LIGHT = [-0.45, -0.6, 0.66];
const DOT = 6;
// Screen pixels, as on the plan; the arm keeps a minimum length when seen at a flat angle.
const [HANDLE, ARM, ARM_MIN] = [9, 34, 26];
// A drawing that takes longer than the first waits until nothing has moved for the second.
const [QUICK_MS, REST_MS] = [6, 120];
// Bodies with more faces are drawn without edges, which would hide the faces.
const EDGED_MAX = 100;

export class RoomView {
  #canvas;
  #scene = null;
  #chosen = null;
  #camera = { ...FIRST };
  #shapes = [];
  #held = null;
  #on;
  #asked = null;
  #tookMs = 0;

  /** `on` is that of the plan. */
  constructor(canvas, on) {
    this.#canvas = canvas;
    this.#on = on;
    canvas.addEventListener("pointerdown", (event) => this.#press(event));
    canvas.addEventListener("pointermove", (event) => this.#drag(event));
    for (const end of ["pointerup", "pointercancel"]) canvas.addEventListener(end, (event) => this.#release(event));
    canvas.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    canvas.addEventListener("keydown", (event) => this.#key(event));
    new ResizeObserver(() => this.#fit()).observe(canvas);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.#later());
  }

  show(scene, chosen) {
    this.#scene = scene;
    this.#chosen = chosen;
    this.#later();
  }

  /**
   * Draws once for many requests: before the next paint, or if drawing is slow, once the pointer rests, so that plan and
   * frames never wait for it.
   */
  #later() {
    const isSlow = this.#tookMs > QUICK_MS;
    if (this.#asked !== null && !isSlow) return;
    clearTimeout(this.#asked);
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
    this.#later();
  }

  #draw() {
    const context = this.#canvas.getContext("2d");
    context.clearRect(0, 0, this.#canvas.width, this.#canvas.height);
    if (this.#scene === null) return;
    const look = this.#look();
    const eye = new Eye(this.#scene.room, this.#camera, this.#canvas);
    context.lineJoin = "round";
    this.#room(context, eye, look);
    const { items } = this.#scene;
    this.#shapes = items.flatMap((item) => (item.faces_deg === undefined ? facesOf : segmentsOf)(item, eye)).sort((one, other) => other.depth - one.depth);
    const outlined = new Set();
    for (const shape of this.#shapes) {
      if (shape.ellipse && !outlined.has(shape.item)) this.#outline(context, shape.item, look);
      outlined.add(shape.item);
      if (shape.ellipse) this.#round(context, shape, look);
      else this.#fill(context, shape, look);
    }
    for (const item of items) this.#lines(context, item, eye, look);
    this.#names(context, items, eye, look);
    this.#handle(context, eye, look);
    this.#canvas.dataset.drawn = `${this.#camera.azimuth} ${this.#camera.elevation} ${this.#camera.nearer.toFixed(2)}`;
  }

  /** Reads the colors of the scheme from the canvas's style. */
  #look() {
    const style = getComputedStyle(this.#canvas);
    const rgb = (color) => color.match(/[\d.]+/g).slice(0, 3).map((part) => Number(part) * (color.startsWith("color(") ? 255 : 1));
    return {
      text: style.color, accent: style.caretColor, people: rgb(style.columnRuleColor), line: style.textDecorationColor, faint: style.textEmphasisColor,
      things: rgb(style.textDecorationColor), ground: style.backgroundColor, letters: `600 ${12 * devicePixelRatio}px system-ui, sans-serif`,
    };
  }

  #room(context, eye, look) {
    const { outline_m: outline, low_m: low, sides_m: sides } = this.#scene.room;
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

  #fill(context, { path, item, shade, edged }, look) {
    const base = item.kind === "agent" ? look.people : look.things;
    const chosen = this.#is(item);
    context.fillStyle = `rgb(${base.map((part) => Math.round(part * shade)).join(" ")})`;
    context.fill(path);
    // Covers the seams between faces.
    context.strokeStyle = !edged ? context.fillStyle : chosen ? look.accent : look.faint;
    context.lineWidth = (edged && chosen ? 2 : 0.5) * devicePixelRatio;
    context.stroke(path);
  }

  /** Outlines a person: its segments, drawn over it, leave the outline of the whole body. */
  #outline(context, item, look) {
    const chosen = this.#is(item);
    context.strokeStyle = chosen ? look.accent : look.faint;
    context.lineWidth = (chosen ? 5 : 2) * devicePixelRatio;
    for (const shape of this.#shapes) if (shape.item === item) context.stroke(shape.path);
  }

  /** A segment of a person, brightest where it faces the light. */
  #round(context, { ellipse: { at: [x, y], half: [long, short], turn }, light: [from, to], place: [across, down] }, look) {
    const [bright, dark] = [from, to].map((shade) => `rgb(${look.people.map((part) => Math.round(part * shade)).join(" ")})`);
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
  }

  /** Trajectories and fields of view. */
  #lines(context, item, eye, look) {
    const chosen = this.#is(item);
    context.lineWidth = (chosen ? 2 : 1) * devicePixelRatio;
    context.strokeStyle = chosen ? look.accent : look.faint;
    if (item.kind === "sensor" && item.at_m) {
      const ends = raysOf(item, this.#scene.room);
      context.setLineDash([5 * devicePixelRatio, 4 * devicePixelRatio]);
      const from = eye.see(item.at_m);
      for (const end of ends) context.stroke(pathOf([from, eye.see(end)], false));
      context.stroke(pathOf(ends.map((end) => eye.see(end))));
      context.setLineDash([]);
      this.#dot(context, item, from, look, "square");
    }
    if (!item.way) return;
    const points = item.way.points_m.map((point) => eye.see(point));
    context.strokeStyle = look.text;
    context.setLineDash([2 * devicePixelRatio, 4 * devicePixelRatio]);
    context.stroke(pathOf(points, false));
    context.setLineDash([]);
    points.forEach((point, row) => this.#dot(context, item, point, look, "round", row));
  }

  #dot(context, item, [x, y], look, form, row) {
    const size = DOT * devicePixelRatio;
    const path = new Path2D();
    if (form === "square") path.rect(x - size, y - size, 2 * size, 2 * size);
    else path.arc(x, y, size, 0, 2 * Math.PI);
    const chosen = isSame(this.#chosen, { kind: item.kind, index: item.index, ...(row === undefined ? {} : { row }) });
    context.fillStyle = chosen ? look.accent : look.ground;
    context.strokeStyle = look.text;
    context.lineWidth = 2 * devicePixelRatio;
    context.fill(path);
    context.stroke(path);
    this.#shapes.push({ path, item, row });
  }

  #names(context, items, eye, look) {
    const above = 9 * devicePixelRatio;
    const labels = items.flatMap((item) => {
      const top = item.kind === "sensor" ? item.at_m : topOf(item);
      if (!top) return [];
      const [x, y] = eye.see(top);
      return [{ item, words: item.name, at: [x, y - above], weight: weightOf(item, this.#is(item)) }];
    });
    Object.assign(context, { font: look.letters, textAlign: "center", lineWidth: 3 * devicePixelRatio, strokeStyle: look.ground });
    for (const { item, words, at: [x, y] } of withRoom(labels, 12 * devicePixelRatio)) {
      context.fillStyle = this.#is(item) ? look.accent : look.text;
      context.strokeText(words, x, y);
      context.fillText(words, x, y);
    }
  }

  /** The round handle that turns the selection, on its level. */
  #handle(context, eye, look) {
    delete this.#canvas.dataset.handle;
    const item = turnable(this.#scene, this.#chosen);
    if (item === null) return;
    const from = eye.see(centerOf(item));
    const meter = eye.focal / from[2] / devicePixelRatio;
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
    if (!event.isPrimary || event.button !== 0 || this.#scene === null) return;
    const [x, y] = this.#pixel(event);
    const context = this.#canvas.getContext("2d");
    // The shape drawn last is in front.
    const hit = this.#shapes.findLast(({ path }) => context.isPointInPath(path, x, y));
    this.#held = hit ? this.#grip(hit, [x, y]) : { pans: true, at: [event.clientX, event.clientY], camera: { ...this.#camera }, moved: false };
    this.#canvas.setPointerCapture(event.pointerId);
    this.#canvas.focus({ preventScroll: true });
    event.preventDefault();
  }

  #grip({ item, row, turns }, at) {
    if (turns) return this.#gripHandle(item);
    const chosen = { kind: item.kind, index: item.index, ...(row === undefined ? {} : { row }) };
    this.#on.choose(chosen);
    const from = placeOf(item, row);
    const eye = new Eye(this.#scene.room, this.#camera, this.#canvas);
    const level = from === null ? 0 : from[2] / 1000;
    return { item, row, from, eye, level, start: at, ground: eye.onLevel(at, level), moved: false };
  }

  #gripHandle(item) {
    const center = centerOf(item);
    return { turns: true, center, eye: new Eye(this.#scene.room, this.#camera, this.#canvas) };
  }

  #drag(event) {
    const held = this.#held;
    if (held === null || !event.isPrimary) return;
    const [x, y] = this.#pixel(event);
    if (held.pans) {
      const [dx, dy] = [event.clientX - held.at[0], event.clientY - held.at[1]];
      held.moved ||= Math.hypot(dx, dy) > 3;
      this.#turn(held.camera, -dx * DEGREES_A_PIXEL, dy * DEGREES_A_PIXEL);
      return;
    }
    if (held.turns) {
      const now = held.eye.onLevel([x, y], held.center[2]);
      if (now !== null) this.#on.turn(turnTowards(held.center, now, event.shiftKey), event.timeStamp);
      return;
    }
    held.moved ||= Math.hypot(x - held.start[0], y - held.start[1]) > 3 * devicePixelRatio;
    if (!held.moved || held.from === null) return;
    const to = event.shiftKey ? this.#lifted(held, y) : this.#along(held, [x, y]);
    if (to !== null) this.#on.move(held, to, event.timeStamp);
  }

  #along(held, at) {
    const now = held.eye.onLevel(at, held.level);
    if (now === null || held.ground === null) return null;
    const to = [0, 1].map((axis) => held.from[axis] + (now[axis] - held.ground[axis]) * 1000);
    return [...onGrid(to, false), held.from[2]];
  }

  #lifted(held, y) {
    const meters = held.eye.height(held.from.map((length) => length / 1000), held.start[1] - y);
    return [held.from[0], held.from[1], ...onGrid([held.from[2] + meters * 1000], false)];
  }

  #release(event) {
    if (this.#held === null || !event.isPrimary) return;
    const held = this.#held;
    this.#held = null;
    if (held.pans && !held.moved) this.#on.choose(null);
    this.#on.drop();
  }

  #wheel(event) {
    event.preventDefault();
    this.#zoom(event.deltaY < 0 ? ZOOM_STEP : 1 / ZOOM_STEP);
  }

  #zoom(by) {
    this.#camera.nearer = Math.min(NEARER_MAX, Math.max(NEARER_MIN, this.#camera.nearer * by));
    this.#later();
  }

  #turn(from, azimuth, elevation) {
    this.#camera.azimuth = Math.round((from.azimuth + azimuth) * 10) / 10;
    this.#camera.elevation = Math.round(Math.min(ELEVATION_MAX, Math.max(-5, from.elevation + elevation)) * 10) / 10;
    this.#later();
  }

  #key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const turns = { ArrowLeft: [-TURN_STEP, 0], ArrowRight: [TURN_STEP, 0], ArrowUp: [0, TURN_STEP], ArrowDown: [0, -TURN_STEP] };
    if (turns[event.key]) this.#turn(this.#camera, ...turns[event.key]);
    else if (event.key === "+") this.#zoom(ZOOM_STEP);
    else if (event.key === "-") this.#zoom(1 / ZOOM_STEP);
    else if (event.key === "0") this.#home();
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  #home() {
    this.#camera = { ...FIRST };
    this.#later();
  }

  #pixel(event) {
    const box = this.#canvas.getBoundingClientRect();
    return [(event.clientX - box.left) * devicePixelRatio, (event.clientY - box.top) * devicePixelRatio];
  }
}

/** A camera that circles the middle of a room. */
class Eye {
  constructor({ low_m: low, high_m: high }, { azimuth, elevation, nearer }, { width, height }) {
    const [across, up] = [azimuth, elevation].map((degrees) => (degrees * Math.PI) / 180);
    this.target = low.map((side, axis) => (side + high[axis]) / 2);
    this.away = [Math.cos(up) * Math.cos(across), Math.cos(up) * Math.sin(across), Math.sin(up)];
    this.right = [-Math.sin(across), Math.cos(across), 0];
    this.up = [-Math.sin(up) * Math.cos(across), -Math.sin(up) * Math.sin(across), Math.cos(up)];
    const size = Math.hypot(...high.map((side, axis) => side - low[axis]));
    this.distance = (1.7 * size) / nearer;
    this.focal = FOCAL * Math.min(width, height * 1.1);
    this.middle = [width / 2, height / 2];
  }

  /** The canvas position of a point, and its distance. */
  see(point) {
    const from = point.map((side, axis) => side - this.target[axis]);
    const depth = Math.max(0.05, this.distance - dot(from, this.away));
    const scale = this.focal / depth;
    return [this.middle[0] + dot(from, this.right) * scale, this.middle[1] - dot(from, this.up) * scale, depth];
  }

  /** The point of a level under a pixel; null above the horizon. */
  onLevel([x, y], level) {
    const [across, up] = [(x - this.middle[0]) / this.focal, (this.middle[1] - y) / this.focal];
    const ray = [0, 1, 2].map((axis) => this.right[axis] * across + this.up[axis] * up - this.away[axis]);
    const from = this.target.map((side, axis) => side + this.away[axis] * this.distance);
    const reach = (level - from[2]) / ray[2];
    return reach > 0 && reach < 20 * this.distance ? from.map((side, axis) => side + ray[axis] * reach) : null;
  }

  /** The height in meters of some pixels at a point. */
  height(point, pixels) {
    const [, , depth] = this.see(point);
    return (pixels * depth) / this.focal / Math.max(0.1, this.up[2]);
  }
}

function facesOf(item, eye) {
  return (item.bodies ?? []).flatMap(({ vertices_m: vertices, faces }) => {
    const seen = vertices.map((vertex) => eye.see(vertex));
    return faces.map((face) => {
      const corners = face.map((corner) => seen[corner]);
      // The farthest corner, so that what lies on a face is in front of it.
      const depth = Math.max(...corners.map(([, , away]) => away));
      return { item, depth, edged: faces.length <= EDGED_MAX, path: pathOf(corners), shade: shadeOf(face.slice(0, 3).map((corner) => vertices[corner])) };
    });
  });
}

/** The segments of a person as they are drawn: ellipses, each with the place of its brightest point and its shades. */
function segmentsOf(item, eye) {
  return item.bodies.map(({ center_m: center, axes_m: axes }) => {
    const [x, y, depth] = eye.see(center);
    const drawn = axes.map((axis) => {
      const [there, back] = [1, -1].map((sign) => eye.see(center.map((side, index) => side + sign * axis[index])));
      return [0, 1].map((index) => (there[index] - back[index]) / 2);
    });
    const sum = (one, other) => drawn.reduce((total, end) => total + end[one] * end[other], 0);
    const [mean, apart] = [(sum(0, 0) + sum(1, 1)) / 2, Math.hypot((sum(0, 0) - sum(1, 1)) / 2, sum(0, 1))];
    const half = [mean + apart, mean - apart].map((square) => Math.sqrt(Math.max(0.01, square)));
    const turn = 0.5 * Math.atan2(2 * sum(0, 1), sum(0, 0) - sum(1, 1));
    const path = new Path2D();
    path.ellipse(x, y, ...half, turn, 0, 2 * Math.PI);
    return { item, depth, path, ellipse: { at: [x, y], half, turn }, ...litOf({ axes, drawn, half, turn }, eye) };
  });
}

/** Where the ellipsoid that is drawn as the unit circle is brightest, and its most and least brightness. */
function litOf({ axes, drawn, half, turn }, eye) {
  const along = axes.map((axis) => dot(axis, LIGHT));
  const length = Math.hypot(...along);
  const facing = axes.reduce((sum, axis, index) => sum + (along[index] / length) * dot(axis, eye.away), 0);
  const [x, y] = [0, 1].map((side) => drawn.reduce((sum, end, index) => sum + (along[index] / length) * end[side], 0));
  const place = [(x * Math.cos(turn) + y * Math.sin(turn)) / half[0], (y * Math.cos(turn) - x * Math.sin(turn)) / half[1]];
  const aside = Math.min(1, Math.hypot(...place));
  const light = [facing > 0 ? 1 : aside, -aside].map(brightness);
  // The brightest point of a segment lit from behind is on its rim.
  return { light, place: facing > 0 || aside === 0 ? place : place.map((side) => side / aside) };
}

/** Brightness by the cosine of the angle to the light. */
function brightness(cosine) {
  return SHADE_MIN + (1 - SHADE_MIN) * (0.5 + 0.5 * cosine);
}

/** Brightness of a face by its angle to the light, the same on both sides. */
function shadeOf([one, other, third]) {
  const [along, up] = [other, third].map((corner) => corner.map((side, axis) => side - one[axis]));
  const normal = [along[1] * up[2] - along[2] * up[1], along[2] * up[0] - along[0] * up[2], along[0] * up[1] - along[1] * up[0]];
  const length = Math.hypot(...normal) || 1;
  return brightness(dot(normal, LIGHT) / length);
}

/** The ends of a view's corner rays, where they leave the box around the room. */
function raysOf({ at_m: at, axes: [forward, left, up], field_rad: field }, { low_m: low, high_m: high }) {
  const [across, down] = field.map((angle) => Math.tan(Math.min(angle, 3) / 2));
  return [[1, 1], [1, -1], [-1, -1], [-1, 1]].map(([toLeft, toUp]) => {
    const ray = forward.map((side, axis) => side + left[axis] * across * toLeft + up[axis] * down * toUp);
    const reach = Math.min(...ray.map((side, axis) => (side === 0 ? Infinity : ((side > 0 ? high : low)[axis] - at[axis]) / side)));
    return at.map((side, axis) => side + ray[axis] * reach);
  });
}

function topOf({ bodies }) {
  const vertices = bodies?.flatMap((body) => body.vertices_m ?? [topOfSegment(body)]) ?? [];
  if (vertices.length === 0) return null;
  const middle = [0, 1].map((axis) => vertices.reduce((sum, vertex) => sum + vertex[axis], 0) / vertices.length);
  return [...middle, vertices.reduce((top, [, , z]) => Math.max(top, z), -Infinity)];
}

function topOfSegment({ center_m: [x, y, z], axes_m: axes }) {
  return [x, y, z + Math.hypot(...axes.map((axis) => axis[2]))];
}

function pathOf(points, closed = true) {
  const path = new Path2D();
  points.forEach(([x, y], index) => (index === 0 ? path.moveTo(x, y) : path.lineTo(x, y)));
  if (closed) path.closePath();
  return path;
}

const dot = (one, other) => one[0] * other[0] + one[1] * other[1] + one[2] * other[2];
