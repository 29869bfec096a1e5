"""Tests of the texts of the web page: each code has a short text, and the texts are plain sentences."""

import re

from pneuforce.registers.codes import FAULTS, REJECT_REASONS, STATUS
from pneuforce.web.browser_feed import STATE
from pneuforce.web.operator_texts import FAULT_TITLES, REJECT_TEXTS, STATUS_ACTIONS

MAX_CHARACTERS = 110
QUANTITY = re.compile(r"\{(\w+)\}")


def test_each_fault_status_bit_and_reject_reason_has_a_text():
    assert list(FAULT_TITLES) == [code for code in FAULTS.names if code]
    assert list(STATUS_ACTIONS) == [bit.name for bit in STATUS.bits]
    assert list(REJECT_TEXTS) == list(REJECT_REASONS.names.values())


def test_the_titles_of_the_faults_differ_and_fit_the_bar():
    assert len(set(FAULT_TITLES.values())) == len(FAULT_TITLES)
    assert [title for title in FAULT_TITLES.values() if not re.fullmatch(r"[A-Za-z ]{4,32}", title)] == []


def test_the_texts_are_short_sentences():
    texts = [*REJECT_TEXTS.values(), *filter(None, STATUS_ACTIONS.values())]
    assert [text for text in texts if not re.fullmatch(r"[A-Z].*\.", text)] == []
    assert [text for text in texts if len(text) > MAX_CHARACTERS] == []


def test_the_quantities_in_the_texts_are_sent_to_the_browsers():
    assert {name for text in STATUS_ACTIONS.values() for name in QUANTITY.findall(text)} <= set(STATE)


def test_a_normal_measurement_asks_nothing_of_the_operator():
    normal = {"holding", "vented", "in_contact", "simulated", "calibrated", "function_check"}
    assert {name for name in normal if STATUS_ACTIONS[name]} == set()
