// A recording's frames as the collector sends them (src/http/recordings/frames.rs), and the time that they share.

import { Track } from "./track.js";

const MAGIC = "GEF1";
const NS = 1e9;

/** The frames of a recording, by sensor; throws an error in a person's words. */
export async function recordedAt(path) {
  const response = await fetch(path).catch(() => {
    throw new Error("The collector cannot be reached: see that it is running, and open the recording again.");
  });
  if (!response.ok) throw new Error(await refusalOf(response));
  const bytes = await response.arrayBuffer().catch(() => {
    throw new Error("The recording did not come whole: open it again.");
  });
  return recordedOf(bytes);
}

async function refusalOf(response) {
  const { error } = await response.json().catch(() => ({ error: { message: `the collector answered ${response.status}` } }));
  return error.hint ? `${error.message}. Hint: ${error.hint}` : error.message;
}

/** Tracks ordered by device and sensor, and when the first frame of all was measured. */
function recordedOf(bytes) {
  const { head, rowsAt } = headOf(bytes);
  const rows = new Rows(bytes, rowsAt, head);
  const streams = streamsOf(rows, head);
  if (streams.length === 0) return { tracks: [], began_ms: null, length: 0 };
  setClocks(rows, streams);
  const began = Math.min(...streams.map((stream) => stream.timeOf(stream.first)));
  const bySensor = Map.groupBy(streams, ({ device, sensor }) => `${device}/${sensor}`);
  const tracks = [...bySensor].map(([key, parts]) => new Track(key, rows, parts, began));
  tracks.sort((one, other) => (one.key < other.key ? -1 : 1));
  const length = Math.max(0, ...tracks.map((track) => track.end));
  return { tracks, began_ms: began * 1000, length };
}

function headOf(bytes) {
  const text = (from, to) => new TextDecoder().decode(bytes.slice(from, to));
  if (text(0, 4) !== MAGIC) throw new Error("The collector sent the recording in a form that this page does not know: load the page again.");
  const rowsAt = 8 + new DataView(bytes).getUint32(4, true);
  const head = JSON.parse(text(8, rowsAt));
  if (bytes.byteLength !== rowsAt + head.rows * head.row_bytes) throw new Error("The recording did not come whole: open it again.");
  return { head, rowsAt };
}

/** The rows, where they lie. */
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

  /** Why there is no frame, or null where there is one. */
  missing(row) {
    const kind = this.#view.getUint8(this.#place(row) + 34);
    return kind === 0 ? null : this.#head.reasons[kind - 1];
  }

  clock(row) {
    return this.#head.clocks[this.#view.getUint8(this.#place(row) + 35)];
  }

  thermistor(row) {
    return this.#view.getInt16(this.#place(row) + 36, true) * this.#head.thermistor_step_celsius;
  }

  /** Least, mean and greatest temperature of a frame. */
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

  /** The frame as pictures take it. */
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

  #place(row) {
    return this.#at + row * this.#head.row_bytes;
  }
}

/** Each stream with its first row and the row behind its last one. */
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
 * Tells each run of a device when its clock began: by wall clock where that was set, and otherwise by the frame that was
 * the shortest on its way, because a Raspberry Pi without network does not know what time it is.
 */
function setClocks(rows, streams) {
  for (const run of Map.groupBy(streams, ({ device, boot }) => `${device}/${boot}`).values()) {
    let [set, heard] = [null, Infinity];
    for (const { first, end } of run) {
      for (let row = first; row < end; row += 1) {
        const boot = rows.bootTime(row);
        if (rows.clock(row) === "synced") set = rows.wallTime(row) - boot;
        heard = Math.min(heard, rows.arrival(row) - boot);
      }
    }
    const began = set ?? heard;
    for (const stream of run) stream.timeOf = (row) => began + rows.bootTime(row);
  }
}
