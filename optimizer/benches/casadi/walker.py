"""The walking model in CasADi expressions: bodies, contacts, domains, muscles, Bezier curves.

Coordinates q = (px, pz, torso, hipL, kneeL, ankleL, hipR, kneeR, ankleR); links torso, thigh, shank, foot (left), thigh,
shank, foot (right). Sides: 0 left (intact), 1 right (prosthesis). Foot points: 0 heel_L, 1 toe_L, 2 heel_R, 3 toe_R.
"""

from dataclasses import dataclass, field
from math import comb, log, pi, radians

import casadi as ca
import numpy as np

GRAVITY = 9.81

# psi = A q
A = np.zeros((7, 9))
A[:, 2] = -1
for _thigh, _hip in ((1, 3), (4, 6)):
    A[_thigh : _thigh + 3, _hip] = 1
    A[_thigh + 1 : _thigh + 3, _hip + 1] = -1
    A[_thigh + 2, _hip + 2] = 1


@dataclass
class Leg:
    thigh: float
    shank: float
    ankle_height: float
    heel_behind: float
    toe_ahead: float


class Walker:
    """Bodies as (mass, inertia, chain to the centre of mass); a chain is a list of (link, ux, uz)."""

    def __init__(self, height, mass):
        left = Leg(0.245 * height, 0.246 * height, 0.039 * height, 0.0333 * height, 0.0833 * height)
        right = Leg(0.530 * height - 0.42, 0.35, 0.070, 0.060, 0.150)
        self.legs = (left, right)
        hat = 0.288 * height
        d, h = left.toe_ahead, left.ankle_height
        self.bodies = [
            (0.678 * mass, 0.678 * mass * (0.496 * hat) ** 2, [(0, 0.0, 0.626 * hat)]),
            (0.100 * mass, 0.100 * mass * (0.323 * left.thigh) ** 2, [(1, 0.0, -0.433 * left.thigh)]),
            (
                0.0465 * mass,
                0.0465 * mass * (0.302 * left.shank) ** 2,
                [(1, 0.0, -left.thigh), (2, 0.0, -0.433 * left.shank)],
            ),
            (
                0.0145 * mass,
                0.0145 * mass * 0.475**2 * (d * d + h * h),
                [(1, 0.0, -left.thigh), (2, 0.0, -left.shank), (3, 0.5 * d, -0.5 * h)],
            ),
            self._right_thigh(height, mass, right.thigh),
            (3.85, 3.85 * (0.33 * 0.35) ** 2, [(4, 0.0, -right.thigh), (5, 0.0, -0.45 * 0.35)]),
            (1.10, 0.0048, [(4, 0.0, -right.thigh), (5, 0.0, -right.shank), (6, 0.04, -0.04)]),
        ]
        self.total_mass = sum(body[0] for body in self.bodies)

    @staticmethod
    def _right_thigh(height, mass, length):
        """Human thigh, knee housing, adapter, and the subject's own shank and foot, knee bent, lumped into one body."""
        own = 0.245 * height
        limb = 0.061 * mass
        parts = [
            (0.1 * mass, 0.0, -0.433 * own, 0.1 * mass * (0.323 * own) ** 2),
            (1.0, 0.0, -length, 0.0016),
            (1.5, 0.0, -(own + length) / 2, 1.5 * 0.12**2),
            (limb, -0.606 * 0.246 * height, -own, limb * (0.416 * 0.246 * height) ** 2),
        ]
        total = sum(p[0] for p in parts)
        x = sum(p[0] * p[1] for p in parts) / total
        z = sum(p[0] * p[2] for p in parts) / total
        inertia = sum(p[3] + p[0] * ((p[1] - x) ** 2 + (p[2] - z) ** 2) for p in parts)
        return (total, inertia, [(4, x, z)])

    def foot_point(self, index):
        side = index // 2
        leg, thigh = self.legs[side], 1 + 3 * side
        forward = leg.toe_ahead if index % 2 else -leg.heel_behind
        return [(thigh, 0.0, -leg.thigh), (thigh + 1, 0.0, -leg.shank), (thigh + 2, forward, -leg.ankle_height)]

    def hip_phase_row(self, stance):
        """dp = row . q, the linearised forward position of the hip over the stance toe."""
        leg, thigh = self.legs[stance], 1 + 3 * stance
        return -(leg.shank * A[thigh + 1] + leg.thigh * A[thigh] + leg.ankle_height * A[thigh + 2])


class State:
    """Kinematics at one instant."""

    def __init__(self, q, qd, qdd):
        self.q, self.qd, self.qdd = q, qd, qdd
        psi = ca.DM(A) @ q
        self.rate, self.acceleration_of_links = ca.DM(A) @ qd, ca.DM(A) @ qdd
        self.cos, self.sin = ca.cos(psi), ca.sin(psi)

    def _turned(self, element):
        link, ux, uz = element
        c, s = self.cos[link], self.sin[link]
        return ca.vertcat(c * ux - s * uz, s * ux + c * uz), ca.vertcat(-s * ux - c * uz, c * ux - s * uz)

    def position(self, chain):
        return self.q[:2] + sum(self._turned(e)[0] for e in chain)

    def velocity(self, chain):
        return self.qd[:2] + sum(self.rate[e[0]] * self._turned(e)[1] for e in chain)

    def acceleration(self, chain):
        result = self.qdd[:2]
        for e in chain:
            along, across = self._turned(e)
            result = result + self.acceleration_of_links[e[0]] * across - self.rate[e[0]] ** 2 * along
        return result

    def generalised_force(self, chain, force):
        torque = ca.SX.zeros(7)
        for e in chain:
            torque[e[0]] += ca.dot(force, self._turned(e)[1])
        return ca.vertcat(force, ca.DM(A[:, 2:].T) @ torque)

    def inverse_dynamics(self, walker, gravity=GRAVITY):
        """M(q) qdd + h(q, qd), body by body."""
        total = ca.SX.zeros(9)
        for mass, inertia, chain in walker.bodies:
            force = mass * (self.acceleration(chain) + ca.vertcat(0, gravity))
            total += self.generalised_force(chain, force)
            link = chain[-1][0]
            total += ca.DM(A[link]) * inertia * self.acceleration_of_links[link]
        return total


@dataclass
class Domain:
    name: str
    kind: str
    stance: int
    intervals: int
    contacts: list  # (foot point, axis)
    outputs: list  # indices into q
    hip_velocity: int | None  # which of the four
    points: int = field(init=False)

    def __post_init__(self):
        self.points = 2 * self.intervals + 1

    @property
    def impact(self):
        return self.kind in ("DS2", "DS3")


def stride(intervals):
    """The eight domains from right heel strike."""
    result = []
    for step, stance in ((0, 1), (1, 0)):
        swing = 1 - stance
        heel, toe, trailing = 2 * stance, 2 * stance + 1, 2 * swing + 1
        st, sw = 3 + 3 * stance, 3 + 3 * swing
        letter = "LR"[stance]
        flat = [(toe, 0), (heel, 1), (toe, 1)]
        for kind, contacts, outputs, hip_velocity in (
            ("DS2", [(heel, 0), (heel, 1), (trailing, 0), (trailing, 1)], [st, sw, sw + 1, sw + 2], 2 * step),
            ("DS3", flat + [(trailing, 0), (trailing, 1)], [st, sw, sw + 1], 2 * step + 1),
            ("SS2", flat, [st, st + 1, sw, sw + 1, sw + 2], 2 * step + 1),
            ("SS1", [(toe, 0), (toe, 1)], [st, st + 1, st + 2, sw, sw + 1, sw + 2], None),
        ):
            result.append(Domain(f"{kind}_{letter}", kind, stance, intervals[kind], contacts, outputs, hip_velocity))
    return result


def contact_target(walker, domain, contact, right_step, stride_length):
    """World position of a contact row."""
    point, axis = contact
    if axis == 1:
        return 0.0
    side = point // 2
    toe = 0.0 if side == 1 else (right_step - stride_length if domain.stance == 1 else right_step)
    leg = walker.legs[side]
    return toe if point % 2 else toe - (leg.heel_behind + leg.toe_ahead)


def bezier(alpha, s):
    """Values and first two derivatives with respect to s of the curves in the rows of alpha (degree 5)."""

    def curve(a):
        n = a.shape[1] - 1
        return sum(a[:, i] * comb(n, i) * s**i * (1 - s) ** (n - i) for i in range(n + 1))

    first = 5 * (alpha[:, 1:] - alpha[:, :-1])
    second = 4 * (first[:, 1:] - first[:, :-1])
    return curve(alpha), curve(first), curve(second)


@dataclass
class Muscle:
    name: str
    force: float
    speed: float
    optimal: float
    slack: float
    joints: list  # (index in q, r0, angle of the largest arm or None, reference angle (deg), rho, direction)


def _muscles():
    ham, glu, hfl = (3000, 12, 0.10, 0.31), (1500, 12, 0.11, 0.13), (2000, 12, 0.11, 0.10)

    def ham_hip(hip):
        return (hip, 0.08, None, 155, 0.7, 1)

    def glu_hip(hip):
        return (hip, 0.10, None, 150, 0.5, 1)

    def hfl_hip(hip):
        return (hip, 0.10, None, 180, 0.5, -1)

    return [
        Muscle("HAM_L", *ham, [ham_hip(3), (4, 0.05, 180, 180, 0.7, -1)]),
        Muscle("GLU_L", *glu, [glu_hip(3)]),
        Muscle("HFL_L", *hfl, [hfl_hip(3)]),
        Muscle("GAS_L", 1500, 12, 0.05, 0.40, [(5, 0.05, 110, 80, 0.7, 1), (4, 0.05, 140, 165, 0.7, -1)]),
        Muscle("VAS_L", 6000, 12, 0.08, 0.23, [(4, 0.06, 165, 125, 0.7, 1)]),
        Muscle("SOL_L", 4000, 6, 0.04, 0.26, [(5, 0.05, 110, 80, 0.5, 1)]),
        Muscle("TA_L", 800, 12, 0.06, 0.24, [(5, 0.04, 80, 110, 0.7, -1)]),
        Muscle("HAM_R", *ham, [ham_hip(6)]),
        Muscle("GLU_R", *glu, [glu_hip(6)]),
        Muscle("HFL_R", *hfl, [hfl_hip(6)]),
    ]


MUSCLES = _muscles()


def joint_length_and_arm(joint, angle):
    """Length change of the unit, and joint torque per newton; for floats and expressions."""
    coordinate, r0, largest, reference, rho, direction = joint
    phi = (pi / 2 if coordinate == 5 else pi) - angle
    if largest is None:
        return -direction * rho * r0 * (phi - radians(reference)), -direction * r0
    shift = radians(largest)
    change = ca.sin(phi - shift) - ca.sin(radians(reference) - shift)
    return -direction * rho * r0 * change, -direction * r0 * ca.cos(phi - shift)


def unit_length(muscle, q):
    """Length of the muscle-tendon unit."""
    return muscle.optimal + muscle.slack + sum(joint_length_and_arm(j, q[j[0]])[0] for j in muscle.joints)


def force_length(x):
    y = (x - 1) / 0.56
    return ca.exp(log(0.05) * y * y * ca.sqrt(y * y + 1e-6))


def force_velocity(nu):
    r = ca.sqrt(nu * nu + 0.01**2)
    a, b = (nu - r) / 2, (nu + r) / 2
    return (1 + a) / (1 - 5 * a) + 1.5 - 0.5 * (1 - b) / (1 + 37.8 * b) - 1


def tendon_force(strain):
    return ((strain + ca.sqrt(strain * strain + 0.002**2)) / (2 * 0.04)) ** 2
