// Operator's token from the login form or from the link (#operator=…). The token is stored for this tab only.

import { post } from "./requests.js";

const KEY = "operator";

/** Operator's token. `isExpired` is true after the server rejects it. Each change calls `onChange()`. */
export class OperatorToken {
  value = ""; // empty if not logged in
  isExpired = false;
  #unchecked = "";
  #onChange;

  constructor(onChange) {
    this.#onChange = onChange;
  }

  /** Load the token from the link or from the tab. Remove the token from the address bar and the history. */
  load() {
    const linkToken = new URLSearchParams(location.hash.slice(1)).get(KEY);
    if (linkToken) history.replaceState(null, "", location.pathname);
    this.#unchecked = linkToken ?? storedToken();
    return this.check();
  }

  /** Check the token with the server. The instrument may have been restarted with another token. */
  async check() {
    const token = this.value || this.#unchecked;
    if (!token) return;
    const { status } = await post("/api/token", { token });
    if (status === 200) this.#set(token, false);
    else if (status === 401) this.expire();
  }

  /** Log in with a token. Return "" if the token is valid, else the error text. */
  async logIn(token) {
    const { status, answer } = await post("/api/token", { token });
    if (status === 200) this.#set(token, false);
    return status === 200 ? "" : (answer.text ?? "The operator’s token is wrong.");
  }

  logOut() {
    this.#set("", false);
  }

  /** Remove the token because the instrument rejects it. */
  expire() {
    this.#set("", true);
  }

  #set(value, isExpired) {
    this.value = value;
    this.isExpired = isExpired;
    this.#unchecked = "";
    store(value);
    this.#onChange();
  }
}

function storedToken() {
  try {
    return sessionStorage.getItem(KEY) ?? "";
  } catch {
    return ""; // the browser may forbid storage
  }
}

function store(value) {
  try {
    if (value) sessionStorage.setItem(KEY, value);
    else sessionStorage.removeItem(KEY);
  } catch {
    // the browser may forbid storage: the token is then lost at a reload
  }
}
