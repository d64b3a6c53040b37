// Labels on a recording: what was to be seen in which frames, put there by key or by range, and listed.

import { ask, complain } from "./ask.js";
import { count, place, say } from "./words.js";

// Keys 1 to 9 put the names that are used already, in the order of the list below them.
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

  /** `at` answers the seconds that are looked at, `seek` goes to others, `drawn` is told what is to be drawn in the strip. */
  constructor({ at, seek, drawn }) {
    [this.#at, this.#seek, this.#drawn] = [at, seek, drawn];
    this.#form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.put(this.#form.elements.name.value.trim());
    });
    for (const button of this.#form.querySelectorAll("[data-end]")) button.addEventListener("click", () => this.mark(button.dataset.end));
  }

  /** Takes another recording, or with `null` none. */
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

  /** Asks again for the labels of the recording, where it is this one that changed. */
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

  /** Puts one end of the range, "from" or "to", where is looked at now; once more, and it is taken back. */
  mark(end) {
    const at = this.#at();
    if (end === "from") this.#from = this.#from === at ? null : at;
    else this.#to = this.#to === at ? null : at;
    this.moved();
  }

  /** Goes to the field for a label's name. */
  write() {
    this.#form.elements.name.focus();
  }

  /** Labels the range, or where none is marked the frame that is looked at, with a name that is used already. */
  again(index) {
    const name = this.#used()[index];
    if (name === undefined) complain(this.#trouble, { message: `No label has the key ${index + 1} yet: the first is put with a.` });
    else this.put(name);
  }

  /** Labels the range, or where none is marked the frame that is looked at. */
  async put(name) {
    const [from, to] = this.#ends();
    const key = this.#which.value;
    const tracks = this.#tracks.filter((track) => key === "" || track.key === key);
    const spans = tracks.flatMap((track) => track.spansBetween(from, to));
    if (spans.length === 0) return complain(this.#trouble, { message: "There is no frame here to put a label on." });
    const answer = await ask(`/v1/recordings/${encodeURIComponent(this.#id)}/labels`, { name, spans });
    this.#form.elements.name.setAttribute("aria-invalid", String(Boolean(answer.error)));
    complain(this.#trouble, answer.error);
    if (answer.error) return;
    [this.#from, this.#to] = [null, null];
    this.#form.elements.name.value = "";
    // The keys are those of the recording again.
    this.#form.elements.name.blur();
    await this.refresh();
  }

  /** The place that is looked at is another one. */
  moved() {
    if (this.#id === null) return;
    const [from, to] = this.#ends();
    const isRange = this.#from !== null || this.#to !== null;
    say(this.#range, isRange ? `${place(from)} to ${place(to)}` : `the frame at ${place(from)}`);
    this.#drawn(this.#labels, isRange ? { from, to } : null);
  }

  /** Without marks the frame itself; with one of them, from or to where is looked at. */
  #ends() {
    const ends = [this.#from ?? this.#at(), this.#to ?? this.#at()];
    return [Math.min(...ends), Math.max(...ends)];
  }

  #used() {
    return [...new Set(this.#labels.map(({ name }) => name))].slice(0, BY_KEY_MAX);
  }

  /** Seconds of its first and its last frame, and how many frames it holds; those that are not shown have no place. */
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
    const remove = button("Remove", `Remove ${label.name}, ${where}`, () => this.#remove(label));
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
