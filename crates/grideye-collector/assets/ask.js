// JSON requests to the collector.

/** GET, or POST with a body, or another method. A failure is in `error`. */
export async function ask(path, body, method = body === undefined ? "GET" : "POST") {
  const sent = body === undefined ? {} : { headers: { "content-type": "application/json" }, body: JSON.stringify(body) };
  try {
    const response = await fetch(path, { method, ...sent });
    return response.status === 204 ? {} : await response.json();
  } catch {
    return { error: { message: "the collector cannot be reached", hint: "check that it runs, and try again" } };
  }
}

/** Shows an error in an element, or hides the element without one. */
export function complain(element, error) {
  const hint = error?.hint ? `. Hint: ${error.hint}` : "";
  element.hidden = !error;
  element.textContent = error ? `${error.message}${hint}` : "";
}
