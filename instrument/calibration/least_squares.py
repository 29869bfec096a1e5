"""Linear least squares with what it leaves: covariance and residual."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from instrument.columns import Numbers


@dataclass(frozen=True, slots=True)
class Fit:
    """Coefficients, how well they are known, and what the points are off by."""

    coefficients: Numbers
    covariance: Numbers
    residuals: Numbers  #: points minus fit, unweighted
    std: float  #: standard deviation of a point of weight 1

    @property
    def stds(self) -> Numbers:
        """Standard uncertainties of the coefficients."""
        stds: Numbers = np.sqrt(np.diag(self.covariance))
        return stds

    @property
    def correlation(self) -> Numbers:
        """The covariance over the standard uncertainties."""
        stds = np.where(self.stds > 0, self.stds, 1.0)
        correlation: Numbers = self.covariance / np.outer(stds, stds)
        return correlation


def fit(basis: Numbers, values: Numbers, weights: Numbers | None = None) -> Fit:
    """Σ (w (y − X c))² is least; the scatter itself tells how well each point is known.

    Columns may differ widely in scale. Raises LinAlgError where the points do not tell the coefficients.
    """
    w = np.ones_like(values) if weights is None else weights / weights.mean()
    scale = np.sqrt(((basis * w[:, None]) ** 2).mean(axis=0))
    x, y = basis * w[:, None] / scale, values * w
    if np.linalg.matrix_rank(x, tol=1e-6 * np.sqrt(len(y))) < x.shape[1]:
        raise np.linalg.LinAlgError("the points do not tell the coefficients")
    inverse = np.linalg.inv(x.T @ x)
    scaled = inverse @ (x.T @ y)
    freedom = len(y) - x.shape[1]
    variance = float(((y - x @ scaled) ** 2).sum() / freedom) if freedom > 0 else float("nan")
    coefficients = scaled / scale
    return Fit(
        coefficients,
        variance * inverse / np.outer(scale, scale),
        values - basis @ coefficients,
        variance**0.5,
    )
