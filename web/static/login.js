// Login form, the name of the user who is logged in, and the read-only banner.

import { byId, setText, showFieldError, showText } from "./elements.js";

const OLD_LINK = "The link of this page contained them: open the latest link of the demo.";
const WAITING = "Too many wrong passwords from your address. The page sends yours again …";

/** Connect the login form and the logout button with the session, and log in with the link of the demo. */
export async function startLogin(session) {
  const showError = (text) => showFieldError("login", text, "password");
  byId("log-in").addEventListener("submit", async (event) => {
    event.preventDefault();
    const [name, password] = [byId("user-name"), byId("password")];
    showError("");
    const error = await session.logIn(name.value, password.value, () => setText(byId("login-message"), WAITING));
    setText(byId("login-message"), "");
    showError(error);
    if (!session.user) return;
    password.value = "";
    byId("log-out-button").focus();
  });
  byId("log-out-button").addEventListener("click", async () => {
    setText(byId("login-message"), await session.logOut());
    if (!session.user) byId("user-name").focus();
  });
  for (const id of ["user-name", "password"]) byId(id).addEventListener("input", () => showError(""));
  const error = await session.start();
  if (error) showError(`${error} ${OLD_LINK}`);
}

/** Show the user who is logged in, or the login form. */
export function showLogin({ user, hasUsers, isEnded }) {
  byId("log-in").hidden = user !== null || !hasUsers;
  byId("logged-in").hidden = user === null;
  if (user) setText(byId("logged-in-user"), `${user.name}, ${user.role}`);
  showText(byId("read-only"), isEnded ? "READ-ONLY: your login has ended. VENT works." : "");
}
