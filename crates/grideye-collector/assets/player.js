// The playback position and speed.

export const SPEEDS = [0.25, 0.5, 1, 2, 4, 8, 16];

export class Player {
  #at = 0;
  #length = 0;
  #speed = 1;
  #before = null;
  #moved;

  /** `moved` is called after each change of position, speed or state. */
  constructor(moved) {
    this.#moved = moved;
  }

  get at() {
    return this.#at;
  }

  get speed() {
    return this.#speed;
  }

  get playing() {
    return this.#before !== null;
  }

  /** Takes another recording of that many seconds, paused at its start. */
  load(length) {
    this.#before = null;
    this.#length = length;
    this.seek(0);
  }

  seek(seconds) {
    this.#at = Math.min(this.#length, Math.max(0, seconds));
    this.#moved();
  }

  pause() {
    this.#before = null;
    this.#moved();
  }

  toggle() {
    if (this.playing) {
      this.pause();
      return;
    }
    if (this.#at >= this.#length) this.#at = 0;
    this.#before = performance.now();
    this.#moved();
    requestAnimationFrame((now) => this.#go(now));
  }

  set speed(speed) {
    this.#speed = speed;
    this.#moved();
  }

  /** The next speed up or down, within `SPEEDS`. */
  hurry(by) {
    const index = SPEEDS.indexOf(this.#speed) + by;
    if (index >= 0 && index < SPEEDS.length) this.speed = SPEEDS[index];
  }

  #go(now) {
    if (!this.playing) return;
    const passed = Math.max(0, now - this.#before) / 1000;
    this.#before = now;
    this.#at = Math.min(this.#length, this.#at + passed * this.#speed);
    if (this.#at >= this.#length) this.#before = null;
    this.#moved();
    if (this.playing) requestAnimationFrame((next) => this.#go(next));
  }
}
