// The table of all recordings.

import { complain } from "./ask.js";
import { NoteField } from "./note.js";
import { lengthOf, offer } from "./recordings.js";
import { fieldsOf, minute, say } from "./words.js";

const SURE = "Delete for good";

export class Library {
  #section = document.querySelector("#recordings");
  #body = document.querySelector("#library");
  #empty = document.querySelector("#library-empty");
  #trouble = document.querySelector("#library-trouble");
  #template = document.querySelector("#library-row");
  #recordings;
  #rows = new Map();

  constructor(recordings) {
    this.#recordings = recordings;
    recordings.listen(() => this.#fill());
  }

  show(visible) {
    this.#section.hidden = !visible;
    if (visible) this.#recordings.refresh();
  }

  #fill() {
    if (this.#section.hidden) return;
    const recordings = this.#recordings.all;
    this.#empty.hidden = recordings.length > 0;
    this.#section.querySelector("table").hidden = recordings.length === 0;
    const rows = recordings.map((recording) => this.#row(recording));
    const same = rows.length === this.#body.children.length && rows.every((row, index) => row === this.#body.children[index]);
    if (!same) this.#body.replaceChildren(...rows);
  }

  #row(recording) {
    if (!this.#rows.has(recording.id)) this.#rows.set(recording.id, this.#newRow(recording.id));
    const { row, fields, note } = this.#rows.get(recording.id);
    row.dataset.running = recording.running;
    say(fields.name, recording.name);
    fields.name.href = `#recording=${recording.id}`;
    note.take(recording);
    say(fields.started, minute(recording.t_start_ns / 1e6));
    say(fields.length, lengthOf(recording));
    say(fields.frames, recording.frames.toLocaleString("en"));
    say(fields.gaps, recording.missing === 0 ? "none" : `${recording.missing.toLocaleString("en")} missing`);
    say(fields.sensors, recording.sensors.toLocaleString("en"));
    offer(fields, recording);
    fields.remove.hidden = recording.running;
    fields.remove.setAttribute("aria-label", `${fields.remove.textContent} recording ${recording.name}`);
    return row;
  }

  #newRow(id) {
    const row = this.#template.content.firstElementChild.cloneNode(true);
    const fields = fieldsOf(row);
    fields.stop.addEventListener("click", async () => complain(this.#trouble, await this.#recordings.stop(id)));
    // The second click deletes: nothing brings a recording back.
    fields.remove.addEventListener("click", async () => {
      if (fields.remove.textContent === SURE) complain(this.#trouble, await this.#recordings.remove(id));
      else say(fields.remove, SURE);
    });
    fields.remove.addEventListener("blur", () => say(fields.remove, "Delete"));
    return { row, fields, note: new NoteField(fields.note, this.#recordings, this.#trouble) };
  }
}
