"""The walker as a MuJoCo model: a planar floating base, seven links, and contacts of heels and toes with the ground.

The joint coordinates of the model are those of the gait, in its order and with its signs. Each contact point is a small
sphere that touches only a plane of its own. `Terrain` moves this plane to the height and slope of the ground below the
point, so that MuJoCo has no edges to resolve.
"""

from dataclasses import dataclass

import mujoco

from anthropometry import Leg, Segment, Walker

GRAVITY = 9.81
FRICTION = 0.8
# Depth under body weight, and the largest speed at which the ground relaxes (Geyer and Herr 2010).
YIELD_M = 0.01
RELEASE_SPEED_M_S = 0.03
STOP_STIFFNESS_N_M_RAD = 3000.0
STOP_DAMPING_N_M_S_RAD = 30.0
POINTS = ("heel_L", "toe_L", "heel_R", "toe_R")
RADIUS_M = 0.002
# The share of the reference acceleration in a contact (`solimp`), for every depth.
IMPEDANCE = 0.9


@dataclass(frozen=True)
class Contact:
    """`documented`: yield and damping of the ground of `gaitwright simulate`. `default`: MuJoCo's own default values."""

    documented: bool
    step_s: float


DOCUMENTED = Contact(True, 0.00025)
DEFAULT = Contact(False, 0.0005)


def _inertial(s: Segment) -> str:
    i = s.inertia_kg_m2
    return f'<inertial pos="{s.com_m[0]!r} 0 {s.com_m[1]!r}" mass="{s.mass_kg!r}" diaginertia="{i!r} {i!r} {i!r}"/>'


def _leg(leg: Leg, side: str, knee: str, ankle: str) -> str:
    # The spheres have their lowest point at the contact point while the foot is flat.
    z = -leg.ankle_height_m + RADIUS_M
    points = "".join(
        f'<geom name="{name}_{side}" type="sphere" size="{RADIUS_M}" pos="{x!r} 0 {z!r}"/>'
        f'<site name="{name}_{side}" pos="{x!r} 0 {-leg.ankle_height_m!r}"/>'
        for name, x in (("heel", -leg.heel_behind_m), ("toe", leg.toe_ahead_m))
    )
    return (
        f'<body name="thigh_{side}"><joint name="hip_{side}" axis="0 -1 0"/>{_inertial(leg.thigh)}'
        f'<body name="shank_{side}" pos="0 0 {-leg.thigh_m!r}"><joint name="knee_{side}" axis="0 1 0" {knee}/>'
        f"{_inertial(leg.shank)}"
        f'<body name="foot_{side}" pos="0 0 {-leg.shank_m!r}"><joint name="ankle_{side}" axis="0 -1 0" {ankle}/>'
        f"{_inertial(leg.foot)}{points}</body></body></body>"
    )


def mjcf(walker: Walker, ankle_range_rad: tuple[float, float], contact: Contact) -> str:
    """The model as MJCF. Knees stop when straight, the prosthetic ankle at the stops of the device."""
    knee = 'limited="true" range="0 3.1"'
    ankle = f'limited="true" range="{ankle_range_rad[0]!r} {ankle_range_rad[1]!r}"'
    planes = "".join(
        f'<body name="ground_{p}" mocap="true"><geom name="ground_{p}" type="plane" size="0 0 1"/></body>'
        for p in POINTS
    )
    pairs = "".join(
        f'<pair name="{p}" geom1="ground_{p}" geom2="{p}" condim="3" friction="{FRICTION} {FRICTION} 0 0 0"/>'
        for p in POINTS
    )
    return f"""<mujoco>
      <compiler angle="radian" autolimits="false"/>
      <option gravity="0 0 {-GRAVITY}" timestep="{contact.step_s}" cone="elliptic" impratio="10"/>
      <default><joint type="hinge"/><geom contype="0" conaffinity="0"/></default>
      <worldbody>
        {planes}
        <body name="torso">
          <joint name="x" type="slide" axis="1 0 0"/>
          <joint name="z" type="slide" axis="0 0 1"/>
          <joint name="torso" axis="0 1 0"/>
          {_inertial(walker.torso)}
          {_leg(walker.left, "L", knee, "")}
          {_leg(walker.right, "R", knee, ankle)}
        </body>
      </worldbody>
      <contact>{pairs}</contact>
    </mujoco>"""


def build(walker: Walker, ankle_range_rad: tuple[float, float], contact: Contact = DOCUMENTED) -> mujoco.MjModel:
    """The compiled model, with contacts and joint stops of the wanted stiffness and damping.

    MuJoCo scales the stiffness of a constraint by the inverse inertia at the reference posture, and adds an inertia of
    its own to the constraint. Both are constants of the model.
    """
    model = mujoco.MjModel.from_xml_string(mjcf(walker, ankle_range_rad, contact))
    if not contact.documented:
        return model
    solimp = [IMPEDANCE, IMPEDANCE, 0.001, 0.5, 2.0]
    stiffness = walker.mass_kg * GRAVITY / YIELD_M
    # Damping of the documented ground, stiffness * depth / release speed, at half of the yield.
    damping = stiffness * 0.5 * YIELD_M / RELEASE_SPEED_M_S
    for pair in range(model.npair):
        body = model.geom_bodyid[model.pair_geom2[pair]]
        model.pair_solref[pair] = _solref(stiffness, damping, model.body_invweight0[body, 0])
        model.pair_solimp[pair] = solimp
    for joint in range(model.njnt):
        inverse = model.dof_invweight0[model.jnt_dofadr[joint]]
        model.jnt_solref[joint] = _solref(STOP_STIFFNESS_N_M_RAD, STOP_DAMPING_N_M_S_RAD, inverse)
        model.jnt_solimp[joint] = solimp
    return model


def _solref(stiffness: float, damping: float, inverse_inertia: float) -> list[float]:
    """The direct format of `solref`, so that a constraint has this stiffness and damping at constant impedance d.

    Its force is d / ((1 - d) inverse_inertia) times the missing acceleration, where MuJoCo's reference acceleration is
    -damping_ / d * rate - stiffness_ / d * depth (for an impedance that does not depend on the depth).
    """
    per_acceleration = IMPEDANCE / ((1.0 - IMPEDANCE) * inverse_inertia)
    return [-stiffness * IMPEDANCE / per_acceleration, -damping * IMPEDANCE / per_acceleration]
