// Real − simulated: colors that need no color vision, and a scale around 0.

import { ofStops } from "./palettes.js";

// Dark where the simulation is warmer, light where the sensor is warmer, gray where both are equal. As in cividis (Nuñez,
// Anderton, Renslow 2018), lightness runs one way, and blue and yellow differ for every kind of color vision.
const STOPS = [
  [0.0, [0, 28, 92]], [0.25, [62, 82, 128]], [0.5, [139, 138, 134]], [0.75, [204, 184, 92]], [1.0, [255, 238, 96]],
];
const COLORS = ofStops(STOPS);
// A narrower scale would show noise as a difference.
const END_MIN_CELSIUS = 2;

/** How differences are drawn: always with numbers, which show the sign. */
export const DIFFERENCES = { colors: COLORS, numbers: true, text: signed };

/** Whole degrees to either side of 0 that hold all of these. */
export function rangeAround(differences) {
  const greatest = Math.max(...differences.map(Math.abs));
  const end = Math.max(END_MIN_CELSIUS, Math.ceil(greatest));
  return { low: -end, high: end };
}

/** With its sign, unless it is 0 by rounding. */
export function signed(celsius, decimals) {
  const text = Math.abs(celsius).toFixed(decimals);
  if (Number(text) === 0) return text;
  return `${celsius < 0 ? "−" : "+"}${text}`;
}

/** A sentence that sums up 64 differences. */
export function summed(differences) {
  const mean = differences.reduce((sum, value) => sum + value, 0) / differences.length;
  const rms = Math.sqrt(differences.reduce((sum, value) => sum + value * value, 0) / differences.length);
  const largest = differences.reduce((most, value, pixel) => (Math.abs(value) > Math.abs(differences[most]) ? pixel : most), 0);
  return `Real − simulated: mean ${signed(mean, 2)} °C, root mean square ${rms.toFixed(2)} °C, largest ${signed(differences[largest], 2)} °C at pixel ${largest + 1}.`;
}
