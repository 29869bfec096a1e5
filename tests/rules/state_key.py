"""Key of a state: all values that decide what the instrument does next. A world is restored from its key."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable
from operator import attrgetter
from typing import Any, NamedTuple

from pneuforce.instrument.rig.link import RawSample
from tests.rules.world import PEERS, SETTINGS, START_S, STEP_S, Board, SearchedInstrument, World


class Value(NamedTuple):
    """One value of a state: its attribute, and the conversions to the key and back."""

    path: str
    save: Callable[[Any, float], Hashable] = lambda value, now_s: value
    restore: Callable[[Any, float], Any] = lambda saved, now_s: saved


def age(path: str, limit_s: float) -> Value:
    """Return the row of a time in the past. All ages above the limit have the same effect."""
    return Value(path, lambda t_s, now_s: min(now_s - t_s, limit_s), lambda age_s, now_s: now_s - age_s)


def left(path: str, latest_s: float = STEP_S) -> Value:
    """Return the row of a time in the future, or None. All times that passed `latest_s` ago are equal."""
    return Value(
        path,
        lambda t_s, now_s: None if t_s is None else max(t_s - now_s, -latest_s),
        lambda left_s, now_s: None if left_s is None else now_s + left_s,
    )


def at_most(path: str, limit: float) -> Value:
    """Return the row of a number whose values above the limit have the same effect."""
    return Value(path, lambda value, now_s: min(value, limit))


def codes(path: str, container: type) -> Value:
    """Return the row of a container of faults. Their order does not decide anything."""
    return Value(path, lambda value, now_s: tuple(sorted(value)), lambda saved, now_s: container(saved))


def optional(path: str) -> Value:
    """Return the row of a number or NaN."""
    return Value(
        path,
        lambda value, now_s: None if math.isnan(value) else value,
        lambda saved, now_s: math.nan if saved is None else saved,
    )


MAX_AGE_S = 2.5  #: older samples have the same effect: the time-out of the host is 2 s
INSTRUMENT = (
    Value("arming"),
    codes("faults._codes", list),
    codes("clearing.faults", set),
    left("clearing.since_s", 1.0),
    Value("lease.duration_s"),
    Value("lease.holder"),
    left("lease._until_s"),
    optional("requested.setpoint_kpa"),
    optional("held_setpoint_kpa"),
    Value("master_lost"),
    left("vent_due_s"),
    Value("command_monitor.vent_due"),
    Value("command_monitor._hold"),
    age("command_monitor._command_s", 0.0),
    age("command_monitor._vent_requested_s", STEP_S),
    age("command_monitor._followed_s", 0.5),
    Value("command_monitor._filled"),
    Value("command_monitor._state"),
    age("command_monitor._held_s", 0.25),
    Value("command_monitor._changes"),
    at_most("command_monitor._deviating_s", 2.0),  # a longer deviation is remembered for a longer time
    at_most("command_monitor._agreeing_s", 0.5),
    at_most("command_monitor._credible_s", 0.5),
    Value("stalls._stall_s"),
    age("stalls._resumed_s", 0.3125),
    age("stalls._active_s", 10.0),
)

#: Fields that `key_of` saves without a row.
SAVED_APART = {"measurement", "raw", "chain", "peers"}
#: Fields that are not in the key, and the reason.
NOT_IN_KEY = {
    "settings": "constant",
    "hello": "the search has one board",
    "firmware": "the search has one board",
    "sample_counter": "only shown",
    "revision": "only shown",
    "peak_force_n": "only shown",
    "extremes": "only shown",
    "event_log_head": "only shown",
    "utc_offset_s": "only shown",
    "alarm_2": "only shown",
    "balloon_id": "only shown",
    "inflation_count": "only shown",
    "can_down": "only shown",
    "log_down": "only shown",
    "recording_down": "only shown",
    "certificate_expiring": "only shown",
    "vent_monitor": "decides on the zero adjustment, which is not searched",
    "proof_tests": "the search has no proof tests",
    "_interlocks": "each sample of the search meets all interlocks",
    "peaks": "only shown",
    "_snapshots": "a cache",
    "_stall_report": "only logged",
}


def key_of(world: World) -> Hashable:
    """Return the key of a world. Two worlds with the same key behave in the same way."""
    instrument, board, now_s = world.instrument, world.board, world.now_s
    values = tuple(save(get(instrument), now_s) for get, save in SAVED)
    m, raw = instrument.measurement, instrument.raw
    return (
        values,
        (m._replace(t_s=min(now_s - m.t_s, MAX_AGE_S)), raw and raw.message),
        (board.state, board.cause, board.latched, board.follows, instrument.clearing.count - board.clear),
        instrument.chain.contact,
        tuple(instrument.peers.record_of(peer).mode for peer in PEERS.values()),
        tuple(instrument.peers.last_command(peer).answer_state == "busy" for peer in PEERS.values()),
    )


def world_of(key: Any) -> World:
    """Return the world with this key. Everything that the key does not contain has its default value."""
    values, (m, message), (state, cause, latched, follows, clears), contact, modes, busy = key
    instrument, now_s = SearchedInstrument(SETTINGS), START_S
    for (holder, name), restore, saved in zip(TARGETS, RESTORED, values, strict=True):
        setattr(holder(instrument), name, restore(saved, now_s))
    instrument.clearing.count = clears
    instrument.measurement = m._replace(t_s=now_s - m.t_s)
    instrument.raw = message and RawSample(0, instrument.measurement.t_s, message, STEP_S)
    instrument.chain.contact = contact
    for peer, mode, is_busy in zip(PEERS.values(), modes, busy, strict=True):
        instrument.peers.record_of(peer).mode = mode
        block = instrument.peers.last_command(peer)
        block.answer_state = "busy" if is_busy else block.answer_state
    return World(instrument, Board(state, cause, latched, follows), now_s)


def _holder_of(path: str) -> tuple[Callable[[Any], Any], str]:
    *parents, name = path.split(".")
    return (attrgetter(parents[0]) if parents else lambda instrument: instrument), name


TARGETS = [_holder_of(value.path) for value in INSTRUMENT]
RESTORED = [value.restore for value in INSTRUMENT]
SAVED = [(attrgetter(value.path), value.save) for value in INSTRUMENT]
