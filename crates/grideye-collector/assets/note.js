// A recording's note in a field: kept when the field is left or Enter is pressed, as it was after Escape.

import { complain } from "./ask.js";

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
    input.addEventListener("keydown", (event) => {
      if (event.key === "Escape") input.value = this.#recording.note;
      if (event.key === "Escape" || event.key === "Enter") input.blur();
    });
  }

  /** Shows the recording's note, unless somebody is writing another one. */
  take(recording) {
    this.#recording = recording;
    this.#input.setAttribute("aria-label", `Note on ${recording.name}`);
    const writing = document.activeElement === this.#input || this.#input.getAttribute("aria-invalid") === "true";
    if (!writing) this.#input.value = recording.note;
  }
}
