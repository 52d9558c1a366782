"""Disturbances of a simulated walk, of the kinds and sizes of `gaitwright simulate`, with draws of their own."""

from dataclasses import dataclass

import numpy as np

from gait_file import Array

MASS_CHANGE = 0.05
SPEED_CHANGE = 0.05
PUSH_N_S = 5.0
PUSH_DURATION_S = 0.1
DELAY_PERIODS = 10
THIGH_OFFSET_RAD = 8.7e-3
PLATEAUS = 64
RAMP_M = 0.1


class Terrain:
    """A plateau for each step, joined by ramps between two footholds."""

    def __init__(self, spacing_m: float, heights_m: Array) -> None:
        self._spacing_m = spacing_m
        self._heights_m = heights_m.tolist()

    def at(self, x_m: float) -> tuple[float, float]:
        """Height, m, and slope at a place, in m from the first foothold."""
        position = x_m / self._spacing_m + 0.5
        last = len(self._heights_m) - 1
        plateau = min(max(int(position // 1), 0), last)
        here = self._heights_m[plateau]
        from_ramp_m = (position - plateau - 1.0) * self._spacing_m + RAMP_M
        if plateau == last or from_ramp_m <= 0.0:
            return here, 0.0
        slope = (self._heights_m[plateau + 1] - here) / RAMP_M
        return here + slope * from_ramp_m, slope


@dataclass(frozen=True)
class Disturbance:
    """Everything that is random in a walk."""

    mass_factor: float
    speed_factor: float
    push_start_s: float
    push_n_s: float
    delay_periods: int
    thigh_offset_rad: float
    terrain: Terrain
    noise: np.random.Generator | None


def undisturbed() -> Disturbance:
    """Level ground, and exact sensors with half of the largest delay."""
    return Disturbance(1.0, 1.0, 0.0, 0.0, DELAY_PERIODS // 2, 0.0, Terrain(1.0, np.zeros(1)), None)


def random(seed: int, walk: int, ground_m: float, step_m: float, pushed_within_s: float) -> Disturbance:
    """Walks with the same seed and number share all draws on every ground: heights scale."""
    draws = np.random.default_rng([seed, walk])
    mass, speed, push = draws.uniform(-1.0, 1.0, 3).tolist()
    push_start_s = pushed_within_s * float(draws.uniform())
    delay_periods = round(DELAY_PERIODS * float(draws.uniform()))
    thigh_offset_rad = THIGH_OFFSET_RAD * float(draws.standard_normal())
    heights_m = ground_m * draws.uniform(-1.0, 1.0, PLATEAUS)
    heights_m[0] = 0.0
    return Disturbance(
        1.0 + MASS_CHANGE * mass,
        1.0 + SPEED_CHANGE * speed,
        push_start_s,
        PUSH_N_S * push,
        delay_periods,
        thigh_offset_rad,
        Terrain(step_m, heights_m),
        draws,
    )
