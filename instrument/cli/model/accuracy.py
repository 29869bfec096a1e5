"""`pneuforce accuracy`: accuracy of each estimator on the simulated balloons, as a document or as JSON."""

from __future__ import annotations

from pneuforce.instrument.cli.terminal.output import done_json, progress
from pneuforce.instrument.studies.accuracy_document import AccuracyCampaign, document
from pneuforce.instrument.studies.accuracy_study import (
    evaluate,
    population_to_json,
    results_to_json,
    rig_score_to_json,
)
from pneuforce.instrument.studies.population_study import evaluate_population
from pneuforce.instrument.studies.timed_membrane import evaluate_rigs
from pneuforce.support.counted import counted


def accuracy(campaign: AccuracyCampaign, as_json: bool) -> str:
    """Return the document docs/accuracy.md in Markdown, or its figures as JSON."""
    with progress("population of balloons") as report_progress:
        population = evaluate_population(campaign.balloons, campaign.seed, report_progress)
    with progress("contacts on the simulated rig") as report_progress:
        results = evaluate(campaign, report_progress)
    with progress("membrane on the rig in time") as report_progress:
        timed = evaluate_rigs(campaign.calibrations, campaign.seed, report_progress)
    if as_json:
        facts = {"population": population_to_json(population)} | results_to_json(results)
        facts["membrane_in_time"] = rig_score_to_json(timed)
        return done_json(f"{counted(len(results), 'balloon')}: accuracy of each estimator", **facts)
    return "\n".join(document(campaign, population, results, timed))
