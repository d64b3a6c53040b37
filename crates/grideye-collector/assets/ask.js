// The collector's answers in JSON.

/** GET, or POST with a body, or another method; what went wrong is in `error`. */
export async function ask(path, body, method = body === undefined ? "GET" : "POST") {
  const sent = body === undefined ? {} : { headers: { "content-type": "application/json" }, body: JSON.stringify(body) };
  try {
    const response = await fetch(path, { method, ...sent });
    return response.status === 204 ? {} : await response.json();
  } catch {
    return { error: { message: "the collector cannot be reached", hint: "see that it is running, and try again" } };
  }
}

/** Says in an element what went wrong, and takes it back when nothing did. */
export function complain(element, error) {
  const hint = error?.hint ? `. Hint: ${error.hint}` : "";
  element.hidden = !error;
  element.textContent = error ? `${error.message}${hint}` : "";
}
