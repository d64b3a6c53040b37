// A small plan of a scene: walls, objects, sensors with their fields of view, trajectories, and where people are now.

const SVG = "http://www.w3.org/2000/svg";
// Lengths as shares of the longer side of the room.
const MARGIN = 0.04;
const RING = 0.042;
const DOT = 0.013;
const LETTERS = 0.04;
const NAME = 0.052;
// Ahead of a person's face, in meters.
const NOSE = [[0.2, -0.07], [0.3, 0], [0.2, 0.07]];

export class Plan {
  #svg;
  #agents = new Map();
  #unit = 1;

  constructor(svg) {
    this.#svg = svg;
  }

  /** Draws the room; `chosen` names the selected sensor. */
  draw(plan, chosen) {
    const [xs, ys] = [0, 1].map((axis) => plan.room_m.map((corner) => corner[axis]));
    const [left, right] = [Math.min(...xs), Math.max(...xs)];
    const [front, back] = [Math.min(...ys), Math.max(...ys)];
    this.#unit = Math.max(right - left, back - front);
    const margin = MARGIN * this.#unit;
    const box = [left - margin, -back - margin, right - left + 2 * margin, back - front + 2 * margin];
    this.#svg.setAttribute("viewBox", box.join(" "));
    this.#agents.clear();
    for (const [kind, color] of Object.entries(plan.colors)) this.#svg.style.setProperty(`--${kind}`, color);
    this.#svg.replaceChildren(
      polygon("room", plan.room_m),
      ...plan.objects.map((object) => titled(polygon("object", object.outline_m), object.name)),
      ...plan.sensors.map((sensor) => polygon(sensor.name === chosen ? "view chosen" : "view", sensor.in_view_m)),
      ...plan.agents.map((agent) => line("way", agent.way_m)),
      ...plan.sensors.flatMap((sensor) => this.#sensor(sensor, sensor.name === chosen)),
      ...plan.agents.flatMap((agent) => this.#agent(agent)),
    );
  }

  /** Moves the agents; `known` is false if their positions are unknown. */
  place(agents, known) {
    this.#svg.dataset.known = known;
    for (const { name, place, front } of agents) {
      const marks = this.#agents.get(name);
      if (!marks) continue;
      const [x, y] = place;
      marks.body.setAttribute("transform", `translate(${x} ${-y}) rotate(${-front})`);
      marks.text.setAttribute("x", x);
      marks.text.setAttribute("y", -y - NAME * this.#unit);
    }
  }

  #sensor(sensor, chosen) {
    const [x, y] = sensor.at_m;
    const dot = element("circle", { class: chosen ? "sensor-dot chosen" : "sensor-dot", cx: x, cy: -y, r: (chosen ? RING : DOT) * this.#unit });
    const marks = [titled(dot, `sensor ${sensor.name}`)];
    if (chosen) marks.push(this.#text("sensor-name", sensor.name, [x, -y + (RING + LETTERS) * this.#unit]));
    return marks;
  }

  #agent(agent) {
    const [x, y] = agent.starts_m;
    const body = element("g", { class: "agent", transform: `translate(${x} ${-y})` });
    if (agent.is_person) body.append(polygon("nose", NOSE));
    body.append(...agent.body_m.map((outline) => polygon("part", outline)));
    const text = this.#text("agent-name", agent.name, [x, -y - NAME * this.#unit]);
    this.#agents.set(agent.name, { body, text });
    return [body, text];
  }

  #text(kind, words, [x, y]) {
    const text = element("text", { class: kind, x, y, "font-size": LETTERS * this.#unit, "text-anchor": "middle" });
    text.textContent = words;
    return text;
  }
}

function element(name, attributes) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

/** Right is right, back is up. */
const onPage = (points) => points.map(([x, y]) => `${x},${-y}`).join(" ");
const polygon = (kind, points) => element("polygon", { class: kind, points: onPage(points) });
const line = (kind, points) => element("polyline", { class: kind, points: onPage(points) });

function titled(shape, words) {
  const title = element("title", {});
  title.textContent = words;
  shape.append(title);
  return shape;
}
