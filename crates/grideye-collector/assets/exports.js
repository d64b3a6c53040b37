// A recording as files: CSV from every collector, other formats where the program added their writers.

import { ask } from "./ask.js";

const BROUGHT = [["npz", "NPZ"], ["parquet", "Parquet"], ["mcap", "MCAP"]];
const PICTURES = [
  ["png", "PNG", "Up to 120 frames side by side, evenly spaced"],
  ["gif", "GIF", "Up to 3,000 frames at their measured speed"],
];
// The browser has the file by then, so its memory can be freed.
const SAVED_MS = 60_000;

/**
 * Fills an element with a recording's downloads. An image shows one of `runs`, `{ device, sensor, boot }`; `complain` gets
 * its error or `null`.
 */
export async function offerFiles(element, recording, runs, complain) {
  const offered = JSON.stringify([recording.id, runs]);
  if (element.dataset.offered === offered) return;
  element.dataset.offered = offered;
  const { annexes } = await ask("/v1/annexes");
  // Another recording may be open by now.
  if (element.dataset.offered !== offered) return;
  const brings = (annexes ?? []).includes("exports");
  const links = [link(recording.csv, "CSV")];
  if (brings) links.push(...BROUGHT.map(([end, title]) => link(`/v1/exports/${recording.id}.${end}`, title)));
  const which = chooser(runs);
  if (brings && runs.length > 0) links.push(...PICTURES.map((picture) => drawn(picture, recording, () => runs[which.selectedIndex], complain)));
  const choice = brings && runs.length > 1 ? [" ", labeled("Images of ", which)] : [];
  element.replaceChildren("Download", ...links.flatMap((file) => [" ", file]), ...choice);
}

function link(path, title) {
  return Object.assign(document.createElement("a"), { href: path, textContent: title });
}

function chooser(runs) {
  const several = new Set(runs.map(({ boot }) => boot)).size > 1;
  const select = document.createElement("select");
  select.append(...runs.map(({ device, sensor, boot }) => new Option(`${device} · ${sensor}${several ? ` · ${boot}` : ""}`)));
  return select;
}

function labeled(text, control) {
  const label = document.createElement("label");
  label.append(text, control);
  return label;
}

/** Fetches an image before saving it, because some recordings cannot be drawn and the page shows the error. */
function drawn([end, title, about], recording, chosen, complain) {
  const button = link("", title);
  button.title = about;
  const address = () => `/v1/exports/${recording.id}.${end}?${new URLSearchParams(chosen() === undefined ? {} : of(chosen()))}`;
  button.href = address();
  button.addEventListener("click", async (event) => {
    event.preventDefault();
    if (button.ariaBusy === "true") return;
    button.ariaBusy = "true";
    complain(await save(address(), `${recording.name}.${end}`));
    button.ariaBusy = null;
  });
  return button;
}

function of({ device, sensor, boot }) {
  return { sensor: `${device}/${sensor}`, boot };
}

/** Saves an address as a file; answers the error, or `null`. */
async function save(address, name) {
  try {
    const response = await fetch(address);
    if (!response.ok) return (await response.json()).error;
    const file = URL.createObjectURL(await response.blob());
    Object.assign(document.createElement("a"), { href: file, download: name }).click();
    setTimeout(() => URL.revokeObjectURL(file), SAVED_MS);
    return null;
  } catch {
    return { message: "the image did not arrive", hint: "check that the collector runs, and try again" };
  }
}
