// The simulated frames of a scene, fetched in pieces of a few seconds and aligned with the sensor's clock.

const PIECES_MAX = 24;
// The next piece is fetched this long before it is needed.
const AHEAD_S = 3;
const RETRY_MS = 2_000;
const ROOM_STEP_S = 0.1;
const ROOMS_MAX = 600;

export class Simulation {
  #path;
  #told;
  #pieces = new Map();
  #asked = new Set();
  #edition = null;

  /** `told` is called with `null` when frames arrive, else with the error. */
  constructor(scene, sensor, told) {
    this.#path = `/v1/scenes/${encodeURIComponent(scene)}/sensors/${encodeURIComponent(sensor)}/frames`;
    this.#told = told;
  }

  /** The frame nearest to a second of the scene, and the agents' places; null until it arrives. */
  at(second) {
    for (const [first, piece] of this.#pieces) {
      const index = Math.round(second / piece.step_s) - first;
      if (index < 0 || index >= piece.frames.length) continue;
      if (second + AHEAD_S < piece.seconds) this.#ask(second + AHEAD_S);
      return {
        celsius: piece.frames[index],
        agents: piece.agents.map(({ name, at_m: places, front_deg: fronts }) => ({ name, place: places[index], front: fronts[index] })),
      };
    }
    this.#ask(second);
    return null;
  }

  async #ask(second) {
    const holds = ([first, piece]) => second / piece.step_s >= first - 0.5 && second / piece.step_s < first + piece.frames.length - 0.5;
    const key = Math.floor(second);
    if (this.#asked.has(key) || [...this.#pieces].some(holds)) return;
    this.#asked.add(key);
    const answer = await fetched(`${this.#path}?at_s=${second.toFixed(3)}`);
    if (answer.error) {
      this.#told(answer.error);
      setTimeout(() => this.#asked.delete(key), RETRY_MS);
      return;
    }
    this.#asked.delete(key);
    // The scene changed, so older pieces are wrong.
    if (this.#edition !== answer.edition) this.#pieces.clear();
    this.#edition = answer.edition;
    this.#pieces.set(answer.first, answer);
    if (this.#pieces.size > PIECES_MAX) this.#pieces.delete(this.#pieces.keys().next().value);
    this.#told(null);
  }
}

/** The room of a scene at each of its seconds, fetched once each. */
export class Rooms {
  #path;
  #told;
  #step;
  #rooms = new Map();
  #asking = false;

  /** `told` is called with `null` when a room arrives, else with the error. A scene that does not move has one room. */
  constructor({ name, moves }, told) {
    this.#path = `/v1/scenes/${encodeURIComponent(name)}/room`;
    this.#told = told;
    this.#step = moves ? ROOM_STEP_S : Infinity;
  }

  /** The room at a second; null until it arrives. */
  at(second) {
    const step = Number.isFinite(this.#step) ? Math.round(second / this.#step) : 0;
    if (!this.#rooms.has(step)) this.#ask(step);
    return this.#rooms.get(step) ?? null;
  }

  async #ask(step) {
    if (this.#asking) return;
    this.#asking = true;
    const answer = await fetched(`${this.#path}?at_s=${step === 0 ? 0 : step * this.#step}`);
    if (answer.error) {
      setTimeout(() => { this.#asking = false; }, RETRY_MS);
    } else {
      // Before `told`, which asks for the room of a moment that came meanwhile.
      this.#asking = false;
      this.#rooms.set(step, answer);
    }
    if (this.#rooms.size > ROOMS_MAX) this.#rooms.delete(this.#rooms.keys().next().value);
    this.#told(answer.error ?? null);
  }
}

/** The scene's state at a time of the device's boot clock: `unset`, `before`, `within` or `ended`, and its second. */
export function momentOf(laid, tBootNs) {
  if (!laid.moves) return { state: "within", second: 0, originNs: null };
  if (laid.originNs === null) return { state: "unset", second: 0, originNs: null };
  const since = (tBootNs - laid.originNs) / 1e9;
  if (since < 0) return { state: "before", second: 0, until: -since, originNs: laid.originNs };
  if (since <= laid.seconds) return { state: "within", second: since, originNs: laid.originNs };
  if (!laid.again) return { state: "ended", second: laid.seconds, since: since - laid.seconds, originNs: laid.originNs };
  const turns = Math.floor(since / laid.seconds);
  return { state: "within", second: since - turns * laid.seconds, turn: turns + 1, originNs: laid.originNs + turns * laid.seconds * 1e9 };
}

/** The JSON at a path. A failure is in `error`. */
export async function fetched(path, options = {}) {
  try {
    const response = await fetch(path, options);
    return await response.json();
  } catch {
    return { error: { message: "the collector cannot be reached", hint: "check that it runs" } };
  }
}
