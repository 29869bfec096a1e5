"""Weighted linear least squares with the covariance of the coefficients."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneuforce.support.columns import Numbers


@dataclass(frozen=True, slots=True)
class LinearFit:
    """Coefficients of a linear fit, their covariance, and the residuals of the points."""

    coefficients: Numbers
    covariance: Numbers
    residuals: Numbers  #: points minus fit, unweighted
    std: float  #: standard deviation of a point of weight 1

    @property
    def stds(self) -> Numbers:
        """Return the standard uncertainties of the coefficients."""
        stds: Numbers = np.sqrt(np.diag(self.covariance))
        return stds

    @property
    def correlation(self) -> Numbers:
        """Return the correlation matrix of the coefficients."""
        stds = np.where(self.stds > 0, self.stds, 1.0)
        correlation: Numbers = self.covariance / np.outer(stds, stds)
        return correlation


def fit_linear(basis: Numbers, values: Numbers, weights: Numbers | None = None) -> LinearFit:
    """Return the coefficients c that minimise Σ (w (y − X c))².

    `basis` is X, of shape (points, coefficients). `values` is y and `weights` is w, one element per point.
    The variance of the points is estimated from the residuals. The columns of X may differ widely in scale.
    Raises LinAlgError if the points do not determine the coefficients.
    """
    w = np.ones_like(values) if weights is None else weights / weights.mean()
    scale = np.sqrt(((basis * w[:, None]) ** 2).mean(axis=0))
    x, y = basis * w[:, None] / scale, values * w
    if np.linalg.matrix_rank(x, tol=1e-6 * np.sqrt(len(y))) < x.shape[1]:
        raise np.linalg.LinAlgError("the points do not determine the coefficients")
    inverse = np.linalg.inv(x.T @ x)
    scaled = inverse @ (x.T @ y)
    degrees_of_freedom = len(y) - x.shape[1]
    variance = float("nan")
    if degrees_of_freedom > 0:
        variance = float(((y - x @ scaled) ** 2).sum() / degrees_of_freedom)
    coefficients = scaled / scale
    return LinearFit(
        coefficients,
        variance * inverse / np.outer(scale, scale),
        values - basis @ coefficients,
        variance**0.5,
    )
