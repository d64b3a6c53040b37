// One sensor: its picture, its numbers, and how it does.

import { HeatMap } from "./heatmap.js";
import { paintBar, rangeOf, ticksOf } from "./palette.js";
import { byKind, count, degrees, duration, fieldsOf, say } from "./words.js";

// Frames of one post are shown as far apart as they were measured, unless that takes longer than this.
const PLAYED_MS_MAX = 1_500;
// A frame older than this, or than three periods of a slow sensor, is not called live.
const STALE_S_MIN = 3;

export class Sensor {
  #fields;
  #article;
  #heat;
  #status = null;
  #waiting = [];
  #shown = null;
  #missing = null;

  constructor(template) {
    this.#article = template.content.firstElementChild.cloneNode(true);
    this.#fields = fieldsOf(this.#article);
    this.#heat = new HeatMap(this.#article.querySelector(".heat"), () => this.#cursor());
    paintBar(this.#article.querySelector(".bar"));
    this.#cursor();
  }

  get element() {
    return this.#article;
  }

  /** Takes a sensor's part of an event: its state, and the frames that came. */
  take(status) {
    const again = this.#status !== null && this.#status.boot !== status.boot;
    this.#status = status;
    if (again) this.#missing = null;
    this.#hurry();
    this.#plan(status.frames);
    this.tick();
  }

  /** Shows what is due, and how old it is by now. */
  tick() {
    const now = performance.now();
    while (this.#waiting.length > 0 && this.#waiting[0].due <= now) this.#show(this.#waiting.shift());
    if (this.#status !== null) this.#describe();
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

  /** What still waits when more comes is shown at once: the picture never falls behind. */
  #hurry() {
    for (const next of this.#waiting.splice(0)) this.#show(next);
  }

  #show(next) {
    if (next.frame.missing !== undefined) {
      this.#missing = next;
      return;
    }
    this.#missing = null;
    this.#shown = next;
    this.#picture(next.frame);
  }

  #picture(frame) {
    const celsius = frame.pixels_celsius;
    const range = rangeOf(celsius);
    this.#heat.show(celsius, range);
    const mean = celsius.reduce((sum, value) => sum + value, 0) / celsius.length;
    say(this.#fields.min, degrees(Math.min(...celsius)));
    say(this.#fields.mean, degrees(mean));
    say(this.#fields.max, degrees(Math.max(...celsius)));
    say(this.#fields.thermistor, degrees(frame.thermistor_celsius));
    say(this.#fields.seq, `#${frame.seq.toLocaleString("en")}`);
    this.#scale(range);
    this.#cursor();
  }

  #scale(range) {
    const ticks = ticksOf(range);
    const labels = ticks.map((tick) => `${tick} °C`);
    if (this.#fields.ticks.dataset.labels === labels.join()) return;
    this.#fields.ticks.dataset.labels = labels.join();
    this.#fields.ticks.replaceChildren(
      ...labels.map((label, index) => {
        const item = document.createElement("li");
        item.textContent = label;
        item.style.top = `${((range.high - ticks[index]) / (range.high - range.low)) * 100}%`;
        return item;
      }),
    );
  }

  #cursor() {
    const cell = this.#heat?.cell ?? null;
    const celsius = this.#shown?.frame.pixels_celsius;
    this.#fields.cursor.dataset.reading = cell !== null && Boolean(celsius);
    if (cell === null || !celsius) {
      say(this.#fields.cursor, "Point at a cell, or use the arrow keys, to read it.");
      return;
    }
    const place = `row ${Math.floor(cell / 8) + 1}, column ${(cell % 8) + 1}`;
    say(this.#fields.cursor, `Pixel ${cell + 1} (${place}): ${degrees(celsius[cell])}`);
  }

  #describe() {
    const { device, sensor, rate_hz: rate } = this.#status;
    const age = this.#shown === null ? Infinity : ageOf(this.#shown);
    const staleAfter = Math.max(STALE_S_MIN, rate ? 3 / rate : 0);
    const stale = age > staleAfter;
    // A reason that is old itself says nothing of now.
    const missing = this.#missing !== null && ageOf(this.#missing) <= staleAfter ? this.#missing.frame.missing : null;
    say(this.#fields.name, `${device} · ${sensor}`);
    this.#article.querySelector(".heat").setAttribute("aria-label", `Heat map of ${device}, ${sensor}; arrow keys read its cells`);
    const atLeast = this.#shown?.frame.age_basis === "arrival" ? "at least " : "";
    say(this.#fields.age, age === Infinity ? "none yet" : `${atLeast}${duration(age)} ago`);
    say(this.#fields.rate, stale || !rate ? "–" : `${rate.toFixed(2)} Hz`);
    say(this.#fields.stored, this.#status.stored.toLocaleString("en"));
    this.#state(age, stale, missing);
    this.#troubles();
  }

  #state(age, stale, missing) {
    const state = missing ? "missing" : stale ? "stale" : "live";
    this.#article.dataset.state = state;
    const old = age === Infinity ? "no frame yet" : `last frame ${duration(age)} ago`;
    say(this.#fields.state, { live: "live", stale: "stale", missing: "no frame" }[state]);
    this.#fields.veil.hidden = state === "live";
    const veil = { live: "", stale: `Stale: ${old}`, missing: `No frame: ${missing}. ${old[0].toUpperCase()}${old.slice(1)}` };
    say(this.#fields.veil, veil[state]);
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
 * Seconds since a frame was measured. The clock that stands still while a computer sleeps, and the one that may be
 * set: whichever says that the frame is older.
 */
function ageOf({ frame, came }) {
  const passed = Math.max(performance.now() - came.now, Date.now() - came.today, 0);
  return frame.age_s + passed / 1000;
}

/** What a person should know of the stream, in sentences. */
function troublesOf(status) {
  const texts = [];
  if (status.never_came > 0) {
    const last = status.gaps.at(-1);
    const where = last ? ` Latest gap: ${last.from === last.to ? `#${last.from}` : `#${last.from} to #${last.to}`}.` : "";
    texts.push(`${count(status.never_came, "frame has", "frames have")} not come.${where}`);
  }
  if (status.missing > 0) {
    texts.push(`${count(status.missing, "frame", "frames")} could not be read and ${status.missing === 1 ? "is" : "are"} recorded as missing.`);
  }
  const errors = byKind(status.errors ?? {});
  if (errors) texts.push(`Bus errors: ${errors}.`);
  const dropped = byKind(status.dropped ?? {});
  if (dropped) texts.push(`Dropped by the agent: ${dropped}.`);
  if (status.spooled > 0) texts.push(`${count(status.spooled, "frame waits", "frames wait")} in the agent's spool.`);
  if (status.unaccounted > 0) texts.push(`${count(status.unaccounted, "frame was", "frames were")} read and cannot be accounted for.`);
  return texts;
}
