// One sensor of a recording: its image at the playback position, or why there is none.

import { Picture } from "./picture.js";
import { fieldsOf, say, timeOfDay } from "./words.js";

export class PlayedSensor {
  #article;
  #fields;
  #picture;
  #track;
  #began_ms;
  #index = null;
  #said = "";
  #moment = null;
  #watcher = null;

  /** `beside` opens the panel beside this sensor. */
  constructor(template, track, { look, began_ms, beside }) {
    this.#track = track;
    this.#began_ms = began_ms;
    this.#article = template.content.firstElementChild.cloneNode(true);
    for (const element of this.#article.querySelectorAll("[data-live]")) element.remove();
    this.#fields = fieldsOf(this.#article);
    this.#picture = new Picture(this.#article, { key: track.key, look, among: "played", oriented: (orientation) => this.#watcher?.orient(orientation) });
    this.#picture.label = `${track.device}, ${track.sensor}, as recorded`;
    say(this.#fields.name, `${track.device} · ${track.sensor}`);
    this.#fields.beside.addEventListener("click", beside);
  }

  /** Shows the panel's button. */
  offerBeside(title) {
    say(this.#fields.beside, title);
    this.#fields.beside.hidden = false;
  }

  /** Sends each frame, the image's orientation and gaps to `watcher` from now on, or to nobody. */
  watch(watcher) {
    this.#watcher = watcher;
    watcher?.orient(this.#picture.orientation);
    this.#tell();
  }

  get element() {
    return this.#article;
  }

  get picture() {
    return this.#picture;
  }

  get track() {
    return this.#track;
  }

  /** Shows the moment at that many seconds; answers it in words. */
  show(seconds) {
    const index = this.#track.indexAt(seconds);
    if (index !== this.#index) {
      this.#index = index;
      this.#moment = this.#track.at(index);
      this.#said = this.#draw(this.#moment);
      this.#tell();
    }
    return this.#said;
  }

  #tell() {
    if (this.#watcher === null || this.#moment === null) return;
    const { frame, boot, why } = this.#moment;
    this.#watcher.state(frame ? "live" : "missing", why ?? "");
    if (frame) this.#watcher.frame(frame, { boot, began_boot_ns: this.#track.began_ns(boot) });
  }

  #draw({ frame, clock, boot, seconds, why }) {
    this.#article.dataset.state = frame ? "recorded" : "missing";
    say(this.#fields.state, frame ? "recorded" : "no frame");
    this.#fields.veil.hidden = Boolean(frame);
    say(this.#fields.veil, why ?? "");
    say(this.#fields.clock, clock ?? "–");
    say(this.#fields.boot, boot ?? "–");
    say(this.#fields.measured, frame && this.#began_ms > 0 ? timeOfDay(this.#began_ms + seconds * 1000) : "–");
    if (!frame) {
      this.#picture.clear();
      return why;
    }
    this.#picture.show(frame);
    return `Frame #${frame.seq.toLocaleString("en")}`;
  }
}
