// What a sensor of a scene would see at each moment: fetched in pieces of some seconds, and laid over the sensor's clock.

const PIECES_MAX = 24;
// The next piece is asked for so long before it is needed.
const AHEAD_S = 3;
const RETRY_MS = 2_000;

export class Simulation {
  #path;
  #told;
  #pieces = new Map();
  #asked = new Set();
  #edition = null;

  /** `told` is called with `null` when frames came, else with what is wrong. */
  constructor(scene, sensor, told) {
    this.#path = `/v1/scenes/${encodeURIComponent(scene)}/sensors/${encodeURIComponent(sensor)}/frames`;
    this.#told = told;
  }

  /** The frame nearest to a second of the scene, with where its agents are; null while it is on its way. */
  at(second) {
    for (const [first, piece] of this.#pieces) {
      const index = Math.round(second / piece.step_s) - first;
      if (index < 0 || index >= piece.frames.length) continue;
      if (second + AHEAD_S < piece.seconds) this.#ask(second + AHEAD_S);
      return {
        celsius: piece.frames[index],
        agents: piece.agents.map(({ name, at_m: places }) => ({ name, place: places[index] })),
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
    // A scene that was changed meanwhile is another scene.
    if (this.#edition !== answer.edition) this.#pieces.clear();
    this.#edition = answer.edition;
    this.#pieces.set(answer.first, answer);
    if (this.#pieces.size > PIECES_MAX) this.#pieces.delete(this.#pieces.keys().next().value);
    this.#told(null);
  }
}

/** Where a scene is at a time of the device's boot clock: `unset`, `before`, `within` or `ended`, and the second. */
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

/** The JSON at a path; what went wrong is in `error`. */
export async function fetched(path) {
  try {
    const response = await fetch(path);
    return await response.json();
  } catch {
    return { error: { message: "the collector cannot be reached", hint: "see that it is running" } };
  }
}
