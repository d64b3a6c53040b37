// Keys that do something wherever the focus is, and the list of them.

const NAMES = new Map([
  ["Escape", "Esc"], [" ", "Space"], ["ArrowLeft", "←"], ["ArrowRight", "→"], ["PageUp", "Page up"], ["PageDown", "Page down"],
]);

const ON_PICTURES = [
  ["Arrow keys", "on a picture: read its cells"],
  ["Shift and arrow keys", "on a picture: mark a region"],
];

/**
 * `keys` names for each key what it says in the list, what it does, and `when` it does so if not always; one that says
 * nothing is among the `others` of the list. `?` shows the list.
 */
export function commands(keys, others = ON_PICTURES) {
  const dialog = document.querySelector("#keys");
  const list = dialog.querySelector("dl");
  const said = Object.entries(keys).filter(([, { says }]) => says);
  const all = [...said.map(([key, { says }]) => [NAMES.get(key) ?? key, says]), ...others, ["?", "this list"]];
  list.replaceChildren(...all.map(([key, says]) => row(key, says)));
  const open = () => dialog.showModal();
  document.querySelector("#show-keys").addEventListener("click", open);
  addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey || document.querySelector("dialog[open]")) return;
    if (event.target.closest("input, select, textarea")) return;
    // Space presses the button or follows the link in focus, as everywhere.
    if (event.key === " " && event.target.closest("button, a")) return;
    const { does, when } = event.key === "?" ? { does: open } : (keys[event.key] ?? {});
    if (!does || when?.() === false) return;
    event.preventDefault();
    does(event);
  });
}

function row(key, says) {
  const line = document.createElement("div");
  const [term, meaning] = ["dt", "dd"].map((name) => document.createElement(name));
  term.append(Object.assign(document.createElement("kbd"), { textContent: key }));
  meaning.textContent = says;
  line.append(term, meaning);
  return line;
}
