// Off-delay of the force alarm (ISA-18.2). A force near its limit would otherwise make the alarm blink.

import { forceAlarm } from "./force-alarm.js";

const NAME = "force_high_alarm";

/** Time for which the alarm is shown after its end. The event log uses the same time. */
export const OFF_DELAY_S = 1;

/** Filter of states that keeps the force alarm for `OFF_DELAY_S` after the last state with this alarm. */
export class AlarmOffDelay {
  #until_s = -Infinity;
  #ended = null; // the latest alarm, with `isOver` set

  /** Return a state with the alarm to show. If the alarm has ended, `ended_alarm` describes it. */
  apply(state) {
    const isHigh = state.status.includes(NAME);
    if (isHigh) {
      this.#until_s = state.t_s + OFF_DELAY_S;
      this.#ended = { ...forceAlarm(state), isOver: true };
    }
    const left_s = this.#until_s - state.t_s; // larger than the delay if the clock of the host was reset
    if (isHigh || !(left_s > 0 && left_s <= OFF_DELAY_S)) return state;
    return { ...state, status: [...state.status, NAME], ended_alarm: this.#ended };
  }
}
