// The fields of the selection. Each is a key of the scene file, in the file's units.

import { itemOf, pathOf, titleOf, turnKey } from "./things.js";

/** What the rows that read scene files say of each key, by table: `unit`, `words`, `numbers` (lowest and highest) and `doc`. */
const KEYS = JSON.parse(document.getElementById("scene-keys").textContent);

const AXES = ["x", "y", "z"];
const POSITION = { key: "position_mm", title: "Position", parts: AXES, step: 50 };
const SIZE = { key: "size_mm", title: "Size", parts: AXES, step: 50, known: true };
const YAW = { key: "yaw_deg", title: "Yaw", step: 5, otherwise: 0 };
const TEMPERATURE = { key: "temperature_c", title: "Temperature", step: 0.5, otherwise: "room" };
const EMISSIVITY = { key: "emissivity", title: "Emissivity", step: 0.05, otherwise: 0.8 };
const STANDS = { ...POSITION, known: true };
const SPEED = { key: "speed_mm_per_s", title: "Speed", step: 100, known: true };
const NAME = { key: "name", title: "Name", text: true };

/** The keys of each table that have a field; `known` ones only where the file has them. */
const FIELDS = {
  room: [
    { ...SIZE, step: 100 },
    { key: "height_mm", title: "Height", step: 100, known: true },
    { key: "ambient_c", title: "Air and walls", step: 0.5 },
  ],
  object: [NAME, POSITION, SIZE, YAW, { ...YAW, key: "pitch_deg", title: "Pitch" }, { ...YAW, key: "roll_deg", title: "Roll" }, TEMPERATURE, EMISSIVITY],
  mosaic: [NAME, POSITION, { ...SIZE, title: "Cell size" }, EMISSIVITY],
  agent: [NAME, STANDS, SIZE, YAW, TEMPERATURE, EMISSIVITY, SPEED],
  sensor: [
    NAME, POSITION,
    { key: "elevation_deg", title: "Elevation (90 down)", step: 5 },
    { key: "azimuth_deg", title: "Azimuth (0 right)", step: 5 },
    { key: "roll_deg", title: "Roll", step: 5, otherwise: 0 },
    { key: "fov_deg", title: "Field of view", step: 1, otherwise: "preset" },
    { key: "noise_sigma_c", title: "Noise (sigma)", step: 0.05, otherwise: "preset" },
  ],
};
/** The choice that turns a word into the number it stands for. */
const NUMBER = "number";
/** The keys of a person's body; a word's default depends on the item. */
const OF_A_PERSON = [
  { key: "height_mm", title: "Height", step: 50, otherwise: 1700 },
  { key: "build", title: "Build", step: 0.05, otherwise: () => "average" },
  { key: "posture", title: "Posture", otherwise: ({ way }) => (way ? "walk" : "stand") },
  { key: "clothing", title: "Clothing", step: 0.1, otherwise: () => "indoor" },
];
const OF_A_PART = [{ ...POSITION, title: "position" }, { ...SIZE, title: "size" }, { ...TEMPERATURE, title: "temperature" }];

/** A field with what its row says. */
function described(table, field) {
  const { unit, words, numbers, doc } = KEYS[table][field.key];
  const choice = numbers === null ? words : [...words, NUMBER];
  return { ...field, unit: field.key.endsWith("_deg") ? "°" : unit, words: words.length > 0 ? choice : undefined, limits: numbers, doc };
}

export class Fields {
  #root;
  #title;
  #scene = null;
  #chosen = null;
  #shown = "";
  #inputs = [];
  #on;

  /**
   * Calls `on.change(edits, at)` at every keystroke that makes a value, and `on.finish` when the field is left;
   * `on.pick(edit)` when a word is chosen, with a function that makes its edit.
   */
  constructor(root, title, on) {
    this.#root = root;
    this.#title = title;
    this.#on = on;
    root.addEventListener("submit", (event) => event.preventDefault());
  }

  show(scene, chosen) {
    this.#scene = scene;
    this.#chosen = chosen;
    const rows = this.#rows();
    const shown = JSON.stringify([chosen, rows.map(({ title, inputs }) => [title, inputs.map(({ path, file }) => [path, file])])]);
    this.#title.textContent = chosen === null ? "Nothing selected" : titleOf(scene, chosen).replace(/^./, (letter) => letter.toUpperCase());
    if (shown !== this.#shown) this.#build(rows);
    this.#shown = shown;
    const inputs = rows.flatMap((row) => row.inputs);
    inputs.forEach((now, index) => this.#fill(this.#inputs[index], now));
  }

  /** Marks the field being typed in as invalid or valid. */
  complain(is) {
    for (const input of this.#inputs) input.setAttribute("aria-invalid", String(is && input.dataset.typing === "true"));
  }

  focus() {
    this.#inputs[0]?.focus();
  }

  #fill(input, { value, otherwise, words }) {
    input.dataset.now = value ?? "";
    if (words) {
      input.value = value ?? otherwise;
      return;
    }
    if (input === document.activeElement && input.dataset.typing === "true") return;
    input.value = value ?? "";
    input.placeholder = otherwise ?? "";
  }

  /** The rows for the selection: a title, and inputs with their values. */
  #rows() {
    if (this.#scene === null || this.#chosen === null) return [];
    const { kind, row } = this.#chosen;
    if (kind === "room") {
      const takes = { title: "Minimum duration", inputs: [this.#input({ key: "duration_s", unit: "s", step: 1, otherwise: 0 }, this.#scene.keys, ["duration_s"])] };
      return [...this.#of("room", FIELDS.room, this.#scene.room.keys, ["room"]), takes];
    }
    const item = itemOf(this.#scene, this.#chosen);
    if (item === null) return [];
    if (row !== undefined) return [this.#point(item, row, "Position")];
    const own = item.keys.person ? this.#person(item) : this.#of(kind, FIELDS[kind], item.keys, pathOf(item));
    const points = item.way?.points_m.map((_, index) => this.#point(item, index, `Waypoint ${index + 1}`)) ?? [];
    const parts = (item.keys.part ?? []).flatMap((part, index) => {
      const rows = this.#of("object", OF_A_PART, part, pathOf(item, "part", index));
      return rows.map((one) => ({ ...one, title: `${part.name}: ${one.title}` }));
    });
    return [...own, ...points, ...parts];
  }

  #person(item) {
    const body = OF_A_PERSON.map(({ otherwise, ...field }) => ({ ...field, otherwise: otherwise instanceof Function ? otherwise(item) : otherwise }));
    const facing = turnKey(item) === null ? [] : [{ ...YAW, title: "Facing" }];
    return [
      ...this.#of("agent", [NAME, STANDS], item.keys, pathOf(item)),
      ...this.#of("person", body, item.keys.person, pathOf(item, "person")),
      ...this.#of("agent", [...facing, SPEED], item.keys, pathOf(item)),
    ];
  }

  #of(table, fields, keys, path) {
    const shown = fields.filter(({ key, known }) => !known || key in keys).map((field) => described(table, field));
    return shown.map((field) => {
      const { doc } = field;
      if (field.words) return { doc, title: field.title, inputs: this.#choice(field, keys, [...path, field.key]) };
      const value = keys[field.key];
      const parts = field.parts ?? (Array.isArray(value) ? ["across", "down"] : null);
      if (parts === null) return { doc, title: field.title, inputs: [this.#input(field, keys, [...path, field.key])] };
      const inputs = parts.map((part, index) => ({ ...this.#input(field, keys, [...path, field.key, index]), part, value: value?.[index] }));
      return { doc, title: field.title, inputs };
    });
  }

  #input({ key, unit, step, otherwise, text, limits }, keys, path) {
    return { path, unit, step, otherwise, text, limits, value: keys[key] };
  }

  /** A choice of words, and beside it the number where the file has one. */
  #choice({ words, otherwise, ...field }, keys, path) {
    const value = keys[field.key];
    if (typeof value !== "number") return [{ path, words, otherwise, value }];
    return [{ path, words, otherwise, value: NUMBER }, { ...this.#input(field, keys, path), as: "number" }];
  }

  #point(item, row, title) {
    const point = item.way.points_m[row].map((meters) => Math.round(meters * 1e6) / 1000);
    const inputs = AXES.map((part, axis) => ({ file: item.way.file, row, axis, part, unit: "mm", step: 50, value: point[axis] }));
    return { title, inputs };
  }

  #build(rows) {
    const { key } = this.#root.contains(document.activeElement) ? document.activeElement.dataset : {};
    this.#inputs = [];
    this.#root.replaceChildren(...rows.map((row) => this.#row(row)));
    // A field that becomes another kind keeps the focus.
    this.#inputs.find((input) => input.dataset.key === key)?.focus();
  }

  #row({ title, doc, inputs }) {
    const group = Object.assign(document.createElement("div"), { className: "field" });
    const name = Object.assign(document.createElement("span"), { className: "field-name", textContent: title, title: doc ?? "" });
    const boxes = inputs.map((input) => this.#box(title, input));
    group.append(name, ...boxes);
    const { unit } = inputs.at(-1);
    if (unit) group.append(Object.assign(document.createElement("span"), { className: "unit", textContent: unit }));
    return group;
  }

  #box(title, wanted) {
    const { part, unit } = wanted;
    const input = wanted.words ? this.#select(wanted) : this.#entry(wanted);
    input.setAttribute("aria-label", [title, part, unit].filter(Boolean).join(", "));
    input.dataset.key = wanted.path?.concat(wanted.as ?? []).join(" ") ?? `way ${wanted.row} ${wanted.axis}`;
    input.autocomplete = "off";
    this.#inputs.push(input);
    if (!part) return input;
    const label = Object.assign(document.createElement("label"), { className: "axis" });
    label.append(Object.assign(document.createElement("span"), { textContent: part }), input);
    return label;
  }

  #entry(wanted) {
    const input = document.createElement("input");
    const { step, text, limits } = wanted;
    Object.assign(input, text ? { type: "text", maxLength: 100 } : { type: "number", step: "any" });
    if (limits) [input.min, input.max] = limits;
    input.addEventListener("input", (event) => this.#typed(input, wanted, event));
    input.addEventListener("keydown", (event) => this.#key(input, wanted, step, event));
    for (const end of ["change", "blur"]) input.addEventListener(end, () => this.#left(input));
    return input;
  }

  #select({ path, words, otherwise }) {
    const select = document.createElement("select");
    select.append(...words.map((word) => new Option(word)));
    select.addEventListener("keydown", (event) => event.key === "Escape" && select.blur());
    select.addEventListener("change", () => {
      const to = select.value;
      this.#on.pick(() => {
        const [kind, index] = path;
        const stands = itemOf(this.#scene, { kind, index })?.person;
        if (to === NUMBER) return stands ? { does: "set", path, to: stands[path.at(-1)] } : null;
        if (to !== otherwise) return { does: "set", path, to };
        // The default needs no key.
        return select.dataset.now === "" ? null : { does: "unset", path };
      });
    });
    return select;
  }

  #typed(input, wanted, { timeStamp }) {
    input.dataset.typing = "true";
    if (input.validity.badInput) return;
    const edit = this.#edit(input, wanted);
    if (edit !== null) this.#on.change([edit], timeStamp);
  }

  #edit(input, { path, file, row, axis, text, as }) {
    const number = input.valueAsNumber;
    if (file !== undefined) {
      if (!Number.isFinite(number)) return null;
      const { points_m: points } = itemOf(this.#scene, this.#chosen).way;
      const to = points[row].map((meters, index) => (index === axis ? number : Math.round(meters * 1e6) / 1000));
      return { does: "move-way-point", file, row, to_mm: to };
    }
    if (input.value === "") return text || as || typeof path.at(-1) === "number" ? null : { does: "unset", path };
    return { does: "set", path, to: text ? input.value : number };
  }

  /** Arrow keys step by an amount that suits the quantity; Escape and Enter leave the field. */
  #key(input, wanted, step, event) {
    const by = { ArrowUp: 1, ArrowDown: -1 }[event.key];
    if (by !== undefined && !wanted.text) {
      const from = Number.isFinite(input.valueAsNumber) ? input.valueAsNumber : Number(input.placeholder) || 0;
      const to = Math.round((from + by * step * (event.shiftKey ? 10 : 1)) * 1000) / 1000;
      input.value = Math.min(Math.max(to, wanted.limits?.[0] ?? to), wanted.limits?.[1] ?? to);
      this.#typed(input, wanted, event);
      event.preventDefault();
    }
    if (event.key === "Escape" || event.key === "Enter") input.blur();
  }

  #left(input) {
    if (input.dataset.typing !== "true") return;
    input.dataset.typing = "false";
    this.#on.finish();
    input.value = input.dataset.now;
    input.setAttribute("aria-invalid", "false");
  }
}
