"""Words for people: every code has some, and they agree with what the codes do."""

import re

import pytest

from instrument.doctor.causes import CAUSES, INFLATED
from instrument.faults import STATUS_OF
from instrument.rig.limits import HARD_LIMIT_KPA, OCCLUDED_SHARE, SUPPLY_MV, ZERO_SPAN_KPA
from registers.advice import FAULT_ADVICE, REFUSAL_WORDS, STATE_WORDS, STATUS_ADVICE
from registers.codes import FAULTS, REFUSALS, STATES, STATUS
from registers.views import VIEWS
from sim.board.limits import MOST_ACTIONS, MOST_TOP_UPS, STUCK_S, TIMEOUT_S, VENT_SHUT_S

QUIET = {"holding", "vented", "calibrated"}
SENTENCES = [
    *(text for advice in (*FAULT_ADVICE.values(), *STATUS_ADVICE.values()) for text in advice if text),
    *REFUSAL_WORDS.values(),
    *STATE_WORDS.values(),
]


def test_each_fault_says_what_has_happened_and_what_to_do():
    assert list(FAULT_ADVICE) == list(FAULTS.names)
    assert [code for code, advice in FAULT_ADVICE.items() if code and not (advice.what and advice.do)] == []


def test_each_status_bit_has_words_and_only_the_harmless_ask_for_nothing():
    assert set(STATUS_ADVICE) == {bit.name for bit in STATUS.bits}
    assert {name for name, advice in STATUS_ADVICE.items() if not advice.do} == QUIET


def test_each_refusal_and_each_state_has_words():
    assert list(REFUSAL_WORDS) == list(REFUSALS.names.values())
    assert list(STATE_WORDS) == list(STATES.names.values())


@pytest.mark.parametrize("text", SENTENCES)
def test_the_words_are_sentences_that_a_table_and_a_browser_show_alike(text):
    assert re.fullmatch(r"[A-ZΔ][^|<>`\n]*[.?]", text)


def test_each_fault_is_cleared_in_the_end():
    assert [code for code, (_, do) in FAULT_ADVICE.items() if code and "lear" not in do] == []


def test_where_the_balloon_may_be_inflated_every_advice_says_so():
    inflated = {code for code, cause in CAUSES.items() if cause.startswith(INFLATED)}
    warned = {code for code, (_, do) in FAULT_ADVICE.items() if "it may be inflated" in do}
    assert warned == inflated == {code for code, bit in STATUS_OF.items() if bit == "vent_fault"}
    assert "it may be inflated" in STATUS_ADVICE["vent_fault"].do


def test_the_figures_are_those_of_board_and_host():
    def told(code):
        return FAULT_ADVICE[code].what

    assert f"{STUCK_S} s" in told(2)
    assert f"{SUPPLY_MV[0] / 1e3}–{SUPPLY_MV[1] / 1e3} V" in told(3)
    assert f"{HARD_LIMIT_KPA:.0f} kPa always" in told(4)
    assert f"{VENT_SHUT_S:.0f} s" in told(9)
    assert f"{100 * OCCLUDED_SHARE:.0f} %" in told(10)
    assert MOST_TOP_UPS == 3
    assert "three top-ups" in told(11)
    assert f"{TIMEOUT_S:.0f} s or {MOST_ACTIONS} actions" in told(12)
    assert f"±{ZERO_SPAN_KPA} kPa" in REFUSAL_WORDS["not_zeroed"]


def test_the_page_of_faults_has_a_row_for_every_code():
    page = VIEWS["faults"].render()
    named = re.findall(r"^\| (\d+) \| `(\w+)` \|", page, re.MULTILINE)
    codes = [(code, name) for code, name in FAULTS.names.items() if code]
    codes += [(bit.number, bit.name) for bit in STATUS.bits]
    codes += [*REFUSALS.names.items(), *STATES.names.items()]
    assert named == [(str(code), name) for code, name in codes]
