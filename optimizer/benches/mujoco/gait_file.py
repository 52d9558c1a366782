"""A gait file, as `gaitwright solve --out` writes it, and the motion between its nodes.

Coordinates: hip x, hip z (m), torso, hip_L, knee_L, ankle_L, hip_R, knee_R, ankle_R (rad). Torques: the last six, N m.
Between nodes, coordinates follow the quintic through position, velocity and acceleration of adjacent nodes. Torques
follow the parabola through the three nodes of a mesh interval.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ContactRow:
    """A component of the force on a contact point."""

    side: str
    point: str
    axis: str


@dataclass(frozen=True)
class Domain:
    """One domain of the stride at equidistant nodes."""

    name: str
    duration_s: float
    q: Array
    qd: Array
    qdd: Array
    u: Array
    contact_rows: tuple[ContactRow, ...]
    contact_forces: Array
    impulse: Array | None

    def at(self, share: float) -> tuple[Array, Array, Array]:
        """Coordinates, their rates and the torques at a share (0 to 1) of the duration."""
        gaps = len(self.q) - 1
        length_s = self.duration_s / gaps
        position = min(max(share, 0.0), 1.0) * gaps
        gap = min(int(position), gaps - 1)
        s = position - gap
        a = (self.q[gap], self.qd[gap] * length_s, 0.5 * self.qdd[gap] * length_s**2)
        end = (self.q[gap + 1], self.qd[gap + 1] * length_s, 0.5 * self.qdd[gap + 1] * length_s**2)
        rest = (end[0] - a[0] - a[1] - a[2], end[1] - a[1] - 2 * a[2], end[2] - a[2])
        c3 = 10 * rest[0] - 4 * rest[1] + rest[2]
        c4 = -15 * rest[0] + 7 * rest[1] - 2 * rest[2]
        c5 = 6 * rest[0] - 3 * rest[1] + rest[2]
        q = a[0] + s * (a[1] + s * (a[2] + s * (c3 + s * (c4 + s * c5))))
        qd = (a[1] + s * (2 * a[2] + s * (3 * c3 + s * (4 * c4 + s * 5 * c5)))) / length_s
        first = gap - gap % 2
        t = 0.5 * (gap % 2 + s)
        weights = ((1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1))
        u = sum(w * self.u[first + k] for k, w in enumerate(weights))
        return q, qd, np.asarray(u)


@dataclass(frozen=True)
class Gait:
    """The parts of a gait that the plant and the controllers need."""

    height_m: float
    body_mass_kg: float
    device: dict[str, Any]
    limits: dict[str, Any]
    stride_length_m: float
    domains: tuple[Domain, ...]

    def torque_limits_n_m(self) -> list[tuple[float, float]]:
        """Lowest and highest torques of the human joints hip_L, knee_L, ankle_L, hip_R."""
        limits = self.limits
        hip, knee = limits["hip_torque_n_m"], limits["knee_torque_n_m"]
        ankle = (-limits["ankle_plantarflexion_torque_n_m"], limits["ankle_dorsiflexion_torque_n_m"])
        return [(-hip, hip), (-knee, knee), ankle, (-hip, hip)]


def _domain(data: dict[str, Any]) -> Domain:
    def array(name: str) -> Array:
        return np.array(data[name], dtype=float)

    rows = tuple(ContactRow(row["side"], row["point"], row["axis"]) for row in data["contact_rows"])
    impulse = None if data["impulse"] is None else array("impulse")
    motion = (array("q"), array("qd"), array("qdd"), array("u"))
    return Domain(data["name"], data["duration_s"], *motion, rows, array("contact_forces"), impulse)


def read_gait(path: Path) -> Gait:
    """Reads a file of `solve --out`, or a gait that the service has served."""
    data = json.loads(path.read_text())
    data = data.get("gait", data)
    subject = data["subject"]
    return Gait(
        subject["height_m"],
        subject["body_mass_kg"],
        data["device"],
        data["settings"]["limits"],
        data["stride_length_m"],
        tuple(_domain(domain) for domain in data["domains"]),
    )
