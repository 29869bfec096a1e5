// Logging in and out, and what the page says about it.

import { announce, byId, say } from "./elements.js";

/** Let the form log in and out with the token. */
export function startAccess(token) {
  byId("log-in").addEventListener("submit", async (event) => {
    event.preventDefault();
    if (token.value) return token.logOut();
    const field = byId("token");
    const why = await token.logIn(field.value);
    say(byId("token-said"), why);
    if (!why) field.value = "";
  });
}

/** Show whether this page may write. */
export function showAccess(token, about, isUp) {
  byId("log-in").hidden = isUp && about.writable === false;
  const field = byId("token");
  field.disabled = token.value !== "";
  field.placeholder = token.value ? "logged in" : "";
  say(byId("log-in-button"), token.value ? "Log out" : "Log in");
  if (token.value) say(byId("token-said"), "");
  announce(
    byId("read-only"),
    token.stale ? "READ-ONLY: the operator’s token is no longer valid. VENT still works." : "",
  );
}
