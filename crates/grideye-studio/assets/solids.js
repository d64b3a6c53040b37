// What is in a room, drawn on a canvas from any side: faces in a tree that orders them for any eye, and ellipsoids.

const FOCAL = 1.5;
// From above a room is seen from so far that all of its levels are drawn alike, meters, with this margin around it.
const FAR_M = 1e6;
const MARGIN = 0.06;
// Brightness of a face turned away from the light.
const SHADE_MIN = 0.55;
const LIGHT = [-0.45, -0.6, 0.66];

/** A camera that circles the middle of a room; with `over`, a place beside that middle, it looks down on it from far above. */
export class Eye {
  constructor({ low_m: low, high_m: high }, { azimuth, elevation, nearer, over = null }, { width, height }) {
    const [across, up] = [azimuth, elevation].map((degrees) => (degrees * Math.PI) / 180);
    this.target = low.map((side, axis) => (side + high[axis]) / 2);
    this.away = [Math.cos(up) * Math.cos(across), Math.cos(up) * Math.sin(across), Math.sin(up)];
    this.right = [-Math.sin(across), Math.cos(across), 0];
    this.up = [-Math.sin(up) * Math.cos(across), -Math.sin(up) * Math.sin(across), Math.cos(up)];
    const size = Math.hypot(...high.map((side, axis) => side - low[axis]));
    this.distance = over === null ? (1.7 * size) / nearer : FAR_M;
    this.from = this.target.map((side, axis) => side + this.away[axis] * this.distance);
    this.middle = [width / 2, height / 2];
    if (over !== null) {
      const [across, along] = [0, 1].map((axis) => high[axis] - low[axis]);
      const margins = 2 * MARGIN * Math.max(across, along);
      const meter = nearer * Math.min(width / (across + margins), height / (along + margins));
      this.focal = meter * FAR_M;
      this.middle = [width / 2 - over[0] * meter, height / 2 + over[1] * meter];
      return;
    }
    this.focal = FOCAL * Math.min(width, height * 1.1);
    // The room, not its middle, is in the middle of the canvas.
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((corner) => this.see([0, 1, 2].map((axis) => ((corner >> axis) & 1 ? high : low)[axis])));
    this.middle = this.middle.map((middle, axis) => {
      const along = corners.map((corner) => corner[axis]);
      return 2 * middle - (Math.min(...along) + Math.max(...along)) / 2;
    });
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
    const reach = (level - this.from[2]) / ray[2];
    return reach > 0 && reach < 20 * this.distance ? this.from.map((side, axis) => side + ray[axis] * reach) : null;
  }

  /** Pixels of a meter at a point. */
  meter(point) {
    return this.focal / this.see(point)[2];
  }

  /** The height in meters of some pixels at a point. */
  height(point, pixels) {
    return pixels / this.meter(point) / Math.max(0.1, this.up[2]);
  }
}

/** Calls `draw` with each face and ellipsoid of a drawing, from far to near. An ellipsoid is where its center is. */
export function farToNear({ nodes, rounds }, eye, draw) {
  const walk = (index, rounds) => {
    if (index === null) {
      const far = rounds.map((round) => ({ round, depth: eye.see(round.center_m)[2] })).sort((one, other) => other.depth - one.depth);
      for (const { round } of far) draw(round);
      return;
    }
    const { plane: [x, y, z, offset], faces, sides: [behind, before] } = nodes[index];
    const height = (point) => x * point[0] + y * point[1] + z * point[2] - offset;
    const halves = [[behind, rounds.filter(({ center_m: center }) => height(center) < 0)], [before, rounds.filter(({ center_m: center }) => height(center) >= 0)]];
    if (height(eye.from) < 0) halves.reverse();
    walk(...halves[0]);
    faces.forEach(draw);
    walk(...halves[1]);
  };
  walk(nodes.length === 0 ? null : 0, rounds);
}

/** A face on the canvas, with its brightness and the edges to draw; null if only its back is seen. */
export function flat({ corners_m: corners, edges }, isClosed, eye) {
  const normal = normalOf(corners);
  const towards = facing(corners, eye);
  if (isClosed && towards <= 0) return null;
  const seen = corners.map((corner) => eye.see(corner));
  const lines = new Path2D();
  edges.forEach((drawn, index) => {
    if (!drawn) return;
    lines.moveTo(seen[index][0], seen[index][1]);
    lines.lineTo(...seen[(index + 1) % seen.length].slice(0, 2));
  });
  return { path: pathOf(seen), lines, shade: brightness(Math.sign(towards) * dot(normal, LIGHT)) };
}

/** An ellipsoid on the canvas: an ellipse, with the place of its brightest point and its shades. */
export function round({ center_m: center, axes_m: axes }, eye) {
  const [x, y] = eye.see(center);
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
  return { path, ellipse: { at: [x, y], half, turn }, ...litOf({ axes, drawn, half, turn }, eye) };
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

/** Positive if the eye is on the side from which corners run counter-clockwise. */
export function facing(corners, eye) {
  return dot(normalOf(corners), eye.from.map((side, axis) => side - corners[0][axis]));
}

/** The unit vector towards the side from which corners run counter-clockwise. */
function normalOf(corners) {
  const sum = [0, 0, 0];
  corners.forEach((to, index) => {
    const [from, anchor] = [corners.at(index - 1), corners[0]];
    const [one, other] = [from, to].map((corner) => corner.map((side, axis) => side - anchor[axis]));
    sum[0] += one[1] * other[2] - one[2] * other[1];
    sum[1] += one[2] * other[0] - one[0] * other[2];
    sum[2] += one[0] * other[1] - one[1] * other[0];
  });
  const length = Math.hypot(...sum) || 1;
  return sum.map((side) => side / length);
}

/** A color of a drawing, darkened. */
export function shaded(color, shade) {
  const parts = [1, 3, 5].map((at) => Math.round(parseInt(color.slice(at, at + 2), 16) * shade));
  return `rgb(${parts.join(" ")})`;
}

export function pathOf(points, closed = true) {
  const path = new Path2D();
  points.forEach(([x, y], index) => (index === 0 ? path.moveTo(x, y) : path.lineTo(x, y)));
  if (closed) path.closePath();
  return path;
}

const dot = (one, other) => one[0] * other[0] + one[1] * other[1] + one[2] * other[2];
