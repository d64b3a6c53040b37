// The scene file as text, with line numbers; the line with the error is marked.

export class SceneText {
  #area;
  #lines;
  #fault = null;

  /** Calls `written` with the whole text at every keystroke. */
  constructor(area, lines, written) {
    this.#area = area;
    this.#lines = lines;
    area.addEventListener("input", () => {
      this.#number();
      written(area.value);
    });
    area.addEventListener("scroll", () => { lines.scrollTop = area.scrollTop; });
  }

  /** Shows a text changed elsewhere and keeps the cursor. */
  show(text) {
    if (this.#area.value === text) return;
    const { selectionStart, selectionEnd, scrollTop } = this.#area;
    this.#area.value = text;
    this.#area.setSelectionRange(selectionStart, selectionEnd);
    this.#area.scrollTop = scrollTop;
    this.#number();
  }

  /** Marks the line with the error; null marks none. */
  mark(line) {
    if (this.#fault === line) return;
    this.#fault = line;
    this.#area.setAttribute("aria-invalid", String(line !== null));
    this.#number();
  }

  /** Moves the cursor to a place; lines and columns count from 1. */
  goTo({ line, column }) {
    const lines = this.#area.value.split("\n");
    const before = lines.slice(0, line - 1).reduce((sum, one) => sum + one.length + 1, 0);
    // Columns count characters, and the area counts units of UTF-16.
    const along = [...(lines[line - 1] ?? "")].slice(0, column - 1).join("").length;
    this.#area.focus();
    this.#area.setSelectionRange(before + along, before + (lines[line - 1]?.length ?? 0));
    const height = this.#area.scrollHeight / Math.max(1, lines.length);
    this.#area.scrollTop = Math.max(0, (line - 4) * height);
  }

  #number() {
    const count = this.#area.value.split("\n").length;
    const numbers = Array.from({ length: count }, (_, index) => (index + 1 === this.#fault ? `▶ ${index + 1}` : `${index + 1}`));
    this.#lines.textContent = numbers.join("\n");
    this.#lines.scrollTop = this.#area.scrollTop;
  }
}
