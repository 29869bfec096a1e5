"""Tests of the texts of the web page: each code has a short text, and the texts are plain sentences."""

import re

from pneuforce.registers.codes import FAULTS, MAINTENANCE_CAUSES, REJECT_REASONS, STATUS
from pneuforce.web.app import STATIC
from pneuforce.web.browser_feed import STATE
from pneuforce.web.instrument_info import instrument_info
from pneuforce.web.operator_texts import FAULT_TITLES, MAINTENANCE_TEXTS, REJECT_TEXTS, STATUS_ACTIONS

MAX_CHARACTERS = 110
QUANTITY = re.compile(r"\{(\w+)\}")
#: Words that an operator at the page cannot use: there are buttons, but no registers, commands and bits.
WORDS_OF_A_BUS = re.compile(r"(register|command|bit|mode) \d|\b[Cc]lear\b(?! faults)")
BUTTONS = ("Clear faults", "New balloon", "VENT", "Inflate")


def test_each_fault_status_bit_cause_and_reject_reason_has_a_text():
    assert list(FAULT_TITLES) == [code for code in FAULTS.names if code]
    assert list(STATUS_ACTIONS) == [bit.name for bit in STATUS.bits]
    assert list(MAINTENANCE_TEXTS) == [bit.name for bit in MAINTENANCE_CAUSES.bits]
    assert list(REJECT_TEXTS) == list(REJECT_REASONS.names.values())


def test_the_titles_of_the_faults_differ_and_fit_the_bar():
    assert len(set(FAULT_TITLES.values())) == len(FAULT_TITLES)
    assert [title for title in FAULT_TITLES.values() if not re.fullmatch(r"[A-Za-z ]{4,32}", title)] == []


def test_the_texts_are_short_sentences():
    texts = [*REJECT_TEXTS.values(), *MAINTENANCE_TEXTS.values(), *filter(None, STATUS_ACTIONS.values())]
    assert [text for text in texts if not re.fullmatch(r"[A-Z].*\.", text)] == []
    assert [text for text in texts if len(text) > MAX_CHARACTERS] == []


def test_the_quantities_in_the_texts_are_sent_to_the_browsers():
    assert {name for text in STATUS_ACTIONS.values() for name in QUANTITY.findall(text)} <= set(STATE)


def test_a_normal_measurement_asks_nothing_of_the_operator():
    normal = {"holding", "vented", "in_contact", "simulated", "calibrated", "function_check"}
    assert {name for name in normal if STATUS_ACTIONS[name]} == set()


def test_the_page_names_buttons_instead_of_registers_and_commands():
    info = instrument_info({})
    texts = [
        *(text for fault in info["faults"].values() for text in (fault["meaning"], fault["action"])),
        *(text for bit in info["status"].values() for text in (bit["meaning"], bit["action"])),
        *info["states"].values(),
        *info["reject_reasons"].values(),
        *info["maintenance"].values(),
    ]
    assert [text for text in texts if WORDS_OF_A_BUS.search(text)] == []
    page = (STATIC / "index.html").read_text()
    for button in BUTTONS:
        assert [text for text in texts if button in text]
        assert re.search(f"<button[^>]*>{button}", page)


def test_the_text_about_a_lost_rig_names_a_time_and_no_configuration_key():
    action = instrument_info({})["faults"][34]["action"]
    assert "within about 2 s" in action
    assert "host_timeout_s" not in action
