// Start, stop and list of recordings.

import { count, duration, fieldsOf, say } from "./words.js";

const REFRESH_MS = 2_000;

export class Recordings {
  #list = document.querySelector("#list");
  #none = document.querySelector("#none");
  #name = document.querySelector("#name");
  #trouble = document.querySelector("#trouble");
  #template = document.querySelector("#recording-row");
  #rows = new Map();
  #running = false;

  constructor() {
    document.querySelector("#start").addEventListener("submit", (event) => {
      event.preventDefault();
      this.#start();
    });
    setInterval(() => {
      if (this.#running) this.refresh();
    }, REFRESH_MS);
  }

  async refresh() {
    const answer = await ask("/v1/recordings");
    // Without an answer the state of the connection at the top says enough.
    if (answer.error) return;
    this.#show(answer.recordings);
  }

  async #start() {
    const answer = await ask("/v1/recordings", { name: this.#name.value });
    this.#complain(answer.error);
    if (!answer.error) this.#name.value = "";
    await this.refresh();
  }

  async #stop(id) {
    const answer = await ask(`/v1/recordings/${id}/stop`, {});
    this.#complain(answer.error);
    await this.refresh();
  }

  #complain(error) {
    this.#trouble.hidden = !error;
    this.#name.setAttribute("aria-invalid", String(Boolean(error)));
    const hint = error?.hint ? `. Hint: ${error.hint}` : "";
    say(this.#trouble, error ? `${error.message}${hint}` : "");
  }

  #show(recordings) {
    this.#running = recordings.some((recording) => recording.running);
    this.#none.hidden = recordings.length > 0;
    const rows = recordings.map((recording) => this.#row(recording));
    const same = rows.length === this.#list.children.length && rows.every((row, index) => row === this.#list.children[index]);
    if (!same) this.#list.replaceChildren(...rows);
  }

  /** Rows are kept, so that a button does not vanish from under a finger. */
  #row(recording) {
    if (!this.#rows.has(recording.id)) {
      const row = this.#template.content.firstElementChild.cloneNode(true);
      fieldsOf(row).stop.addEventListener("click", () => this.#stop(recording.id));
      this.#rows.set(recording.id, row);
    }
    const row = this.#rows.get(recording.id);
    const fields = fieldsOf(row);
    row.dataset.running = recording.running;
    say(fields.name, recording.name);
    say(fields.facts, facts(recording));
    fields.stop.hidden = !recording.running;
    fields.stop.setAttribute("aria-label", `Stop recording ${recording.name}`);
    fields.csv.hidden = recording.running;
    fields.csv.href = recording.csv;
    fields.csv.setAttribute("aria-label", `Download ${recording.name} as CSV`);
    return row;
  }
}

function facts(recording) {
  const until = recording.t_stop_ns ?? Date.now() * 1e6;
  const length = duration(Math.max(0, (until - recording.t_start_ns) / 1e9));
  const parts = [
    recording.running ? `recording for ${length}` : length,
    recording.frames > 0 ? count(recording.frames, "frame", "frames") : "no frames",
  ];
  if (recording.sensors > 0) parts.push(count(recording.sensors, "sensor", "sensors"));
  if (recording.missing > 0) parts.push(`${recording.missing.toLocaleString("en")} missing`);
  return parts.join(" · ");
}

/** GET, or POST with a body; what went wrong is in `error`. */
async function ask(path, body) {
  const post = { method: "POST", headers: { "content-type": "application/json" } };
  try {
    const response = await fetch(path, body === undefined ? {} : { ...post, body: JSON.stringify(body) });
    return await response.json();
  } catch {
    return { error: { message: "the collector cannot be reached", hint: "see that it is running, and try again" } };
  }
}
