"""Operations that the command block starts, for example zero adjustment, clear faults and self-test."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping

from pneuforce.instrument.core.arming import Step
from pneuforce.instrument.core.interlocks import violated
from pneuforce.instrument.core.reject_reason import RejectReason
from pneuforce.instrument.core.state import InstrumentState
from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.force_extremes import ForceExtremes
from pneuforce.instrument.model.known_results import computes_known_forces

log = logging.getLogger("pneuforce")

#: Time from the start of the command to a sample that shows its effect. The board needs this time to receive
#: the command and to report the remaining faults.
CLEAR_HEARD_S = 0.1
CLEAR_ANSWER_S = 0.5  #: time after which the command to clear faults fails


def run(state: InstrumentState, code: str, argument: int, now_s: float) -> RejectReason | None:
    """Run a command by its name.

    Returns NONE if the command is done, None if the command is in progress, and otherwise the reject reason.
    The reject reason for an unknown name is STATE. Only the command that clears faults can be in progress.
    """
    operation = _OPERATIONS.get(code)
    return operation(state, argument, now_s) if operation else RejectReason.STATE


def _zero_pressure(state: InstrumentState, argument: int, now_s: float) -> RejectReason:  # noqa: ARG001
    if state.link_lost(now_s):
        return RejectReason.LINK_LOST
    if state.measurement.in_contact:
        return RejectReason.IN_CONTACT
    if not state.chain.zero.take():
        return RejectReason.STATE
    log.info("zero taken: the sensor reads %.3f kPa when vented", state.chain.zero.zero_kpa)
    return RejectReason.NONE


def _restore_zero(state: InstrumentState, argument: int, now_s: float) -> RejectReason:  # noqa: ARG001
    restored = state.vented(now_s) and state.chain.zero.restore_previous()
    return RejectReason.NONE if restored else RejectReason.STATE


def _check_last_sample(state: InstrumentState, now_s: float) -> RejectReason:
    """Return NONE if the last sample is recent and meets every interlock."""
    if state.link_lost(now_s) or state.raw is None:
        return RejectReason.LINK_LOST
    if violated(state.raw, state.measurement, state.settings.contact_limit_kpa) is not None:
        return RejectReason.CAUSE_PERSISTS
    return RejectReason.NONE


def _self_test(state: InstrumentState, argument: int, now_s: float) -> RejectReason:  # noqa: ARG001
    """Check the last sample and the arithmetic of the force law. A proof test of a held balloon follows."""
    reason = _check_last_sample(state, now_s)
    if reason is not RejectReason.NONE:
        return reason
    if not _computes_correctly(state.settings.chain):
        log.error("self-test: this computer computes wrong forces")
        return RejectReason.CAUSE_PERSISTS
    state.proof_tests.expedite()
    return RejectReason.NONE


def _computes_correctly(chain: ChainSettings) -> bool:
    """Return True if the arithmetic gives known forces, and the force model is consistent."""
    method = chain.law.method
    known = computes_known_forces("energetic" if method == "membrane" else method)
    return known and chain.force_model.is_consistent


def _new_balloon(state: InstrumentState, argument: int, now_s: float) -> RejectReason:
    if state.link_lost(now_s):
        return RejectReason.LINK_LOST
    if not state.vented(now_s):
        return RejectReason.STATE
    if argument != state.settings.identity.balloon_id:
        state.chain.remove_calibration()
    if not state.faults:
        state.clearing.count += 1  # the board deletes its record of top-ups
    state.chain.leak.forget()
    state.proof_tests.tube_unproven = False
    state.balloon_id, state.inflation_count = argument, 0
    return RejectReason.NONE


def _reset_force_extremes(state: InstrumentState, argument: int, now_s: float) -> RejectReason:  # noqa: ARG001
    state.extremes = ForceExtremes()
    return RejectReason.NONE


def _clear_faults(state: InstrumentState, argument: int, now_s: float) -> RejectReason | None:  # noqa: ARG001
    """Ask the board to clear its faults. Later samples show the result. No valve moves."""
    if state.vent_pending:
        return RejectReason.IN_CONTACT
    if state.master_lost:
        return RejectReason.CAUSE_PERSISTS
    failed = _check_last_sample(state, now_s)
    if failed is not RejectReason.NONE:
        return failed
    clearing = state.clearing
    clearing.count += 1
    clearing.faults = set(state.faults)
    clearing.since_s = now_s
    return None


def finish_clearing(state: InstrumentState, now_s: float) -> RejectReason | None:
    """Return the result of the command that clears faults, or None if this command does not end now.

    Only a sample that the board took `CLEAR_HEARD_S` after the start of the command or later can confirm the
    command. An older sample does not show whether the board still works, for example after a pulled cable.
    """
    clearing = state.clearing
    if clearing.since_s is None or state.sample is None:
        return None
    confirmed = state.sample.faults == 0 and state.measurement.t_s - clearing.since_s >= CLEAR_HEARD_S
    if not confirmed and now_s - clearing.since_s <= CLEAR_ANSWER_S:
        return None
    failed = _check_last_sample(state, now_s)
    if confirmed and failed is RejectReason.NONE:
        state.faults.clear(clearing.faults)
    clearing.faults = set()
    clearing.since_s = None
    if failed is not RejectReason.NONE:
        return failed
    if state.faults:
        return RejectReason.CAUSE_PERSISTS
    state.advance(Step.CLEAR)
    return RejectReason.NONE


_OPERATIONS: Mapping[str, Callable[[InstrumentState, int, float], RejectReason | None]] = {
    "zero_pressure": _zero_pressure,
    "clear_faults": _clear_faults,
    "self_test": _self_test,
    "restore_zero": _restore_zero,
    "new_balloon": _new_balloon,
    "reset_force_extremes": _reset_force_extremes,
}
