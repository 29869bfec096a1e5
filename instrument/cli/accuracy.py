"""`pneuforce accuracy`: accuracy of each estimator on the simulated balloons, as a document or as JSON."""

from __future__ import annotations

import json

from pneuforce.instrument.cli.output import progress
from pneuforce.instrument.studies.accuracy_document import AccuracyCampaign, document
from pneuforce.instrument.studies.accuracy_study import evaluate, results_to_json


def accuracy(campaign: AccuracyCampaign, as_json: bool) -> str:
    """Return the document docs/accuracy.md in Markdown, or its figures as JSON."""
    with progress("contacts on the simulated rig") as report_progress:
        results = evaluate(campaign, report_progress)
    if as_json:
        return json.dumps(results_to_json(results), indent=2, ensure_ascii=False)
    return "\n".join(document(campaign, results))
