// One recording played back: images as in the live view, a timeline, and keys.

import { complain } from "./ask.js";
import { brought } from "./brought.js";
import { offerFiles } from "./exports.js";
import { Labels } from "./labels.js";
import { NoteField } from "./note.js";
import { PlayedSensor } from "./played-sensor.js";
import { Player, SPEEDS } from "./player.js";
import { recordedAt } from "./recorded.js";
import { factsOf } from "./recordings.js";
import { Timeline } from "./timeline.js";
import { putOn } from "./wall.js";
import { count, duration, minute, moment, place, say } from "./words.js";

const element = (id) => document.querySelector(`#${id}`);
const SKIPPED_S = 10;
const TOGETHER_S = 1;

/** In place of a recording's number: the file that was opened last, which the collector does not keep. */
export const FILE = "file";

export class Playback {
  #section = element("playback");
  #wall = element("played");
  #transport = element("transport");
  #loading = element("loading");
  #template = element("sensor-card");
  #recordings;
  #look;
  #player = new Player(() => this.#show());
  #timeline = new Timeline((seconds) => this.#player.seek(seconds));
  #note;
  #labels = new Labels({
    at: () => this.#player.at,
    seek: (seconds) => this.#player.seek(seconds),
    drawn: (labels, range) => this.#timeline.label(labels, range),
  });
  #id = null;
  #sensors = [];
  #began_ms = null;
  #length = 0;
  #beside;
  #watched = null;
  #file = null;

  /** `recordings` is the list of all, `look` how images are drawn. */
  constructor(recordings, look) {
    this.#recordings = recordings;
    this.#look = look;
    const { panel } = brought;
    this.#beside = panel && new panel.Panel(element("played-beside"), { look, among: "played", toggled: () => {} });
    this.#note = new NoteField(element("played-note"), recordings, element("played-trouble"));
    recordings.listen(() => this.#describe());
    element("speed").replaceChildren(...SPEEDS.map((speed) => new Option(`${speed}×`, speed)));
    element("speed").addEventListener("change", (event) => { this.#player.speed = Number(event.target.value); });
    for (const button of this.#transport.querySelectorAll("[data-does]")) button.addEventListener("click", () => this.does(button.dataset.does));
    element("jump").addEventListener("submit", (event) => {
      event.preventDefault();
      this.#jump(event.target.elements.place.value.trim());
    });
    element("scrub").addEventListener("keydown", (event) => this.#key(event));
  }

  /** The sensors of the recording, by their key. */
  get sensors() {
    return new Map(this.#sensors.map((sensor) => [sensor.track.key, sensor]));
  }

  /** Takes a file, which is shown under the number `FILE`. */
  open(file) {
    this.#file = file;
    if (this.#id === FILE) this.#id = null;
    if (!this.#section.hidden) this.show(FILE);
  }

  /** Opens the recording with that number, or closes it with `null`; a file, or with `plays`, plays by itself. */
  async show(id, plays = false) {
    this.#section.hidden = id === null;
    if (id === this.#id) return;
    this.#clear();
    this.#id = id;
    if (id === null) return;
    this.#recordings.refresh();
    const file = id === FILE ? this.#file : null;
    if (id === FILE && file === null) {
      this.#load("This file is not open any more. Drop it on the page again.");
      return;
    }
    this.#load("Loading the frames …");
    const path = file === null ? `/v1/recordings/${encodeURIComponent(id)}.frames` : `/v1/files?${new URLSearchParams({ name: file.name })}`;
    const isOpen = () => this.#id === id && (file === null || file === this.#file);
    try {
      const isOfFile = file !== null || plays;
      const recorded = await recordedAt(path, file, isOfFile);
      // Another recording may be open by now.
      if (!isOpen()) return;
      this.#take(recorded);
      if (isOfFile && recorded.tracks.length > 0) this.#player.toggle();
    } catch (error) {
      if (isOpen()) this.#load(error.message);
    }
  }

  /** Opens or closes the panel beside this sensor. */
  toggleBeside(key) {
    const sensor = this.sensors.get(key);
    if (!this.#beside || !sensor) return;
    if (this.#watched !== sensor) this.#watch(sensor);
    this.#beside.toggle();
  }

  #offerBeside() {
    if (!this.#beside) return;
    for (const sensor of this.#sensors) sensor.offerBeside(brought.panel.title);
    // A single sensor shows its last choice again.
    if (this.#sensors.length === 1) this.#watch(this.#sensors[0]);
  }

  #watch(sensor) {
    this.#watched?.watch(null);
    this.#watched = sensor;
    const track = sensor?.track;
    const isFile = this.#id === FILE;
    const key = `${track?.key} of ${isFile ? `file ${this.#file?.name}` : `recording ${this.#id}`}`;
    // The collector does not keep a file, so its frames go with each comparison.
    const frames = isFile && sensor !== null ? (...which) => track.sent(...which) : null;
    this.#beside?.follow(sensor === null ? null : { key, device: track.device, sensor: track.sensor, recording: this.#id, frames });
    sensor?.watch(this.#beside);
  }

  /** The labels of a recording changed. */
  labeled({ recording }) {
    this.#labels.refresh(recording);
  }

  redraw() {
    for (const sensor of this.#sensors) sensor.picture.redraw();
  }

  /** Runs the command of a button or a key. */
  does(what) {
    const acts = {
      play: () => this.#player.toggle(),
      first: () => this.#player.seek(0),
      last: () => this.#player.seek(this.#length),
      back: () => this.#step(-1),
      on: () => this.#step(1),
      rewind: () => this.#player.seek(this.#player.at - SKIPPED_S),
      forward: () => this.#player.seek(this.#player.at + SKIPPED_S),
      slower: () => this.#player.hurry(-1),
      faster: () => this.#player.hurry(1),
      gap: () => this.#nextGap(),
      from: () => this.#labels.mark("from"),
      to: () => this.#labels.mark("to"),
      label: () => this.#labels.write(),
    };
    if (this.#sensors.length > 0) acts[what]();
  }

  /** Adds the label of this key, counted from 0. */
  putLabel(index) {
    if (this.#sensors.length > 0) this.#labels.again(index);
  }

  #clear() {
    this.#player.load(0);
    this.#watch(null);
    this.#sensors = [];
    this.#wall.replaceChildren();
    this.#transport.hidden = true;
    this.#labels.take(null, []);
    this.#look.forget("played");
    for (const id of ["played-name", "played-facts"]) say(element(id), "");
    for (const id of ["jump-trouble", "played-trouble"]) complain(element(id), null);
  }

  #load(text) {
    this.#loading.hidden = text === "";
    say(this.#loading, text);
  }

  #take({ tracks, began_ms, length }) {
    this.#load(tracks.length === 0 ? "This recording has no frames." : "");
    if (tracks.length === 0) return;
    this.#began_ms = began_ms;
    this.#length = length;
    this.#sensors = tracks.map((track) => {
      const beside = () => this.toggleBeside(track.key);
      return new PlayedSensor(this.#template, track, { look: this.#look, began_ms, beside });
    });
    this.#offerBeside();
    putOn(this.#wall, this.#sensors.map((sensor) => sensor.element));
    this.#transport.hidden = false;
    this.#timeline.take(tracks, length);
    this.#player.load(length);
    // Sensors measure at different moments. It opens where all that began together have a frame.
    const begun = tracks.map(({ times }) => times[0]).filter((seconds) => seconds < TOGETHER_S);
    this.#player.seek(Math.max(...begun));
    if (this.#id !== FILE) this.#labels.take(this.#id, tracks);
    this.#describe();
  }

  #describe() {
    element("playback").dataset.file = this.#id === FILE;
    if (this.#id === FILE) {
      say(element("played-name"), this.#file?.name ?? "");
      say(element("played-facts"), this.#sensors.length === 0 ? "" : `${count(this.#sensors.length, "sensor", "sensors")} · ${duration(this.#length)} · a file on this computer, not stored`);
      return;
    }
    const recording = this.#recordings.all.find(({ id }) => String(id) === this.#id);
    if (!recording) return;
    say(element("played-name"), recording.name);
    const running = recording.running ? " · reopen it to see newer frames" : "";
    // How long its frames last: those of a file arrive at once.
    const length = recording.running || this.#sensors.length === 0 ? undefined : duration(this.#length);
    say(element("played-facts"), `${minute(recording.t_start_ns / 1e6)} · ${factsOf(recording, length)}${running}`);
    this.#note.take(recording);
    const runs = this.#sensors.flatMap(({ track }) => track.boots.map((boot) => ({ device: track.device, sensor: track.sensor, boot })));
    offerFiles(element("downloads"), recording, runs, (error) => complain(element("played-trouble"), error));
  }

  #show() {
    const { at, playing, speed } = this.#player;
    if (this.#sensors.length === 0) return;
    const said = this.#sensors.map((sensor) => sensor.show(at));
    this.#timeline.point(at, said[0]);
    this.#labels.moved();
    say(element("time"), `${place(at)} / ${place(this.#length)}`);
    // A file may say nothing of the day.
    say(element("wall-time"), this.#began_ms > 0 ? moment(this.#began_ms + at * 1000) : "");
    const button = this.#transport.querySelector("[data-does=play]");
    say(button, playing ? "Pause" : "Play");
    button.setAttribute("aria-pressed", String(playing));
    element("speed").value = speed;
  }

  /** The sensor to step through: the focused one, else the first. */
  #lead() {
    const key = document.activeElement?.closest(".sensor")?.dataset.key;
    return (this.sensors.get(key) ?? this.#sensors[0]).track;
  }

  #step(by) {
    this.#player.pause();
    const seconds = this.#lead().step(this.#player.at, by);
    if (seconds !== null) this.#player.seek(seconds);
  }

  #nextGap() {
    this.#player.pause();
    const gaps = this.#sensors.map(({ track }) => track.gapAfter(this.#player.at)).filter((seconds) => seconds !== null);
    complain(element("jump-trouble"), gaps.length === 0 ? { message: "There is no later gap." } : null);
    if (gaps.length > 0) this.#player.seek(Math.min(...gaps));
  }

  #jump(text) {
    const { seconds, fault } = this.#placeOf(text);
    complain(element("jump-trouble"), fault ? { message: fault } : null);
    if (fault) return;
    this.#player.pause();
    this.#player.seek(seconds);
  }

  /** Seconds of "#900", "90", "1:30" or "1:00:30.5". */
  #placeOf(text) {
    if (/^#\d+$/.test(text)) {
      const seconds = this.#lead().secondsOf(Number(text.slice(1)));
      return seconds === null ? { fault: `Frame ${text} is not in this recording.` } : { seconds };
    }
    if (!/^(\d+:){0,2}\d+(\.\d+)?$/.test(text)) return { fault: "Enter a time as 1:30 or 90, or a frame as #900." };
    const seconds = text.split(":").reduce((sum, part) => sum * 60 + Number(part), 0);
    if (seconds > this.#length) return { fault: `The recording lasts ${place(this.#length)} (${count(Math.ceil(this.#length), "second", "seconds")}).` };
    return { seconds };
  }

  #key(event) {
    const does = {
      ArrowLeft: "back", ArrowDown: "back", ArrowRight: "on", ArrowUp: "on", PageUp: "forward", PageDown: "rewind", Home: "first", End: "last",
    }[event.key];
    if (!does) return;
    event.preventDefault();
    event.stopPropagation();
    this.does(does);
  }
}
