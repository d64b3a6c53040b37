import { follow } from "./feed.js";
import { Recordings } from "./recordings.js";
import { Sensor } from "./sensor.js";
import { say } from "./words.js";

const TICK_MS = 50;

const LINK = {
  connecting: "connecting to the collector",
  open: "connected",
  lost: "connection lost, trying again",
};

const wall = document.querySelector("#sensors");
const empty = document.querySelector("#empty");
const template = document.querySelector("#sensor-card");
const link = document.querySelector("#link");
const sensors = new Map();
const recordings = new Recordings();

function take({ sensors: states }) {
  for (const state of states) {
    const key = JSON.stringify([state.device, state.sensor]);
    if (!sensors.has(key)) {
      sensors.set(key, new Sensor(template));
      arrange();
    }
    sensors.get(key).take(state);
  }
  empty.hidden = sensors.size > 0;
}

/** By device and sensor, whatever the order in which they were first seen. */
function arrange() {
  const sorted = [...sensors].sort(([a], [b]) => (a < b ? -1 : 1));
  wall.replaceChildren(...sorted.map(([, sensor]) => sensor.element));
  wall.dataset.count = sensors.size;
}

follow({
  link(state) {
    link.dataset.state = state;
    say(link, LINK[state]);
  },
  snapshot(event) {
    take(event);
    recordings.refresh();
  },
  frames: take,
  alive({ store }) {
    if (store === null) return;
    link.dataset.state = "failing";
    say(link, `connected, but frames cannot be stored: ${store}`);
  },
  recordings: () => recordings.refresh(),
});

setInterval(() => {
  for (const sensor of sensors.values()) sensor.tick();
}, TICK_MS);
