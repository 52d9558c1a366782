"""The walker of MuJoCo on the documented force law of level ground, in place of MuJoCo's contact solver.

The normal force is `k d (1 + d' / v)`, and friction is smoothed Coulomb friction (Geyer and Herr 2010). The velocities at
the end of a step solve the equations of motion with the forces of ground and joint stops at the end.
"""

import mujoco
import numpy as np

from gait_file import Array
from walker_model import (
    FRICTION,
    GRAVITY,
    POINTS,
    RELEASE_SPEED_M_S,
    STOP_DAMPING_N_M_S_RAD,
    STOP_STIFFNESS_N_M_RAD,
)

SLIP_SPEED_M_S = 0.01
ITERATIONS = 30
CONVERGED = 1e-9
SHORTEST = 1e-3


class ForceLawGround:
    """One plant step after another, of `step_s` each."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, yield_m: float, step_s: float) -> None:
        self._model, self._data, self._step_s = model, data, step_s
        model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
        self._stiffness = float(model.body_mass.sum()) * GRAVITY / yield_m
        self._sites = [model.site(point).id for point in POINTS]
        ankle = model.joint("ankle_R").range
        # Coordinate, direction and limit.
        self._stops = ((4, 1.0, 0.0), (7, 1.0, 0.0), (8, 1.0, float(ankle[0])), (8, -1.0, float(ankle[1])))
        self.loads_n = (0.0, 0.0)

    def step(self) -> None:
        """Advances the data by one step under `qfrc_applied`."""
        model, data, h = self._model, self._data, self._step_s
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mass = np.zeros((model.nv, model.nv))
        for column, unit in enumerate(np.eye(model.nv)):
            mujoco.mj_mulM(model, data, mass[column], unit)
        smooth = data.qfrc_applied - data.qfrc_bias
        jacobians = np.zeros((len(POINTS), 3, model.nv))
        for jacobian, site in zip(jacobians, self._sites, strict=True):
            mujoco.mj_jacSite(model, data, jacobian, None, site)
        along, up = jacobians[:, 0], jacobians[:, 2]
        depths = -data.site_xpos[self._sites, 2]
        before = data.qvel.copy()

        def residual(v: Array) -> tuple[Array, Array, Array]:
            """Residual of the momentum, its Jacobian, and the normal forces."""
            r, slope = mass @ (v - before) - h * smooth, mass.copy()
            rate, slip = -up @ v, along @ v
            depth, damping = depths + h * rate, 1.0 + rate / RELEASE_SPEED_M_S
            touches = (depth > 0.0) & (damping > 0.0)
            normal = np.where(touches, self._stiffness * depth * damping, 0.0)
            by_rate = np.where(touches, self._stiffness * (h * damping + depth / RELEASE_SPEED_M_S), 0.0)
            speed = np.hypot(slip, SLIP_SPEED_M_S)
            ratio = -FRICTION * slip / speed
            r -= h * (up.T @ normal + along.T @ (normal * ratio))
            slope += h * up.T @ (by_rate[:, None] * up) + h * along.T @ ((ratio * by_rate)[:, None] * up)
            slope += h * along.T @ ((normal * FRICTION * SLIP_SPEED_M_S**2 / speed**3)[:, None] * along)
            for c, direction, limit in self._stops:
                excess = direction * (limit - data.qpos[c]) - h * direction * v[c]
                torque = STOP_STIFFNESS_N_M_RAD * excess - STOP_DAMPING_N_M_S_RAD * direction * v[c]
                if excess > 0.0 and torque > 0.0:
                    r[c] -= h * direction * torque
                    slope[c, c] += h * (h * STOP_STIFFNESS_N_M_RAD + STOP_DAMPING_N_M_S_RAD)
            return r, slope, normal

        v = before
        r, slope, normal = residual(v)
        for _ in range(ITERATIONS):
            change = np.linalg.solve(slope, -r)
            fraction = 1.0
            following = residual(v + change)
            while np.linalg.norm(following[0]) > np.linalg.norm(r) and fraction > SHORTEST:
                fraction *= 0.5
                following = residual(v + fraction * change)
            v = v + fraction * change
            r, slope, normal = following
            if np.abs(change).max() < CONVERGED:
                break
        data.qvel[:] = v
        data.qpos[:] += h * v
        self.loads_n = (float(normal[:2].sum()), float(normal[2:].sum()))
