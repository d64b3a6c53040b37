// A recording's frames as the collector sends them (src/http/recordings/frames.rs), on one shared clock.

import { Track } from "./track.js";

const MAGIC = "GEF1";
const NS = 1e9;
/** In place of a thermistor that is not known. */
const NO_THERMISTOR = -32768;

/**
 * The frames of a recording by sensor; of a file, if there is one. `byStamps` takes the times of frames from their stamps even
 * if their clock was never set: what comes from a file arrived at another time. Throws an error that a person can read.
 */
export async function recordedAt(path, file, byStamps) {
  const response = await fetch(path, file === null ? {} : { method: "POST", body: file }).catch(() => {
    throw new Error("The collector cannot be reached. Check that it runs, and open the recording again.");
  });
  if (!response.ok) throw new Error(await refusalOf(response));
  const bytes = await response.arrayBuffer().catch(() => {
    throw new Error("The recording arrived incomplete. Open it again.");
  });
  return recordedOf(bytes, byStamps);
}

async function refusalOf(response) {
  const { error } = await response.json().catch(() => ({ error: { message: `the collector answered ${response.status}` } }));
  return error.hint ? `${error.message}. Hint: ${error.hint}` : error.message;
}

/** Tracks ordered by device and sensor, and the time of the first frame. */
function recordedOf(bytes, byStamps) {
  const { head, rowsAt } = headOf(bytes);
  const rows = new Rows(bytes, rowsAt, head);
  const streams = streamsOf(rows, head);
  if (streams.length === 0) return { tracks: [], began_ms: null, length: 0 };
  setClocks(rows, streams, byStamps);
  const began = Math.min(...streams.map((stream) => stream.timeOf(stream.first)));
  const bySensor = Map.groupBy(streams, ({ device, sensor }) => `${device}/${sensor}`);
  const tracks = [...bySensor].map(([key, parts]) => new Track(key, rows, parts, began));
  tracks.sort((one, other) => (one.key < other.key ? -1 : 1));
  const length = Math.max(0, ...tracks.map((track) => track.end));
  return { tracks, began_ms: began * 1000, length };
}

function headOf(bytes) {
  const text = (from, to) => new TextDecoder().decode(bytes.slice(from, to));
  if (text(0, 4) !== MAGIC) throw new Error("The collector sent a format that this page does not know. Reload the page.");
  const rowsAt = 8 + new DataView(bytes).getUint32(4, true);
  const head = JSON.parse(text(8, rowsAt));
  if (bytes.byteLength !== rowsAt + head.rows * head.row_bytes) throw new Error("The recording arrived incomplete. Open it again.");
  return { head, rowsAt };
}

/** The rows, read in place. */
class Rows {
  #view;
  #words;
  #at;
  #head;

  constructor(bytes, at, head) {
    this.#view = new DataView(bytes);
    this.#words = new Int16Array(bytes);
    this.#at = at;
    this.#head = head;
  }

  get count() {
    return this.#head.rows;
  }

  seq(row) {
    return Number(this.#view.getBigUint64(this.#place(row), true));
  }

  bootTime(row) {
    return Number(this.#view.getBigUint64(this.#place(row) + 8, true)) / NS;
  }

  wallTime(row) {
    return Number(this.#view.getBigInt64(this.#place(row) + 16, true)) / NS;
  }

  arrival(row) {
    return Number(this.#view.getBigInt64(this.#place(row) + 24, true)) / NS;
  }

  stream(row) {
    return this.#view.getUint16(this.#place(row) + 32, true);
  }

  /** The reason for a missing frame, or null. */
  missing(row) {
    const kind = this.#view.getUint8(this.#place(row) + 34);
    return kind === 0 ? null : this.#head.reasons[kind - 1];
  }

  clock(row) {
    return this.#head.clocks[this.#view.getUint8(this.#place(row) + 35)];
  }

  thermistor(row) {
    const steps = this.#view.getInt16(this.#place(row) + 36, true);
    return steps === NO_THERMISTOR ? null : steps * this.#head.thermistor_step_celsius;
  }

  /** Minimum, mean and maximum temperature of a frame. */
  summary(row) {
    const from = (this.#place(row) + 40) / 2;
    let [min, max, sum] = [Infinity, -Infinity, 0];
    for (let at = from; at < from + 64; at += 1) {
      const word = this.#words[at];
      if (word < min) min = word;
      if (word > max) max = word;
      sum += word;
    }
    const step = this.#head.pixel_step_celsius;
    return [min * step, (sum / 64) * step, max * step];
  }

  /** The frame as `Picture` takes it. */
  frame(row) {
    const from = (this.#place(row) + 40) / 2;
    const step = this.#head.pixel_step_celsius;
    return {
      seq: this.seq(row),
      t_boot_ns: this.bootTime(row) * NS,
      thermistor_celsius: this.thermistor(row),
      pixels_celsius: Array.from(this.#words.subarray(from, from + 64), (word) => word * step),
    };
  }

  /** The row as agents send it. */
  sent(row) {
    const missing = this.missing(row);
    const from = (this.#place(row) + 40) / 2;
    const steps = this.#view.getInt16(this.#place(row) + 36, true);
    // Pixels are two's complement of 12 bits, the thermistor sign and magnitude.
    const pixels = Array.from(this.#words.subarray(from, from + 64), (word) => word & 0xfff);
    const thermistor = steps === NO_THERMISTOR ? {} : { thermistor_raw: steps < 0 ? 0x800 | -steps : steps };
    const ns = (seconds) => Math.round(seconds * NS);
    return {
      seq: this.seq(row), t_boot_ns: ns(this.bootTime(row)), t_utc_ns: ns(this.wallTime(row)), clock: this.clock(row),
      ...(missing === null ? { pixels_raw: pixels, ...thermistor } : { missing }),
    };
  }

  #place(row) {
    return this.#at + row * this.#head.row_bytes;
  }
}

/** Each stream with its first row and the row after its last one. */
function streamsOf(rows, head) {
  const streams = [];
  for (let row = 0; row < rows.count; row += 1) {
    const index = rows.stream(row);
    if (streams.at(-1)?.index !== index) streams.push({ ...head.streams[index], index, first: row, end: row });
    streams.at(-1).end = row + 1;
  }
  return streams;
}

/**
 * Sets the start of each boot's clock: from the wall clock if it was synced, else from the frame with the shortest delay,
 * because a Raspberry Pi without network does not know the time.
 */
function setClocks(rows, streams, byStamps) {
  for (const run of Map.groupBy(streams, ({ device, boot }) => `${device}/${boot}`).values()) {
    let [set, heard] = [null, Infinity];
    for (const { first, end } of run) {
      for (let row = first; row < end; row += 1) {
        const boot = rows.bootTime(row);
        if (rows.clock(row) === "synced") set = rows.wallTime(row) - boot;
        heard = Math.min(heard, rows.arrival(row) - boot);
      }
    }
    const [{ first }] = run;
    const began = set ?? (byStamps ? rows.wallTime(first) - rows.bootTime(first) : heard);
    for (const stream of run) stream.timeOf = (row) => began + rows.bootTime(row);
  }
}
