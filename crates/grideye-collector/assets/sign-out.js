// The signed-in person: what their token may do, and signing out.

/** Shows the button to whoever signed in with a cookie, and marks the page with the token's scope. */
export async function offerSignOut(button) {
  button.addEventListener("click", async () => {
    await fetch("/v1/logout", { method: "POST" });
    location.assign("/login");
  });
  try {
    const who = await (await fetch("/v1/whoami")).json();
    // The style sheet hides what is marked with data-writes from scope "read".
    document.documentElement.dataset.scope = who.scope;
    button.hidden = who.signed_in !== true;
    button.title = who.name ? `Signed in with the token ${who.name}` : "";
  } catch {
    // The state of the connection reports that the collector is away.
  }
}

/** Whether the token may start, stop, label and write notes. */
export function mayWrite() {
  return document.documentElement.dataset.scope !== "read";
}
