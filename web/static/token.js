// Operator's token from the login form or from the link (#operator=…). The token is stored for this tab only.

import { post } from "./requests.js";

const KEY = "operator";
const TIMEOUT_MS = 10000; // during a flood, the server delays requests of unknown browsers by up to 8 s
const RETRY_MS = 2000;
const RETRIED = [429, 503]; // too many wrong tokens, or too many requests

/** Operator's token. `isExpired` is true after the server rejects it. Each change calls `onChange()`. */
export class OperatorToken {
  value = ""; // empty if not logged in
  isExpired = false;
  #unchecked = "";
  #checkCount = 0;
  #onChange;

  constructor(onChange) {
    this.#onChange = onChange;
  }

  /** Load the token from the link or from the tab. Remove the token from the address bar and the history. */
  load() {
    const linkToken = new URLSearchParams(location.hash.slice(1)).get(KEY);
    if (linkToken) history.replaceState(null, "", location.pathname + location.search);
    this.#unchecked = linkToken ?? storedToken();
    return this.check();
  }

  /** Check the token with the server. The instrument may have been restarted with another token. */
  async check() {
    const token = this.value || this.#unchecked;
    if (!token) return;
    const { status } = await this.#send(token);
    if (status === 401) this.expire();
  }

  /**
   * Log in with a token. Return "" if the token is valid, else the error text.
   *
   * `onWait()` is called if the server does not compare the token yet.
   */
  async logIn(token, onWait) {
    const { status, answer } = await this.#send(token, onWait);
    return status === 200 ? "" : (answer.text ?? "The token is wrong.");
  }

  /**
   * Send a token until the server has compared the token, or until another token is sent.
   *
   * After many wrong tokens from the address of this browser, the server compares tokens in the order of their
   * arrival. A token that is not sent again loses its place.
   */
  async #send(token, onWait = () => {}) {
    const count = ++this.#checkCount;
    let response = await post("/api/token", { token }, TIMEOUT_MS);
    while (RETRIED.includes(response.status) && count === this.#checkCount) {
      onWait();
      await new Promise((resolve) => setTimeout(resolve, RETRY_MS));
      if (count === this.#checkCount) response = await post("/api/token", { token }, TIMEOUT_MS);
    }
    if (count !== this.#checkCount) return { status: 0, answer: { text: "" } };
    if (response.status === 200) this.#set(token, false);
    return response;
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
