// The scene editor: selection, keys and buttons, opening and saving.

import { ask } from "./ask.js";
import { Cover } from "./cover.js";
import { Draft } from "./draft.js";
import { Fields } from "./fields.js";
import { commands } from "./keys.js";
import { Look } from "./look.js";
import { copyOf, newRoom, newThing, newWay } from "./new-things.js";
import { RoomView } from "./room-view.js";
import { SceneText } from "./scene-text.js";
import { Seen } from "./seen.js";
import { offerSignOut } from "./sign-out.js";
import { ThingList } from "./thing-list.js";
import { choices, isSame, itemOf, moved, placeOf, turnKey, turnOf, turned } from "./things.js";
import { say } from "./words.js";

const [STEP_MM, STEP_COARSE_MM] = [50, 500];
const [TURN, TURN_COARSE] = [5, 45];
const PLAY_MS = 100;

const at = (selector) => document.querySelector(selector);
const look = new Look();
let chosen = null;
let leaveFor = null;
let playing = null;

const draft = new Draft({ drawn: draw, text: (text) => textPane.show(text) });
const hand = { choose, move: moveTo, turn: (degrees, handAt) => turnTo(degrees, handAt), drop: () => draft.finish() };
const plan = new RoomView(at("#plan"), { on: hand, isPlan: true });
const view = new RoomView(at("#view"), { on: hand });
const list = new ThingList(at("#things"), { choose });
const fields = new Fields(at("#fields"), at("#fields-title"), { change: (edits, handAt) => draft.change(edits, handAt), finish: () => draft.finish(true), pick });
const seen = new Seen(at("#frames"), look, { choose: (name) => choose({ kind: "sensor", index: draft.scene.items.find((item) => item.kind === "sensor" && item.name === name).index }) });
const textPane = new SceneText(at("#text"), at("#lines"), (text) => draft.write(text));
const cover = new Cover(draft, plan);
look.listen(() => view.color(seen.colors));

/** Shows the newest state of the draft everywhere. */
function draw() {
  const { scene, fault, broken } = draft;
  if (scene !== null && chosen !== null && !choices(scene).some((choice) => isSame(choice, chosen))) chosen = null;
  plan.show(scene, chosen);
  view.show(scene, chosen);
  list.show(scene, chosen);
  fields.show(scene, chosen);
  const item = itemOf(scene, chosen);
  seen.show(draft.frames, item?.kind === "sensor" ? item.name : null, broken);
  view.color(seen.colors);
  fields.complain(fault !== null);
  tell();
  time();
  cover.follow();
}

/** Shows errors, warnings and whether all is saved. */
function tell() {
  const { fault, broken, warnings, changed, name } = draft;
  const place = fault?.place ?? null;
  at("#fault").hidden = fault === null;
  if (fault !== null) {
    const words = `${broken ? "The scene has an error" : "Not changed"}: ${fault.message}${fault.hint ? `. Hint: ${fault.hint}` : ""}`;
    say(at("#fault-words"), words);
  }
  at("#fault-place").hidden = place === null;
  if (place !== null) say(at("#fault-place"), placeWords(place));
  textPane.mark(broken && place?.file === "scene" ? place.line : null);
  at("#stage").dataset.broken = broken;
  at("#warnings").replaceChildren(...warnings.map(warningOf));
  const state = name === null ? "not saved yet" : changed ? "not saved" : "saved";
  at("#saved").dataset.state = state;
  say(at("#saved"), state);
  at("#save").disabled = name === null || !changed;
  at("#undo").disabled = !draft.canUndo;
  at("#redo").disabled = !draft.canRedo;
  const { shared } = draft;
  at("#shared").hidden = shared.length === 0;
  say(at("#shared"), `This scene shares trajectories with ${shared.join(", ")}. A waypoint that you move here also moves there.`);
}

function placeWords({ file, line, column }) {
  return file === "scene" ? `line ${line}, column ${column}` : `${file}, line ${line}, column ${column}`;
}

function warningOf({ message, hint, place }) {
  const item = document.createElement("li");
  const button = Object.assign(document.createElement("button"), { type: "button", className: "link", textContent: `Line ${place.line}` });
  button.addEventListener("click", () => goTo(place));
  item.append(button, ` ${message}${hint ? `. Hint: ${hint}` : ""}`);
  return item;
}

function goTo(place) {
  if (place.file !== "scene") return;
  at("#text-panel").open = true;
  textPane.goTo(place);
}

function time() {
  const { seconds } = draft;
  at("#time").hidden = seconds === 0;
  at("#second").max = seconds;
  say(at("#second-now"), `${Number(at("#second").value).toFixed(1)} of ${seconds.toFixed(1)} s`);
}

function choose(which) {
  chosen = which;
  draw();
}

function moveTo({ item, row, from }, to, handAt) {
  draft.change(moved(item, row, from, to), handAt);
}

let nudged = null;

/** Moves the selection by a step. Keys that come faster than answers add up. */
function nudge(axis, by, event) {
  const item = itemOf(draft.scene, chosen);
  if (item === null || placeOf(item, chosen.row) === null) return;
  const key = JSON.stringify(chosen);
  if (nudged?.key !== key) nudged = { key, item, from: placeOf(item, chosen.row), to: [...placeOf(item, chosen.row)], times: 0 };
  nudged.times += 1;
  nudged.to[axis] += by * (event.shiftKey ? STEP_COARSE_MM : STEP_MM);
  draft.change(moved(nudged.item, chosen.row, nudged.from, nudged.to), event.timeStamp);
}

function turnTo(degrees, handAt) {
  const item = itemOf(draft.scene, chosen);
  if (item === null || turnKey(item) === null) return;
  draft.change(turned(item, degrees), handAt);
}

function turnBy(degrees, event) {
  const item = itemOf(draft.scene, chosen);
  if (item === null || turnKey(item) === null) return;
  const [edit] = turned(item, 0);
  turnTo((draft.pending(edit) ?? turnOf(item)) + degrees, event.timeStamp);
}

function tiltBy(degrees, event) {
  const item = itemOf(draft.scene, chosen);
  if (item?.kind !== "sensor") return;
  const edit = { does: "set", path: ["sensor", item.index, "elevation_deg"] };
  const to = (draft.pending(edit) ?? item.keys.elevation_deg) + degrees;
  draft.change([{ ...edit, to: Math.min(90, Math.max(-90, to)) }], event.timeStamp);
}

/** Releasing a key ends its gesture. A key pressed again before the answer arrives continues the gesture. */
addEventListener("keyup", async (event) => {
  if (event.target.closest?.("input, select, textarea")) return;
  draft.finish();
  const times = nudged?.times;
  await draft.settled();
  if (nudged?.times === times) nudged = null;
});

/** Makes an edit that depends on the newest state. */
async function pick(edit) {
  await draft.settled();
  const made = edit();
  if (made !== null) await draft.apply([made]);
}

async function add(kind) {
  at("#new").close();
  if (draft.scene === null) {
    askForRoom();
    return;
  }
  const count = (of) => draft.scene.items.filter((item) => item.kind === of).length;
  const index = count(kind);
  if (await newThing(draft, kind)) choose({ kind, index });
  at("#plan").focus();
}

async function addWaypoint() {
  const item = itemOf(draft.scene, chosen);
  if (item?.kind !== "agent") {
    notice({ message: "no person selected", hint: "select the person who gets the waypoint" });
    return;
  }
  const row = await newWay(draft, item, chosen.row);
  if (row !== null) choose({ kind: "agent", index: item.index, row });
}

async function duplicate() {
  const item = itemOf(draft.scene, chosen);
  if (item === null) return;
  const { kind } = item;
  const index = draft.scene.items.filter((one) => one.kind === kind).length;
  if (await copyOf(draft, item)) choose({ kind, index });
}

async function remove() {
  const item = itemOf(draft.scene, chosen);
  if (item === null) return;
  const { kind, index } = item;
  const { row } = chosen;
  const edit = row === undefined ? { does: "remove", path: [kind, index] } : { does: "remove-way-point", file: item.way.file, row };
  if (await draft.apply([edit])) choose(row === undefined ? null : { kind, index, row: Math.max(0, row - 1) });
}

/** Shows an error that is not in the scene. */
function notice(error) {
  draft.fault = error;
  tell();
}

async function save(name) {
  const error = await draft.save(name);
  if (error) {
    notice(error);
    return;
  }
  draft.fault = null;
  tell();
  await offer();
  location.hash = `scene=${encodeURIComponent(name)}`;
}

/** Escape answers nothing, and what was answered before holds no more. */
function openDialog(selector) {
  at(selector).returnValue = "";
  at(selector).showModal();
}

function askForRoom() {
  leave(() => openDialog("#room"));
}

function saveAs() {
  at("#save-name").value = draft.name === null ? "" : `${draft.name}-2`;
  openDialog("#save-as");
}

/** Lists the scenes of the folder. */
async function offer() {
  const answer = await ask("/v1/scenes");
  if (answer.error) {
    notice(answer.error.code === "unknown_path" ? { message: "this collector has no scenes folder", hint: "start it with --scenes DIR" } : answer.error);
    return [];
  }
  const options = answer.scenes.map(({ name, error }) => new Option(error ? `${name} (has an error)` : name, name));
  at("#scene").replaceChildren(...options);
  at("#scene").value = draft.name ?? "";
  return answer.scenes.map(({ name }) => name);
}

async function open(name) {
  const error = await draft.open(name);
  if (error) {
    notice(error);
    return;
  }
  at("#second").value = 0;
  choose(null);
  at("#scene").value = name;
  document.title = `${name} · Scenes · grideye`;
  if (draft.broken) at("#text-panel").open = true;
  location.hash = `scene=${encodeURIComponent(name)}`;
}

/** Goes to another scene by `next`; asks first if this one has unsaved changes. */
function leave(next) {
  if (!draft.changed) {
    next();
    return;
  }
  at("#scene").value = draft.name ?? "";
  leaveFor = next;
  openDialog("#leave");
}

function wish(name) {
  if (name !== draft.name) leave(() => open(name));
}

async function create() {
  const [x, y, z] = ["x", "y", "z"].map((axis) => Math.round(at(`#room-${axis}`).valueAsNumber * 1000));
  await draft.create(newRoom([x, y, z]));
  at("#scene").value = "";
  at("#second").value = 0;
  document.title = "New room · Scenes · grideye";
  history.replaceState(null, "", location.pathname);
  choose({ kind: "room", index: 0 });
  at("#plan").focus();
}

/** Runs the scene in its own time, again and again. */
function play() {
  const is = at("#play").getAttribute("aria-pressed") === "false";
  at("#play").setAttribute("aria-pressed", String(is));
  say(at("#play"), is ? "Pause" : "Play");
  clearInterval(playing);
  if (!is) return;
  const second = at("#second");
  const since = performance.now() - second.valueAsNumber * 1000;
  playing = setInterval(() => {
    if (draft.seconds === 0) {
      play();
      return;
    }
    second.value = ((performance.now() - since) / 1000) % draft.seconds;
    draft.seek(second.valueAsNumber);
  }, PLAY_MS);
}

at("#scene").addEventListener("change", (event) => wish(event.target.value));
at("#leave").addEventListener("close", () => {
  if (at("#leave").returnValue === "leave") leaveFor();
});
at("#new-room").addEventListener("click", askForRoom);
at("#room").addEventListener("close", () => {
  if (at("#room").returnValue === "create") create();
});
at("#play").addEventListener("click", play);
at("#save").addEventListener("click", () => save(draft.name));
at("#save-other").addEventListener("click", saveAs);
at("#save-as").addEventListener("close", () => {
  const name = at("#save-name").value.trim();
  if (at("#save-as").returnValue === "save" && name !== "") save(name);
});
at("#undo").addEventListener("click", () => draft.undo());
at("#redo").addEventListener("click", () => draft.redo());
at("#add").addEventListener("click", () => at("#new").showModal());
at("#new").addEventListener("keydown", (event) => {
  const kind = { o: "object", p: "agent", s: "sensor" }[event.key];
  if (kind) add(kind);
});
for (const button of document.querySelectorAll("#new [data-kind]")) button.addEventListener("click", () => add(button.dataset.kind));
at("#add-waypoint").addEventListener("click", addWaypoint);
at("#duplicate").addEventListener("click", duplicate);
at("#remove").addEventListener("click", remove);
at("#fault-place").addEventListener("click", () => goTo(draft.fault.place));
at("#second").addEventListener("input", (event) => draft.seek(event.target.valueAsNumber));
at("#home").addEventListener("click", () => plan.home());
at("#nearer").addEventListener("click", () => plan.zoom(true));
at("#farther").addEventListener("click", () => plan.zoom(false));
at("#cover").addEventListener("click", () => cover.toggle());
addEventListener("hashchange", () => {
  const name = new URLSearchParams(location.hash.slice(1)).get("scene");
  if (name !== null) wish(name);
});
addEventListener("beforeunload", (event) => {
  if (draft.changed) event.preventDefault();
});
// Ctrl keys work in fields too: the text is part of the scene.
addEventListener("keydown", (event) => {
  if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
  const does = { z: () => (event.shiftKey ? draft.redo() : draft.undo()), y: () => draft.redo(), s: () => (draft.name === null ? saveAs() : save(draft.name)) }[event.key.toLowerCase()];
  if (!does) return;
  event.preventDefault();
  does();
});

const chooses = () => chosen !== null && draft.scene !== null;
commands({
  ".": { says: "select the next item in the list", does: () => list.next(chosen, 1) },
  ",": { says: "select the previous item", does: () => list.next(chosen, -1) },
  ArrowLeft: { when: chooses, does: (event) => nudge(0, -1, event) },
  ArrowRight: { when: chooses, does: (event) => nudge(0, 1, event) },
  ArrowUp: { when: chooses, does: (event) => nudge(1, 1, event) },
  ArrowDown: { when: chooses, does: (event) => nudge(1, -1, event) },
  PageUp: { says: "raise by 5 cm, with Shift by 50 cm", when: chooses, does: (event) => nudge(2, 1, event) },
  PageDown: { says: "lower by 5 cm, with Shift by 50 cm", when: chooses, does: (event) => nudge(2, -1, event) },
  "[": { says: "turn by 5° counterclockwise", does: (event) => turnBy(TURN, event) },
  "]": { says: "turn by 5° clockwise", does: (event) => turnBy(-TURN, event) },
  "{": { says: "turn by 45° counterclockwise", does: (event) => turnBy(TURN_COARSE, event) },
  "}": { says: "turn by 45° clockwise", does: (event) => turnBy(-TURN_COARSE, event) },
  t: { says: "tilt a sensor down by 5°", does: (event) => tiltBy(TURN, event) },
  T: { says: "tilt a sensor up by 5°", does: (event) => tiltBy(-TURN, event) },
  Enter: { says: "go to the fields of the selection", when: () => chooses() && !document.activeElement.closest("button, a, summary"), does: () => fields.focus() },
  n: { says: "add an object, person or sensor", does: () => at("#new").showModal() },
  w: { says: "add a waypoint to a person", does: addWaypoint },
  d: { says: "duplicate the selection", does: duplicate },
  Delete: { says: "delete the selection", does: remove },
  c: { says: "show or hide where people are seen", does: () => cover.toggle() },
  "+": { says: "plan: zoom in", does: () => plan.zoom(true) },
  "-": { says: "plan: zoom out", does: () => plan.zoom(false) },
  "0": { says: "plan: fit the room", does: () => plan.home() },
  p: { says: "next palette", does: () => look.next("palette") },
  i: { says: "next drawing method: cells, bilinear, bicubic", does: () => look.next("method") },
  v: { says: "show or hide numbers in the cells", does: () => look.toggleNumbers() },
  x: { says: "open the scene file at the error", does: toText },
  Escape: { says: "clear the selection", does: () => choose(null) },
}, [
  ["Arrow keys", "move the selection by 5 cm, with Shift by 50 cm; in the list: select; in the 3-D view: turn it; on an image: read its pixels"],
  ["Ctrl Z", "undo"],
  ["Ctrl Shift Z", "redo; Ctrl Y does the same"],
  ["Ctrl S", "save"],
]);

function toText() {
  at("#text-panel").open = true;
  goTo(draft.fault?.place ?? { file: "scene", line: 1, column: 1 });
}

offerSignOut(at("#sign-out"));
const names = await offer();
const asked = new URLSearchParams(location.hash.slice(1)).get("scene");
if (asked !== null) await open(asked);
else if (names.length > 0) await open(names[0]);
else if (draft.fault === null) askForRoom();
document.querySelector("main").dataset.ready = "true";
