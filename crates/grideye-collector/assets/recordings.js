// Recordings: the form that starts one, and the newest ones beside the live images.

import { ask, complain } from "./ask.js";
import { count, duration, fieldsOf, say } from "./words.js";

const REFRESH_MS = 2_000;
// The live view lists this many; the Recordings view has all.
const LISTED_MAX = 8;

export class Recordings {
  #list = document.querySelector("#list");
  #none = document.querySelector("#none");
  #more = document.querySelector("#more");
  #name = document.querySelector("#name");
  #trouble = document.querySelector("#trouble");
  #template = document.querySelector("#recording-row");
  #rows = new Map();
  #all = [];
  #running = false;
  #listeners = [];

  constructor() {
    document.querySelector("#start").addEventListener("submit", (event) => {
      event.preventDefault();
      this.#start();
    });
    setInterval(() => {
      if (this.#running) this.refresh();
    }, REFRESH_MS);
  }

  /** Calls back with all recordings, newest first, after each refresh. */
  listen(listener) {
    this.#listeners.push(listener);
  }

  get all() {
    return this.#all;
  }

  async refresh() {
    const answer = await ask("/v1/recordings");
    // The state of the connection at the top reports a missing answer.
    if (answer.error) return;
    this.#all = answer.recordings;
    this.#show(answer.recordings);
    for (const listener of this.#listeners) listener(answer.recordings);
  }

  /** Stops one; answers the error, if any. */
  async stop(id) {
    const answer = await ask(`/v1/recordings/${id}/stop`, {});
    await this.refresh();
    return answer.error;
  }

  /** Deletes one for good; answers the error, if any. */
  async remove(id) {
    const answer = await ask(`/v1/recordings/${id}`, undefined, "DELETE");
    await this.refresh();
    return answer.error;
  }

  /** Writes a note; answers the error, if any. */
  async note(id, note) {
    const answer = await ask(`/v1/recordings/${id}/note`, { note });
    await this.refresh();
    return answer.error;
  }

  async #start() {
    const answer = await ask("/v1/recordings", { name: this.#name.value });
    this.#complain(answer.error);
    if (!answer.error) this.#name.value = "";
    await this.refresh();
  }

  #complain(error) {
    this.#name.setAttribute("aria-invalid", String(Boolean(error)));
    complain(this.#trouble, error);
  }

  #show(recordings) {
    this.#running = recordings.some((recording) => recording.running);
    this.#none.hidden = recordings.length > 0;
    this.#more.hidden = recordings.length <= LISTED_MAX;
    // Running ones are listed however many came after them.
    const listed = recordings.filter((recording, index) => index < LISTED_MAX || recording.running);
    const rows = listed.map((recording) => this.#row(recording));
    const same = rows.length === this.#list.children.length && rows.every((row, index) => row === this.#list.children[index]);
    if (!same) this.#list.replaceChildren(...rows);
  }

  /** Rows persist, so that a button does not vanish under a finger. */
  #row(recording) {
    if (!this.#rows.has(recording.id)) {
      const row = this.#template.content.firstElementChild.cloneNode(true);
      fieldsOf(row).stop.addEventListener("click", async () => this.#complain(await this.stop(recording.id)));
      this.#rows.set(recording.id, row);
    }
    const row = this.#rows.get(recording.id);
    const fields = fieldsOf(row);
    row.dataset.running = recording.running;
    say(fields.name, recording.name);
    say(fields.facts, factsOf(recording));
    offer(fields, recording);
    return row;
  }
}

/** A recording's buttons and links. */
export function offer(fields, recording) {
  fields.stop.hidden = !recording.running;
  fields.stop.setAttribute("aria-label", `Stop recording ${recording.name}`);
  fields.csv.hidden = recording.running;
  fields.csv.href = recording.csv;
  fields.csv.setAttribute("aria-label", `Download ${recording.name} as CSV`);
  fields.play.href = `#recording=${recording.id}`;
  fields.play.setAttribute("aria-label", `Play ${recording.name}`);
}

/** The length of a recording, so far if it is running. */
export function lengthOf(recording) {
  const until = recording.t_stop_ns ?? Date.now() * 1e6;
  const length = duration(Math.max(0, (until - recording.t_start_ns) / 1e9));
  return recording.running ? `recording for ${length}` : length;
}

/** One line: length, frames, sensors, missing frames. */
export function factsOf(recording, length = lengthOf(recording)) {
  const parts = [length, recording.frames > 0 ? count(recording.frames, "frame", "frames") : "no frames"];
  if (recording.sensors > 0) parts.push(count(recording.sensors, "sensor", "sensors"));
  if (recording.missing > 0) parts.push(`${recording.missing.toLocaleString("en")} missing`);
  return parts.join(" · ");
}
