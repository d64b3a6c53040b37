// The scale of an image: which temperatures its colors mean.

// An empty room spans about this much. A smaller span would show noise as heat.
const SPAN_MIN_CELSIUS = 4;
// Five seconds of frames, and by how much a frame may leave the range before it grows.
const RECENT = 50;
const SPARE_CELSIUS = 0.5;
const STEPS = [0.25, 0.5, 1, 2, 5, 10, 20, 50];

/** Whole degrees from some temperatures on, so that noise does not move the scale, and sensors of one room begin alike. */
export function rangeOf(least, most) {
  const low = Math.floor(least);
  return { low, high: Math.max(low + SPAN_MIN_CELSIUS, Math.ceil(most)) };
}

/**
 * The range of one sensor's frames that follow each other: it grows at once, and shrinks when all recent frames fit into less.
 * Each range has some room to spare, the first one too, so that noise around a whole degree does not move it, nor decides
 * where it begins.
 */
export class Steady {
  #range = null;
  #recent = [];

  fit(celsius) {
    this.#recent.push(boundsOf(celsius));
    if (this.#recent.length > RECENT) this.#recent.shift();
    const [least, most] = this.#recent.at(-1);
    const { low, high } = this.#range ?? { low: Infinity, high: -Infinity };
    const around = rangeOf(Math.min(...this.#recent.map(([one]) => one)) - SPARE_CELSIUS, Math.max(...this.#recent.map(([, one]) => one)) + SPARE_CELSIUS);
    const grows = least < low - SPARE_CELSIUS || most > high + SPARE_CELSIUS;
    const shrinks = this.#recent.length === RECENT && around.high - around.low < high - low;
    if (grows || shrinks) this.#range = around;
    return this.#range;
  }
}

/** What all but the coldest twentieth is above, and the warmest: people are few pixels, and a single cold one is noise. */
function boundsOf(celsius) {
  const sorted = [...celsius].sort((one, other) => one - other);
  return [sorted[Math.floor(sorted.length / 20)], sorted.at(-1)];
}

/** The range that holds all of these. */
export function around(ranges) {
  return { low: Math.min(...ranges.map(({ low }) => low)), high: Math.max(...ranges.map(({ high }) => high)) };
}

/** Which of 256 colors a temperature has; beyond the range, the color of its end. */
export function shadeOf(celsius, { low, high }) {
  return Math.round(Math.min(1, Math.max(0, (celsius - low) / (high - low))) * 255);
}

/** Paints a palette into a canvas one pixel wide, hot end up. */
export function paintBar(canvas, colors) {
  const context = canvas.getContext("2d");
  const image = context.createImageData(1, 256);
  for (let row = 0; row < 256; row += 1) paintPixel(image.data, row, colors, 255 - row);
  context.putImageData(image, 0, 0);
}

/** The palette's color of a temperature, as CSS writes it. */
export function cssOf(colors, celsius, range) {
  const shade = shadeOf(celsius, range) * 3;
  return `rgb(${colors.subarray(shade, shade + 3).join(" ")})`;
}

/** Gives one pixel of an image the palette's color of that shade. */
export function paintPixel(data, pixel, colors, shade) {
  data.set(colors.subarray(shade * 3, shade * 3 + 3), pixel * 4);
  data[pixel * 4 + 3] = 255;
}

/** Writes the ticks of a range beside its bar, at most `steps_max` steps apart; unchanged ticks stay. */
export function labelTicks(list, range, number = String, steps_max = 6) {
  const ticks = ticksOf(range, steps_max);
  const labels = ticks.map((tick) => `${number(tick)} °C`);
  if (list.dataset.labels === labels.join()) return;
  list.dataset.labels = labels.join();
  list.replaceChildren(
    ...labels.map((label, index) => {
      const item = document.createElement("li");
      item.textContent = label;
      item.style.top = `${((range.high - ticks[index]) / (range.high - range.low)) * 100}%`;
      return item;
    }),
  );
}

/** Both ends and round numbers between them, hot end first. */
function ticksOf({ low, high }, steps_max) {
  const span = high - low;
  const step = STEPS.find((width) => span / width <= steps_max) ?? span;
  const ticks = [high];
  for (let tick = Math.floor(high / step) * step; tick > low; tick -= step) {
    // Closer to an end, the two labels would meet.
    if (high - tick >= 0.75 * step && tick - low >= 0.75 * step) ticks.push(tick);
  }
  ticks.push(low);
  return ticks;
}
