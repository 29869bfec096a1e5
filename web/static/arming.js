// Arming: after a start, a trip or a hold, the instrument requires a vent from this page before the next
// hold.

/** Estimate of the arming state. A vent is due at the start, and after the connection was lost. */
export class Arming {
  isVentDue = true;
  #user = "";

  /** Update from the current state: a trip, a lost connection or another user makes a vent due. */
  update(model) {
    const user = model.session.user?.name ?? "";
    this.isVentDue ||= isLocked(model) || user !== this.#user;
    this.#user = user;
  }

  /** Record an accepted vent. A vent during a trip does not arm. */
  ventAccepted(model) {
    this.isVentDue = isLocked(model);
  }

  /** Record a hold request, which needs a new vent afterwards. */
  holdRequested() {
    this.isVentDue = true;
  }
}

const isLocked = ({ link, state }) => !link.up || state?.state === "tripped" || state?.faults.length > 0;
