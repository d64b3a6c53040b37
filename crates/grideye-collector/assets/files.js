// Files that are dropped on the page, or chosen where it offers that.

import { ask } from "./ask.js";

/** Calls `take` with each. Only a collector whose program reads recordings of any format offers it. */
export async function takeFiles(take) {
  const answer = await ask("/v1/annexes");
  if (!answer.annexes?.includes("files")) return;
  document.querySelector("#open-file").hidden = false;
  document.querySelector("#open-file input").addEventListener("change", ({ target }) => {
    if (target.files.length > 0) take(target.files[0]);
    target.value = "";
  });
  addEventListener("dragover", (event) => {
    if (!event.dataTransfer.types.includes("Files")) return;
    event.preventDefault();
    document.body.dataset.dropping = true;
  });
  addEventListener("dragleave", (event) => {
    if (event.relatedTarget === null) delete document.body.dataset.dropping;
  });
  addEventListener("drop", (event) => {
    delete document.body.dataset.dropping;
    const [file] = event.dataTransfer.files;
    if (!file) return;
    event.preventDefault();
    take(file);
  });
}
