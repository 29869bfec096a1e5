"""Tests of the C header that firmware and Python board share."""

from pathlib import Path

import pytest

from pneuforce.sim.board import header

COMMITTED = Path(__file__).parents[2] / header.HEADER


def test_the_committed_header_is_the_generated_header():
    assert COMMITTED.read_text(encoding="utf-8") == header.render(), "run `make docs`"


def test_times_become_whole_milliseconds_and_rates_are_unchanged():
    assert header.literal("HOST_SILENCE_S", 0.25) == ("HOST_SILENCE_MS", "250u")
    assert header.literal("FILL_KPA_PER_S", 5.0) == ("FILL_KPA_PER_S", "5.0f")
    with pytest.raises(ValueError, match="SHORT_S"):
        header.literal("SHORT_S", 0.0005)
