// One live sensor: its image, its history and its state.

import { ask } from "./ask.js";
import { History } from "./history.js";
import { Picture } from "./picture.js";
import { troublesOf } from "./troubles.js";
import { duration, fieldsOf, say } from "./words.js";

// Frames of one batch are shown at their measured intervals, unless that takes longer than this.
const PLAYED_MS_MAX = 1_500;
// A sensor is stale after this time, or after three periods of a slow sensor.
const STALE_S_MIN = 3;
const DESCRIBED_MS = 200;
const HISTORY_DRAWN_MS = 500;

export class Sensor {
  #fields;
  #article;
  #picture;
  #history;
  #status = null;
  #waiting = [];
  #shown = null;
  #missing = null;
  #describedAt = -Infinity;
  #drawnAt = -Infinity;
  // The first frame shown; earlier ones come from the collector's memory.
  #first = null;
  #asked = false;
  #watcher = null;

  /** `key` identifies the sensor, `look` is how images are drawn, `enlarge` shows this sensor alone. */
  constructor(template, { key, look, enlarge }) {
    this.#article = template.content.firstElementChild.cloneNode(true);
    for (const element of this.#article.querySelectorAll("[data-played]")) element.remove();
    this.#fields = fieldsOf(this.#article);
    this.#history = new History(this.#article.querySelector(".history"));
    this.#picture = new Picture(this.#article, { key, look, among: "live", oriented: (orientation) => this.#watcher?.orient(orientation) });
    this.#fields.large.addEventListener("click", () => enlarge(key));
  }

  get element() {
    return this.#article;
  }

  get picture() {
    return this.#picture;
  }

  /** Sends each frame, the image's orientation and the state to `watcher` from now on, or to nobody. */
  watch(watcher) {
    this.#watcher = watcher;
    watcher?.orient(this.#picture.orientation);
    if (this.#shown !== null) watcher?.frame(this.#shown.frame, this.#status);
    this.#describedAt = -Infinity;
  }

  /** Names the panel's button, and what it does. */
  offerBeside(title, toggle) {
    say(this.#fields.beside, title);
    this.#fields.beside.addEventListener("click", toggle);
  }

  /** Takes a sensor's part of an event: its state and new frames. */
  take(status) {
    const again = this.#status !== null && this.#status.boot !== status.boot;
    this.#status = status;
    if (again) this.#missing = null;
    this.#hurry();
    this.#plan(status.frames);
    this.#describedAt = -Infinity;
    this.tick();
  }

  /** Shows what is due, and its age. */
  tick() {
    const now = performance.now();
    while (this.#waiting.length > 0 && this.#waiting[0].due <= now) this.#show(this.#waiting.shift());
    if (this.#status === null || now - this.#describedAt < DESCRIBED_MS) return;
    this.#describedAt = now;
    this.#describe();
    if (now - this.#drawnAt < HISTORY_DRAWN_MS) return;
    this.#drawnAt = now;
    if (!this.#asked && this.#first !== null && this.#history.isSeen) this.#fill();
    this.#history.draw(now / 1000);
  }

  #plan(frames) {
    if (frames.length === 0) return;
    const [now, today] = [performance.now(), Date.now()];
    const since = (frame) => (frame.t_boot_ns - frames[0].t_boot_ns) / 1e6;
    const played = since(frames.at(-1)) <= PLAYED_MS_MAX;
    for (const frame of frames) {
      this.#waiting.push({ frame, came: { now, today }, due: played ? now + since(frame) : now });
    }
  }

  /** Shows waiting frames at once when more arrive, so that the image never lags. */
  #hurry() {
    for (const next of this.#waiting.splice(0)) this.#show(next);
  }

  #show(next) {
    const measuredAt = next.came.now / 1000 - next.frame.age_s;
    this.#describedAt = -Infinity;
    if (next.frame.missing !== undefined) {
      this.#missing = next;
      this.#history.miss(measuredAt);
      return;
    }
    this.#missing = null;
    this.#shown = next;
    this.#first ??= { boot: this.#status.boot, t_boot_ns: next.frame.t_boot_ns, at: measuredAt };
    this.#history.add(measuredAt, this.#picture.show(next.frame));
    this.#watcher?.frame(next.frame, this.#status);
  }

  /** Adds the minutes before the page opened, from the collector's memory. */
  async #fill() {
    this.#asked = true;
    const { device, sensor } = this.#status;
    const answer = await ask(`/v1/recent?${new URLSearchParams({ device, sensor })}`);
    // Without them the history begins now, as for a new sensor.
    if (answer.error || answer.boot !== this.#first.boot) return;
    const before = answer.rows.filter(([t_boot_ns]) => t_boot_ns < this.#first.t_boot_ns);
    const at = (t_boot_ns) => this.#first.at - (this.#first.t_boot_ns - t_boot_ns) / 1e9;
    const points = before.filter(([, min]) => min !== null).map(([t, min, mean, max]) => ({ at: at(t), min, mean, max, region: null }));
    this.#history.precede(points, before.filter(([, min]) => min === null).map(([t]) => at(t)));
  }

  #describe() {
    const { device, sensor, rate_hz: rate } = this.#status;
    const age = this.#shown === null ? Infinity : ageOf(this.#shown);
    const staleAfter = Math.max(STALE_S_MIN, rate ? 3 / rate : 0);
    const stale = age > staleAfter;
    // An old reason does not explain the present.
    const missing = this.#missing !== null && ageOf(this.#missing) <= staleAfter ? this.#missing.frame.missing : null;
    say(this.#fields.name, `${device} · ${sensor}`);
    this.#picture.label = `${device}, ${sensor}`;
    const atLeast = this.#shown?.frame.age_basis === "arrival" ? "at least " : "";
    say(this.#fields.age, age === Infinity ? "none yet" : `${atLeast}${duration(age)} ago`);
    say(this.#fields.rate, stale || !rate ? "–" : `${rate.toFixed(2)} Hz`);
    say(this.#fields.stored, this.#status.stored.toLocaleString("en"));
    this.#people(stale || missing !== null);
    this.#state(age, stale, missing);
    this.#troubles();
  }

  /** If the collector counts people: how many, and where. */
  #people(isOld) {
    const { people, people_pixels: pixels, entered, left } = this.#status;
    const label = this.#fields.people.parentElement;
    label.hidden = people === undefined;
    this.#picture.people = isOld ? [] : pixels ?? [];
    if (label.hidden) return;
    const count = isOld ? "–" : people === null ? "not yet" : people === 3 ? "3 or more" : String(people);
    label.title = people === null ? "The empty room is known after half a minute." : "";
    say(this.#fields.people, entered === undefined ? count : `${count} (${entered} in, ${left} out)`);
  }

  #state(age, stale, missing) {
    const state = missing ? "missing" : stale ? "stale" : "live";
    this.#article.dataset.state = state;
    const old = age === Infinity ? "no frame yet" : `last frame ${duration(age)} ago`;
    say(this.#fields.state, { live: "live", stale: "stale", missing: "no frame" }[state]);
    this.#fields.veil.hidden = state === "live";
    const veil = { live: "", stale: `Stale: ${old}`, missing: `No frame: ${missing}. ${old[0].toUpperCase()}${old.slice(1)}` };
    say(this.#fields.veil, veil[state]);
    this.#watcher?.state(state, veil[state]);
  }

  #troubles() {
    const texts = troublesOf(this.#status);
    if (this.#fields.troubles.dataset.texts === texts.join("\n")) return;
    this.#fields.troubles.dataset.texts = texts.join("\n");
    this.#fields.troubles.replaceChildren(
      ...texts.map((text) => Object.assign(document.createElement("li"), { textContent: text })),
    );
  }
}

/**
 * Seconds since a frame was measured. One clock stops while a computer sleeps and the other can be set, so the larger age
 * counts.
 */
function ageOf({ frame, came }) {
  const passed = Math.max(performance.now() - came.now, Date.now() - came.today, 0);
  return frame.age_s + passed / 1000;
}
