// The operator's token: in memory and for this tab alone; from the log-in field or the link's #operator=….

import { post } from "./requests.js";

const KEY = "operator";

/** The token, and whether one that was used no longer holds. `changed()` is called when either changes. */
export class Token {
  value = "";
  stale = false;
  #unchecked = "";
  #changed;

  constructor(changed) {
    this.#changed = changed;
  }

  /** Take the link's or this tab's token, and hide the link's from view and history. */
  begin() {
    const given = new URLSearchParams(location.hash.slice(1)).get(KEY);
    if (given) history.replaceState(null, "", location.pathname);
    this.#unchecked = given ?? kept();
    return this.recheck();
  }

  /** Ask whether the token holds: the instrument may have begun anew with another. */
  async recheck() {
    const token = this.value || this.#unchecked;
    if (!token) return;
    const { status } = await post("/api/token", { token });
    if (status === 200) this.#set(token, false);
    else if (status === 401) this.reject();
  }

  /** Log in with what was typed; the sentence that says why not, "" where it holds. */
  async logIn(token) {
    const { status, answer } = await post("/api/token", { token });
    if (status === 200) this.#set(token, false);
    return status === 200 ? "" : (answer.text ?? "This token is not the operator’s.");
  }

  logOut() {
    this.#set("", false);
  }

  /** The instrument no longer accepts it. */
  reject() {
    this.#set("", true);
  }

  #set(value, stale) {
    this.value = value;
    this.stale = stale;
    this.#unchecked = "";
    keep(value);
    this.#changed();
  }
}

function kept() {
  try {
    return sessionStorage.getItem(KEY) ?? "";
  } catch {
    return ""; // storage may be forbidden: then it lives in memory
  }
}

function keep(value) {
  try {
    if (value) sessionStorage.setItem(KEY, value);
    else sessionStorage.removeItem(KEY);
  } catch {
    // as above
  }
}
