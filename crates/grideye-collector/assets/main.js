import { brought } from "./brought.js";
import { Devices } from "./devices.js";
import { follow } from "./feed.js";
import { takeFiles } from "./files.js";
import { commands } from "./keys.js";
import { Library } from "./library.js";
import { Look } from "./look.js";
import { FILE, Playback } from "./playback.js";
import { Recordings } from "./recordings.js";
import { Sensor } from "./sensor.js";
import { mayWrite, offerSignOut } from "./sign-out.js";
import { putOn } from "./wall.js";
import { say } from "./words.js";

const TICK_MS = 50;
const DIGITS = [..."123456789"];

const LINK = {
  connecting: "connecting",
  open: "connected",
  lost: "connection lost, retrying",
  full: "too many open pages, retrying",
};

const wall = document.querySelector("#sensors");
const empty = document.querySelector("#empty");
const template = document.querySelector("#sensor-card");
const link = document.querySelector("#link");
const back = document.querySelector("#back");
const sensors = new Map();
const recordings = new Recordings();
const devices = new Devices();
const library = new Library(recordings);
const look = new Look();
const { panel } = brought;
const beside = panel && new panel.Panel(document.querySelector("#beside"), {
  look,
  among: "live",
  toggled: (open) => { document.querySelector("#wall").dataset.beside = open; },
});
const playback = new Playback(recordings, look);
let view = "sensors";
let large = null;
let watched = null;

// Browsers let a page copy only where it came from this computer or by TLS.
for (const line of navigator.clipboard ? empty.querySelectorAll("pre") : []) {
  const button = Object.assign(document.createElement("button"), { type: "button", textContent: "Copy" });
  button.addEventListener("click", async () => {
    await navigator.clipboard.writeText(line.firstElementChild.textContent);
    say(button, "Copied");
  });
  line.append(button);
}

function take({ sensors: states }) {
  for (const state of states) {
    const key = `${state.device}/${state.sensor}`;
    if (!sensors.has(key)) {
      const sensor = new Sensor(template, { key, look, enlarge: (which) => show(which === large ? null : which) });
      if (panel) sensor.offerBeside(panel.title, () => beside.toggle());
      sensors.set(key, sensor);
      arrange();
    }
    sensors.get(key).take(state);
  }
  empty.hidden = sensors.size > 0;
}

/** Shows the sensors by device and name. */
function arrange() {
  const sorted = [...sensors].sort(([a], [b]) => (a < b ? -1 : 1));
  const shown = sorted.filter(([key]) => !sensors.has(large) || key === large);
  putOn(wall, shown.map(([, sensor]) => sensor.element));
  back.hidden = !sensors.has(large) || sensors.size === 1;
  for (const [key, { element }] of sensors) {
    const button = element.querySelector("[data-field=large]");
    button.hidden = sensors.size === 1;
    say(button, key === large ? "Show all" : "Enlarge");
  }
  if (panel) putBeside(shown.length === 1 ? shown[0] : null);
}

/** Offers the panel to a sensor that is shown alone. */
function putBeside(only) {
  const [key, sensor] = only ?? [null, null];
  for (const [other, { element }] of sensors) element.querySelector("[data-field=beside]").hidden = other !== key;
  if (watched === key) return;
  sensors.get(watched)?.watch(null);
  watched = key;
  const [device] = key?.split("/", 1) ?? [];
  beside.follow(key === null ? null : { key, device, sensor: key.slice(device.length + 1) });
  sensor?.watch(beside);
}

/** Shows one sensor alone, or all with `null`. The address holds the choice, so a link can share it. */
function show(key) {
  location.hash = key === null ? "" : `sensor=${encodeURIComponent(key)}`;
}

/** The view that the address names. */
function viewOf(address) {
  if (address.has("recording") || address.has("file")) return "playback";
  return ["devices", "recordings"].find((name) => address.has(name)) ?? "sensors";
}

function followAddress() {
  const address = new URLSearchParams(location.hash.slice(1));
  view = viewOf(address);
  const part = view === "playback" ? "recordings" : view;
  for (const link of document.querySelectorAll("nav a[data-view]")) link.setAttribute("aria-current", link.dataset.view === part ? "page" : "false");
  document.querySelector("main").dataset.view = view;
  document.querySelector("#wall").hidden = view !== "sensors";
  for (const control of ["#look", "#unfold"]) document.querySelector(control).hidden = !["sensors", "playback"].includes(view);
  devices.show(view === "devices");
  library.show(view === "recordings");
  playback.show(address.has("file") ? FILE : address.get("recording"), address.has("play"));
  large = address.get("sensor");
  arrange();
  sensors.get(large)?.picture.focus();
}

/** The sensors of the view, by key. */
function inSight() {
  return view === "playback" ? playback.sensors : sensors;
}

/** The sensor that keys act on: the focused one, else the only one shown. */
function meant() {
  const cards = document.querySelectorAll(view === "playback" ? "#played > *" : "#sensors > *");
  const key = document.activeElement?.closest(".sensor")?.dataset.key ?? (cards.length === 1 ? cards[0].dataset.key : null);
  return key === null ? null : inSight().get(key);
}

/** Goes to the previous or next sensor. */
function step(by) {
  const keys = [...inSight().keys()].sort();
  if (keys.length === 0) return;
  const from = keys.indexOf(meant()?.element.dataset.key ?? large);
  const key = keys[(from + by + keys.length) % keys.length];
  if (view === "sensors" && sensors.has(large)) show(key);
  else inSight().get(key).picture.focus();
}

/** Opens a view, or from there the sensors. */
function toggleView(name) {
  location.hash = view === name ? "" : name;
}

/** A key that adds a label in use. */
function putting(digit) {
  const says = digit === "1" ? "recording: add the first label in use, 2 the second, up to 9" : null;
  return { says, writes: true, does: () => playback.putLabel(Number(digit) - 1), when: () => view === "playback" && mayWrite() };
}

/** A key for playback. */
function playing(what, says) {
  return { says: `recording: ${says}`, does: () => playback.does(what), when: () => view === "playback" };
}

/** A key for labels. */
function labeling(what, says) {
  return { ...playing(what, says), writes: true, when: () => view === "playback" && mayWrite() };
}

look.listen(() => {
  for (const { picture } of sensors.values()) picture.redraw();
  playback.redraw();
});
for (const { id, title, href } of brought.links) {
  document.querySelector("nav").append(Object.assign(document.createElement("a"), { id, textContent: title, href }));
}
document.querySelector("#record").addEventListener("click", ({ target }) => {
  const open = target.ariaExpanded === "false";
  target.ariaExpanded = String(open);
  document.querySelector("#recorder").dataset.open = open;
});
back.addEventListener("click", () => show(null));
// On a telephone such a button shows and hides what follows it.
document.addEventListener("click", ({ target }) => {
  const fold = target.closest(".fold");
  if (fold) fold.ariaExpanded = String(fold.ariaExpanded === "false");
});
takeFiles((file) => {
  playback.open(file);
  location.hash = `file=${encodeURIComponent(file.name)}`;
});
addEventListener("hashchange", followAddress);
followAddress();

commands({
  p: { says: "next palette", does: () => look.next("palette") },
  i: { says: "next image: pixels, bilinear, bicubic", does: () => look.next("method") },
  h: { says: "hold or release the scale", does: () => look.toggleHold() },
  n: { says: "show or hide numbers", does: () => look.toggleNumbers() },
  t: { says: "turn the image by 90°", does: () => meant()?.picture.turn() },
  m: { says: "mirror the image", does: () => meant()?.picture.mirror() },
  c: { says: "clear the region", does: () => meant()?.picture.clearRegion() },
  l: { says: "enlarge one sensor, or show all", when: () => view === "sensors", does: () => show(sensors.has(large) ? null : (meant()?.element.dataset.key ?? null)) },
  "[": { says: "previous sensor", does: () => step(-1) },
  "]": { says: "next sensor", does: () => step(1) },
  ...panel && { [panel.key]: { says: panel.says, does: () => (view === "playback" ? playback.toggleBeside(meant()?.track.key) : beside.toggle()) } },
  d: { says: "show devices or sensors", does: () => toggleView("devices") },
  r: { says: "show recordings or sensors", does: () => toggleView("recordings") },
  ...Object.fromEntries(brought.links.map(({ key, says, href }) => [key, { says, does: () => location.assign(href) }])),
  Escape: { says: "show all sensors, or all recordings", does: () => (view === "playback" ? toggleView("recordings") : show(null)) },
  " ": playing("play", "play or pause"),
  ",": playing("back", "step back one frame"),
  ".": playing("on", "step forward one frame"),
  ArrowLeft: playing("back", "step back one frame"),
  ArrowRight: playing("on", "step forward one frame"),
  PageDown: playing("rewind", "back 10 s"),
  PageUp: playing("forward", "forward 10 s"),
  Home: playing("first", "go to the start"),
  End: playing("last", "go to the end"),
  "-": playing("slower", "slower, down to 0.25×"),
  "+": playing("faster", "faster, up to 16×"),
  g: playing("gap", "go to the next gap"),
  "<": labeling("from", "start a range at this frame"),
  ">": labeling("to", "end the range at this frame"),
  a: labeling("label", "name a label for the range or the frame"),
  ...Object.fromEntries(DIGITS.map((digit) => [digit, putting(digit)])),
});

follow({
  link(state, why) {
    link.dataset.state = state;
    say(link, why ? `${LINK[state]}: ${why}` : LINK[state]);
  },
  snapshot(event) {
    take(event);
    recordings.refresh();
  },
  frames: take,
  alive({ store }) {
    if (store === null) return;
    link.dataset.state = "failing";
    say(link, `connected, but the collector cannot store frames: ${store}`);
  },
  recordings: () => recordings.refresh(),
  labels: (changed) => playback.labeled(changed),
});

offerSignOut(document.querySelector("#sign-out"));

setInterval(() => {
  for (const sensor of sensors.values()) sensor.tick();
}, TICK_MS);
