// Keys that work wherever the focus is, and their list.

const NAMES = new Map([
  ["Escape", "Esc"], [" ", "Space"], ["ArrowLeft", "←"], ["ArrowRight", "→"], ["PageUp", "Page up"], ["PageDown", "Page down"],
]);

const ON_PICTURES = [
  ["Arrow keys", "read the pixels of the focused image"],
  ["Shift and arrow keys", "mark a region of the focused image"],
];

/**
 * `keys` has for each key what it `says` in the list, what it `does`, `when` it works if not always, and whether it `writes`.
 * A key that says nothing is part of a line in `others`. `?` shows the list.
 */
export function commands(keys, others = ON_PICTURES) {
  const dialog = document.querySelector("#keys");
  const list = dialog.querySelector("dl");
  const said = Object.entries(keys).filter(([, { says }]) => says).map(([key, { says, writes }]) => [NAMES.get(key) ?? key, says, writes]);
  // Letters first, then digits and signs, then named keys; a to z within each.
  const kind = (key) => (key.length > 1 ? 2 : /[a-z]/i.test(key) ? 0 : 1);
  const all = [...said, ...others, ["?", "show this list"]].sort(([one], [other]) => kind(one) - kind(other) || one.localeCompare(other, "en"));
  list.replaceChildren(...all.map((line) => row(...line)));
  const open = () => dialog.showModal();
  document.querySelector("#show-keys").addEventListener("click", open);
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || document.querySelector("dialog[open]")) return;
    if (event.target.closest("input, select, textarea")) return;
    // Space presses the focused button or link, as everywhere.
    if (event.key === " " && event.target.closest("button, a")) return;
    const { does, when } = event.key === "?" ? { does: open } : (keys[event.key] ?? {});
    if (!does || when?.() === false) return;
    event.preventDefault();
    does(event);
  });
}

function row(key, says, writes = false) {
  const line = document.createElement("div");
  line.toggleAttribute("data-writes", writes);
  const [term, meaning] = ["dt", "dd"].map((name) => document.createElement(name));
  term.append(Object.assign(document.createElement("kbd"), { textContent: key }));
  meaning.textContent = says;
  line.append(term, meaning);
  return line;
}
