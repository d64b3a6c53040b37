// The coverage map of the draft: requested while it is shown, and again when the scene changes.

import { KINDS, hatch, tile } from "./hatch.js";
import { say } from "./words.js";

export class Cover {
  #draft;
  #plan;
  #on = false;
  #of = null;
  #asking = null;
  #button = document.querySelector("#cover");
  #legend = document.querySelector("#cover-legend");
  #words = document.querySelector("#cover-words");

  constructor(draft, plan) {
    this.#draft = draft;
    this.#plan = plan;
  }

  toggle() {
    this.#on = !this.#on;
    const keys = [...KINDS].map(([letter, { words }]) => {
      const item = document.createElement("li");
      item.append(tile(letter, this.#plan.look, 2), words);
      return item;
    });
    this.#legend.replaceChildren(...keys);
    this.#button.setAttribute("aria-pressed", String(this.#on));
    this.#legend.hidden = !this.#on;
    this.#words.hidden = !this.#on;
    this.#of = null;
    if (!this.#on) {
      this.#asking?.abort();
      this.#plan.cover(null);
    }
    this.follow();
  }

  /** Requests the map of the newest text, if the map is on and shows an older text. */
  async follow() {
    if (!this.#on || this.#draft.broken) return;
    const { body } = this.#draft;
    const of = body.text + JSON.stringify(body.files);
    if (this.#of === of) return;
    this.#of = of;
    // The collector stops computing a map when its request is dropped.
    this.#asking?.abort();
    this.#asking = new AbortController();
    const { signal } = this.#asking;
    this.#legend.dataset.old = "true";
    say(this.#words, "Computing the map…");
    const answer = await asked(body, signal);
    if (signal.aborted) return;
    this.#take(answer);
  }

  #take({ map, fault, error }) {
    this.#legend.dataset.old = "false";
    this.#plan.cover(map ? (context, eye, look) => hatch(context, map, eye, look) : null);
    const wrong = fault ?? error;
    if (wrong) {
      say(this.#words, `No map: ${wrong.message}${wrong.hint ? `. Hint: ${wrong.hint}` : ""}`);
      return;
    }
    const { detected, places, figure, sigma_min: sigma, cell_m: cell } = map;
    const share = places === 0 ? 0 : Math.round((100 * detected) / places);
    say(this.#words, `${figure.replace(/^./, (letter) => letter.toUpperCase())} is detected at ${detected} of ${places} places, ${share} %, at ${sigma} sigma or more. Places are ${cell[0].toFixed(2)} by ${cell[1].toFixed(2)} m. Blank places have no space for a person.`);
  }
}

async function asked(body, signal) {
  const headers = { "content-type": "application/json" };
  try {
    const response = await fetch("/v1/editor/coverage", { method: "POST", headers, body: JSON.stringify(body), signal });
    return await response.json();
  } catch {
    return { error: { message: "the collector cannot be reached", hint: "check that it runs" } };
  }
}
