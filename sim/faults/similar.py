"""Faults that an unknown name can mean: by a similar name, the response, or words of the description."""

from __future__ import annotations

import re
from difflib import get_close_matches

from pneuforce.sim.faults.catalogue import CATALOGUE
from pneuforce.sim.faults.kind import FaultKind

#: Words of users that no description contains, and the faults that they can mean.
_SYNONYMS = {
    "kink": ("occluded",),
    "blocked": ("occluded", "inlet_shut", "vent_shut"),
    "clogged": ("occluded", "inlet_shut", "vent_shut"),
    "usb": ("cable_pulled",),
    "power": ("board_reset", "supply_low", "supply_high"),
}
_LONG_WORD = re.compile("[a-z]{4,}")  #: shorter words, for example "the", are in each description


def similar_names(name: str) -> list[str]:
    """Return the names of the faults that `name` can mean.

    Examples: "leek" is similar to `leak`. The board answers `occluded` with the fault "occlusion". The
    description of `occluded` contains both words of "kinked tube".
    """
    close = get_close_matches(name, CATALOGUE)
    meant = [kind.name for kind in CATALOGUE.values() if _means(name.lower(), kind)]
    synonyms = [fault for word in re.findall("[a-z]+", name.lower()) for fault in _SYNONYMS.get(word, ())]
    return list(dict.fromkeys([*close, *synonyms, *meant]))


def _means(name: str, kind: FaultKind) -> bool:
    response = kind.board_fault.name.lower() if kind.board_fault is not None else kind.effect
    words = set(_LONG_WORD.findall(name))
    described = bool(words) and words <= set(_LONG_WORD.findall(kind.description.lower()))
    return described or (bool(name) and re.sub(r"\W+", "_", name) == response)
