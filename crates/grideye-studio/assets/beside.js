// Real beside simulated: a sensor's frames, a scene's frames at the same moments, and their comparison. The live view or
// playback calls `follow`, then `orient`, `frame` and `state`.

import { brought } from "./brought.js";
import { DIFFERENCES, rangeAround, signed, summed } from "./difference.js";
import { HeatMap } from "./heatmap.js";
import { keep, kept } from "./keep.js";
import { offer } from "./offers.js";
import { UPRIGHT, placeOf } from "./orientation.js";
import { RoomView } from "./room-view.js";
import { Steady, cssOf, labelTicks, paintBar } from "./scale.js";
import { Scores } from "./scores.js";
import { Rooms, Simulation, fetched, momentOf } from "./simulation.js";
import { HOW_TO_READ, degrees, duration, fieldsOf, say } from "./words.js";

const ASK_MS = 2_000;
// What is warm has a name on the image.
const [WARM_CELSIUS, BESIDE_M] = [1, 0.5];
const NOTHING = { open: false, scene: null, sensor: null, originNs: null, boot: null, again: false, seconds: 10 };
const SIDES = ["real", "simulated", "difference"];

export class Beside {
  #place;
  #root;
  #look;
  #fields;
  #sides = {};
  #room;
  #rooms = null;
  #steady = new Steady();
  #drawn = null;
  #scores;
  #scenes = null;
  #source = null;
  #chosen = NOTHING;
  #scene = null;
  #simulation = null;
  #newest = null;
  #values = null;
  #answeredFor = null;
  #asking = false;
  #opening = null;
  #toggled;
  #among;
  // In the sentences about it.
  #real = "Real";
  #orientation = UPRIGHT;

  /**
   * The panel opens in `place`; `look` is how images are drawn, `among` names the group that shares a scale, and `toggled`
   * gets whether the panel is open.
   */
  constructor(place, { look, among, toggled }) {
    const template = document.querySelector("#beside-panel");
    const root = template.content.firstElementChild.cloneNode(true);
    if (among === "live" && template.dataset.scene !== undefined) {
      // The sensor of the demonstration sees its scene again and again.
      this.#opening = { ...template.dataset, again: true };
      this.#real = "Emulated sensor";
      say(root.querySelector("[data-side=real] figcaption"), "Emulated sensor");
      say(root.querySelector("[data-side=difference] figcaption"), "Emulated − simulated");
      say(root.querySelector("[data-field=footprints] option"), "emulated");
      say(root.querySelector("h2"), "Emulated sensor beside its simulated scene");
    }
    this.#place = place;
    this.#root = root;
    this.#look = look;
    this.#toggled = toggled;
    this.#among = among;
    this.#fields = fieldsOf(root);
    this.#room = new RoomView(this.#fields.room);
    this.#scores = new Scores(root);
    for (const side of SIDES) this.#sides[side] = this.#side(side);
    paintBar(root.querySelector("[data-scale=difference] .bar"), DIFFERENCES.colors);
    this.#fields.choice.addEventListener("change", (event) => this.#choose(event.target.value));
    this.#fields.begin.addEventListener("click", () => this.#begin(this.#newest?.frame.t_boot_ns ?? null));
    this.#fields.first.addEventListener("click", () => this.#begin(this.#newest?.began ?? null));
    this.#fields.again.addEventListener("change", (event) => this.#change({ again: event.target.checked }));
    this.#fields.seconds.addEventListener("change", (event) => this.#compare(Number(event.target.value)));
    this.#fields.footprints.addEventListener("change", () => this.#draw());
    this.#fields.close.addEventListener("click", () => this.toggle());
    look.listen(() => this.#draw());
    setInterval(() => this.#ask(), ASK_MS / 2);
  }

  /**
   * Follows a sensor: `{ key, device, sensor }`, in playback also `recording`, and of a file its `frames(boot, until_ns,
   * seconds)`; `null` closes the panel. The last choice for
   * the key applies again, but the first live sensor gets the scene that the page opens with.
   */
  async follow(source) {
    if (source?.key === this.#source?.key && source?.recording === this.#source?.recording) return;
    this.#source = source;
    this.#newest = null;
    this.#scene = null;
    this.#simulation = null;
    this.#rooms = null;
    this.#drawn = null;
    this.#steady = new Steady();
    this.#values = null;
    this.#chosen = source === null ? NOTHING : kept(`beside.${source.key}`, null) ?? this.#assumed(source);
    if (source !== null && this.#opening !== null) {
      this.#change({ ...NOTHING, ...this.#opening, open: true });
      this.#opening = null;
    }
    this.#open();
    if (!this.#chosen.open) return;
    await this.#offer();
  }

  /** Opens or closes the panel. */
  async toggle() {
    if (this.#source === null) return;
    this.#change({ open: !this.#chosen.open });
    this.#open();
    if (!this.#chosen.open) return;
    await this.#offer();
    this.#root.querySelector(this.#scene === null ? ".offers button" : "[data-field=choice]")?.focus();
  }

  /** The orientation of the images. */
  orient(orientation) {
    this.#orientation = orientation;
    for (const side of SIDES) this.#sides[side].heat.orient(orientation);
  }

  /** A new frame `{ seq, t_boot_ns, pixels_celsius }` of a boot `{ boot, began_boot_ns }`. */
  frame(frame, run) {
    this.#newest = { frame, boot: run.boot, began: run.began_boot_ns ?? null };
    // Each boot has its own clock, so a start on an earlier boot's clock means nothing now.
    if (this.#chosen.boot !== null && this.#chosen.boot !== run.boot) this.#change({ originNs: null, boot: null });
    this.#draw();
  }

  /** Whether the sensor is `live`, and if not, why. */
  state(state, why) {
    const { figure, veil } = this.#sides.real;
    figure.dataset.state = state;
    veil.hidden = state === "live";
    say(veil, why);
    this.#root.dataset.state = state;
  }

  #side(name) {
    const figure = this.#root.querySelector(`[data-side=${name}]`);
    const canvas = figure.querySelector(".heat");
    canvas.setAttribute("aria-label", `${figure.querySelector("figcaption").textContent}; arrow keys read its pixels`);
    const heat = new HeatMap(canvas, { cell: (cell) => this.#point(cell) });
    return { figure, heat, veil: figure.querySelector(".veil") };
  }

  /** The scene that a recording's sensor was last beside, live. */
  #assumed({ device, sensor, recording }) {
    return recording === undefined ? NOTHING : { ...kept(`beside.${device}/${sensor}`, NOTHING), open: false };
  }

  #open() {
    const open = this.#source !== null && this.#chosen.open;
    if (open !== this.#root.isConnected) this.#place.replaceChildren(...(open ? [this.#root] : []));
    this.#toggled(open);
  }

  #change(change) {
    this.#chosen = { ...this.#chosen, ...change };
    if (this.#source !== null) keep(`beside.${this.#source.key}`, this.#chosen);
  }

  #compare(seconds) {
    this.#change({ seconds });
    this.#answeredFor = null;
    this.#ask();
  }

  /** Fetches and lists the scenes. */
  async #offer() {
    const answer = await fetched("/v1/scenes");
    this.#complain(answer.error);
    if (answer.error) return;
    this.#scenes = answer.scenes;
    const options = this.#scenes.flatMap(optionsOf);
    this.#fields.choice.replaceChildren(new Option("Choose a scene", ""), ...options);
    offer(this.#fields.offers, this.#scenes, this.#source.sensor, (name, sensor) => this.#choose(JSON.stringify([name, sensor])));
    this.#take();
  }

  #choose(value) {
    const [scene, sensor] = value === "" ? [null, null] : JSON.parse(value);
    this.#change({ scene, sensor, originNs: null, boot: null });
    this.#take();
  }

  /** Loads the chosen scene. */
  async #take() {
    const { scene: name, sensor } = this.#chosen;
    this.#scene = this.#scenes.find((scene) => scene.name === name && scene.sensors.some((one) => one.name === sensor && one.fits)) ?? null;
    this.#answeredFor = null;
    this.#simulation = null;
    this.#fields.choice.value = this.#scene === null ? "" : JSON.stringify([name, sensor]);
    this.#fields.running.hidden = this.#scene?.moves !== true;
    this.#fields.again.checked = this.#chosen.again;
    this.#fields.seconds.value = this.#chosen.seconds;
    say(this.#fields.about, this.#scene === null ? "" : `${this.#scene.title} The simulation has no noise.`);
    const offered = this.#scenes.length === 0 ? "There is no scene in the folder to compare with." : "Choose the scene that the sensor is in.";
    this.#scores.none(this.#scene === null ? offered : "Comparing the first frames.");
    this.#root.dataset.chosen = this.#scene !== null;
    if (this.#scene === null) {
      const lost = name !== null ? `The scene ${name} with an 8 x 8 sensor ${sensor} no longer exists.` : "";
      this.#complain(lost ? { message: lost } : null);
      this.#draw();
      return;
    }
    this.#rooms = new Rooms(this.#scene, (error) => {
      this.#complain(error);
      this.#draw();
    });
    this.#simulation = new Simulation(name, sensor, (error) => {
      this.#complain(error);
      this.#draw();
    });
    this.#draw();
    // The collector keeps frames of further sensors only after the first request.
    this.#ask();
  }

  #begin(originNs) {
    if (originNs === null) return;
    this.#change({ originNs, boot: this.#newest.boot });
    this.#answeredFor = null;
    this.#scores.none("The scene has just started.");
    this.#draw();
  }

  #draw() {
    if (!this.#root.isConnected || this.#newest === null) return;
    const { frame, began } = this.#newest;
    this.#fields.first.hidden = began === null;
    // An emulated sensor starts its scene with its first frame, and a recording is taken to begin with its scene, as by
    // `grideye compare`. For people before a real sensor, somebody starts it.
    if (this.#scene?.moves && !this.#scene.starts_utc && this.#chosen.originNs === null && began !== null) {
      this.#change({ originNs: began, boot: this.#newest.boot });
    }
    const moment = this.#scene === null ? null : momentOf(this.#laid(), frame.t_boot_ns);
    const simulated = moment === null ? null : (this.#simulation?.at(moment.second) ?? null);
    this.#pictures(frame.pixels_celsius, simulated, moment);
    say(this.#fields.clock, moment === null ? "" : clockWords(moment, this.#scene));
    if (simulated !== null) this.#places(simulated.agents, moment);
  }

  #laid() {
    const { moves, seconds } = this.#scene;
    const { originNs, again } = this.#chosen;
    return { moves, seconds, originNs, again };
  }

  #pictures(real, simulated, moment) {
    const drawing = this.#look.drawing;
    const range = simulated === null
      ? this.#look.rangeFor(this.#source.key, real, this.#among)
      : this.#look.rangeFor(`${this.#source.key} beside`, [...real, ...simulated.celsius], this.#among);
    const now = simulated !== null && moment.state === "within";
    const differences = now ? real.map((celsius, pixel) => celsius - simulated.celsius[pixel]) : null;
    this.#values = { real, simulated: simulated?.celsius ?? null, differences };
    for (const side of ["real", "simulated"]) this.#sides[side].heat.look(drawing);
    this.#sides.difference.heat.look({ ...DIFFERENCES, method: "cells" });
    this.#sides.real.heat.show(real, range);
    if (simulated !== null) this.#sides.simulated.heat.show(simulated.celsius, range);
    const apart = differences === null ? { low: 0, high: 0 } : rangeAround(this.#steady.fit(differences));
    if (differences !== null) this.#sides.difference.heat.show(differences, apart);
    paintBar(this.#root.querySelector("[data-scale=temperature] .bar"), drawing.colors);
    labelTicks(this.#root.querySelector("[data-scale=temperature] ol"), range);
    labelTicks(this.#root.querySelector("[data-scale=difference] ol"), rangeAround(apart), (tick) => signed(tick, Number.isInteger(tick) ? 0 : 1));
    this.#paintRoom(moment, range);
    this.#veil("simulated", simulated !== null, now ? "" : veilWords(moment));
    this.#veil("difference", differences !== null, differences === null ? "No simulated frame for this moment." : "");
    this.#read(this.#sides.real.heat.cell);
  }

  /** The room at this moment, with what each pixel sees in the color of the real or the simulated frame. */
  #paintRoom(moment, range) {
    const room = moment === null ? null : (this.#rooms?.at(moment.second) ?? null);
    if (room === null) return;
    const { sensor } = this.#chosen;
    const number = room.drawing.sensors.findIndex(({ name }) => name === sensor);
    const celsius = this.#values[this.#fields.footprints.value];
    const { colors } = this.#look.drawing;
    const shown = celsius?.map((degree) => cssOf(colors, degree, range));
    if (this.#drawn !== room) this.#room.show(room, room.items.find(({ kind, name }) => kind === "sensor" && name === sensor) ?? null);
    this.#drawn = room;
    this.#room.color(room.drawing.sensors.map((_, index) => (index === number ? shown : undefined)));
    this.#fields.room.dataset.known = moment.state === "within";
    this.#name(room, number);
  }

  /** Names what is warm on the simulated image. */
  #name(room, number) {
    const { simulated } = this.#values;
    const names = simulated === null ? [] : warmOf(room.drawing, number, simulated).map(([name, pixels]) => {
      const item = Object.assign(document.createElement("li"), { textContent: name });
      const [across, down] = [0, 1].map((axis) => pixels.reduce((sum, pixel) => sum + placeOf(pixel, this.#orientation)[axis] + 0.5, 0) / pixels.length);
      Object.assign(item.style, { left: `${12.5 * across}%`, top: `${12.5 * down}%` });
      return item;
    });
    this.#fields.names.replaceChildren(...names);
  }

  /** Covers an image that is not of this moment with the reason; one without a frame is blank. */
  #veil(side, drawn, words) {
    const { figure, veil } = this.#sides[side];
    figure.dataset.blank = !drawn;
    figure.dataset.state = words === "" ? "live" : "missing";
    veil.hidden = words === "";
    say(veil, words);
  }

  #point(cell) {
    for (const side of SIDES) this.#sides[side].heat?.mark(cell);
    this.#read(cell);
  }

  #read(cell) {
    const { real, simulated, differences } = this.#values ?? {};
    this.#fields.cursor.dataset.reading = cell !== null;
    if (!real) return;
    if (cell === null) {
      say(this.#fields.cursor, differences === null ? HOW_TO_READ : summed(this.#real, differences));
      return;
    }
    const parts = [`Pixel ${cell + 1}: ${this.#real.toLowerCase()} ${degrees(real[cell])}`];
    if (simulated !== null) parts.push(`simulated ${degrees(simulated[cell])}`);
    if (differences !== null) parts.push(`difference ${signed(differences[cell], 2)} °C`);
    say(this.#fields.cursor, parts.join(", "));
  }

  #places(agents, moment) {
    const known = moment.state === "within";
    const words = agents.map(({ name, place: [x, y] }) => `${name} at ${x.toFixed(2)} m from the left, ${y.toFixed(2)} m from the front`);
    const when = known ? "" : ` (at the ${moment.state === "ended" ? "end" : "start"} of the scene)`;
    say(this.#fields.places, words.length === 0 ? "This scene has no people." : `${words.join("; ")}${when}.`);
  }

  /** Requests a comparison while the panel is shown and frames arrive. */
  async #ask() {
    if (this.#asking || !this.#root.isConnected || document.hidden || this.#scene === null || this.#newest === null) return;
    const { frame, boot } = this.#newest;
    const laid = this.#laid();
    let moment = momentOf(laid, frame.t_boot_ns);
    // A round that has just begun shows little: the one before it is compared.
    if (moment.turn && moment.second < this.#chosen.seconds) moment = momentOf({ ...laid, again: false, originNs: moment.originNs - laid.seconds * 1e9 }, frame.t_boot_ns);
    // By UTC, the collector knows where the scene starts on the device's clock.
    if (moment.state === "before" || (moment.state === "unset" && !this.#scene.starts_utc)) return;
    // After the scene's end the answer no longer changes.
    const asks = moment.state === "ended" ? `ended ${moment.originNs}` : frame.seq;
    if (this.#answeredFor === asks) return;
    this.#asking = true;
    const [simulation, { scene, sensor }] = [this.#simulation, this.#chosen];
    const path = `/v1/scenes/${encodeURIComponent(scene)}/sensors/${encodeURIComponent(sensor)}/comparison`;
    const answer = await fetched(`${path}?${this.#question(frame, boot, moment)}`, this.#sent(frame, boot, moment));
    setTimeout(() => { this.#asking = false; }, ASK_MS);
    if (simulation !== this.#simulation) return;
    this.#answeredFor = asks;
    const { origin_ns: originNs } = answer;
    if (this.#scene.starts_utc && Number.isFinite(originNs) && this.#chosen.originNs !== originNs) {
      this.#change({ originNs, boot });
      this.#draw();
    }
    if (answer.error) this.#scores.none(`${answer.error.message}.`);
    else if (moment.state === "ended" && !answer.frames) this.#scores.none("The collector no longer has the frames of this scene. Start the scene again.");
    else this.#scores.show(answer);
  }

  /** Of a file, its frames before this moment or before the scene's end. */
  #sent(frame, boot, { state, since }) {
    const { frames } = this.#source;
    if (!frames) return {};
    const until = frame.t_boot_ns - (state === "ended" ? since * 1e9 : 0);
    const body = JSON.stringify(frames(boot, until, this.#chosen.seconds));
    return { method: "POST", headers: { "content-type": "application/json" }, body };
  }

  #question(frame, boot, { originNs }) {
    const { device, sensor, recording, frames } = this.#source;
    const asked = new URLSearchParams({ device, of: sensor, seconds: this.#chosen.seconds });
    if (originNs !== null) asked.set("origin_ns", String(Math.max(0, Math.round(originNs))));
    if (recording !== undefined && !frames) {
      asked.set("recording", recording);
      asked.set("boot", boot);
      asked.set("through_seq", frame.seq);
    }
    return asked;
  }

  #complain(error) {
    const hint = error?.hint ? `. Hint: ${error.hint}` : "";
    this.#fields.trouble.hidden = !error;
    say(this.#fields.trouble, error ? `${error.message}${hint}` : "");
  }
}

/** What a sensor sees as warmer than most of its frame, or what warms it from beside the view: names, each with the pixels. */
function warmOf({ shapes, nodes, rounds, sides }, number, celsius) {
  const least = [...celsius].sort((one, other) => one - other)[32] + WARM_CELSIUS;
  const seen = new Map();
  const add = ({ shape }, pixel) => seen.set(shapes[shape].name, (seen.get(shapes[shape].name) ?? new Set()).add(pixel));
  const isWarm = ({ shape }) => shapes[shape]?.celsius > least;
  const warm = ({ footprints }) => footprints.filter(([sensor, pixel]) => sensor === number && celsius[pixel] > least);
  const faces = nodes.flatMap(({ faces }) => faces);
  for (const part of [...faces, ...rounds].filter(isWarm)) for (const [, pixel] of warm(part)) add(part, pixel);
  const beside = faces.filter((face) => isWarm(face) && !seen.has(shapes[face.shape].name));
  for (const surface of [...faces, ...sides]) {
    for (const [, pixel, corners] of isWarm(surface) ? [] : warm(surface)) {
      const near = beside.find((face) => apart(face.corners_m, corners) < BESIDE_M);
      if (near) add(near, pixel);
    }
  }
  return [...seen].map(([name, pixels]) => [name, [...pixels]]);
}

/** How far the boxes around some corners are apart. */
function apart(corners, others) {
  const gaps = [0, 1, 2].map((axis) => {
    const [one, other] = [corners, others].map((all) => all.map((corner) => corner[axis]));
    return Math.max(0, Math.min(...one) - Math.max(...other), Math.min(...other) - Math.max(...one));
  });
  return Math.hypot(...gaps);
}

brought.panel = { title: "Compare with a scene", key: "b", says: "open or close the comparison with a scene", Panel: Beside };

/** One entry per sensor of 8 x 8 pixels, or one that explains why there is none. */
function optionsOf(scene) {
  const fitting = scene.sensors.filter(({ fits }) => fits);
  if (fitting.length === 0) {
    const option = new Option(`${scene.name} (${scene.error ? "cannot be read" : "no sensor of 8 x 8 pixels"})`, "");
    option.disabled = true;
    option.title = scene.error ?? "";
    return [option];
  }
  return fitting.map(({ name }) => {
    const option = new Option(fitting.length > 1 ? `${scene.name} · ${name}` : scene.name, JSON.stringify([scene.name, name]));
    option.title = scene.title;
    return option;
  });
}

function clockWords(moment, scene) {
  if (!scene.moves) return "Nothing moves in this scene.";
  switch (moment.state) {
    case "unset": return `This scene moves for ${duration(scene.seconds)}. ${scene.starts_utc ? `It starts at ${scene.starts_utc}.` : "Start it at its second 0."}`;
    case "before": return `The scene starts in ${duration(moment.until)}.`;
    case "ended": return `The scene ended ${duration(moment.since)} ago.`;
    default: return `Second ${moment.second.toFixed(1)} of ${scene.seconds.toFixed(1)}${moment.turn ? `, round ${moment.turn}` : ""}.`;
  }
}

function veilWords(moment) {
  if (moment === null) return "No scene is chosen.";
  switch (moment.state) {
    case "unset":
    case "before": return "The scene has not started. This is its first moment.";
    case "ended": return "The scene has ended. This is its last moment.";
    default: return "Simulating.";
  }
}
