"""The gait as the controllers store it: coordinates, rates and feed-forward torques, sampled at about 1 kHz."""

from bisect import bisect_right
from dataclasses import dataclass
from math import ceil

import numpy as np

from gait_file import Array, Domain, Gait

CONTROL_PERIOD_S = 1e-3


@dataclass(frozen=True)
class SetPoint:
    """Coordinates, rates and torques at one instant."""

    q: Array
    qd: Array
    u: Array


def _samples(domain: Domain) -> Array:
    parts = max(1, ceil(domain.duration_s / CONTROL_PERIOD_S))
    return np.array([np.concatenate(domain.at(k / parts)) for k in range(parts + 1)])


class PlannedStride:
    """The stride over time."""

    def __init__(self, gait: Gait) -> None:
        self._samples = [_samples(domain) for domain in gait.domains]
        durations = [domain.duration_s for domain in gait.domains]
        self._starts_s = [sum(durations[:k]) for k in range(len(durations))]
        self._periods_s = [d / (len(s) - 1) for d, s in zip(durations, self._samples, strict=True)]
        self.duration_s = sum(durations)

    def start_s(self, domain: int) -> float:
        """Start of a domain."""
        return self._starts_s[domain]

    def at(self, time_s: float) -> SetPoint:
        """The plan at a time, limited to the stride."""
        domain = max(0, bisect_right(self._starts_s, time_s) - 1)
        samples = self._samples[domain]
        last = len(samples) - 1
        position = min(max((time_s - self._starts_s[domain]) / self._periods_s[domain], 0.0), float(last))
        before = min(int(position), last - 1)
        row = samples[before] + (position - before) * (samples[before + 1] - samples[before])
        return SetPoint(row[:9], row[9:18], row[18:])

    def ahead(self, time_s: float) -> SetPoint:
        """The plan at a time that may lie in the next stride."""
        return self.at(time_s - self.duration_s if time_s >= self.duration_s else time_s)
