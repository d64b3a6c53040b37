// Signing in: sends the token once and gets a cookie that no script can read.

import { say } from "./words.js";

const form = document.querySelector("#login");
const token = document.querySelector("#token");
const trouble = document.querySelector("#trouble");

form.addEventListener("submit", async (event) => {
  event.preventDefault();
  complain(await signIn(token.value.trim()));
});

function complain(error) {
  if (!error) {
    location.assign("/");
    return;
  }
  trouble.hidden = false;
  token.setAttribute("aria-invalid", "true");
  say(trouble, error.hint ? `${error.message}. Hint: ${error.hint}` : error.message);
}

/** The error, or `null`. */
async function signIn(text) {
  try {
    const response = await fetch("/v1/login", {
      method: "POST",
      headers: { "content-type": "application/json" },
      body: JSON.stringify({ token: text }),
    });
    return response.ok ? null : (await response.json()).error;
  } catch {
    return { message: "the collector cannot be reached", hint: "check that it runs, and try again" };
  }
}
