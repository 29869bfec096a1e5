"""Figure of the variants of the force law: the force around 8.85 kPa, and the force at low rises."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pneuforce.instrument.model import PAPER_LAW, Balloon, Circuit, ForceLaw, estimate, solve_contact
from pneuforce.instrument.model.balloon import MIN_RISE_KPA, VALID_HIGH_KPA, VALID_LOW_KPA

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIZE_INCH = (8.0, 3.4)
RISE_KPA, BASELINE_KPA = 1.0, 8.0
RED, BLUE, GREY = "#c8102e", "#1f4e9c", "#999999"


def draw_law(balloon: Balloon, circuit: Circuit) -> Figure:
    """Return a figure with two plots: force over ΔP_i at one rise, and force over the rise at one ΔP_i."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=SIZE_INCH, layout="constrained")
    step, low = figure.subplots(1, 2)
    baseline = np.linspace(VALID_LOW_KPA, VALID_HIGH_KPA, 600)
    for variant, colour, width in ((PAPER_LAW, GREY, 3.0), (ForceLaw(switch="blend"), RED, 1.3)):
        forces = estimate(baseline, baseline + RISE_KPA, balloon, circuit, variant).force_n
        step.plot(baseline, forces, color=colour, linewidth=width, label=f"switch = {variant.switch}")
    rise = np.linspace(0.0, 2 * MIN_RISE_KPA, 400)
    unjoined = solve_contact(BASELINE_KPA, BASELINE_KPA + rise, balloon, circuit).force_n
    low.plot(rise, unjoined, color=GREY, linestyle="dotted", label="law without a join to zero")
    for variant, colour in ((PAPER_LAW, BLUE), (ForceLaw(low="smooth"), RED)):
        forces = estimate(BASELINE_KPA, BASELINE_KPA + rise, balloon, circuit, variant).force_n
        low.plot(rise, forces, color=colour, label=f"low = {variant.low}")
    step.set(xlabel=f"ΔP_i [kPa], rise {RISE_KPA:g} kPa", ylabel="force [N]")
    low.set(xlabel=f"rise ΔP_f − ΔP_i [kPa], ΔP_i = {BASELINE_KPA:g} kPa", ylim=(0, None))
    for axes in (step, low):
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(alpha=0.25)
        axes.legend(frameon=False, fontsize=8)
    return figure
