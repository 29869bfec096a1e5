// Login of a user. The browser keeps the key of the session in a cookie that scripts cannot read.

import { post } from "./requests.js";

const TIMEOUT_MS = 10000; // during a flood, the server delays requests of unknown browsers by up to 8 s
const RETRY_MS = 2000;
const RETRIED = [429, 503]; // too many wrong passwords, or too many requests
const POLL_MS = 5000;

/** User who is logged in, and whether users exist. Each change calls `onChange()`. */
export class Session {
  user = null; // {name, role, may_write}; null if no user is logged in
  hasUsers = true;
  isEnded = false; // the login has ended without a logout on this page
  #loginCount = 0;
  #isActive = true; // there was input since the last poll
  #onChange;

  constructor(onChange) {
    this.#onChange = onChange;
    for (const type of ["pointerdown", "keydown"])
      addEventListener(type, () => (this.#isActive = true), { capture: true });
    setInterval(() => document.hidden || this.update(), POLL_MS);
  }

  /**
   * Log in with the user and the password of the link, as the demo prints it. Remove them from the address bar.
   *
   * Return the error text of this login; "" without an error or without a user in the link.
   */
  async start() {
    const link = new URLSearchParams(location.hash.slice(1));
    if (!link.has("user")) {
      await this.update();
      return "";
    }
    history.replaceState(null, "", location.pathname + location.search);
    return this.logIn(link.get("user"), link.get("password") ?? "");
  }

  /** Ask the server who is logged in. */
  async update() {
    const count = this.#loginCount;
    const { status, answer } = await post("/api/session", { active: this.#isActive });
    if (status !== 200 || count !== this.#loginCount) return;
    this.#isActive = false;
    this.#set(answer.user, answer.has_users);
  }

  /**
   * Log in. Return "" if name and password are right, else the error text.
   *
   * After many wrong passwords from the address of this browser, the server compares passwords in the order of
   * their arrival. A password that is not sent again loses its place. Therefore this method sends the password
   * until the server has compared it, or until another login begins. `onWait()` is called before each repetition.
   */
  async logIn(name, password, onWait = () => {}) {
    const count = ++this.#loginCount;
    let response = await post("/api/login", { name, password }, TIMEOUT_MS);
    while (RETRIED.includes(response.status) && count === this.#loginCount) {
      onWait();
      await new Promise((resolve) => setTimeout(resolve, RETRY_MS));
      if (count === this.#loginCount) response = await post("/api/login", { name, password }, TIMEOUT_MS);
    }
    if (count !== this.#loginCount) return "";
    this.#loginCount++; // an answer about the time before the login must not end the login
    const { status, answer } = response;
    if (status === 200) this.#set(answer, true);
    if (status === 0) return "You are not logged in: the instrument did not answer. Try again.";
    return status === 200 ? "" : answer.text;
  }

  /** Log out. Return "" or the error text. */
  async logOut() {
    this.#loginCount++;
    const { status, answer } = await post("/api/logout", {});
    if (status !== 200) return answer.text;
    this.user = null;
    this.#set(null, this.hasUsers);
    return "";
  }

  /** Remove the user because the server has ended the session. */
  expire() {
    this.#set(null, this.hasUsers);
  }

  #set(user, hasUsers) {
    this.isEnded = !user && (this.isEnded || this.user !== null);
    this.user = user;
    this.hasUsers = hasUsers;
    this.#onChange();
  }
}
