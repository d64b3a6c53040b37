// The devices: the state of each, and how to fix it.

import { adviceFor, pastOf } from "./advice.js";
import { byKind, duration, fieldsOf, say } from "./words.js";

const REFRESH_MS = 1_000;
// A device sends a batch every half second. A slow network may delay it this long.
const SILENT_S = 5;

export class Devices {
  #section = document.querySelector("#devices");
  #list = document.querySelector("#device-list");
  #none = document.querySelector("#no-devices");
  #template = document.querySelector("#device-card");
  #cards = new Map();
  #timer = null;

  /** Refreshes the devices while they are shown. */
  show(visible) {
    this.#section.hidden = !visible;
    clearInterval(this.#timer);
    if (!visible) return;
    this.#timer = setInterval(() => this.#refresh(), REFRESH_MS);
    this.#refresh();
  }

  async #refresh() {
    const answer = await devicesNow();
    // The state of the connection at the top reports a missing answer.
    if (answer === null) return;
    const { devices, faults_recent_s: recent_s } = answer;
    this.#none.hidden = devices.length > 0;
    const cards = devices.map((device) => this.#card(device, recent_s));
    const same = cards.length === this.#list.children.length && cards.every((card, index) => card === this.#list.children[index]);
    if (!same) this.#list.replaceChildren(...cards);
  }

  #card(device, recent_s) {
    if (!this.#cards.has(device.device)) this.#cards.set(device.device, this.#template.content.firstElementChild.cloneNode(true));
    const card = this.#cards.get(device.device);
    const fields = fieldsOf(card);
    const isSilent = device.age_s === null || device.age_s > SILENT_S;
    const advice = adviceFor(device, isSilent);
    const state = isSilent ? "stale" : advice.length > 0 ? "missing" : "live";
    card.dataset.state = state;
    say(fields.name, device.device);
    say(fields.state, { live: "OK", missing: "needs attention", stale: "silent" }[state]);
    for (const [name, text] of Object.entries(factsOf(device))) say(fields[name], text);
    rows(fields.sensors, device.sensors.map(sensorCells));
    list(fields.advice, advice);
    say(fields.past, pastOf(device, recent_s));
    return card;
  }
}

function factsOf(device) {
  const number = (value) => (value === null || value === undefined ? "–" : value.toLocaleString("en"));
  return {
    age: device.age_s === null ? "never" : `${duration(device.age_s)} ago`,
    rate: device.rate_hz === null ? "–" : `${device.rate_hz.toFixed(2)} Hz`,
    backlog: number(device.backlog),
    read: number(device.read),
    stored: number(device.stored),
    missing: number(device.missing),
    dropped: byKind(device.dropped ?? {}) || "none",
    errors: byKind(device.errors ?? {}) || "none",
    clock: device.clock ?? "–",
    version: device.agent_version ?? "unknown",
    boot: device.boot ?? "–",
    configuration: configured(device.configuration),
  };
}

function configured(configuration) {
  if (!configuration) return "unknown";
  const parts = [];
  if (configuration.post_every_ms) parts.push(`sends every ${configuration.post_every_ms} ms`);
  if (configuration.spool) parts.push(`spool: ${configuration.spool}`);
  for (const [name, sensor] of Object.entries(configuration.sensors ?? {})) {
    parts.push(`${name}: ${sensor.part}, ${sensor.rate_hz} Hz${sensor.moving_average ? ", moving average" : ""}`);
  }
  return parts.join(" · ");
}

function sensorCells(sensor) {
  const number = (value) => (value === null || value === undefined ? "–" : value.toLocaleString("en"));
  return [
    sensor.sensor,
    sensor.missing_now ?? (sensor.age_s === null ? "no frame" : `${duration(sensor.age_s)} ago`),
    sensor.rate_hz === null ? "–" : `${sensor.rate_hz.toFixed(2)} Hz`,
    number(sensor.read),
    number(sensor.stored),
    number(sensor.missing),
    byKind(sensor.errors ?? {}) || "none",
  ];
}

/** Fills a table's body, changing only what differs. */
function rows(body, wanted) {
  while (body.children.length > wanted.length) body.lastElementChild.remove();
  for (const [index, texts] of wanted.entries()) {
    const row = body.children[index] ?? body.appendChild(document.createElement("tr"));
    for (const [column, text] of texts.entries()) {
      const cell = row.children[column] ?? row.appendChild(document.createElement(column === 0 ? "th" : "td"));
      say(cell, text);
    }
  }
}

function list(element, texts) {
  if (element.dataset.texts === texts.join("\n")) return;
  element.dataset.texts = texts.join("\n");
  element.replaceChildren(...texts.map((text) => Object.assign(document.createElement("li"), { textContent: text })));
}

async function devicesNow() {
  try {
    const response = await fetch("/v1/devices");
    return response.ok ? await response.json() : null;
  } catch {
    return null;
  }
}
