// The collector's events, with a connection that comes back by itself.

// The collector says "alive" every 5 s when it has nothing else to say.
const SILENCE_MAX_MS = 12_000;
const RETRY_MS = 1_000;

/** Follows /v1/live. `on` holds one function for each event, and `link` for the state of the connection. */
export function follow(on) {
  let source = null;
  let heardAt = 0;
  let retry = null;

  const connect = () => {
    retry = null;
    heardAt = performance.now();
    source = new EventSource("/v1/live");
    for (const event of ["snapshot", "frames", "recordings", "labels", "lagged", "alive"]) {
      source.addEventListener(event, (message) => {
        heardAt = performance.now();
        on.link("open");
        on[event]?.(JSON.parse(message.data));
      });
    }
    source.addEventListener("error", again);
  };

  const again = () => {
    source.close();
    on.link("lost");
    retry ??= setTimeout(connect, RETRY_MS);
    askWhy(on.link);
  };

  // A network that went away without a word leaves a connection that looks open.
  setInterval(() => {
    if (retry === null && performance.now() - heardAt > SILENCE_MAX_MS) again();
  }, 1_000);
  // A page that was left may be kept for the way back, and its connection with it. A browser has six to one host, so the
  // seventh page would wait for a minute.
  addEventListener("pagehide", () => source.close());
  addEventListener("pageshow", (event) => {
    if (event.persisted) again();
  });
  on.link("connecting");
  connect();
}

/**
 * A browser does not say why a stream of events broke: whoever was signed out is asked to sign in, and who comes when all
 * seats are taken is told so.
 */
async function askWhy(tell) {
  try {
    const who = await fetch("/v1/whoami");
    if (who.status === 401) location.assign("/login");
    const asking = new AbortController();
    const stream = await fetch("/v1/live", { signal: asking.signal });
    if (stream.status === 503) tell("full", (await stream.json()).error.message);
    else asking.abort();
  } catch {
    // The collector is away: the next try to follow says so.
  }
}
