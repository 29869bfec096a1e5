// Login form for the operator's token, and the read-only banner.

import { byId, setText, showFieldError, showText } from "./elements.js";

const WAITING = "Too many wrong tokens from your address. The page sends yours again …";

/** Connect the login form with the token. */
export function startLogin(token) {
  byId("log-in").addEventListener("submit", async (event) => {
    event.preventDefault();
    if (token.value) return token.logOut();
    const field = byId("token");
    showFieldError("token", "");
    const error = await token.logIn(field.value, () => setText(byId("token-message"), WAITING));
    setText(byId("token-message"), "");
    showFieldError("token", error);
    if (token.value) field.value = "";
  });
  byId("token").addEventListener("input", () => showFieldError("token", ""));
}

/** Show whether the operator is logged in. */
export function showLogin(token, info, isConnected) {
  byId("log-in").hidden = isConnected && info.writable === false;
  const field = byId("token");
  field.disabled = token.value !== "";
  field.placeholder = token.value ? "logged in" : "";
  setText(byId("log-in-button"), token.value ? "Log out" : "Log in");
  if (token.value) setText(byId("token-message"), "");
  showText(
    byId("read-only"),
    token.isExpired ? "READ-ONLY: the operator’s token is no longer valid. VENT works." : "",
  );
}
