// A recording's note in a field. Leaving the field or Enter saves it; Escape restores it.

import { complain } from "./ask.js";
import { mayWrite } from "./sign-out.js";

export class NoteField {
  #input;
  #recording = null;

  constructor(input, recordings, trouble) {
    this.#input = input;
    input.addEventListener("change", async () => {
      const error = await recordings.note(this.#recording.id, input.value);
      input.setAttribute("aria-invalid", String(Boolean(error)));
      complain(trouble, error);
    });
    // The scope may arrive after the first recordings.
    input.addEventListener("focus", () => this.#lock());
    input.addEventListener("keydown", (event) => {
      if (event.key === "Escape") input.value = this.#recording.note;
      if (event.key === "Escape" || event.key === "Enter") input.blur();
    });
  }

  /** Shows the recording's note, unless the person is writing one. */
  take(recording) {
    this.#recording = recording;
    this.#input.setAttribute("aria-label", `Note on ${recording.name}`);
    this.#lock();
    const writing = document.activeElement === this.#input || this.#input.getAttribute("aria-invalid") === "true";
    if (!writing) this.#input.value = recording.note;
  }

  #lock() {
    if (mayWrite()) return;
    this.#input.readOnly = true;
    this.#input.placeholder = "";
  }
}
