"""Segments of a subject with a prosthesis on the right leg.

Human segments: Winter, Biomechanics and Motor Control of Human Movement, 4th ed. 2009, as fractions of height and body
mass. Prosthesis: the device in the gait file. The right thigh carries the knee housing, the adapter and, with a bypass
adapter, the subject's own shank and foot behind a bent knee.
"""

from dataclasses import dataclass
from math import hypot
from typing import Any


@dataclass(frozen=True)
class Segment:
    """A rigid body, in a frame at its upper joint: x forward, z up."""

    mass_kg: float
    com_m: tuple[float, float]
    inertia_kg_m2: float


@dataclass(frozen=True)
class Leg:
    """Segments and lengths of a leg."""

    thigh: Segment
    shank: Segment
    foot: Segment
    thigh_m: float
    shank_m: float
    ankle_height_m: float
    heel_behind_m: float
    toe_ahead_m: float


@dataclass(frozen=True)
class Walker:
    """Torso and legs."""

    torso: Segment
    left: Leg
    right: Leg

    @property
    def mass_kg(self) -> float:
        legs = sum(s.mass_kg for leg in (self.left, self.right) for s in (leg.thigh, leg.shank, leg.foot))
        return self.torso.mass_kg + legs


def _lump(parts: list[Segment]) -> Segment:
    mass = sum(p.mass_kg for p in parts)
    x = sum(p.mass_kg * p.com_m[0] for p in parts) / mass
    z = sum(p.mass_kg * p.com_m[1] for p in parts) / mass
    inertia = sum(p.inertia_kg_m2 + p.mass_kg * hypot(p.com_m[0] - x, p.com_m[1] - z) ** 2 for p in parts)
    return Segment(mass, (x, z), inertia)


def _rod(mass: float, length: float, com: float, gyration: float) -> Segment:
    return Segment(mass, (0.0, -com * length), mass * (gyration * length) ** 2)


def walker(height_m: float, body_mass_kg: float, device: dict[str, Any]) -> Walker:
    """The walker of a subject with this device."""
    h, m = height_m, body_mass_kg
    trunk, thigh, shank = 0.288 * h, 0.245 * h, 0.246 * h
    ankle, toe = 0.039 * h, 0.0833 * h
    torso = Segment(0.678 * m, (0.0, 0.626 * trunk), 0.678 * m * (0.496 * trunk) ** 2)
    human_thigh = _rod(0.100 * m, thigh, 0.433, 0.323)
    human_shank = _rod(0.0465 * m, shank, 0.433, 0.302)
    foot = Segment(0.0145 * m, (0.5 * toe, -0.5 * ankle), 0.0145 * m * 0.475**2 * (toe**2 + ankle**2))
    left = Leg(human_thigh, human_shank, foot, thigh, shank, ankle, 0.0333 * h, toe)

    d = device
    knee_z = -(0.530 * h - d["shank_length_m"] - d["ankle_height_m"])
    adapter = d["adapter_mass_kg"]
    parts = [
        human_thigh,
        Segment(d["knee_housing_mass_kg"], (0.0, knee_z), d["knee_housing_inertia_kg_m2"]),
        Segment(adapter, (0.0, 0.5 * (knee_z - thigh)), adapter * d["adapter_gyration_radius_m"] ** 2),
    ]
    if d["carried_limb"]:
        limb = 0.061 * m
        parts.append(Segment(limb, (-0.606 * shank, -thigh), limb * (0.416 * shank) ** 2))
    device_shank = _rod(
        d["shank_mass_kg"], d["shank_length_m"], d["shank_com_fraction"], d["shank_gyration_fraction"]
    )
    device_foot = Segment(d["foot_mass_kg"], (d["foot_com_forward_m"], -d["foot_com_down_m"]), d["foot_inertia_kg_m2"])
    right = Leg(
        _lump(parts),
        device_shank,
        device_foot,
        -knee_z,
        d["shank_length_m"],
        d["ankle_height_m"],
        d["heel_behind_m"],
        d["toe_ahead_m"],
    )
    return Walker(torso, left, right)
