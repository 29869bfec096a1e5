// Whether a vent from here must come before a hold: the instrument wants one after a start, a trip, a hold.

/** What the page remembers of that; at first, and whenever it cannot know, a vent is due. */
export class Arming {
  isVentDue = true;

  /** Learn from what is shown: vents before a trip, or before nothing was seen, count for nothing. */
  see(world) {
    this.isVentDue ||= isLocked(world);
  }

  /** A vent from here was accepted; during a trip it counts for nothing. */
  vented(world) {
    this.isVentDue = isLocked(world);
  }

  /** A hold was asked for from here. */
  spend() {
    this.isVentDue = true;
  }
}

const isLocked = ({ link, state }) => !link.up || state?.state === "tripped" || state?.faults.length > 0;
