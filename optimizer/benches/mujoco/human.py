"""The person: compliant tracking of both hips, the intact knee and the intact ankle, with a lag."""

from math import exp

import numpy as np

from anthropometry import Leg
from gait_file import Array, Gait
from planned_stride import CONTROL_PERIOD_S, PlannedStride
from stride_clock import FootContact, StrideClock

LAG_S = 0.025
# Stiffness, N m/rad, and damping, N m s/rad.
THIGH = (250.0, 18.0)
TORSO = (300.0, 40.0)
STANCE = ((250.0, 15.0), (250.0, 12.0))
SWING = ((100.0, 6.0), (40.0, 2.0))
LIGHT_N = 50.0
PASSIVE_DAMPING_N_M_S_RAD = 1.0
SLOWEST_HIP_M_S = 0.1
LEFT_STANCE = 4
# Coordinates of the joints hip_L, knee_L, ankle_L and hip_R.
JOINTS = (3, 4, 5, 6)


def hip_gradient(leg: Leg, hip: int) -> Array:
    """Gradient of the linearised hip position over the toe of a leg, for the nine coordinates."""
    gradient = np.zeros(9)
    lengths = leg.thigh_m + leg.shank_m + leg.ankle_height_m
    gradient[2] = lengths
    gradient[hip] = -lengths
    gradient[hip + 1] = leg.shank_m + leg.ankle_height_m
    gradient[hip + 2] = -leg.ankle_height_m
    return gradient


class Human:
    """The human part of the walker. Senses without error."""

    def __init__(self, plan: PlannedStride, legs: tuple[Leg, Leg], gait: Gait) -> None:
        self._plan = plan
        self._left_gradient = hip_gradient(legs[0], 3)
        self._right_gradient = hip_gradient(legs[1], 6)
        self._clock = StrideClock()
        self._feet = (FootContact(), FootContact())
        self._limits = gait.torque_limits_n_m()
        self._lagged = [float(plan.at(0.0).u[c - 3]) for c in JOINTS]
        self._planned_rates = plan.at(0.0).qd
        self._share = 1.0 - exp(-CONTROL_PERIOD_S / LAG_S)

    def _heel_strikes(self, loads_n: tuple[float, float]) -> tuple[bool, bool]:
        for foot, load in zip(self._feet, loads_n, strict=True):
            foot.update(load)
        middle_s, end_s = self._plan.start_s(LEFT_STANCE), self._plan.duration_s
        if self._clock.time_s >= middle_s:
            return False, self._clock.restart_at(0.0, (middle_s, end_s), self._feet[1])
        return self._clock.restart_at(middle_s, (0.0, middle_s), self._feet[0]), False

    def control(self, q: Array, qd: Array, loads_n: tuple[float, float]) -> tuple[bool, bool]:
        """One period of the controller. Returns whether the left and the right heel strike."""
        strikes = self._heel_strikes(loads_n)
        plan, clock = self._plan, self._clock
        middle_s = plan.start_s(LEFT_STANCE)
        in_left_stance = clock.time_s >= middle_s
        end_s = plan.duration_s if in_left_stance else middle_s - 1e-9
        gradient = self._left_gradient if in_left_stance else self._right_gradient
        now = plan.at(clock.time_s)
        clock.advance(
            CONTROL_PERIOD_S, end_s, float(gradient @ (q - now.q)), float(gradient @ now.qd), SLOWEST_HIP_M_S
        )
        now, anticipated = plan.at(clock.time_s), plan.ahead(clock.time_s + LAG_S)
        self._planned_rates = now.qd
        error, error_rate = (now.q - q).tolist(), (now.qd - qd).tolist()
        upright = TORSO[0] * error[2] + TORSO[1] * error_rate[2]
        loaded = max(sum(loads_n), LIGHT_N)
        gains = STANCE if self._feet[0].loaded else SWING
        feed_forward = anticipated.u.tolist()
        for joint, c in enumerate(JOINTS):
            if c in (4, 5):
                stiffness, damping = gains[c - 4]
                feedback = stiffness * error[c] + damping * error_rate[c]
            else:
                share = loads_n[0 if c == 3 else 1] / loaded
                thigh = THIGH[0] * (error[c] - error[2]) + THIGH[1] * (error_rate[c] - error_rate[2])
                feedback = (1.0 - share) * thigh + share * upright
            low, high = self._limits[joint]
            wanted = min(max(feed_forward[c - 3] + feedback, low), high)
            self._lagged[joint] += self._share * (wanted - self._lagged[joint])
        return strikes

    def torques(self, qd: Array) -> Array:
        """Torques of hip_L, knee_L, ankle_L and hip_R, N m."""
        return np.array(self._lagged) + PASSIVE_DAMPING_N_M_S_RAD * (self._planned_rates[3:7] - qd[3:7])
