"""Checks of the plant: inverse dynamics and impacts of gaits, energy in flight, and the weight of a standing walker.

    python check_plant.py GAIT.json...
"""

import sys
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from anthropometry import walker
from gait_file import Array, ContactRow, Domain, Gait, read_gait
from walker_model import DEFAULT, DOCUMENTED, GRAVITY, POINTS, YIELD_M, Contact, build

AXES = {"x": 0, "z": 2}
POSTURE = [0.0, 2.0, 0.1, 0.3, 0.4, 0.05, -0.2, 0.5, 0.02]
RATES = [1.0, 3.0, 0.5, 1.0, 0.6, -0.3, -1.0, 0.5, 0.4]


def model_of(gait: Gait, contact: Contact = DOCUMENTED) -> mujoco.MjModel:
    """The model of the walker of a gait."""
    device = gait.device
    ankle_range = (device["ankle_min_rad"], device["ankle_max_rad"])
    return build(walker(gait.height_m, gait.body_mass_kg, device), ankle_range, contact)


@dataclass
class Differences:
    """Largest differences between MuJoCo and a gait."""

    torque_n_m: float = 0.0
    base_n: float = 0.0
    impact_n_m_s: float = 0.0
    nodes: int = 0


def contact_jacobian(model: mujoco.MjModel, data: mujoco.MjData, rows: tuple[ContactRow, ...]) -> Array:
    """One row for each component of a contact force."""
    jacobian = np.zeros((len(rows), model.nv))
    for k, row in enumerate(rows):
        position = np.zeros((3, model.nv))
        site = model.site(f"{row.point}_{row.side[0].upper()}").id
        mujoco.mj_jacSite(model, data, position, None, site)
        jacobian[k] = position[AXES[row.axis]]
    return jacobian


def compare_domain(model: mujoco.MjModel, domain: Domain, before: Domain, largest: Differences) -> None:
    """The torques at each node by inverse dynamics, and the change of momentum at the start."""
    data = mujoco.MjData(model)
    for q, qd, qdd, u, force in zip(domain.q, domain.qd, domain.qdd, domain.u, domain.contact_forces, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, qd, qdd
        mujoco.mj_inverse(model, data)
        needed = data.qfrc_inverse - contact_jacobian(model, data, domain.contact_rows).T @ force
        largest.base_n = max(largest.base_n, float(np.abs(needed[:3]).max()))
        largest.torque_n_m = max(largest.torque_n_m, float(np.abs(needed[3:] - u).max()))
        largest.nodes += 1
    if domain.impulse is not None:
        data.qpos[:] = domain.q[0]
        mujoco.mj_forward(model, data)
        change = np.zeros(model.nv)
        mujoco.mj_mulM(model, data, change, domain.qd[0] - before.qd[-1])
        momentum = contact_jacobian(model, data, domain.contact_rows).T @ domain.impulse
        largest.impact_n_m_s = max(largest.impact_n_m_s, float(np.abs(change - momentum).max()))


def compare_gait(gait: Gait) -> Differences:
    """Inverse dynamics without the contacts and joint stops of MuJoCo: the forces are those of the gait."""
    model = model_of(gait)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    largest = Differences()
    for number, domain in enumerate(gait.domains):
        compare_domain(model, domain, gait.domains[number - 1], largest)
    return largest


def energy_change_in_flight(gait: Gait, step_s: float) -> float:
    """Relative change of the energy in 0.2 s of flight without torques."""
    model = model_of(gait)
    model.opt.timestep = step_s
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = POSTURE, RATES
    mujoco.mj_forward(model, data)
    start = data.energy.sum()
    while data.time < 0.2:
        mujoco.mj_step(model, data)
    mujoco.mj_forward(model, data)
    assert data.ncon == 0
    return float(abs(data.energy.sum() - start) / start)


def stand(gait: Gait, contact: Contact) -> tuple[float, float, float]:
    """Carried weight as a share, depth of the four points added up, m, and speed of the hip, m/s, of a standing walker."""
    model = model_of(gait, contact)
    data = mujoco.MjData(model)
    posture = np.array([0.0, 0.0, 0.2, 0.2, 0.0, 0.0, 0.2, 0.0, 0.0])
    data.qpos[:] = posture
    mujoco.mj_kinematics(model, data)
    data.qpos[1] = 0.002 - data.site("toe_L").xpos[2]
    while data.time < 8.0:
        data.qfrc_applied[3:] = 3000.0 * (posture[3:] - data.qpos[3:]) - 40.0 * data.qvel[3:]
        mujoco.mj_step(model, data)
    carried, force = 0.0, np.zeros(6)
    for contact_number in range(data.ncon):
        mujoco.mj_contactForce(model, data, contact_number, force)
        carried += force[0]
    depth = sum(max(0.0, -data.site(point).xpos[2]) for point in POINTS)
    weight = walker(gait.height_m, gait.body_mass_kg, gait.device).mass_kg * GRAVITY
    return float(carried / weight), float(depth), float(np.abs(data.qvel[:2]).max())


def main() -> None:
    gaits = [(Path(name).stem, read_gait(Path(name))) for name in sys.argv[1:]]
    first = gaits[0][1]
    coarse, fine = energy_change_in_flight(first, 1e-3), energy_change_in_flight(first, 5e-4)
    print(f"flight: energy changes by {coarse:.1e} at 1 ms, {fine:.1e} at 0.5 ms (ratio {coarse / fine:.2f})")
    for name, contact in (("documented", DOCUMENTED), ("MuJoCo default", DEFAULT)):
        carried, depth, speed = stand(first, contact)
        print(
            f"standing, {name} contact: carries {carried:.4f} of the weight, "
            f"depths add up to {1e3 * depth:.2f} mm (yield {1e3 * YIELD_M:.0f} mm), creeps by {1e3 * speed:.2f} mm/s"
        )
    print("largest difference   torque, N m   force on the base, N or N m   impact, N s or N m s   nodes")
    for name, gait in gaits:
        d = compare_gait(gait)
        print(f"{name:20} {d.torque_n_m:12.1e} {d.base_n:29.1e} {d.impact_n_m_s:22.1e} {d.nodes:7}")


if __name__ == "__main__":
    main()
