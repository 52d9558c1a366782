"""One simulated walk in MuJoCo, until the last stride, a fall or a halt."""

from collections.abc import Callable
from dataclasses import dataclass
from math import atan, cos, sin

import mujoco
import numpy as np

from anthropometry import walker
from disturbances import PUSH_DURATION_S, Disturbance
from gait_file import Gait
from human import Human
from planned_stride import CONTROL_PERIOD_S, PlannedStride
from prosthesis import Prosthesis, Sensors
from walker_model import POINTS, Contact, build

LOWEST_HIP = 0.8
LARGEST_LEAN_RAD = 1.0
LONGEST_STEP = 1.5


@dataclass(frozen=True)
class Outcome:
    """How a walk ended (`completed`, `fell` or `halted`), and the strides until then."""

    end: str
    strides: int


class Plant:
    """A walker on a terrain."""

    def __init__(self, model: mujoco.MjModel, disturbance: Disturbance) -> None:
        self.model = model
        self.data = mujoco.MjData(model)
        self.terrain = disturbance.terrain
        self._steps = round(CONTROL_PERIOD_S / model.opt.timestep)
        self._spheres = [model.geom(point).id for point in POINTS]
        self._planes = [model.body(f"ground_{point}").mocapid[0] for point in POINTS]
        self._foot_of_geom = {model.geom(point).id: number // 2 for number, point in enumerate(POINTS)}
        self._force = np.zeros(6)
        self._heights_m: list[float | None] = [None] * len(POINTS)

    def move_ground(self) -> None:
        """Moves each plane to the ground below its point. The lowest points of the spheres are the contact points."""
        for point, (sphere, plane) in enumerate(zip(self._spheres, self._planes, strict=True)):
            x = float(self.data.geom_xpos[sphere, 0])
            height, slope = self.terrain.at(x)
            if slope == 0.0 and height == self._heights_m[point]:
                continue
            half = -0.5 * atan(slope)
            self.data.mocap_pos[plane] = (x, 0.0, height)
            self.data.mocap_quat[plane] = (cos(half), 0.0, sin(half), 0.0)
            self._heights_m[point] = height if slope == 0.0 else None

    def loads_n(self) -> tuple[float, float]:
        """Normal force on the left and the right foot in the last step."""
        loads = [0.0, 0.0]
        for number in range(self.data.ncon):
            mujoco.mj_contactForce(self.model, self.data, number, self._force)
            loads[self._foot_of_geom[int(self.data.contact.geom2[number])]] += float(self._force[0])
        return loads[0], loads[1]

    def period(self) -> None:
        """One period of the controller with constant torques."""
        self.move_ground()
        mujoco.mj_step(self.model, self.data, self._steps)


class SimulatedWalker:
    """A gait that walks start from."""

    def __init__(
        self, gait: Gait, contact: Contact, plant: Callable[[mujoco.MjModel, Disturbance], Plant] = Plant
    ) -> None:
        self._gait = gait
        self._plant = plant
        self._contact = contact
        self._plan = PlannedStride(gait)
        # The controllers do not know a change of the body mass; lengths do not change.
        assumed = walker(gait.height_m, gait.body_mass_kg, gait.device)
        self._legs = (assumed.left, assumed.right)
        self._lowest_hip_m = LOWEST_HIP * min(float(domain.q[:, 1].min()) for domain in gait.domains)
        self.step_m = 0.5 * gait.stride_length_m
        self.stride_s = self._plan.duration_s

    def _model(self, mass_factor: float) -> mujoco.MjModel:
        gait, device = self._gait, self._gait.device
        body = walker(gait.height_m, gait.body_mass_kg * mass_factor, device)
        return build(body, (device["ankle_min_rad"], device["ankle_max_rad"]), self._contact)

    def _start(self, disturbance: Disturbance) -> Plant:
        first = self._gait.domains[0]
        plant = self._plant(self._model(disturbance.mass_factor), disturbance)
        data = plant.data
        data.qpos[:] = first.q[0]
        mujoco.mj_kinematics(plant.model, data)
        data.qpos[0] -= data.site("toe_R").xpos[0] - 0.5 * self._legs[1].toe_ahead_m
        data.qvel[:] = first.qd[0] * disturbance.speed_factor
        mujoco.mj_kinematics(plant.model, data)
        return plant

    def walk(self, disturbance: Disturbance, strides: int) -> Outcome:
        """Walks until `strides` strides are complete."""
        plant = self._start(disturbance)
        data = plant.data
        human = Human(self._plan, self._legs, self._gait)
        prosthesis = Prosthesis(self._plan, self._legs[1], self._gait)
        sensors = Sensors(disturbance.delay_periods, disturbance.thigh_offset_rad, disturbance.noise)
        loads, done, periods, last_strike_s = (0.0, 0.0), 0, 0, 0.0
        while done < strides:
            q, qd = data.qpos.copy(), data.qvel.copy()
            left, right = human.control(q, qd, loads)
            prosthesis.control(sensors.sample(q, qd, loads[1]))
            elapsed_s = periods * CONTROL_PERIOD_S
            if left or right:
                last_strike_s = elapsed_s
                done += int(right)
            pushed = 0.0 <= elapsed_s - disturbance.push_start_s < PUSH_DURATION_S
            data.qfrc_applied[0] = disturbance.push_n_s / PUSH_DURATION_S if pushed else 0.0
            data.qfrc_applied[3:7] = human.torques(qd)
            data.qfrc_applied[7:] = [drive.torque_n_m for drive in prosthesis.drives]
            plant.period()
            periods += 1
            loads = plant.loads_n()
            height = data.qpos[1] - plant.terrain.at(float(data.qpos[0]))[0]
            if not height >= self._lowest_hip_m or abs(data.qpos[2]) > LARGEST_LEAN_RAD:
                return Outcome("fell", done)
            if periods * CONTROL_PERIOD_S - last_strike_s > LONGEST_STEP * self.stride_s:
                return Outcome("halted", done)
        return Outcome("completed", done)
