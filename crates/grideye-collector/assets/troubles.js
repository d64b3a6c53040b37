// The state of a stream, in sentences.

import { byKind, count } from "./words.js";

export function troublesOf(status) {
  const texts = [];
  if (status.never_came > 0) {
    const last = status.gaps.at(-1);
    const where = last ? ` Latest gap: ${last.from === last.to ? `#${last.from}` : `#${last.from} to #${last.to}`}.` : "";
    texts.push(`${count(status.never_came, "frame has", "frames have")} not arrived.${where}`);
  }
  if (status.missing > 0) {
    texts.push(`${count(status.missing, "frame", "frames")} could not be read and ${status.missing === 1 ? "is" : "are"} recorded as missing.`);
  }
  const errors = byKind(status.errors ?? {});
  if (errors) texts.push(`Bus errors: ${errors}.`);
  const dropped = byKind(status.dropped ?? {});
  if (dropped) texts.push(`Dropped by the agent: ${dropped}.`);
  if (status.spooled > 0) texts.push(`${count(status.spooled, "frame waits", "frames wait")} in the agent's spool.`);
  if (status.unaccounted > 0) texts.push(`${count(status.unaccounted, "frame is", "frames are")} unaccounted for: read, but neither stored, dropped nor spooled.`);
  return texts;
}
