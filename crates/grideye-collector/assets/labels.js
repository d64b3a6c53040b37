// Labels on a recording: what its frames show. Added for a frame or a range, by form or by key.

import { ask, complain } from "./ask.js";
import { count, place, say } from "./words.js";

// Keys 1 to 9 add the names in use, in the order of the list.
const BY_KEY_MAX = 9;

export class Labels {
  #form = document.querySelector("#label");
  #range = document.querySelector("#label-range");
  #which = document.querySelector("#label-which");
  #names = document.querySelector("#label-names");
  #list = document.querySelector("#label-list");
  #csv = document.querySelector("#label-csv");
  #trouble = document.querySelector("#label-trouble");
  #at;
  #seek;
  #drawn;
  #id = null;
  #tracks = [];
  #labels = [];
  #from = null;
  #to = null;

  /** `at` answers the position in seconds, `seek` changes it, `drawn` gets what the timeline shows. */
  constructor({ at, seek, drawn }) {
    [this.#at, this.#seek, this.#drawn] = [at, seek, drawn];
    this.#form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.put(this.#form.elements.name.value.trim());
    });
    for (const button of this.#form.querySelectorAll("[data-end]")) button.addEventListener("click", () => this.mark(button.dataset.end));
  }

  /** Takes another recording, or none with `null`. */
  async take(id, tracks) {
    [this.#id, this.#tracks, this.#labels, this.#from, this.#to] = [id, tracks, [], null, null];
    document.querySelector("#labels").hidden = tracks.length === 0;
    const several = tracks.length > 1;
    this.#which.parentElement.hidden = !several;
    const options = tracks.map(({ key, device, sensor }) => new Option(`${device} · ${sensor}`, key));
    this.#which.replaceChildren(new Option("all sensors", ""), ...options);
    this.#csv.href = `/v1/recordings/${encodeURIComponent(id)}/labels.csv`;
    complain(this.#trouble, null);
    this.#show();
    if (id !== null) await this.refresh();
  }

  /** Fetches the labels again if this recording changed. */
  async refresh(id = this.#id) {
    if (this.#id === null || String(id) !== String(this.#id)) return;
    const asked = this.#id;
    const answer = await ask(`/v1/recordings/${encodeURIComponent(asked)}/labels`);
    if (asked !== this.#id) return;
    complain(this.#trouble, answer.error);
    if (answer.error) return;
    this.#labels = answer.labels.map((label) => ({ ...label, ...this.#placeOf(label) }));
    this.#show();
  }

  /** Sets one end of the range, "from" or "to", to the position; a second time clears it. */
  mark(end) {
    const at = this.#at();
    if (end === "from") this.#from = this.#from === at ? null : at;
    else this.#to = this.#to === at ? null : at;
    this.moved();
  }

  /** Focuses the field for a label's name. */
  write() {
    this.#form.elements.name.focus();
  }

  /** Adds a label with a name in use. */
  again(index) {
    const name = this.#used()[index];
    if (name === undefined) complain(this.#trouble, { message: `Key ${index + 1} has no label yet. Press a to add one.` });
    else this.put(name);
  }

  /** Labels the range, or without one the frame at the position. */
  async put(name) {
    const [from, to] = this.#ends();
    const key = this.#which.value;
    const tracks = this.#tracks.filter((track) => key === "" || track.key === key);
    const spans = tracks.flatMap((track) => track.spansBetween(from, to));
    if (spans.length === 0) return complain(this.#trouble, { message: "There is no frame here to label." });
    const answer = await ask(`/v1/recordings/${encodeURIComponent(this.#id)}/labels`, { name, spans });
    this.#form.elements.name.setAttribute("aria-invalid", String(Boolean(answer.error)));
    complain(this.#trouble, answer.error);
    if (answer.error) return;
    [this.#from, this.#to] = [null, null];
    this.#form.elements.name.value = "";
    // Keys control the recording again.
    this.#form.elements.name.blur();
    await this.refresh();
  }

  /** The position changed. */
  moved() {
    if (this.#id === null) return;
    const [from, to] = this.#ends();
    const isRange = this.#from !== null || this.#to !== null;
    say(this.#range, isRange ? `${place(from)} to ${place(to)}` : `the frame at ${place(from)}`);
    this.#drawn(this.#labels, isRange ? { from, to } : null);
  }

  /** From mark to mark; a missing mark is the position. */
  #ends() {
    const ends = [this.#from ?? this.#at(), this.#to ?? this.#at()];
    return [Math.min(...ends), Math.max(...ends)];
  }

  #used() {
    return [...new Set(this.#labels.map(({ name }) => name))].slice(0, BY_KEY_MAX);
  }

  /** Seconds of its first and last frame, and its number of frames. Sensors that are not shown have no place. */
  #placeOf({ spans }) {
    const found = spans.flatMap((span) => {
      const track = this.#tracks.find(({ device, sensor }) => device === span.device && sensor === span.sensor);
      return track?.placesOf(span) ?? [];
    });
    return { from: Math.min(...found), to: Math.max(...found), frames: spans.reduce((sum, span) => sum + span.last_seq - span.first_seq + 1, 0) };
  }

  #show() {
    const used = this.#used();
    this.#names.replaceChildren(...used.map((name) => new Option(name)));
    const rows = this.#labels.toSorted((one, other) => one.from - other.from).map((label) => this.#row(label, used.indexOf(label.name)));
    this.#list.replaceChildren(...rows);
    this.#csv.hidden = this.#labels.length === 0;
    this.moved();
  }

  #row(label, key) {
    const row = document.createElement("li");
    if (key >= 0) row.append(Object.assign(document.createElement("kbd"), { textContent: key + 1 }));
    const where = label.from === label.to ? place(label.from) : `${place(label.from)} to ${place(label.to)}`;
    const name = button(label.name, `Go to ${label.name}, ${where}`, () => this.#seek(label.from));
    const facts = Object.assign(document.createElement("span"), { className: "faint", textContent: `${where} · ${count(label.frames, "frame", "frames")}` });
    const remove = button("Delete", `Delete ${label.name}, ${where}`, () => this.#remove(label));
    remove.dataset.writes = "";
    row.append(name, facts, remove);
    return row;
  }

  async #remove({ number }) {
    const answer = await ask(`/v1/recordings/${encodeURIComponent(this.#id)}/labels/${number}`, undefined, "DELETE");
    complain(this.#trouble, answer.error);
    await this.refresh();
  }
}

function button(text, label, does) {
  const made = Object.assign(document.createElement("button"), { type: "button", textContent: text });
  made.setAttribute("aria-label", label);
  made.addEventListener("click", does);
  return made;
}
