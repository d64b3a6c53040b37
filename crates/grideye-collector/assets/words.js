// Numbers as people read them.

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

/** "nack 3, bus-timeout 1", the most frequent first. */
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

/** Sets a text only when it differs, so that nothing is redrawn or read aloud without need. */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}
