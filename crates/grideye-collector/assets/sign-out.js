// The button for signing out, for whoever signed in.

/** Shows the button where a cookie was used, and takes the cookie away when it is pressed. */
export async function offerSignOut(button) {
  button.addEventListener("click", async () => {
    await fetch("/v1/logout", { method: "POST" });
    location.assign("/login");
  });
  try {
    const who = await (await fetch("/v1/whoami")).json();
    button.hidden = who.signed_in !== true;
    button.title = who.name ? `Signed in with the token ${who.name}` : "";
  } catch {
    // The state of the connection says that the collector is away.
  }
}
