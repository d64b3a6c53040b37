// The collector's events, over a connection that reconnects itself.

// The collector sends "alive" after 5 s without another event.
const SILENCE_MAX_MS = 12_000;
const RETRY_MS = 1_000;

/** Follows /v1/live. `on` has one function per event, and `link` for the state of the connection. */
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

  // A network that vanished leaves a connection that looks open.
  setInterval(() => {
    if (retry === null && performance.now() - heardAt > SILENCE_MAX_MS) again();
  }, 1_000);
  // The browser may cache a page that was left, with its connection. It has six per host, so a seventh page would wait for a
  // minute.
  addEventListener("pagehide", () => source.close());
  addEventListener("pageshow", (event) => {
    if (event.persisted) again();
  });
  on.link("connecting");
  connect();
}

/** Finds out why the stream broke, which the browser does not report: signed out, or too many pages. */
async function askWhy(tell) {
  try {
    const who = await fetch("/v1/whoami");
    if (who.status === 401) location.assign("/login");
    const asking = new AbortController();
    const stream = await fetch("/v1/live", { signal: asking.signal });
    if (stream.status === 503) tell("full", (await stream.json()).error.message);
    else asking.abort();
  } catch {
    // The collector is away; the next attempt reports that.
  }
}
