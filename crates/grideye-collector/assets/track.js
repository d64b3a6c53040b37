// One sensor during a recording: its frames in order of time, and the gaps between them.

const FRAME = 0;
const MISSING = 1;
const GAP = 2;
const END = 3;
// A longer pause is a gap even without a gap in the numbers; three periods of a slow sensor, if longer. As on the live page.
const STALE_S_MIN = 3;
// The period is measured over at most this many frames, from the start.
const PERIODS_MAX = 2_000;
// A time this shortly before a frame belongs to the frame, because sums of seconds are inexact.
const SAME_S = 1e-4;

export class Track {
  #rows;
  #moments = [];
  #times;
  #runs;

  /** `parts` are the sensor's boots, `began` the recording's start on the shared clock. */
  constructor(key, rows, parts, began) {
    this.key = key;
    this.device = parts[0].device;
    this.sensor = parts[0].sensor;
    this.#rows = rows;
    for (const part of parts.toSorted((one, other) => one.timeOf(one.first) - other.timeOf(other.first))) this.#add(part, began);
    this.#moments.sort((one, other) => one.at - other.at);
    this.#moments = joined(this.#moments);
    const rowsOnly = this.#moments.filter(({ kind }) => kind === FRAME || kind === MISSING);
    this.#runs = Map.groupBy(rowsOnly.map(({ at, row, boot }) => ({ at, boot, row, seq: rows.seq(row) })), ({ boot }) => boot);
    this.#times = Float64Array.from(this.#moments, ({ at }) => at);
    this.lows = new Float32Array(this.#moments.length);
    this.means = new Float32Array(this.#moments.length);
    this.highs = new Float32Array(this.#moments.length);
    this.#moments.forEach(({ kind, row }, index) => {
      if (kind === FRAME) [this.lows[index], this.means[index], this.highs[index]] = rows.summary(row);
    });
  }

  /** Seconds of the last frame, read or missing. */
  get end() {
    return this.#times.at(-2);
  }

  get times() {
    return this.#times;
  }

  /** The boots of its frames, in order of time. */
  get boots() {
    return [...this.#runs.keys()];
  }

  /** When a boot's first frame here was measured, by its boot clock, ns. */
  began_ns(boot) {
    return 1e9 * this.#rows.bootTime(this.#runs.get(boot)[0].row);
  }

  isFrame(index) {
    return this.#moments[index].kind === FRAME;
  }

  isEnd(index) {
    return this.#moments[index].kind === END;
  }

  /** The moment that holds at a time; -1 before the first. */
  indexAt(seconds) {
    let [low, high] = [0, this.#times.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.#times[middle] <= seconds + SAME_S) low = middle + 1;
      else high = middle;
    }
    return low - 1;
  }

  /** The frame of a moment with its time and clock, or why there is none. */
  at(index) {
    if (index < 0) return { why: "The first frame comes later." };
    const { kind, row, why, boot } = this.#moments[index];
    if (kind === GAP || kind === END) return { why };
    if (kind === MISSING) return { why: `Gap: #${this.#rows.seq(row)} could not be read (${this.#rows.missing(row)}).` };
    return { frame: this.#rows.frame(row), clock: this.#rows.clock(row), boot, seconds: this.#times[index] };
  }

  /** Seconds of the moment `by` steps away; null beyond the ends. */
  step(seconds, by) {
    const index = this.indexAt(seconds) + by;
    return index < 0 || index >= this.#times.length || this.isEnd(index) ? null : this.#times[index];
  }

  /** The frames of a boot in the `seconds` until a time of its clock, as agents send them. */
  sent(boot, until_ns, seconds) {
    const [from, until] = [until_ns / 1e9 - seconds - SAME_S, until_ns / 1e9 + SAME_S];
    const isMeant = ({ kind, row, boot: of }) => kind <= MISSING && of === boot && this.#rows.bootTime(row) >= from && this.#rows.bootTime(row) <= until;
    const frames = this.#moments.filter(isMeant).map(({ row }) => this.#rows.sent(row));
    return { device: this.device, boot, sensors: [{ sensor: this.sensor, frames }] };
  }

  /** Seconds of the next gap; null if there is none. */
  gapAfter(seconds) {
    const from = this.indexAt(seconds) + 1;
    const index = this.#moments.findIndex(({ kind }, index) => index >= from && (kind === GAP || kind === MISSING));
    return index < 0 ? null : this.#times[index];
  }

  /** The frames that hold from `from` to `to`, as one range of numbers per boot. */
  spansBetween(from, to) {
    const spans = new Map();
    const last = this.indexAt(to);
    for (let index = Math.max(0, this.indexAt(from)); index <= last; index += 1) {
      const { kind, row, boot } = this.#moments[index];
      if (kind === GAP || kind === END) continue;
      const seq = this.#rows.seq(row);
      const span = spans.get(boot) ?? { device: this.device, sensor: this.sensor, boot, first_seq: seq, last_seq: seq };
      spans.set(boot, { ...span, first_seq: Math.min(span.first_seq, seq), last_seq: Math.max(span.last_seq, seq) });
    }
    return [...spans.values()];
  }

  /** Seconds of the first and last frame of such a range; null if it has none here. */
  placesOf({ boot, first_seq, last_seq }) {
    const run = this.#runs.get(boot) ?? [];
    const after = run.findLastIndex(({ seq }) => seq <= last_seq);
    const from = run.findIndex(({ seq }) => seq >= first_seq);
    return from < 0 || after < from ? null : [run[from].at, run[after].at];
  }

  /** Seconds of the frame with that number; null if there is none. */
  secondsOf(seq) {
    const found = this.#moments.findIndex(({ kind, row }) => kind !== GAP && kind !== END && this.#rows.seq(row) === seq);
    return found < 0 ? null : this.#times[found];
  }

  #add(part, began) {
    const rows = this.#rows;
    const time = (row) => part.timeOf(row) - began;
    const period = periodOf(rows, part);
    for (let row = part.first; row < part.end; row += 1) {
      const at = time(row);
      const kind = rows.missing(row) === null ? FRAME : MISSING;
      this.#moments.push({ at, kind, row, boot: part.boot });
      const [until, next] = row + 1 < part.end ? [time(row + 1), rows.seq(row + 1)] : [Infinity, null];
      const gap = next === null ? endOf(at, period, part.boot) : gapBetween(at, until, rows.seq(row) + 1, next, period);
      if (gap !== null) this.#moments.push(gap);
    }
  }
}

function endOf(at, period, boot) {
  return { at: at + period, kind: END, boot, why: "No more frames of this sensor." };
}

/** Only the last boot's end is an end; the others are gaps. */
function joined(moments) {
  const last = moments.length - 1;
  const kept = moments.filter(({ kind, boot }, index) => kind !== END || index === last || moments[index - 1].boot === boot);
  return kept.map((moment, index) =>
    moment.kind === END && index < kept.length - 1 ? { ...moment, kind: GAP, why: "Gap: the agent restarted." } : moment,
  );
}

/** The gap between two frames; null if they follow each other. */
function gapBetween(at, until, expected, next, period) {
  const pause = until - at;
  // A frame holds for one period.
  const after = at + Math.min(period, pause / 2);
  if (next > expected) {
    const numbers = next - expected === 1 ? `#${expected} is` : `#${expected} to #${next - 1} are`;
    return { at: after, kind: GAP, why: `Gap: ${numbers} not in this recording (${(until - after).toFixed(1)} s).` };
  }
  const stale = Math.max(STALE_S_MIN, 3 * period);
  return pause > stale ? { at: at + stale, kind: GAP, why: `Gap: no frame for ${pause.toFixed(1)} s.` } : null;
}

/** The median seconds between frames. */
function periodOf(rows, { first, end }) {
  const periods = [];
  for (let row = first + 1; row < end && periods.length < PERIODS_MAX; row += 1) {
    if (rows.seq(row) === rows.seq(row - 1) + 1) periods.push(rows.bootTime(row) - rows.bootTime(row - 1));
  }
  periods.sort((one, other) => one - other);
  // A single frame tells nothing: 0.1 s, the sensor's own period.
  return periods[Math.floor(periods.length / 2)] ?? 0.1;
}
