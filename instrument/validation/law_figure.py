"""The figure of the law's two choices: its step at 8.85 kPa, and its low end."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from instrument.model import PAPER, Balloon, Circuit, Law, contact, estimate
from instrument.model.balloon import LOWEST_RISE_KPA, VALID_HIGH_KPA, VALID_LOW_KPA

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIZE_INCH = (8.0, 3.4)
RISE_KPA, INITIAL_KPA = 1.0, 8.0
RED, BLUE, GREY = "#c8102e", "#1f4e9c", "#999999"


def law(balloon: Balloon, circuit: Circuit) -> Figure:
    """Force over ΔP_i at one rise, and over the rise at one ΔP_i, by every variant."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=SIZE_INCH, layout="constrained")
    step, low = figure.subplots(1, 2)
    initial = np.linspace(VALID_LOW_KPA, VALID_HIGH_KPA, 600)
    for variant, colour, width in ((PAPER, GREY, 3.0), (Law(switch="blend"), RED, 1.3)):
        forces = estimate(initial, initial + RISE_KPA, balloon, circuit, variant).force_n
        step.plot(initial, forces, color=colour, linewidth=width, label=f"switch = {variant.switch}")
    rise = np.linspace(0.0, 2 * LOWEST_RISE_KPA, 400)
    bare = contact(INITIAL_KPA, INITIAL_KPA + rise, balloon, circuit).force_n
    low.plot(rise, bare, color=GREY, linestyle="dotted", label="the bare law")
    for variant, colour in ((PAPER, BLUE), (Law(low="smooth"), RED)):
        forces = estimate(INITIAL_KPA, INITIAL_KPA + rise, balloon, circuit, variant).force_n
        low.plot(rise, forces, color=colour, label=f"low = {variant.low}")
    step.set(xlabel=f"ΔP_i [kPa], rise {RISE_KPA:g} kPa", ylabel="force [N]")
    low.set(xlabel=f"rise ΔP_f − ΔP_i [kPa], ΔP_i = {INITIAL_KPA:g} kPa", ylim=(0, None))
    for axes in (step, low):
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(alpha=0.25)
        axes.legend(frameon=False, fontsize=8)
    return figure
