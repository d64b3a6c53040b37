// Numbers and times for people.

/** How a pixel is read, by mouse and keys or by touch. */
export const HOW_TO_READ = matchMedia("(pointer: coarse)").matches ? "Touch a pixel to read it." : "Point at a pixel or use the arrow keys to read it.";

export function degrees(celsius) {
  return Number.isFinite(celsius) ? `${celsius.toFixed(2)} °C` : "–";
}

/** A length of time, coarser the longer it is. */
export function duration(seconds) {
  if (!Number.isFinite(seconds)) return "–";
  if (seconds < 9.95) return `${seconds.toFixed(1)} s`;
  if (seconds < 99.5) return `${Math.round(seconds)} s`;
  if (seconds < 90 * 60) return `${Math.round(seconds / 60)} min`;
  if (seconds < 36 * 3600) return `${Math.round(seconds / 3600)} h`;
  return `${Math.round(seconds / 86400)} days`;
}

export function count(number, one, many) {
  return `${number.toLocaleString("en")} ${number === 1 ? one : many}`;
}

/** "nack 3, bus-timeout 1", most frequent first. */
export function byKind(counts) {
  return Object.entries(counts)
    .filter(([, number]) => number > 0)
    .sort((a, b) => b[1] - a[1])
    .map(([kind, number]) => `${kind} ${number.toLocaleString("en")}`)
    .join(", ");
}

/** The elements of a template's copy, by their data-field. */
export function fieldsOf(root) {
  const fields = {};
  for (const element of root.querySelectorAll("[data-field]")) fields[element.dataset.field] = element;
  return fields;
}

/** Sets a text only when it differs, so that nothing is redrawn or read aloud again. */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** The same with what stands between backticks as code. */
export function sayMarked(element, text) {
  if (element.dataset.said === text) return;
  element.dataset.said = text;
  const pieces = text.split("`").map((piece, index) => (index % 2 === 0 ? piece : Object.assign(document.createElement("code"), { textContent: piece })));
  element.replaceChildren(...pieces);
}

const DAY_AND_TIME = new Intl.DateTimeFormat(undefined, { dateStyle: "medium", timeStyle: "medium" });
const DAY_AND_MINUTE = new Intl.DateTimeFormat(undefined, { dateStyle: "medium", timeStyle: "short" });
const TIME_OF_DAY = new Intl.DateTimeFormat(undefined, {
  hour: "numeric", minute: "2-digit", second: "2-digit", fractionalSecondDigits: 1,
});

/** Date and time to the second, from milliseconds since 1970, in the browser's locale. */
export function moment(milliseconds) {
  return DAY_AND_TIME.format(milliseconds);
}

/** Time of day to a tenth of a second. */
export function timeOfDay(milliseconds) {
  return TIME_OF_DAY.format(milliseconds);
}

/** Date and time to the minute. */
export function minute(milliseconds) {
  return DAY_AND_MINUTE.format(milliseconds);
}

/** A time in a recording, to a tenth of a second: 1:02:03.4. */
export function place(seconds) {
  const tenths = Math.max(0, Math.floor(seconds * 10 + 1e-6));
  const [whole, tenth] = [Math.floor(tenths / 10), tenths % 10];
  const [hours, minutes, rest] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  const two = (number) => String(number).padStart(2, "0");
  return `${hours > 0 ? `${hours}:${two(minutes)}` : minutes}:${two(rest)}.${tenth}`;
}
