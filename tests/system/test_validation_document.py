"""Tests that docs/validation.md has the results of the program, and that sentences agree with tables."""

import re

import pytest

from tests.system.validation_document import FILE, PLANTS, block_of, short_campaign_row

DOCUMENT = FILE.read_text(encoding="utf-8")
SENTENCES = " ".join(DOCUMENT.partition("\n## Interpretation\n")[2].partition("\nDifferences ")[0].split())
PUBLISHED, MEMBRANE = (block_of(DOCUMENT, plant) for plant in PLANTS)


def group(block, name):
    """Return the mean errors [%] of the energetic, Lulevich's and Shanahan's method in a group."""
    row = re.search(rf"^ +{re.escape(name)} +\d+ (.*)$", block, re.MULTILINE)[1]
    return [float(error) for error in re.findall(r"([\d.]+)/", row)]


def number(block, pattern):
    """Return the number that the pattern finds in the results of a campaign."""
    return float(re.search(pattern, block)[1])


@pytest.mark.parametrize("plant", PLANTS)
def test_the_document_has_the_results_of_the_short_campaign(plant):
    assert short_campaign_row(plant) in DOCUMENT


def test_the_sentences_have_the_figures_of_the_tables():
    without_s = number(MEMBRANE, r"(\d+) s of them without")
    delay_s = number(MEMBRANE, r"−([\d.]+) s  ")
    low, high, mean = re.search(r"kPa: ([\d.]+) to ([\d.]+), mean ([\d.]+)", MEMBRANE).groups()
    for sentence in (
        f"for {without_s:.0f} s of the campaign on the membrane plant",
        f"The error of {group(PUBLISHED, 'all contacts')[0]:.1f} % on this plant",
        f"for forces of 1 to 3.5 N is {group(MEMBRANE, 'of them 1 to 3.5 N')[0]:.0f} %",
        f"is {float(low):.2f} to {float(high):.2f} (mean {float(mean):.2f}) on the membrane plant",
        f"The best delay, {delay_s:.3f} s",
    ):
        assert sentence in SENTENCES


def test_the_comparisons_of_the_sentences_are_those_of_the_tables():
    energetic, lulevich, shanahan = group(MEMBRANE, "4.95–6.25 kPa")
    assert energetic < lulevich < shanahan
    energetic, _, shanahan = group(MEMBRANE, "above 8.85 kPa")
    assert shanahan == pytest.approx(energetic, rel=0.01)
    _, lulevich, shanahan = group(MEMBRANE, "ΔV/V_i < 0.2")
    assert shanahan < lulevich
    for block in (PUBLISHED, MEMBRANE):
        live, shifted = (
            number(block, rf"{name} .*?(0\.\d{{3}})  ") for name in ("compensation", "afterwards")
        )
        assert live < shifted
