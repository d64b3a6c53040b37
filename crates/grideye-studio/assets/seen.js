// The simulated frame of every sensor of the edited scene.

import { HeatMap } from "./heatmap.js";
import { SIDE } from "./orientation.js";
import { cssOf, paintPixel, shadeOf } from "./scale.js";
import { degrees, say } from "./words.js";

const AMONG = "editor";

export class Seen {
  #place;
  #look;
  #shown = new Map();
  #on;

  /** `on.choose` gets the sensor that was clicked. */
  constructor(place, look, on) {
    this.#place = place;
    this.#look = look;
    this.#on = on;
    look.listen(() => this.#redraw());
  }

  /** Shows one frame per sensor; `stale` if they belong to an earlier state of the scene. */
  show(frames, chosen, stale) {
    const names = frames.map(({ sensor, columns, rows }) => `${sensor} ${columns} ${rows}`);
    if (names.join("\n") !== [...this.#shown.keys()].join("\n")) this.#build(frames, names);
    this.#place.dataset.stale = stale;
    frames.forEach((frame, index) => {
      const shown = this.#shown.get(names[index]);
      shown.frame = frame;
      shown.figure.dataset.chosen = frame.sensor === chosen;
    });
    this.#paint();
  }

  /** The colors of every frame, in the scene's order; null of one that is not shown. */
  get colors() {
    const { colors } = this.#look.drawing;
    return [...this.#shown.values()].map(({ frame: { sensor, celsius } }) => {
      if (celsius === null) return null;
      const range = this.#look.rangeFor(sensor, celsius, AMONG);
      return celsius.map((degree) => cssOf(colors, degree, range));
    });
  }

  #build(frames, names) {
    this.#look.forget(AMONG);
    this.#shown = new Map(frames.map((frame, index) => [names[index], this.#figure(frame)]));
    this.#place.replaceChildren(...[...this.#shown.values()].map(({ figure }) => figure));
    this.#redraw();
  }

  /** Draws every frame again. */
  #redraw() {
    for (const shown of this.#shown.values()) {
      shown.heat?.look(this.#look.drawing);
      shown.bar.style.background = `linear-gradient(to right, ${stopsOf(this.#look.drawing.colors)})`;
      shown.drawn = "";
    }
    this.#paint();
  }

  #figure({ sensor, columns, rows }) {
    const [figure, caption, box, canvas, reading] = ["figure", "figcaption", "div", "canvas", "p"].map((name) => document.createElement(name));
    const button = Object.assign(document.createElement("button"), { type: "button", className: "link", textContent: sensor });
    button.addEventListener("click", () => this.#on.choose(sensor));
    const range = document.createElement("span");
    caption.append(button, range);
    box.className = "frame";
    canvas.className = "heat";
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "application");
    canvas.setAttribute("aria-label", `Simulated frame of ${sensor}; arrow keys read its pixels`);
    reading.className = "reading";
    const [scale, low, bar, high] = ["p", "span", "i", "span"].map((name) => document.createElement(name));
    scale.className = "band";
    scale.append(low, bar, high);
    box.append(canvas);
    figure.append(caption, box, scale, reading);
    figure.dataset.sensor = sensor;
    const shown = { figure, range, canvas, reading, low, bar, high, frame: null, heat: null, drawn: "" };
    if (columns === SIDE && rows === SIDE) shown.heat = new HeatMap(canvas, { cell: () => read(shown) });
    else box.style.aspectRatio = `${columns} / ${rows}`;
    return shown;
  }

  #paint() {
    for (const shown of this.#shown.values()) {
      if (shown.frame === null) continue;
      const { celsius, sensor } = shown.frame;
      const now = celsius?.join(" ") ?? "";
      if (celsius === null) {
        say(shown.range, "too many pixels to show here");
        continue;
      }
      const range = this.#look.rangeFor(sensor, celsius, AMONG);
      const drawn = `${range.low} ${range.high} ${now}`;
      if (shown.drawn === drawn) continue;
      shown.drawn = drawn;
      say(shown.low, `${range.low} °C`);
      say(shown.high, `${range.high} °C`);
      say(shown.range, `${Math.min(...celsius).toFixed(1)} to ${Math.max(...celsius).toFixed(1)} °C`);
      if (shown.heat) {
        shown.heat.show(celsius, range);
      } else {
        paint(shown.canvas, shown.frame, range, this.#look.drawing.colors);
      }
      read(shown);
      shown.figure.dataset.celsius = now;
    }
  }
}

/** A palette for a gradient, cold end first. */
function stopsOf(colors) {
  const shades = [0, 51, 102, 153, 204, 255];
  return shades.map((shade) => `rgb(${colors.subarray(3 * shade, 3 * shade + 3).join(" ")})`).join(", ");
}

function read({ heat, reading, frame }) {
  const cell = heat?.cell ?? null;
  say(reading, cell === null ? "" : `Pixel ${cell + 1}: ${degrees(frame.celsius[cell])}`);
}

/** A frame of another size than 8 x 8, one dot per pixel, scaled up by the page. */
function paint(canvas, { columns, rows, celsius }, range, colors) {
  if (canvas.width !== columns || canvas.height !== rows) Object.assign(canvas, { width: columns, height: rows });
  const context = canvas.getContext("2d");
  const image = context.createImageData(columns, rows);
  celsius.forEach((degree, pixel) => paintPixel(image.data, pixel, colors, shadeOf(degree, range)));
  context.putImageData(image, 0, 0);
}
