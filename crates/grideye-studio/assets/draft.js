// A scene while it is edited: its text, what the collector makes of it, and the way back. The collector makes every edit in
// the text itself, so that remarks and layout stay; at most one request is on its way, and the newest state goes last.

const HISTORY_MAX = 200;
// Texts of all steps back together; the oldest go first.
const HISTORY_CHARACTERS_MAX = 16_000_000;
// Typing goes on as one step while pauses are shorter.
const TYPING_MS = 1_500;
// No more often than screens change: a token has so many requests a second.
const SEND_MS = 14;
const MEASURES_MAX = 1_000;

export class Draft {
  /** Its name in the folder, or null for one that was never saved. */
  name = null;
  /** What is where, as the collector drew it last; null until it did. */
  scene = null;
  frames = [];
  warnings = [];
  /** What is wrong with the newest state, with its place. */
  fault = null;
  /** Whether the text itself has that fault, and not only an edit that was not made. */
  broken = false;
  /** Scenes that go the same ways. */
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

  /** `on.drawn` is called after every answer, `on.text` when the text is another one. */
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

  /** Whether there is something that is not in the folder. */
  get changed() {
    const { text, files } = this.#base;
    return text !== this.#saved.text || Object.entries(files).some(([file, now]) => now !== this.#saved.files[file]);
  }

  /** The text of the scene and its trajectories, as requests have it. */
  get body() {
    return { text: this.#base.text, files: this.#base.files, at_s: this.#atS };
  }

  /** Opens a scene of the folder; answers what is wrong if that cannot be. */
  async open(name) {
    const answer = await this.#asked("GET", `/v1/editor/scenes/${encodeURIComponent(name)}`);
    if (answer.error) return answer.error;
    this.#begin(answer.text, { name, version: answer.version, shared: answer.shared });
    await this.settled();
    this.#saved = structuredClone(this.#base);
    this.#on.drawn();
    return null;
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

  /** Goes on with a gesture: each edit takes the place of the one before for the same thing. */
  change(edits, handAt = performance.now()) {
    this.#open = true;
    for (const edit of edits) {
      this.#edits.delete(keyOf(edit));
      this.#edits.set(keyOf(edit), edit);
    }
    this.#handAt = handAt;
    this.#send();
  }

  /** Ends a gesture: it becomes one step. One that ends in a fault goes as far as it was good, or if `whole` not at all. */
  finish(whole = false) {
    if (!this.#open) return;
    this.#open = false;
    this.#whole = whole;
    if (!this.#busy && !this.#dirty) this.#settle();
  }

  /** One step at once; answers whether it could be made. */
  async apply(edits) {
    await this.settled();
    this.change(edits);
    this.finish();
    await this.settled();
    return this.fault === null;
  }

  /** The first of several ways to do something that makes a scene, if there is one without a new warning; or null. */
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

  /** What a key will be once all is done that was asked for: of an edit that is on its way, or of the scene. */
  pending(edit) {
    return this.#edits.get(keyOf(edit))?.to;
  }

  /** Takes a text that was typed. */
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

  /** Saves under a name; answers what is wrong if that cannot be. */
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

  /** Resolves when nothing is on its way any more. */
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
    // Nobody answered: that says nothing of the text.
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

  /** What came of a gesture is the scene; of one that ended in a fault, the last that was none. */
  #settle() {
    const [good, edited] = [this.#good, this.#edits.size > 0];
    this.#edits.clear();
    this.#good = null;
    if (edited && this.fault !== null && this.#whole && !this.broken) {
      // What was good on the way is on the screen: what stays is drawn again, and the fault stays said.
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
      return { error: { message: "the collector cannot be reached", hint: "see that it is running; what you did is still here" } };
    }
  }
}

/** What an edit is for: a later one for the same takes its place. */
function keyOf({ does, path, file, row, name }) {
  return JSON.stringify([does === "unset" ? "set" : does, path, file, row, name]);
}

function rest(milliseconds) {
  return milliseconds <= 0 ? null : new Promise((resolve) => setTimeout(resolve, milliseconds));
}

/** Keeps how long it took from the hand to the picture, as `performance.getEntriesByName("hand to picture")`. */
function measure(handAt) {
  // What is asked for before a picture of the screen is done when the page has painted it.
  requestAnimationFrame(() => setTimeout(() => {
    const name = "hand to picture";
    if (performance.getEntriesByName(name).length >= MEASURES_MAX) performance.clearMeasures(name);
    performance.measure(name, { start: handAt, end: performance.now() });
  }));
}
