// The image of one sensor and its readings: minimum, mean and maximum, the pixel under the cursor, and a region. Live view
// and playback share it.

import { HeatMap } from "./heatmap.js";
import { keep, kept } from "./keep.js";
import { UPRIGHT, inWords, mirrored, turned } from "./orientation.js";
import { labelTicks, paintBar } from "./scale.js";
import { HOW_TO_READ, degrees, fieldsOf, say } from "./words.js";

// The four pixels around the middle of the field of view: 28, 29, 36 and 37.
const CENTER = [27, 28, 35, 36];

export class Picture {
  #key;
  #among;
  #look;
  #fields;
  #article;
  #heat;
  #orientation;
  #region = null;
  #frame = null;
  #oriented;

  /**
   * `key` identifies the sensor, `look` is how images are drawn, `among` names the group that shares a scale, and `oriented` gets
   * the orientation.
   */
  constructor(article, { key, look, among, oriented = () => {} }) {
    this.#oriented = oriented;
    this.#key = key;
    this.#among = among;
    this.#look = look;
    this.#article = article;
    this.#article.dataset.key = key;
    this.#fields = fieldsOf(article);
    this.#heat = new HeatMap(article.querySelector(".heat"), {
      cell: () => this.#cursor(),
      region: (pixels) => this.#choose(pixels),
    });
    const view = kept(`view.${key}`, { orientation: UPRIGHT, region: null });
    this.#orientation = view.orientation;
    if (view.region !== null) this.#heat.region = view.region;
    this.#fields.turn.addEventListener("click", () => this.turn());
    this.#fields.mirror.addEventListener("click", () => this.mirror());
    this.redraw();
    this.#orient();
    this.#cursor();
  }

  /** The image's name for screen readers. */
  set label(label) {
    this.#article.querySelector(".heat").setAttribute("aria-label", `Heat map of ${label}; arrow keys read its pixels`);
  }

  get orientation() {
    return this.#orientation;
  }

  /** The pixels of people, to be outlined. */
  set people(pixels) {
    this.#heat.people = pixels;
  }

  turn() {
    this.#orientation = turned(this.#orientation);
    this.#orient();
  }

  mirror() {
    this.#orientation = mirrored(this.#orientation);
    this.#orient();
  }

  clearRegion() {
    this.#heat.region = null;
  }

  /** Takes the focus, so that keys act on this image. */
  focus() {
    this.#article.querySelector(".heat").focus();
  }

  /** Draws again after a change of display. */
  redraw() {
    this.#heat.look(this.#look.drawing);
    paintBar(this.#article.querySelector(".bar"), this.#look.drawing.colors);
    this.#fields.invented.hidden = !this.#look.interpolated;
    if (this.#frame !== null) this.show(this.#frame);
  }

  /** Shows a frame (`pixels_celsius`, `thermistor_celsius`, `seq`); answers its summary. */
  show(frame) {
    this.#frame = frame;
    const celsius = frame.pixels_celsius;
    const range = this.#look.rangeFor(this.#key, celsius, this.#among);
    this.#heat.show(celsius, range);
    const [all, center] = [summaryOf(celsius), summaryOf(CENTER.map((pixel) => celsius[pixel]))];
    say(this.#fields.min, degrees(all.min));
    say(this.#fields.mean, degrees(all.mean));
    say(this.#fields.max, degrees(all.max));
    say(this.#fields.center, degrees(center.mean));
    say(this.#fields.thermistor, frame.thermistor_celsius === null ? "–" : degrees(frame.thermistor_celsius));
    say(this.#fields.seq, `#${frame.seq.toLocaleString("en")}`);
    labelTicks(this.#fields.ticks, range);
    this.#cursor();
    return { ...all, region: this.#readRegion() };
  }

  /** Removes every color and number of an earlier frame. */
  clear() {
    if (this.#frame === null) return;
    this.#frame = null;
    this.#heat.clear();
    for (const name of ["min", "mean", "max", "center", "thermistor", "seq"]) say(this.#fields[name], "–");
    this.#cursor();
    this.#readRegion();
  }

  #cursor() {
    const cell = this.#heat?.cell ?? null;
    const celsius = this.#frame?.pixels_celsius;
    this.#fields.cursor.dataset.reading = cell !== null && Boolean(celsius);
    if (cell === null || !celsius) {
      say(this.#fields.cursor, `${HOW_TO_READ} Drag to mark a region.`);
      return;
    }
    const place = `row ${Math.floor(cell / 8) + 1}, column ${(cell % 8) + 1}`;
    say(this.#fields.cursor, `Pixel ${cell + 1} (${place}): ${degrees(celsius[cell])}`);
  }

  #choose(pixels) {
    this.#region = pixels;
    this.#keepView();
    this.#readRegion();
  }

  /** Shows the region's readings; answers its mean. */
  #readRegion() {
    const celsius = this.#frame?.pixels_celsius;
    this.#fields.region.hidden = this.#region === null || !celsius;
    if (this.#fields.region.hidden) return null;
    const { min, mean, max } = summaryOf(this.#region.map((pixel) => celsius[pixel]));
    const [first, last] = [this.#region[0] + 1, this.#region.at(-1) + 1];
    const what = `Region of ${this.#region.length} pixels (${first} to ${last})`;
    say(this.#fields.region, `${what}: minimum ${degrees(min)}, mean ${degrees(mean)}, maximum ${degrees(max)}`);
    return mean;
  }

  #orient() {
    this.#heat.orient(this.#orientation);
    this.#oriented(this.#orientation);
    const words = inWords(this.#orientation);
    this.#fields.orientation.hidden = words === "";
    say(this.#fields.orientation, words === "" ? "" : `Drawn ${words}.`);
    this.#fields.mirror.setAttribute("aria-pressed", String(this.#orientation.mirrored));
    this.#keepView();
  }

  #keepView() {
    if (this.#orientation === undefined) return;
    keep(`view.${this.#key}`, { orientation: this.#orientation, region: this.#heat?.region ?? null });
  }
}

function summaryOf(celsius) {
  const mean = celsius.reduce((sum, value) => sum + value, 0) / celsius.length;
  return { min: Math.min(...celsius), mean, max: Math.max(...celsius) };
}
