// A scene being edited: its text, the collector's answer, and the undo history. The collector edits the text itself, so that
// comments and layout stay. At most one request is under way; the newest state is sent after it.

const HISTORY_MAX = 200;
// Characters of all undo steps together; the oldest are deleted first.
const HISTORY_CHARACTERS_MAX = 16_000_000;
// Typing is one step until a pause this long.
const TYPING_MS = 1_500;
// Not more often than screens refresh: a token has a request limit.
const SEND_MS = 14;
const MEASURES_MAX = 1_000;

export class Draft {
  /** Name in the folder; null before the first save. */
  name = null;
  /** The outline from the last good answer; null before it. */
  scene = null;
  frames = [];
  warnings = [];
  /** The error of the newest state, with its place. */
  fault = null;
  /** Whether the text itself has that error, not just a rejected edit. */
  broken = false;
  /** Scenes that share trajectories with this one. */
  shared = [];
  #base = { text: "", files: {} };
  #good = null;
  #edits = new Map();
  #open = false;
  #whole = false;
  #said = null;
  #undone = [];
  #done = [];
  #versions = new Map();
  #version = null;
  #saved = { text: "", files: {} };
  #atS = 0;
  #dirty = false;
  #busy = false;
  #typedAt = -Infinity;
  #sentAt = 0;
  #handAt = null;
  #waiting = [];
  #on;

  /** Calls `on.drawn` after every answer, and `on.text` when the text changes. */
  constructor(on) {
    this.#on = on;
  }

  get text() {
    return this.#base.text;
  }

  get seconds() {
    return this.scene?.seconds ?? 0;
  }

  get canUndo() {
    return this.#done.length > 0;
  }

  get canRedo() {
    return this.#undone.length > 0;
  }

  /** Whether there are unsaved changes. */
  get changed() {
    const { text, files } = this.#base;
    return text !== this.#saved.text || Object.entries(files).some(([file, now]) => now !== this.#saved.files[file]);
  }

  /** The scene and its trajectories as a request body. */
  get body() {
    return { text: this.#base.text, files: this.#base.files, at_s: this.#atS };
  }

  /** Opens a scene of the folder; returns an error or null. */
  async open(name) {
    const answer = await this.#asked("GET", `/v1/editor/scenes/${encodeURIComponent(name)}`);
    if (answer.error) return answer.error;
    this.#begin(answer.text, { name, version: answer.version, shared: answer.shared });
    await this.settled();
    this.#saved = structuredClone(this.#base);
    this.#on.drawn();
    return null;
  }

  /** Begins a scene that is in no file yet. */
  async create(text) {
    this.#begin(text, { name: null, version: null, shared: [] });
    await this.settled();
    this.#on.drawn();
  }

  #begin(text, { name, version, shared }) {
    Object.assign(this, { name, shared, scene: null, frames: [], warnings: [], fault: null, broken: false });
    this.#base = { text, files: {} };
    this.#saved = { text: version === null ? "" : text, files: {} };
    this.#version = version;
    this.#versions.clear();
    this.#edits.clear();
    this.#done = [];
    this.#undone = [];
    this.#atS = 0;
    this.#on.text(text);
    this.#send();
  }

  /** Continues a gesture: each edit replaces the earlier one of the same key. */
  change(edits, handAt = performance.now()) {
    this.#open = true;
    for (const edit of edits) {
      this.#edits.delete(keyOf(edit));
      this.#edits.set(keyOf(edit), edit);
    }
    this.#handAt = handAt;
    this.#send();
  }

  /** Ends a gesture and makes it one undo step. If it ends in an error, the last good state stays, or with `whole` the first. */
  finish(whole = false) {
    if (!this.#open) return;
    this.#open = false;
    this.#whole = whole;
    if (!this.#busy && !this.#dirty) this.#settle();
  }

  /** Makes one step of some edits; returns whether it succeeded. */
  async apply(edits) {
    await this.settled();
    this.change(edits);
    this.finish();
    await this.settled();
    return this.fault === null;
  }

  /** The first alternative that gives a valid scene, preferably without a new warning; or null. */
  async best(ways) {
    await this.settled();
    let possible = null;
    for (const edits of ways) {
      const answer = await this.#asked("POST", "/v1/editor/draft", { ...this.body, edits });
      if (answer.error || answer.fault) continue;
      if (answer.warnings.length <= this.warnings.length) return edits;
      possible ??= edits;
    }
    return possible;
  }

  /** The value of a key in an edit not yet answered. */
  pending(edit) {
    return this.#edits.get(keyOf(edit))?.to;
  }

  /** Takes typed text. */
  async write(text) {
    await this.settled();
    if (text === this.#base.text) return;
    const now = performance.now();
    if (now - this.#typedAt > TYPING_MS) this.#remember();
    this.#typedAt = now;
    this.#undone = [];
    this.#base = { ...this.#base, text };
    this.#handAt = now;
    this.#send();
  }

  async undo() {
    await this.#step(this.#done, this.#undone);
  }

  async redo() {
    await this.#step(this.#undone, this.#done);
  }

  async #step(from, to) {
    await this.settled();
    const step = from.pop();
    if (!step) return;
    to.push(this.#base);
    this.#typedAt = -Infinity;
    this.#base = step;
    this.#on.text(step.text);
    this.#send();
    await this.settled();
  }

  /** Shows another second of the scene. */
  seek(seconds) {
    this.#atS = seconds;
    this.#send();
  }

  /** Saves under a name; returns an error or null. */
  async save(name) {
    await this.settled();
    if (this.broken) return this.fault;
    const kept = this.#base;
    const files = Object.entries(kept.files).map(([file, text]) => [file, { text, version: this.#versions.get(file) ?? null }]);
    const version = name === this.name ? this.#version : null;
    const answer = await this.#asked("PUT", `/v1/editor/scenes/${encodeURIComponent(name)}`, { text: kept.text, version, files: Object.fromEntries(files) });
    if (answer.error) return answer.error;
    this.name = name;
    this.#version = answer.version;
    for (const [file, now] of Object.entries(answer.files)) this.#versions.set(file, now);
    this.#saved = structuredClone(kept);
    this.#on.drawn();
    return null;
  }

  /** Resolves when no request is under way. */
  settled() {
    if (!this.#busy && !this.#dirty) return Promise.resolve();
    return new Promise((resolve) => this.#waiting.push(resolve));
  }

  async #send() {
    this.#dirty = true;
    if (this.#busy) return;
    this.#busy = true;
    while (this.#dirty) {
      await rest(this.#sentAt + SEND_MS - performance.now());
      this.#dirty = false;
      this.#sentAt = performance.now();
      const handAt = this.#handAt;
      const answer = await this.#asked("POST", "/v1/editor/draft", { ...this.body, edits: [...this.#edits.values()] });
      this.#take(answer);
      if (handAt !== null && this.fault === null) measure(handAt);
    }
    this.#busy = false;
    if (!this.#open) this.#settle();
    for (const resolve of this.#waiting.splice(0)) resolve();
  }

  #take(answer) {
    const edited = this.#edits.size > 0;
    const fault = answer.error ?? answer.fault ?? null;
    this.fault = fault;
    // No answer says nothing about the text.
    if (!answer.error && !edited) this.broken = fault !== null;
    const read = Object.entries(answer.read ?? {});
    for (const [file, { text, version }] of read) {
      this.#base.files[file] ??= text;
      if (!this.#versions.has(file)) this.#versions.set(file, version);
      this.#saved.files[file] ??= text;
    }
    if (fault === null) {
      [this.fault, this.#said] = [this.#said, null];
      const { scene, frames, warnings } = answer;
      Object.assign(this, { scene, frames, warnings });
      if (edited) this.#good = { text: answer.text, files: { ...this.#base.files, ...answer.files } };
    }
    this.#on.drawn();
  }

  /** Takes the result of a gesture; after an error, its last good state. */
  #settle() {
    const [good, edited] = [this.#good, this.#edits.size > 0];
    this.#edits.clear();
    this.#good = null;
    if (edited && this.fault !== null && this.#whole && !this.broken) {
      // The screen shows a state that is dropped now: draw the scene again and keep the error on screen.
      this.#said = good === null ? null : this.fault;
      if (good !== null) this.#send();
      return;
    }
    if (!edited || good === null) return;
    if (good.text === this.#base.text && JSON.stringify(good.files) === JSON.stringify(this.#base.files)) return;
    this.#remember();
    this.#undone = [];
    this.#typedAt = -Infinity;
    this.#base = good;
    this.#on.text(good.text);
    this.#on.drawn();
  }

  #remember() {
    this.#done.push(this.#base);
    let characters = this.#done.reduce((sum, { text }) => sum + text.length, 0);
    while (this.#done.length > HISTORY_MAX || characters > HISTORY_CHARACTERS_MAX) characters -= this.#done.shift().text.length;
  }

  async #asked(method, path, body) {
    const headers = { "content-type": "application/json" };
    try {
      const response = await fetch(path, body === undefined ? { method } : { method, headers, body: JSON.stringify(body) });
      return await response.json();
    } catch {
      return { error: { message: "the collector cannot be reached", hint: "check that it runs; your changes are still here" } };
    }
  }
}

/** Edits with the same key replace each other. */
function keyOf({ does, path, file, row, name }) {
  return JSON.stringify([does === "unset" ? "set" : does, path, file, row, name]);
}

function rest(milliseconds) {
  return milliseconds <= 0 ? null : new Promise((resolve) => setTimeout(resolve, milliseconds));
}

/** Records the time from input to painted answer, as `performance.getEntriesByName("hand to picture")`. */
function measure(handAt) {
  // A timeout set before a paint runs after it.
  requestAnimationFrame(() => setTimeout(() => {
    const name = "hand to picture";
    if (performance.getEntriesByName(name).length >= MEASURES_MAX) performance.clearMeasures(name);
    performance.measure(name, { start: handAt, end: performance.now() });
  }));
}
