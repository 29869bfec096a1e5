"""The rules of docs/rules.md as conditions on one change. The search checks each rule after each change.

The rules use what can be seen from outside, and a history that is written from the events. They do not use
the code that decides.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from pneuforce.instrument.core.faults import HostFault
from pneuforce.instrument.core.reject_reason import RejectReason
from pneuforce.protocol.frames import Fault
from tests.rules.world import DELAY_S, LEASE_S, STEP_S, Change

SILENCE_S, STALE_S, STEADY_S = 0.25, 0.1, 0.25
CLEARING_S = 0.5
HEARD_S = 0.1
HOST_TIMEOUT_S = 2.0
FOLLOW_S = 1.0
#: Causes that wait for the end of a contact before the vent.
DELAYED = {HostFault.LEASE_EXPIRED, HostFault.CAN_MASTER_LOST}
IGNORED = {HostFault.DISAGREEMENT, HostFault.NOT_VENTED}
VENTS = ("vent", "vent with a bad value")


class History(NamedTuple):
    """Earlier events, as far as the rules need them."""

    last_holds: frozenset[str] = frozenset()  #: names of the peers whose last mode is "hold"
    vented: bool = False  #: a vent without a latched fault, since the start and since the last trip
    lease_left_s: float = 0.0
    delayed_s: float = 0.0  #: time for which a vent has waited for the end of a contact
    clearing_s: float = 0.0  #: time for which a command to clear has been in progress, at most 1 s
    resumed_s: float = 0.3125  #: time since the end of a stall, at most this value
    venting: bool = False  #: a held balloon was vented by a peer, and no sample shows an empty balloon yet
    ignoring_s: float = 0.0  #: time for which the board has contradicted the command, at most 1.5 s

    @property
    def in_stall(self) -> bool:
        """Return True during a stall and shortly after it."""
        return self.resumed_s <= STEADY_S


def history_after(history: History, change: Change) -> History:
    """Return the history with one more change."""
    event, peer, reason, before, after = change
    passed_s = after.now_s - before.now_s
    accepted = reason is RejectReason.NONE
    holds, left_s = history.last_holds, max(history.lease_left_s - passed_s, -STEP_S)
    holds = holds - {peer} if event in VENTS else holds | {peer} if event == "hold" else holds
    if peer and accepted and after.holder == peer:
        left_s = LEASE_S
    vented = history.vented and not after.faults
    vents = event in VENTS and before.wants_hold and not before.vent_delayed
    ordered = before.commands_hold != after.commands_hold or before.wants_hold != after.wants_hold
    ordered = ordered or (accepted and event in ("hold", *VENTS))
    venting = vents or (history.venting and (event != "wait" or after.is_filled))
    # The board receives a vent until it is empty, so another order in this time is no new command.
    ignoring_s = 0.0 if ordered and not (history.venting and venting) else history.ignoring_s
    if event == "wait":
        ignoring_s = ignoring_s + passed_s if after.is_filled != before.commands_hold else 0.0
    return History(
        last_holds=holds,
        vented=vented or (event in VENTS and not after.faults),
        lease_left_s=left_s if after.holder else 0.0,
        delayed_s=history.delayed_s + passed_s if after.vent_delayed else 0.0,
        clearing_s=min(history.clearing_s + passed_s, 1.0) if after.clearing else 0.0,
        resumed_s=0.0 if event == "stall" else min(history.resumed_s + passed_s, 0.3125),
        venting=venting,
        ignoring_s=min(ignoring_s, 1.5),
    )


def a_vent_is_always_accepted(change: Change, history: History) -> bool:
    """A vent is executed at once, from each peer in each state, even if other values are rejected."""
    event, _, reason, _, after = change
    if event == "vent" and reason is not RejectReason.NONE:
        return False
    return event not in VENTS or not (after.wants_hold or after.commands_hold)


def only_an_accepted_hold_inflates(change: Change, history: History) -> bool:
    """The balloon is inflated only after an accepted "hold"."""
    event, _, reason, before, after = change
    begins = after.wants_hold and not before.wants_hold
    allowed = event == "hold" and reason is RejectReason.NONE
    return (not begins or allowed) and (not after.commands_hold or after.wants_hold)


def a_hold_needs_all_steps(change: Change, history: History) -> bool:
    """After a start or a trip: no fault is latched, then a vent, then "hold". The link must be alive."""
    event, _, reason, before, after = change
    ready = history.vented and not before.faults and not after.faults and after.age_s <= SILENCE_S
    return event != "hold" or reason is not RejectReason.NONE or ready


def a_repeated_hold_does_not_inflate(change: Change, history: History) -> bool:
    """A peer whose last mode is "hold" cannot inflate a balloon that was vented."""
    event, peer, reason, before, _ = change
    repeated = event == "hold" and peer in history.last_holds and not before.wants_hold
    return not repeated or reason is not RejectReason.NONE


def a_complete_order_is_accepted(change: Change, history: History) -> bool:
    """If all steps were carried out and no lease of another peer prevents it, "hold" is accepted."""
    event, peer, reason, before, after = change
    ready = history.vented and not after.faults and after.age_s <= SILENCE_S and before.holder in ("", peer)
    first = peer not in history.last_holds or before.wants_hold
    return event != "hold" or not (ready and first) or reason is RejectReason.NONE


def a_lease_excludes_other_peers(change: Change, history: History) -> bool:
    """While a peer holds a lease, each write of another peer is rejected, except a vent."""
    event, peer, reason, before, _ = change
    excluded = peer != "" and before.holder not in ("", peer) and history.lease_left_s >= 0.0
    return not excluded or event == "vent" or reason is not RejectReason.NONE


def a_lease_expires(change: Change, history: History) -> bool:
    """A lease that is not renewed in time expires and trips the rig. A stall gives the holder 0.25 s more."""
    event, peer, _, before, after = change
    if before.holder == "" or (event == "end of lease" and peer == before.holder):
        return True
    if after.holder != before.holder:
        return HostFault.LEASE_EXPIRED in after.faults
    left_s = history.lease_left_s - (after.now_s - before.now_s)
    in_stall = event == "stall" or history_after(history, change).in_stall
    return peer != "" or left_s >= 0.0 or in_stall


def a_lease_is_kept(change: Change, history: History) -> bool:
    """A lease does not end before its time, or shortly after a stall, unless its holder ends it."""
    event, peer, _, before, after = change
    later = history_after(history, change)
    left_s = history.lease_left_s - (after.now_s - before.now_s)
    resuming = later.in_stall and after.age_s <= HOST_TIMEOUT_S
    ended = event == "end of lease" and peer == before.holder
    return before.holder in ("", after.holder) or ended or (left_s < 0.0 and not resuming)


def a_vent_reaches_the_board(change: Change, history: History) -> bool:
    """After a vent that ends a hold, no "hold" is sent until a later sample shows an empty balloon."""
    return not (history_after(history, change).venting and change.after.commands_hold)


def a_fault_vents(change: Change, history: History) -> bool:
    """With a latched fault the command is "vent". Only a contact delays it, for a limited time and cause."""
    before, after = change.before, change.after
    if not after.faults:
        return not after.vent_delayed
    if not after.vent_delayed:
        return not after.commands_hold
    delayed_s = history_after(history, change).delayed_s
    return (
        (before.wants_hold or before.vent_delayed)
        and after.in_contact
        and after.faults <= DELAYED
        and delayed_s <= DELAY_S + STEP_S
    )


def a_lost_link_trips(change: Change, history: History) -> bool:
    """Without samples for 0.25 s the rig trips. A stall gives 0.25 s more, but not after 2 s."""
    event, after = change.event, change.after
    lost = event in ("wait", "silence", "stall") and after.age_s > SILENCE_S
    resuming = history_after(history, change).in_stall and after.age_s <= HOST_TIMEOUT_S
    return not lost or resuming or HostFault.LINK_LOST in after.faults


def a_restart_and_a_pulled_cable_trip(change: Change, history: History) -> bool:
    """A restart of the board, a pulled cable and a lost CANopen master trip the rig."""
    event, _, _, _, after = change
    if event == "master" and not after.master_lost:
        return True
    caused = {
        "restart of the board": HostFault.BOARD_RESET,
        "unplug": HostFault.LINK_LOST,
        "master": HostFault.CAN_MASTER_LOST,
    }.get(event)
    return caused is None or caused in after.faults


def a_fault_of_the_board_trips(change: Change, history: History) -> bool:
    """A fault that the board reports is latched with the first sample that reports it."""
    after = change.after
    return not after.board_fault or Fault.OVERPRESSURE in after.faults


def a_board_that_ignores_commands_trips(change: Change, history: History) -> bool:
    """A board that contradicts the last vent, hold or trip for more than 1.25 s trips the rig."""
    ignoring_s = history_after(history, change).ignoring_s
    return ignoring_s <= FOLLOW_S + STEADY_S or bool(IGNORED & change.after.faults)


def faults_end_only_by_clearing(change: Change, history: History) -> bool:
    """A fault ends only by the command to clear, if its cause has gone.

    A sample from at least 0.1 s after the command must show this.
    """
    before, after = change.before, change.after
    ended = before.faults - after.faults
    if not ended:
        return True
    clearing_s = history.clearing_s + after.now_s - before.now_s
    gone = not after.board_fault and after.age_s <= clearing_s - HEARD_S
    gone = gone and not (HostFault.CAN_MASTER_LOST in ended and after.master_lost)
    return before.clearing and gone and not after.wants_hold and not change.peer


def clearing_moves_no_valve(change: Change, history: History) -> bool:
    """Neither the begin nor the end of the command to clear changes the command to the board."""
    before, after = change.before, change.after
    same = before.commands_hold == after.commands_hold or bool(after.faults - before.faults)
    ends = before.clearing and not after.clearing
    return same or not (change.event == "clear" or ends)


def a_hold_ends_only_by_a_vent_or_a_trip(change: Change, history: History) -> bool:
    """A balloon that shall be held is vented only after a vent command or with a latched fault."""
    ended = change.before.wants_hold and not change.after.wants_hold
    return not ended or change.event in VENTS or bool(change.after.faults)


def clearing_ends(change: Change, history: History) -> bool:
    """The command to clear ends within 0.5 s, and no second one is accepted. A stall prolongs it."""
    later = history_after(history, change)
    second = change.event == "clear" and change.before.clearing and change.reason is RejectReason.NONE
    return not second and (later.clearing_s <= CLEARING_S or later.in_stall)


def a_trip_shows_no_force(change: Change, history: History) -> bool:
    """No force is shown while the rig is tripped, or if the last sample is older than 0.1 s."""
    after = change.after
    tripped = bool(after.faults) and not after.vent_delayed
    return not after.force_valid or not (tripped or after.age_s > STALE_S)


Rule = Callable[[Change, History], bool]

RULES: tuple[Rule, ...] = (
    a_vent_is_always_accepted,
    only_an_accepted_hold_inflates,
    a_hold_needs_all_steps,
    a_repeated_hold_does_not_inflate,
    a_complete_order_is_accepted,
    a_lease_excludes_other_peers,
    a_lease_expires,
    a_lease_is_kept,
    a_vent_reaches_the_board,
    a_fault_vents,
    a_lost_link_trips,
    a_restart_and_a_pulled_cable_trip,
    a_fault_of_the_board_trips,
    a_board_that_ignores_commands_trips,
    faults_end_only_by_clearing,
    clearing_moves_no_valve,
    a_hold_ends_only_by_a_vent_or_a_trip,
    clearing_ends,
    a_trip_shows_no_force,
)
