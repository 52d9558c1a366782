"""Spearman's rank correlation with a bootstrap interval over gaits."""

import numpy as np
from scipy.stats import rankdata

from gait_file import Array

RESAMPLES = 10_000
SEED = 1


def _correlation(x: Array, y: Array) -> float:
    """NaN if either is constant."""
    a, b = rankdata(x), rankdata(y)
    a, b = a - a.mean(), b - b.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / size if size > 0.0 else float("nan")


def spearman(x: Array, y: Array) -> str:
    """The correlation with its 95 % percentile interval, or why there is none."""
    value = _correlation(x, y)
    if np.isnan(value):
        return "none: all equal in one plant"
    random = np.random.default_rng(SEED)
    draws = random.integers(len(x), size=(RESAMPLES, len(x)))
    resampled = np.array([_correlation(x[d], y[d]) for d in draws])
    undefined = int(np.isnan(resampled).sum())
    low, high = np.nanquantile(resampled, [0.025, 0.975])
    text = f"{value:.2f} ({low:.2f} to {high:.2f})"
    return f"{text}; {undefined} of {RESAMPLES} resamples without a value" if undefined else text
