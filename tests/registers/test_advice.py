"""Tests of the advice texts: no text is missing, and the numbers in the texts are those of the program."""

import re

import pytest

from pneuforce.instrument.config import Configuration
from pneuforce.instrument.core.faults import STATUS_OF
from pneuforce.instrument.core.settings import Settings
from pneuforce.instrument.doctor.causes import CAUSES, INFLATED
from pneuforce.protocol.limits import HARD_LIMIT_KPA, OCCLUDED_TIME_RATIO, SUPPLY_MV, ZERO_SPAN_KPA
from pneuforce.registers.advice import FAULT_ADVICE, REJECT_REASON_ADVICE, STATE_DESCRIPTIONS, STATUS_ADVICE
from pneuforce.registers.codes import FAULTS, MAINTENANCE_CAUSES, REJECT_REASONS, STATES, STATUS
from pneuforce.registers.views import VIEWS
from pneuforce.sim.board.limits import (
    FROZEN_S,
    MAX_TOP_UPS,
    MAX_VALVE_ACTIONS,
    SETPOINT_TIMEOUT_S,
    VENT_SHUT_S,
)

WITHOUT_ACTION = {"holding", "vented", "calibrated"}
SENTENCES = [
    *(text for advice in (*FAULT_ADVICE.values(), *STATUS_ADVICE.values()) for text in advice if text),
    *REJECT_REASON_ADVICE.values(),
    *STATE_DESCRIPTIONS.values(),
]


def test_each_fault_has_a_meaning_and_an_action():
    assert list(FAULT_ADVICE) == list(FAULTS.names)
    assert [code for code, advice in FAULT_ADVICE.items() if code and not (advice.what and advice.do)] == []


def test_each_status_bit_has_a_meaning_and_only_harmless_bits_have_no_action():
    assert set(STATUS_ADVICE) == {bit.name for bit in STATUS.bits}
    assert {name for name, advice in STATUS_ADVICE.items() if not advice.do} == WITHOUT_ACTION


def test_each_reject_reason_and_each_state_has_a_text():
    assert list(REJECT_REASON_ADVICE) == list(REJECT_REASONS.names.values())
    assert list(STATE_DESCRIPTIONS) == list(STATES.names.values())


@pytest.mark.parametrize("text", SENTENCES)
def test_the_texts_are_sentences_without_markup_characters(text):
    assert re.fullmatch(r"[A-ZΔ][^|<>`\n]*[.?]", text)


def test_the_action_of_each_fault_includes_clearing():
    assert [code for code, (_, do) in FAULT_ADVICE.items() if code and "lear" not in do] == []


def test_no_advice_for_a_fault_names_a_key_of_the_configuration():
    """An operator does not know the keys, and cannot change the configuration."""
    sections = (field.annotation for field in Configuration.model_fields.values())
    keys = {key for section in sections for key in getattr(section, "model_fields", ())}
    assert "contact_limit_kpa" in keys
    texts = [*(text for advice in FAULT_ADVICE.values() for text in advice), STATUS_ADVICE["overpressure"].do]
    assert [text for text in texts if keys & set(re.findall(r"\w+_\w+", text))] == []


def test_the_advice_warns_if_the_balloon_may_be_inflated():
    inflated = {code for code, cause in CAUSES.items() if cause.startswith(INFLATED)}
    warned = {code for code, (_, do) in FAULT_ADVICE.items() if "it may be inflated" in do}
    assert warned == inflated == {code for code, bit in STATUS_OF.items() if bit == "vent_fault"}
    assert "it may be inflated" in STATUS_ADVICE["vent_fault"].do


def test_the_numbers_agree_with_board_and_host():
    def meaning(code):
        return FAULT_ADVICE[code].what

    assert f"{FROZEN_S} s" in meaning(2)
    assert f"{SUPPLY_MV[0] / 1e3}–{SUPPLY_MV[1] / 1e3} V" in meaning(3)
    assert f"{HARD_LIMIT_KPA:.0f} kPa always" in meaning(4)
    assert f"{VENT_SHUT_S:.0f} s" in meaning(9)
    assert f"{100 * OCCLUDED_TIME_RATIO:.0f} %" in meaning(10)
    assert MAX_TOP_UPS == 3
    assert "three top-ups" in meaning(11)
    assert f"{SETPOINT_TIMEOUT_S:.0f} s or {MAX_VALVE_ACTIONS} actions" in meaning(12)
    limits = f"{Settings().contact_limit_kpa:.0f} kPa by default"
    assert limits in meaning(4)
    assert f"({limits}, at most {HARD_LIMIT_KPA:.0f} kPa)" in meaning(35)
    assert f"after {Settings().host_timeout_s:.0f} s by default" in FAULT_ADVICE[34].do
    assert f"±{ZERO_SPAN_KPA} kPa" in REJECT_REASON_ADVICE["not_zeroed"]


def test_the_faults_page_has_a_row_for_every_code():
    page = VIEWS["faults"].render()
    named = re.findall(r"^\| (\d+) \| `(\w+)` \|", page, re.MULTILINE)
    codes = [(code, name) for code, name in FAULTS.names.items() if code]
    codes += [(bit.number, bit.name) for bits in (STATUS, MAINTENANCE_CAUSES) for bit in bits.bits]
    codes += [*REJECT_REASONS.names.items(), *STATES.names.items()]
    assert named == [(str(code), name) for code, name in codes]


def test_no_advice_says_that_a_fault_has_vented_the_rig():
    """After a fault, a vent is commanded, but a blocked valve or a lost link can prevent it."""
    assert [text for text in SENTENCES if re.search("(rig has vented|vented the rig)", text)] == []
