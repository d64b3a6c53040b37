// The scenes of the folder to choose from, each with a picture of its room.

import { RoomView } from "./room-view.js";
import { fetched } from "./simulation.js";

/** Fills a list; `choose` gets the names of scene and sensor. Sensors of that name come first, alone of their scene. */
export function offer(list, scenes, like, choose) {
  const fitting = scenes.flatMap((scene) => {
    const sensors = scene.sensors.filter(({ fits }) => fits).map(({ name }) => name);
    return (sensors.includes(like) ? [like] : sensors).map((sensor) => ({ scene, sensor }));
  });
  fitting.sort((one, other) => (other.sensor === like) - (one.sensor === like));
  // Each room is asked for when it comes into sight.
  const seen = new IntersectionObserver((entries) => {
    for (const { isIntersecting, target } of entries) {
      if (!isIntersecting) continue;
      seen.unobserve(target);
      draw(target);
    }
  });
  list.replaceChildren(...fitting.map(({ scene, sensor }) => {
    const button = Object.assign(document.createElement("button"), { type: "button" });
    const several = scene.sensors.length > 1 ? ` · ${sensor}` : "";
    const canvas = Object.assign(document.createElement("canvas"), { className: "room" });
    Object.assign(canvas.dataset, { scene: scene.name, sensor, second: scene.seconds / 2 });
    button.append(canvas, part("strong", scene.name + several), part("span", scene.title));
    button.addEventListener("click", () => choose(scene.name, sensor));
    seen.observe(canvas);
    return button;
  }));
}

async function draw(canvas) {
  const { scene, sensor, second } = canvas.dataset;
  const room = await fetched(`/v1/scenes/${encodeURIComponent(scene)}/room?at_s=${second}`);
  if (room.error) return;
  const chosen = room.items.find(({ kind, name }) => kind === "sensor" && name === sensor) ?? null;
  new RoomView(canvas).show(room, chosen);
}

function part(kind, textContent) {
  return Object.assign(document.createElement(kind), { textContent });
}
