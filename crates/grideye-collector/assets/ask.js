// The collector's answers in JSON.

/** GET, or POST with a body; what went wrong is in `error`. */
export async function ask(path, body) {
  const post = { method: "POST", headers: { "content-type": "application/json" } };
  try {
    const response = await fetch(path, body === undefined ? {} : { ...post, body: JSON.stringify(body) });
    return await response.json();
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
