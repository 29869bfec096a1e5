"""Peaks of simulated presses: found by the peak tracker, and true."""

import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from pneuforce.instrument.measurement.chain_settings import ChainSettings
from pneuforce.instrument.measurement.peak import PeakTracker
from pneuforce.instrument.model.curve import ContactCurve
from pneuforce.instrument.studies.measured_playback import measure_playback
from pneuforce.sim.headless import Playback
from pneuforce.sim.scenario import Scenario

PAUSE_S = 1.2
SAMPLES_OF_HALF_SINE = 100


class Press(NamedTuple):
    """One press of the simulated hand, and the peaks that were found during this press."""

    true_n: float  #: greatest force, by the force law from the true pressures of the simulation
    true_host_s: float  #: time of this force on the clock of the host
    greatest_n: float  #: greatest force of all samples
    peaks: list

    @property
    def error(self):
        """Return the relative error of the first peak."""
        return self.peaks[0].force_n / self.true_n - 1


def half_sine(force_n, duration_s):
    """Return the table of a press that has the shape of a half sine."""
    return {"kind": "half_sine", "force_n": force_n, "duration_s": duration_s, "pause_s": PAUSE_S}


def plateau(force_n, hold_s):
    """Return the table of a press whose force rises and falls with at most 10 N/s."""
    return {"kind": "press", "force_n": force_n, "hold_s": hold_s, "pause_s": PAUSE_S}


def simulated_presses(contacts, setpoint_kpa, plant="published", seed=1, pneumatics=None, settings=None):
    """Return each press of a simulated rig that plays `contacts` once."""
    table = {
        "doc": "peaks",
        "seed": seed,
        "plant": {"kind": plant},
        "pneumatics": pneumatics or {},
    }
    with TemporaryDirectory() as folder:
        rows = [_with_file(contact, Path(folder), n) for n, contact in enumerate(contacts)]
        phases = [{"setpoint_kpa": [setpoint_kpa], "contact": rows}]
        scenario = Scenario.model_validate(table | {"phase": phases}, context={"folder": Path(folder)})
        return _presses(Playback(scenario), settings or ChainSettings())


def _with_file(contact, folder, number):
    if contact["kind"] != "half_sine":
        return contact
    rows = ["t_s,force_n"]
    for n in range(SAMPLES_OF_HALF_SINE + 1):
        share = n / SAMPLES_OF_HALF_SINE
        force_n = contact["force_n"] * math.sin(math.pi * share)
        rows.append(f"{share * contact['duration_s']:.6f},{force_n:.6f}")
    file = folder / f"half_sine_{number}.csv"
    file.write_text("\n".join(rows) + "\n")
    return {"kind": "profile", "file": file.name, "pause_s": contact["pause_s"]}


def _presses(playback, settings):
    tracker, pressed, presses, peaks = PeakTracker(settings.tube_time_constant_s), [], [], []
    for m, truth in measure_playback(playback, settings):
        peaks += tracker.step(m)
        if truth.force_n > 0:
            pressed.append((truth, m))
        elif pressed and not m.in_contact and truth.t_s - pressed[-1][0].t_s > PAUSE_S / 2:
            presses.append(_press(pressed, peaks))
            pressed, peaks = [], []
    return presses


def _press(pressed, peaks):
    truth, m = max(pressed, key=lambda pair: pair[0].balloon_kpa - pair[0].baseline_kpa)
    curve = ContactCurve(truth.baseline_kpa, ChainSettings().force_model)
    true_n = curve.force_n(truth.balloon_kpa - truth.baseline_kpa)
    greatest_n = max((m.force_n for _, m in pressed if math.isfinite(m.force_n)), default=math.nan)
    return Press(true_n, m.t_s, greatest_n, peaks)
