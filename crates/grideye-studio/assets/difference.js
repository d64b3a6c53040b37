// Real − simulated: colors that need no color vision, and a scale around 0.

import { ofStops } from "./palettes.js";

// As in reports (grideye-draw's palette): blue where the simulation is warmer, red where the sensor is, lightest where both are
// equal. Blue and red differ for every kind of color vision.
const STOPS = [[0, [33, 102, 172]], [0.5, [247, 247, 247]], [1, [178, 24, 43]]];
const COLORS = ofStops(STOPS);
// A narrower scale would show noise as a difference.
const END_MIN_CELSIUS = 2;

/** How differences are drawn: always with numbers, which show the sign. */
export const DIFFERENCES = { colors: COLORS, numbers: true, text: signed };

/** Whole degrees to either side of 0 that hold a range of differences. */
export function rangeAround({ low, high }) {
  const end = Math.max(END_MIN_CELSIUS, -low, high);
  return { low: -end, high: end };
}

/** With its sign, unless it is 0 by rounding. */
export function signed(celsius, decimals) {
  const text = Math.abs(celsius).toFixed(decimals);
  if (Number(text) === 0) return text;
  return `${celsius < 0 ? "−" : "+"}${text}`;
}

/** A sentence that sums up 64 differences of what is called `real`. */
export function summed(real, differences) {
  const mean = differences.reduce((sum, value) => sum + value, 0) / differences.length;
  const rms = Math.sqrt(differences.reduce((sum, value) => sum + value * value, 0) / differences.length);
  const largest = differences.reduce((most, value, pixel) => (Math.abs(value) > Math.abs(differences[most]) ? pixel : most), 0);
  return `${real} − simulated: mean ${signed(mean, 2)} °C, root mean square ${rms.toFixed(2)} °C, largest ${signed(differences[largest], 2)} °C at pixel ${largest + 1}.`;
}
