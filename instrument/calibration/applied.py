"""A calibration applied: the chain's settings with what was measured in the place of what was assumed."""

from __future__ import annotations

from dataclasses import replace

from instrument.calibration.file import Calibration, ForcePart, MadeFor, rounded
from instrument.chain import ChainSettings
from instrument.errors import ConfigurationError
from instrument.model import Correction
from instrument.model.correction import MIDDLE_KPA
from instrument.model.law import BLEND_KPA
from instrument.model.uncertainty import ModelErrors

#: Keys of a part that are fields of the balloon.
OF_RADIUS = ("rest_radius_mm", "radius_linear_mm_per_kpa", "radius_quadratic_mm_per_kpa2")
#: Where the configuration has the keys that a calibration may contradict.
SECTION_OF = {
    "method": "measurement",
    "switch": "measurement",
    "low": "measurement",
    "volume_mm3": "circuit",
    "tube_s": "measurement",
}
#: What a release decides, not a configuration.
OF_RELEASE = {
    "blend_kpa": "the width of the blend",
    "middle_kpa": "the ΔP_i at which p is 0",
}
#: What is wrong with these is the same in every contact of one balloon on one circuit: the force calibration
#: has taken it in, and what it left is in its residual.
ABSORBED = ("radius_mm", "volume_mm3", "young_kpa", "rest_thickness_mm", "poisson")


def calibrated(own: ChainSettings, calibration: Calibration) -> ChainSettings:
    """The settings after a calibration. Raises ConfigurationError where it contradicts them."""
    for measure in (_radius, _volume, _lag):
        own = measure(own, calibration)
    return _force(own, calibration.force) if calibration.force else own


def made_for(own: ChainSettings) -> MadeFor:
    """What a force calibration of these settings holds for."""
    law, balloon = own.law, own.balloon
    return MadeFor(
        method=law.method,
        switch=law.switch,
        blend_kpa=BLEND_KPA,
        low=law.low,
        middle_kpa=MIDDLE_KPA,
        young_kpa=balloon.young_kpa,
        poisson=balloon.poisson,
        rest_radius_mm=balloon.rest_radius_mm,
        rest_thickness_mm=balloon.rest_thickness_mm,
        radius_linear_mm_per_kpa=balloon.radius_linear_mm_per_kpa,
        radius_quadratic_mm_per_kpa2=balloon.radius_quadratic_mm_per_kpa2,
        volume_mm3=own.circuit.volume_mm3,
    )


def stale(own: ChainSettings, force: ForcePart) -> list[str]:
    """Sentences about what the force calibration was made for and the settings no longer are."""
    now = made_for(own)
    return [
        f"{_place(key)} = {value!r}, and its force calibration was made for {getattr(force.made_for, key)!r}"
        for key, value in now
        if value != getattr(force.made_for, key)
    ]


def _place(key: str) -> str:
    """How a user names a key."""
    return OF_RELEASE.get(key) or f"{SECTION_OF.get(key, 'balloon')}.{key}"


def _radius(own: ChainSettings, calibration: Calibration) -> ChainSettings:
    part = calibration.radius
    if part is None:
        return own
    assumed = ChainSettings().balloon
    measured = {key: getattr(part, key) for key in OF_RADIUS}
    for key, value in measured.items():
        _agree(key, getattr(own.balloon, key), getattr(assumed, key), value)
    errors = replace(own.errors, radius_mm=part.residual_mm)
    return replace(own, balloon=replace(own.balloon, **measured), errors=errors)


def _volume(own: ChainSettings, calibration: Calibration) -> ChainSettings:
    part = calibration.volume
    if part is None:
        return own
    _agree("volume_mm3", own.circuit.volume_mm3, ChainSettings().circuit.volume_mm3, part.volume_mm3)
    return replace(
        own,
        circuit=replace(own.circuit, volume_mm3=part.volume_mm3),
        errors=replace(own.errors, volume_mm3=part.volume_std_mm3),
    )


def _lag(own: ChainSettings, calibration: Calibration) -> ChainSettings:
    part = calibration.lag
    if part is None:
        return own
    _agree("tube_s", own.tube_s, ChainSettings().tube_s, part.tube_s)
    return replace(own, tube_s=part.tube_s, lag_share=part.tube_std_s / part.tube_s)


def _agree(key: str, configured: float, assumed: float, measured: float) -> None:
    """A key left at its default gives way to what was measured; any other value is somebody's word."""
    if rounded(configured) not in (rounded(assumed), measured):
        raise ConfigurationError(
            f"{_place(key)} = {configured!r} contradicts the calibration, which "
            f"measured {measured!r}: delete one of them"
        )


def _force(own: ChainSettings, part: ForcePart) -> ChainSettings:
    differing = stale(own, part)
    if differing:
        raise ConfigurationError("; ".join(differing) + ": calibrate the force again, or change it back")
    correction = Correction(
        constant=part.constant,
        by_rise=part.by_rise,
        by_initial=part.by_initial_per_kpa,
        by_both=part.by_both_per_kpa,
        by_step=part.by_step,
        law=own.law,
        balloon=own.balloon,
        rise_span_kpa=(part.rise_low_kpa, part.rise_high_kpa),
        initial_span_kpa=(part.initial_low_kpa, part.initial_high_kpa),
    )
    model = ModelErrors(
        share_below=part.residual_share,
        share_above=part.residual_share,
        floor_n=part.residual_floor_n,
        join=False,
    )
    return replace(
        own, correction=correction, model=model, errors=replace(own.errors, **dict.fromkeys(ABSORBED, 0.0))
    )
