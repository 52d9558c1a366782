"""The prosthesis: what it measures, its controller at 1 kHz, and its drives."""

from collections import deque
from dataclasses import dataclass
from math import pi

import numpy as np

from anthropometry import Leg
from gait_file import Array, Gait
from planned_stride import CONTROL_PERIOD_S, PlannedStride
from stride_clock import FootContact, StrideClock

# Stiffness, N m/rad, and damping, N m s/rad, of knee and ankle.
STANCE = ((450.0, 15.0), (300.0, 6.0))
SWING = ((250.0, 12.0), (15.0, 0.4))
# Time from zero to the largest torque, s.
RISE_S = 0.04
SWING_STARTS = 6
SLOWEST_HIP_M_S = 0.3
SLOWEST_THIGH_RAD_S = 1.0

ANGLE_STEP_RAD = 2 * pi / 16384
RATE_STEP_RAD_S = ANGLE_STEP_RAD / 50 / CONTROL_PERIOD_S
FORCE_STEP_N = 1.0
ANGLE_NOISE_RAD = 5e-4
RATE_NOISE_RAD_S = 0.02
THIGH_NOISE_RAD = 3e-3
FORCE_NOISE_N = 5.0


@dataclass(frozen=True)
class Readings:
    """Thigh angle in space, knee and ankle with their rates, and the vertical force on the foot."""

    thigh_rad: float
    joints_rad: tuple[float, float]
    rates_rad_s: tuple[float, float]
    load_n: float


class Sensors:
    """A delay of whole periods, after noise and quantisation. Without a source of noise they are exact."""

    def __init__(self, delay_periods: int, thigh_offset_rad: float, noise: np.random.Generator | None) -> None:
        self._delay_periods = delay_periods
        self._thigh_offset_rad = thigh_offset_rad
        self._noise = noise
        self._delayed: deque[Readings] = deque()

    def sample(self, q: Array, qd: Array, load_n: float) -> Readings:
        """Takes a sample, and returns the one that arrives now."""
        now = Readings(float(q[6] - q[2]), (float(q[7]), float(q[8])), (float(qd[7]), float(qd[8])), load_n)
        if not self._delayed:
            self._delayed.extend([now] * self._delay_periods)
        if self._noise is not None:
            now = self._with_noise(now, self._noise.standard_normal(6))
        self._delayed.append(now)
        return self._delayed.popleft()

    def _with_noise(self, exact: Readings, draws: Array) -> Readings:
        def rounded(value: float, step: float) -> float:
            return round(value / step) * step

        angles = [rounded(a + ANGLE_NOISE_RAD * n, ANGLE_STEP_RAD) for a, n in zip(exact.joints_rad, draws[1:3])]
        rates = [rounded(r + RATE_NOISE_RAD_S * n, RATE_STEP_RAD_S) for r, n in zip(exact.rates_rad_s, draws[3:5])]
        thigh = exact.thigh_rad + self._thigh_offset_rad + THIGH_NOISE_RAD * draws[0]
        load = rounded(exact.load_n + FORCE_NOISE_N * draws[5], FORCE_STEP_N)
        return Readings(float(thigh), (angles[0], angles[1]), (rates[0], rates[1]), load)


class Drive:
    """A torque that follows its command within limits of magnitude and rate."""

    def __init__(self, limit_n_m: float) -> None:
        self._limit = limit_n_m
        self._reach = limit_n_m / RISE_S * CONTROL_PERIOD_S
        self.torque_n_m = 0.0

    def follow(self, command_n_m: float) -> None:
        change = min(max(command_n_m, -self._limit), self._limit) - self.torque_n_m
        self.torque_n_m += min(max(change, -self._reach), self._reach)


def hip_position(leg: Leg, thigh: float, knee: float, ankle: float) -> float:
    """Linearised hip position over the toe, m; also its rate."""
    shank = thigh - knee
    return -(leg.thigh_m * thigh + leg.shank_m * shank + leg.ankle_height_m * (shank + ankle))


class Prosthesis:
    """Proportional-derivative tracking of knee and ankle with feed-forward torques."""

    def __init__(self, plan: PlannedStride, leg: Leg, gait: Gait) -> None:
        self._plan = plan
        self._leg = leg
        self._clock = StrideClock()
        self._foot = FootContact()
        self.drives = [Drive(gait.device["knee_torque_limit_n_m"]), Drive(gait.device["ankle_torque_limit_n_m"])]

    def control(self, measured: Readings) -> None:
        """One period of the controller."""
        plan, clock = self._plan, self._clock
        self._foot.update(measured.load_n)
        swing_s, end_s = plan.start_s(SWING_STARTS), plan.duration_s
        clock.restart_at(0.0, (swing_s, end_s), self._foot)
        now = plan.at(clock.time_s)
        thigh, thigh_rate = now.q[6] - now.q[2], now.qd[6] - now.qd[2]
        if clock.time_s < swing_s:
            planned = hip_position(self._leg, thigh, now.q[7], now.q[8])
            rate = hip_position(self._leg, thigh_rate, now.qd[7], now.qd[8])
            error = hip_position(self._leg, measured.thigh_rad, *measured.joints_rad) - planned
            slowest = SLOWEST_HIP_M_S
        else:
            error, rate, slowest = measured.thigh_rad - thigh, thigh_rate, SLOWEST_THIGH_RAD_S
        clock.advance(CONTROL_PERIOD_S, end_s, error, rate, slowest)
        now = plan.at(clock.time_s)
        gains = STANCE if self._foot.loaded else SWING
        for joint, drive in enumerate(self.drives):
            stiffness, damping = gains[joint]
            command = now.u[4 + joint] + stiffness * (now.q[7 + joint] - measured.joints_rad[joint])
            drive.follow(float(command + damping * (now.qd[7 + joint] - measured.rates_rad_s[joint])))
