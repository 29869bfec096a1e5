"""Document docs/accuracy.md: the text before, between and after the tables of `pneuforce accuracy`."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import NamedTuple

from pneuforce.instrument.model.pressure_bins import BIN_EDGES_KPA
from pneuforce.instrument.studies.balloon_population import WEIGHT_G
from pneuforce.instrument.studies.population_study import PopulationScores
from pneuforce.instrument.studies.timed_membrane import CONTACT, POLYTROPIC, RigScore
from pneuforce.instrument.validation.accuracy import AccuracyScore, EstimatorScores

CONTACTS_PER_CALIBRATION = 24
INTRODUCTION = """\
# Accuracy on simulated balloons

For everybody who wants to know how accurate the force is, and which calibration is necessary. This
command generates the document:

```sh
.venv/bin/pneuforce accuracy {options}
```

The command takes about half an hour on two processors, and some minutes with `--balloons 12`.

**Which calibration do you need?**

| accuracy from 1 to 3.5 N | what you do |
| --- | --- |
| {energetic:.0f} % | nothing: the energetic method with the constants of the paper |
| {membrane:.0f} % | `calibrate radius` with a caliper, and `method = "membrane"` |
| {weight:.0f} % | in addition, `calibrate grip` with one known weight |
| {sensor:.0f} % | in addition, `calibrate force` with a force sensor |

The accuracies are mean absolute errors on the population of balloons in the next section. They are
results of simulations: your balloon can differ from all of them.

Each cell of the tables has three values, with a dot between them:

- the mean absolute error of the forces from 1 to 3.5 N,
- the RMSE of the forces below 1 N,
- the share of contacts whose true force is within ±2u of the measured force. For a correct uncertainty,
  this share is 95 %.

## A population of {balloons} rubber balloons

Each balloon is drawn at random: Mooney–Rivlin, Gent or Ogden rubber, thickness ±15 %, unevenness of the
thickness ±10 %, grip of the contact 0 to 1, one or two pressed sides, volume of the tubes ±1 %.
Without pressure, all balloons have the radius of the balloon of the paper. Forces
are between 0.2 and 3.5 N, and ΔP_i between 4.95 and 11.45 kPa, but at most 90 % of the limit pressure of
the balloon. The number of pressed sides is configured; the other properties are unknown to the
instrument. Without *radius*, the instrument uses the radii that the paper measured. *Radius* is a
calibration with 12 radii (scatter 0.03 mm). *One weight* is a calibration of the grip with
{weight_g:.0f} g. *Force sensor* is a calibration with 24 contacts.

**Fast contacts.** The contacts are at rest (gas exponent 1.0), also those with the weight and with the
force sensor. Therefore the figures apply to contacts that began more than about a second before. The last
column contains the same contacts, pressed suddenly: the gas still has all heat of its compression, and
each balloon has a gas exponent from 1.0 to 1.2. The [uncertainty](model.md#uncertainty) contains this heat.

{population}

The method `membrane` shows no force in {without_percent:.1f} % of the contacts, near the limit pressure
of the balloon or on a balloon that is pressed nearly flat. The energetic method is evaluated on all contacts,
also on those for which the instrument shows no force because the
[balloon may be pressed flat](model.md#a-balloon-that-is-pressed-flat). A calibration is rejected if it is not
clearly better than the uncalibrated method, which then stays in use.

{rejected}

## Two balloons on the simulated rig

In each simulated contact, a constant force of 0.2 to 3.5 N presses on the balloon. The setpoints are
between 5.05 and 11.35 kPa. The simulation includes the noise of the ADC, a filter and a leak. The
samples pass through the link and the measuring chain of the instrument, which has the default settings.
The reference force is the true force plus a random error with a standard deviation of 0.01 N, like the
reading of a force sensor.

Rows with *calibrated* contain the averages over {calibrations} calibrations by `pneuforce calibrate
force`. Each calibration uses {points} other contacts, which are different from the evaluated contacts.
In rows with *smooth*, the calibration uses `low = "smooth"`. The uncalibrated law replaces a rejected
calibration in the average.
"""
TITLES = {
    "published": "The published balloon, which follows the energetic law",
    "membrane": "The rubber balloon, which is not fitted to the law",
}
TIMED = """\
## The method `membrane` on the rig in time

The population above has no time: its contacts begin at the true ΔP_i. Here, the simulated rig plays the
contacts in time, and its gas heats and cools in each contact (gas exponent {polytropic:g}, 0.3 s). The
next contact begins 1.5 s after the release of the contact before. The rubber balloon slides in part
(`contact = {contact:g}`). Each of the {rigs} rigs has other errors of the gain (±1 %) and of P_0 (1 kPa). The
radius is measured without an error, and one weight of {weight_g:.0f} g calibrates the grip. The contacts of
the table were not used for the calibration.

| estimator | {contacts} contacts | samples within ±2u | force without contact |
| --- | --- | --- | --- |
| membrane, radius, one weight | {cell} | {samples:.1f} % | {false:.2f} % of the time |

*Samples within ±2u* is the share of all samples with a valid force, also while the force changes and
without contact. *Force without contact* is the share of the time without a true force in which a force
above 0 N was shown. This is a short time after each release.
"""
CLOSING = """\
## Interpretation

- On the `published` balloon, the energetic law is exact by construction, except between 7.85 and 9.85
  kPa. Between these pressures, the instrument changes gradually from one part of the law to the other
  part. The simulated balloon has the sudden step of the paper instead. The stated uncertainty covers
  other balloons, so it is too large for this balloon. An uncalibrated instrument does not know which
  balloon it has.
- Your balloon differs from all simulated balloons. To determine the accuracy on your balloon, use a
  force sensor with `pneuforce validate --data` and `pneuforce calibrate force`."""


class AccuracyCampaign(NamedTuple):
    """Extent of an accuracy study."""

    contacts: int  #: evaluated contacts on each balloon
    calibrations: int  #: calibrations on each balloon
    seed: int
    balloons: int  #: number of balloons in the population


class BalloonAccuracy(NamedTuple):
    """Results on one simulated balloon."""

    contacts: int
    estimators: list[EstimatorScores]
    rejected: Mapping[str, int]  #: number of rejected calibrations, by the name of the estimator


def document(
    campaign: AccuracyCampaign,
    population: PopulationScores,
    results: Mapping[str, BalloonAccuracy],
    timed: RigScore,
) -> Iterator[str]:
    """Yield the lines of the document. The keys of `results` are the kinds of simulated balloon."""
    yield introduction(campaign, population)
    for plant, result in results.items():
        yield f"### {TITLES[plant]} (`{plant}`)"
        yield ""
        yield from _table(result.contacts, result.estimators)
        yield ""
        yield rejected_calibrations(result.rejected, campaign.calibrations)
        yield ""
    yield timed_section(timed)
    yield CLOSING


def timed_section(timed: RigScore) -> str:
    """Return the section about the method "membrane" on rigs in time."""
    return TIMED.format(
        rigs=timed.rigs,
        contacts=timed.contacts,
        polytropic=POLYTROPIC,
        contact=CONTACT,
        weight_g=WEIGHT_G,
        cell=_cell(timed.score),
        samples=timed.samples_percent,
        false=timed.false_contact_percent,
    )


def introduction(campaign: AccuracyCampaign, population: PopulationScores) -> str:
    """Return the text before the tables of the two balloons, with the results of the population."""
    mean = {estimator.name: estimator.all.mean_percent for estimator in population.estimators}
    without = population.without_force["membrane, radius"]
    calibrated = {name: count for name, count in population.rejected.items() if ", " in name}
    return INTRODUCTION.format(
        **campaign._asdict(),
        options=" ".join(f"--{name} {value}" for name, value in campaign._asdict().items()),
        points=CONTACTS_PER_CALIBRATION,
        energetic=mean["energetic"],
        membrane=mean["membrane, radius"],
        weight=mean["membrane, radius, one weight"],
        sensor=mean["membrane, radius, one weight, force sensor"],
        weight_g=WEIGHT_G,
        population="\n".join(_table(population.contacts, population.estimators)),
        without_percent=100 * without / population.contacts,
        rejected=rejected_calibrations(calibrated, population.balloons),
    )


def rejected_calibrations(rejected: Mapping[str, int], calibrations: int) -> str:
    """Return the sentence that states how many calibrations were rejected for each estimator."""
    each = ", ".join(f"{count} of {calibrations} ({name})" for name, count in rejected.items())
    return f"Rejected calibrations: {each}."


def _table(contacts: int, estimators: list[EstimatorScores]) -> Iterator[str]:
    bins = [f"{low:.2f}–{high:.2f} kPa" for low, high in pairwise(BIN_EDGES_KPA)]
    fast = ["fast contacts"] if estimators[0].fast else []
    yield "| " + " | ".join(["estimator", f"all {contacts} contacts", *bins, *fast]) + " |"
    yield "| --- " * (len(bins) + len(fast) + 2) + "|"
    for estimator in estimators:
        scores = (estimator.all, *estimator.by_pressure, estimator.fast)
        cells = [_cell(score) for score in scores if score]
        yield "| " + " | ".join([estimator.name, *cells]) + " |"


def _cell(score: AccuracyScore) -> str:
    return f"{score.mean_percent:.1f} % · {score.rmse_n:.3f} N · {score.coverage_percent:.0f} %"
