// A recording as files: CSV from every collector, the others where the program brought their writers along.

import { ask } from "./ask.js";

const BROUGHT = [["npz", "NPZ"], ["parquet", "Parquet"], ["mcap", "MCAP"]];

/** Fills an element with the links by which a recording is downloaded. */
export async function offerFiles(element, recording) {
  if (element.dataset.recording === String(recording.id)) return;
  element.dataset.recording = recording.id;
  const { annexes } = await ask("/v1/annexes");
  const brought = (annexes ?? []).includes("exports") ? BROUGHT : [];
  const links = [link(recording.csv, "CSV"), ...brought.map(([end, title]) => link(`/v1/exports/${recording.id}.${end}`, title))];
  // Another recording may have been opened meanwhile.
  if (element.dataset.recording === String(recording.id)) element.replaceChildren("Download", ...links.flatMap((file) => [" ", file]));
}

function link(path, title) {
  return Object.assign(document.createElement("a"), { href: path, textContent: title });
}
