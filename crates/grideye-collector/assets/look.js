// How all images are drawn: palette, method, scale and numbers.

import { keep, kept } from "./keep.js";
import { PALETTES } from "./palettes.js";
import { Steady, around } from "./scale.js";
import { METHODS } from "./smooth.js";
import { say } from "./words.js";

const SCALES = new Map([
  ["auto", "Automatic, per sensor"],
  ["shared", "Automatic, shared"],
  ["hold", "Hold current"],
  ["fixed", "Fixed"],
]);
const FIRST = { palette: "inferno", method: "cells", scale: "auto", low: 18, high: 34, numbers: false };
// Range of a 12-bit word in steps of 0.25 °C.
const [LOWEST, HIGHEST] = [-512, 511.75];

export class Look {
  #form = document.querySelector("#look");
  #chosen = valid(kept("look", FIRST));
  #held = new Map();
  #newest = new Map();
  #steady = new Map();
  #listeners = [];

  constructor() {
    offer(this.#control("palette"), [...PALETTES].map(([key, { title }]) => [key, title]));
    offer(this.#control("method"), [...METHODS].map(([key, { title }]) => [key, title]));
    offer(this.#control("scale"), [...SCALES]);
    for (const name of ["palette", "method", "scale"]) {
      this.#control(name).addEventListener("change", (event) => this.choose({ [name]: event.target.value }));
    }
    for (const name of ["low", "high"]) this.#control(name).addEventListener("change", () => this.#limits());
    this.#control("numbers").addEventListener("click", () => this.choose({ numbers: !this.#chosen.numbers }));
    this.#form.addEventListener("submit", (event) => event.preventDefault());
    this.#describe();
  }

  /** Calls back at every change. */
  listen(listener) {
    this.#listeners.push(listener);
  }

  /** What an image needs. */
  get drawing() {
    const { palette, method, numbers } = this.#chosen;
    return { colors: PALETTES.get(palette).colors, method, numbers };
  }

  get interpolated() {
    return this.#chosen.method !== "cells";
  }

  choose(change) {
    const before = this.#chosen.scale;
    this.#chosen = { ...this.#chosen, ...change };
    if (this.#chosen.scale === "hold" && before !== "hold") this.#hold(before);
    keep("look", this.#chosen);
    this.#describe();
    for (const listener of this.#listeners) listener();
  }

  /** The next palette or method, in a circle. */
  next(name) {
    const keys = [...(name === "palette" ? PALETTES : METHODS).keys()];
    this.choose({ [name]: keys[(keys.indexOf(this.#chosen[name]) + 1) % keys.length] });
  }

  toggleHold() {
    this.choose({ scale: this.#chosen.scale === "hold" ? "auto" : "hold" });
  }

  toggleNumbers() {
    this.choose({ numbers: !this.#chosen.numbers });
  }

  /** The scale for a sensor's frame; `among` names the group that shares a scale. */
  rangeFor(sensor, celsius, among) {
    const key = `${among} ${sensor}`;
    if (!this.#steady.has(key)) this.#steady.set(key, new Steady());
    const own = this.#steady.get(key).fit(celsius);
    this.#newest.set(key, { own, among });
    const { scale, low, high } = this.#chosen;
    if (scale === "fixed") return { low, high };
    if (scale === "shared") return this.#shared(among);
    // A sensor that appears while scales are held is held at its first frame.
    if (scale === "hold" && !this.#held.has(key)) this.#held.set(key, own);
    return scale === "hold" ? this.#held.get(key) : own;
  }

  /** Forgets sensors that left the page. */
  forget(among) {
    for (const [key, newest] of this.#newest) {
      if (newest.among !== among) continue;
      this.#newest.delete(key);
      this.#steady.delete(key);
    }
  }

  #shared(among) {
    const ranges = [...this.#newest.values()].filter((newest) => newest.among === among);
    return around(ranges.map(({ own }) => own));
  }

  #hold(before) {
    const all = [...this.#newest];
    this.#held = new Map(all.map(([key, { own, among }]) => [key, this.#shown(before, among, own)]));
  }

  #shown(before, among, own) {
    if (before === "fixed") return { low: this.#chosen.low, high: this.#chosen.high };
    return before === "shared" ? this.#shared(among) : own;
  }

  #limits() {
    const [low, high] = ["low", "high"].map((name) => this.#control(name).valueAsNumber);
    const fault = faultOf(low, high);
    for (const name of ["low", "high"]) this.#control(name).setAttribute("aria-invalid", String(fault !== ""));
    this.#complain(fault);
    if (fault === "") this.choose({ low, high });
  }

  #complain(fault) {
    const trouble = this.#form.querySelector("#look-trouble");
    trouble.hidden = fault === "";
    say(trouble, fault);
  }

  #describe() {
    const chosen = this.#chosen;
    for (const name of ["palette", "method", "scale", "low", "high"]) this.#control(name).value = chosen[name];
    this.#control("numbers").setAttribute("aria-pressed", String(chosen.numbers));
    this.#form.querySelector("#limits").hidden = chosen.scale !== "fixed";
    if (chosen.scale !== "fixed") this.#complain("");
  }

  #control(name) {
    return this.#form.elements[name];
  }
}

function offer(select, options) {
  select.replaceChildren(...options.map(([value, text]) => new Option(text, value)));
}

function faultOf(low, high) {
  if (!Number.isFinite(low) || !Number.isFinite(high)) return "Both limits must be numbers, in °C.";
  if (low < LOWEST || high > HIGHEST) return `The sensor's range is ${LOWEST} to ${HIGHEST} °C.`;
  return low < high ? "" : "The lower limit must be below the upper limit.";
}

/** What an older page stored may no longer exist. */
function valid(chosen) {
  const known = PALETTES.has(chosen.palette) && METHODS.has(chosen.method) && SCALES.has(chosen.scale);
  const usable = known && faultOf(chosen.low, chosen.high) === "";
  // Held scales are not stored, because their frames are gone.
  return usable ? { ...chosen, scale: chosen.scale === "hold" ? "auto" : chosen.scale } : FIRST;
}
