// A recording as files: CSV from every collector, the others where the program brought their writers along.

import { ask } from "./ask.js";

const BROUGHT = [["npz", "NPZ"], ["parquet", "Parquet"], ["mcap", "MCAP"]];
const PICTURES = [
  ["png", "PNG", "Frames side by side: up to 120 of them, evenly over the recording"],
  ["gif", "GIF", "Frames as fast as they were measured: up to 3,000 of them"],
];
// A browser has the file by then, and its memory is given back.
const SAVED_MS = 60_000;

/**
 * Fills an element with the links by which a recording is downloaded; `runs` are `{ device, sensor, boot }`, of which a
 * picture shows one, and `complain` is told what went wrong with one, or `null`.
 */
export async function offerFiles(element, recording, runs, complain) {
  const offered = JSON.stringify([recording.id, runs]);
  if (element.dataset.offered === offered) return;
  element.dataset.offered = offered;
  const { annexes } = await ask("/v1/annexes");
  // Another recording may have been opened meanwhile.
  if (element.dataset.offered !== offered) return;
  const brings = (annexes ?? []).includes("exports");
  const links = [link(recording.csv, "CSV")];
  if (brings) links.push(...BROUGHT.map(([end, title]) => link(`/v1/exports/${recording.id}.${end}`, title)));
  const which = chooser(runs);
  if (brings && runs.length > 0) links.push(...PICTURES.map((picture) => drawn(picture, recording, () => runs[which.selectedIndex], complain)));
  const choice = brings && runs.length > 1 ? [" ", labeled("Pictures of ", which)] : [];
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

/** A picture is asked for before it is saved: some recordings cannot be drawn, and why is said on this page. */
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

/** Saves what stands at an address as a file; what went wrong, if anything did. */
async function save(address, name) {
  try {
    const response = await fetch(address);
    if (!response.ok) return (await response.json()).error;
    const file = URL.createObjectURL(await response.blob());
    Object.assign(document.createElement("a"), { href: file, download: name }).click();
    setTimeout(() => URL.revokeObjectURL(file), SAVED_MS);
    return null;
  } catch {
    return { message: "the picture did not come", hint: "see that the collector runs, and try again" };
  }
}
