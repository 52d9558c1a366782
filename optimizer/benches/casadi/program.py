"""The gait problem: variables, rows, bounds and objective. DEFAULTS has all options."""

from math import radians

import casadi as ca
import numpy as np

import walker as model
from assembly import Element, Program

DEFAULTS = {
    "subject": {"H": 1.727, "M": 65.7},
    "muscles": False,
    "bounds": {"a1": 20.0, "a2": 90.0, "a3": 0.3, "a4": 1.4, "a5": 0.0, "a6": 0.5, "a7": 50.0, "a8": 40.0},
    "intervals": {"DS2": 4, "DS3": 4, "SS2": 6, "SS1": 6},
    "friction": 0.6,
    "impact_friction": 0.6,
    "limits": {
        "knee": [0.02, 1.45],
        "hip": 1.2,
        "step": [0.5, 0.85],
        "speed": [1.0, 1.4],
        "u_hip": 200.0,
        "u_knee": 200.0,
        "u_ankle": [-180.0, 50.0],
        "u_prosthetic_knee": 80.0,
        "u_prosthetic_ankle": 120.0,
        "prosthetic_speed": 7.0,
        "prosthetic_ankle": [-0.436, 0.349],
        "T_min": {"DS2": 0.03, "DS3": 0.02, "SS2": 0.08, "SS1": 0.08},
        "T_max": {"DS2": 0.3, "DS3": 0.3, "SS2": 0.7, "SS1": 0.7},
        "phase_rate_min": 0.1,
        "torso_tolerance": 0.005,
        "touchdown": 0.1,
        "clearance_min": 0.005,
        "liftoff_force": 20.0,
        "force_max": 3000.0,
        "impulse_max": 500.0,
        "fibre": [0.3, 1.6],
    },
    "objective": {
        "power_smoothing": 1.0,
        "torque": 3e-3,
        "acceleration": 1e-4,
        "force": 1e-4,
        "activation": 3e-3,
        "fibre_velocity": 1e-2,
    },
}

BOUNDARIES = (0.0, 0.07, 0.12, 0.33, 0.50)
BEZIER = 6


class Layout:
    """Offsets and scales of the variables."""

    def __init__(self, domains, muscles):
        self.domains, self.muscles = domains, muscles
        self.scale, self.point_start, self.globals = [], [], []
        for domain in domains:
            self.point_start.append([])
            for _ in range(domain.points):
                self.point_start[-1].append(len(self.scale))
                self.scale += self.point_scale(domain)
        self.vhip = self._add([1.0] * 4)
        self.right_step, self.stride = self._add([1.0, 1.0])
        for domain in domains:
            entry = {"T": self._add([0.2])[0], "pa": self._add([1.0])[0]}
            if domain.kind == "SS1":
                entry["pb"] = self._add([1.0])[0]
            entry["alpha"] = self._add([1.0] * (len(domain.outputs) * BEZIER))
            if domain.impact:
                entry["impulse"] = self._add([20.0] * len(domain.contacts))
            self.globals.append(entry)
        self.n = len(self.scale)
        self.scale = np.array(self.scale)

    def _add(self, scales):
        first = len(self.scale)
        self.scale += scales
        return list(range(first, first + len(scales)))

    def point_scale(self, domain):
        fibres = [1.0] * 10 + [3.0] * 10 + [1.0] * 10 if self.muscles else []
        return [1.0] * 9 + [3.0] * 9 + [30.0] * 9 + [100.0] * 6 + [500.0] * len(domain.contacts) + fibres

    def point(self, d, k):
        start = self.point_start[d][k]
        return list(range(start, start + len(self.point_scale(self.domains[d]))))


class Gait:
    """The gait problem of some options; missing ones are those of DEFAULTS."""

    def __init__(self, options, reference):
        self.options = merged(DEFAULTS, options)
        self.muscles = self.options["muscles"]
        self.walker = model.Walker(self.options["subject"]["H"], self.options["subject"]["M"])
        self.domains = model.stride(self.options["intervals"])
        self.layout = Layout(self.domains, self.muscles)
        self.reference = reference
        self.lower, self.upper, self.tags = [], [], []
        self.touchdown_rows = []
        self.elements = []
        for d in range(8):
            self._point_elements(d)
            self._integration_elements(d)
        for d in range(8):
            self._transition_element(d)
        self._stride_element()
        self.program = Program(self.elements, self.layout.n, len(self.tags), 2)

    # Rows ---------------------------------------------------------------------------------------------------------

    def _register(self, tags, bounds):
        """Appends rows with (tag, lower, upper); returns their indices."""
        first = len(self.tags)
        self.tags += tags
        self.lower += [b[0] for b in bounds]
        self.upper += [b[1] for b in bounds]
        return list(range(first, len(self.tags)))

    def _reference_angles(self, d, k):
        domain = self.domains[d]
        step, kind = divmod(d, 4)
        sigma = k / (domain.points - 1)
        fraction = 0.5 * step + BOUNDARIES[kind] + sigma * (BOUNDARIES[kind + 1] - BOUNDARIES[kind])

        def at(f):
            return [np.interp(100 * (f % 1.0), np.arange(101.0), column) for column in self.reference]

        own, opposite = at(fraction), at(fraction + 0.5)
        return own + opposite[2:4]

    def _point_elements(self, d):
        domain, layout = self.domains[d], self.layout
        last = domain.points - 1
        classes = {"first": [0], "inner": list(range(1, last)), "last": [last]}
        for label, ks in classes.items():
            self._point_element(d, label, ks)

    def _point_element(self, d, label, ks):
        domain, layout, walker = self.domains[d], self.layout, self.walker
        limits, cost = self.options["limits"], self.options["objective"]
        first, last = label == "first", label == "last"
        nc, ny = len(domain.contacts), len(domain.outputs)

        # Local variables: those of the node, then the global ones in the rows of this domain.
        own = layout.globals[d]
        names = [("T", own["T"], 0.2), ("D", layout.stride, 1.0)]
        if any(contact[1] == 0 and contact[0] < 2 for contact in domain.contacts):
            names.append(("xL", layout.right_step, 1.0))
        names.append(("pa", own["pa"], 1.0))
        if domain.kind == "SS1":
            names += [("pb", own["pb"], 1.0), ("T_other", layout.globals[d - 1]["T"], 0.2)]
        if domain.kind == "SS2":
            names.append(("T_other", layout.globals[d + 1]["T"], 0.2))
        if domain.hip_velocity is not None:
            names.append(("vhip", layout.vhip[domain.hip_velocity], 1.0))
        point_scale = layout.point_scale(domain)
        z = ca.SX.sym("z", len(point_scale) + len(names) + ny * BEZIER)
        point = z[: len(point_scale)] * ca.DM(point_scale)
        shared = {n: z[len(point_scale) + i] * s for i, (n, _, s) in enumerate(names)}
        alpha = ca.reshape(z[len(point_scale) + len(names) :], ny, BEZIER)
        q, qd, qdd, u, force = ca.vertsplit(point[: 33 + nc], [0, 9, 18, 27, 33, 33 + nc])
        constants = ca.SX.sym("c", 2 + 7)
        sigma, simpson, tracked = constants[0], constants[1], constants[2:]
        state = model.State(q, qd, qdd)
        zero, positive = (0.0, 0.0), (0.0, ca.inf)
        rows, tags, bounds = [], [], []

        def add(kind, values, limit=zero):
            values = ca.vertcat(*values) if isinstance(values, list) else values
            rows.append(values)
            suffix = {"eq": "eq0" if first else "eq"}.get(kind, kind)
            tags.extend([f"{domain.name}:{suffix}"] * values.numel())
            bounds.extend([limit] * values.numel())

        # Motion and contacts.
        balance = state.inverse_dynamics(walker)
        balance[3:] -= u
        for c, (foot, axis) in enumerate(domain.contacts):
            vector = ca.vertcat(force[c], 0) if axis == 0 else ca.vertcat(0, force[c])
            balance -= state.generalised_force(walker.foot_point(foot), vector)
        add("eq", balance / 100)
        chains = [(walker.foot_point(foot), axis) for foot, axis in domain.contacts]
        add("eq", [state.acceleration(chain)[axis] / 10 for chain, axis in chains])
        if not first or domain.impact:
            add("eq", [state.velocity(chain)[axis] for chain, axis in chains])
        guard = {"DS2": [0, 1], "DS3": [2]}.get(domain.kind, []) if first else range(nc)
        for c in guard:
            goal = model.contact_target(walker, domain, domain.contacts[c], shared.get("xL"), shared["D"])
            add("eq", state.position(chains[c][0])[chains[c][1]] - goal)

        # Virtual constraints and hip phase.
        row = ca.DM(walker.hip_phase_row(domain.stance)).T
        dp, dpd, dpdd = row @ q, row @ qd, row @ qdd
        if domain.kind == "SS1":
            width = shared["pb"] - shared["pa"]
            s, sd, sdd = (dp - shared["pa"]) / width, dpd / width, dpdd / width
        else:
            s, sd, sdd = sigma, 1 / shared["T"], 0.0
        y, slope, curvature = model.bezier(alpha, s)
        outputs = domain.outputs
        add("eq", q[outputs] - y)
        add("eq", qd[outputs] - slope * sd)
        add("eq", (qdd[outputs] - curvature * sd**2 - slope * sdd) / 10)
        if domain.kind == "SS1":
            if first:
                add("eq", dp - shared["pa"])
            if last:
                add("pb", dp - shared["pb"])
        else:
            add("eq", dp - shared["pa"] - shared["vhip"] * shared["T"] * sigma)
            if not first or domain.impact:
                add("eq", dpd - shared["vhip"])
            add("eq", dpdd / 10)

        # Muscles.
        squares = (
            cost["torque"] * ca.sumsqr(u / 100)
            + cost["acceleration"] * ca.sumsqr(qdd / 30)
            + cost["force"] * ca.sumsqr(force / 500)
        )
        if self.muscles:
            length, velocity, activation = ca.vertsplit(point[33 + nc :], [0, 10, 20, 30])
            driven, forces = [0.0] * 4, []
            for m, muscle in enumerate(model.MUSCLES):
                strain = (model.unit_length(muscle, q) - muscle.optimal * length[m] - muscle.slack) / muscle.slack
                tendon = model.tendon_force(strain)
                active = activation[m] * model.force_length(length[m]) * model.force_velocity(velocity[m] / muscle.speed)
                forces.append(active - tendon)
                for joint in muscle.joints:
                    driven[joint[0] - 3] += model.joint_length_and_arm(joint, q[joint[0]])[1] * muscle.force * tendon
                squares += cost["fibre_velocity"] * (velocity[m] / muscle.speed) ** 2
                squares += cost["activation"] * activation[m] ** 2
            add("eq", forces)
            add("eq", [(u[i] - driven[i]) / 100 for i in range(4)])

        # Inequalities.
        for side in (domain.stance, 1 - domain.stance):
            mine = [c for c in range(nc) if domain.contacts[c][0] // 2 == side]
            if mine:
                leaves = domain.kind == "DS3" and last and side != domain.stance
                normal = sum(force[c] for c in mine if domain.contacts[c][1] == 1)
                shear = sum(force[c] for c in mine if domain.contacts[c][1] == 0)
                mu = self.options["friction"]
                limit = (-ca.inf, ca.inf) if leaves else positive
                add("ineq", [(mu * normal - shear) / 500, (mu * normal + shear) / 500], limit)
        stance, swing = domain.stance, 1 - domain.stance
        made_zero = {
            ("DS2", "last"): 2 * stance + 1,
            ("SS2", "first"): 2 * swing + 1,
            ("SS1", "first"): 2 * stance,
            ("SS1", "last"): 2 * swing,
        }.get((domain.kind, label))
        clearance = max(self.options["bounds"]["a5"], limits["clearance_min"])
        for foot in range(4):
            if foot == made_zero or any(foot == contact[0] for contact in domain.contacts):
                continue
            height = 10 * state.position(walker.foot_point(foot))[1]
            if foot // 2 == swing and domain.kind in ("SS2", "SS1"):
                total = shared["T"] + shared["T_other"]
                elapsed = sigma * shared["T"] + (shared["T_other"] if domain.kind == "SS1" else 0)
                w = elapsed / total
                height -= 10 * clearance * (4 * w * (1 - w)) ** 2
            add("ineq", height, positive)
        if domain.kind == "SS1":
            add("ineq", dpd - limits["phase_rate_min"], positive)
        landing = {"DS2": 2 * stance + 1, "SS1": 2 * swing}.get(domain.kind)
        if last and landing is not None:
            self.touchdown_rows.append(len(self.tags) + sum(r.numel() for r in rows))
            add("guardvel", state.velocity(walker.foot_point(landing))[1], (-ca.inf, -limits["touchdown"]))

        # Part of the objective.
        w = ca.SX.sym("w", 2)
        power = u * qd[3:]
        eps = cost["power_smoothing"]
        energy = ca.sum1(ca.sqrt(power**2 + eps**2) - eps)
        transport = energy / (walker.total_mass * model.GRAVITY * shared["D"])
        share = shared["T"] * simpson * (w[0] * transport + squares)
        share += w[1] * ca.sumsqr(q[2:] - tracked) / domain.points

        variables, values, rows_at = [], [], []
        for k in ks:
            variables.append(layout.point(d, k) + [index for _, index, _ in names] + own["alpha"])
            weight = (4 if k % 2 else 1 if k in (0, domain.points - 1) else 2) / (6 * domain.intervals)
            values.append([k / (domain.points - 1), weight] + self._reference_angles(d, k))
            rows_at.append(self._register(tags, bounds))
        name = f"{domain.name}_{label}"
        self.elements.append(Element(name, z, constants, w, ca.vertcat(*rows), share, variables, values, rows_at))

    @staticmethod
    def _defects(z, f, h):
        return (
            z[1] - (z[0] + z[2]) / 2 - h / 8 * (f[0] - f[2]),
            z[2] - z[0] - h / 6 * (f[0] + 4 * f[1] + f[2]),
        )

    def _integration_elements(self, d):
        domain, layout = self.domains[d], self.layout
        T = layout.globals[d]["T"]
        empty = ca.SX.sym("c", 0)
        w = ca.SX.sym("w", 2)

        def intervals(offsets):
            for interval in range(domain.intervals):
                starts = [layout.point_start[d][2 * interval + i] for i in range(3)]
                yield [start + offset for start in starts for offset in offsets] + [T]

        def element(name, z, rows, tags, offsets):
            variables = list(intervals(offsets))
            rows_at = [self._register(tags, [(0.0, 0.0)] * len(tags)) for _ in variables]
            constants = [[] for _ in variables]
            self.elements.append(Element(name, z, empty, w, rows, None, variables, constants, rows_at))

        if domain.kind == "SS1":
            hip = 3 + 3 * domain.stance
            angles = [2, hip, hip + 1, hip + 2]
            offsets = angles + [9 + a for a in angles] + [18 + a for a in angles]
            z = ca.SX.sym("z", 3 * 12 + 1)
            row = ca.DM(self.walker.hip_phase_row(domain.stance)[angles]).T
            points = [z[12 * i : 12 * i + 12] for i in range(3)]
            dp = [row @ p[:4] for p in points]
            dpd = [row @ p[4:8] * 3.0 for p in points]
            dpdd = [row @ p[8:] * 30.0 for p in points]
            h = z[-1] * 0.2 / domain.intervals
            rows = ca.vertcat(*self._defects(dp, dpd, h), *self._defects(dpd, dpdd, h))
            tags = [f"{domain.name}:{suffix}" for suffix in ("hs_p_mid", "hs_p", "hs_v_mid", "hs_v")]
            element(f"{domain.name}_phase", z, rows, tags, offsets)
        if self.muscles:
            fibre = 33 + len(domain.contacts)
            offsets = list(range(fibre, fibre + 20))
            z = ca.SX.sym("z", 3 * 20 + 1)
            length = [z[20 * i : 20 * i + 10] for i in range(3)]
            velocity = [z[20 * i + 10 : 20 * i + 20] * 3.0 for i in range(3)]
            rows = ca.vertcat(*self._defects(length, velocity, z[-1] * 0.2 / domain.intervals))
            tags = [f"{domain.name}:hs_lce_mid"] * 10 + [f"{domain.name}:hs_lce"] * 10
            element(f"{domain.name}_fibres", z, rows, tags, offsets)

    def _transition_element(self, d):
        after = (d + 1) % 8
        domain, target, layout, walker = self.domains[d], self.domains[after], self.layout, self.walker
        last, start = layout.point(d, domain.points - 1), layout.point(after, 0)
        impulses = layout.globals[after].get("impulse", [])
        variables = last[:18] + start[:18] + impulses
        fibres = []
        if self.muscles:
            a, b = 33 + len(domain.contacts), 33 + len(target.contacts)
            fibres = last[a : a + 10] + start[b : b + 10]
        shift = [layout.stride] if after == 0 else []
        z = ca.SX.sym("z", len(variables) + len(fibres) + len(shift))
        q0, v0, q1, v1 = z[:9], z[9:18] * 3.0, z[18:27], z[27:36] * 3.0
        impulse = z[36 : 36 + len(impulses)] * 20.0
        continuity = q1 - q0
        if shift:
            continuity[0] += z[-1]
        tag = f"{domain.name}->{target.name}"
        rows, tags, bounds = [continuity], [f"{tag}:q"] * 9, [(0.0, 0.0)] * 9
        if impulses:
            state = model.State(q1, ca.SX.zeros(9), v1 - v0)
            balance = state.inverse_dynamics(walker, gravity=0.0)
            for c, (foot, axis) in enumerate(target.contacts):
                vector = ca.vertcat(impulse[c], 0) if axis == 0 else ca.vertcat(0, impulse[c])
                balance -= state.generalised_force(walker.foot_point(foot), vector)
            rows.append(balance / 5)
            tags += [f"{tag}:imp"] * 9
            bounds += [(0.0, 0.0)] * 9
            if target.kind == "DS2":
                normal = self.options["impact_friction"] * impulse[1]
                rows.append(ca.vertcat(normal - impulse[0], normal + impulse[0]) / 20)
                tags += [f"{tag}:impfric"] * 2
                bounds += [(0.0, ca.inf)] * 2
        else:
            rows.append((v1 - v0) / 3)
            tags += [f"{tag}:dq"] * 9
            bounds += [(0.0, 0.0)] * 9
        if fibres:
            first = len(variables)
            rows.append(z[first + 10 : first + 20] - z[first : first + 10])
            tags += [f"{tag}:lce"] * 10
            bounds += [(0.0, 0.0)] * 10
        at = [self._register(tags, bounds)]
        self.elements.append(
            Element(
                f"{domain.name}_to_{target.name}",
                z,
                ca.SX.sym("c", 0),
                ca.SX.sym("w", 2),
                ca.vertcat(*rows),
                None,
                [variables + fibres + shift],
                [[]],
                at,
            )
        )

    def _stride_element(self):
        layout, limits = self.layout, self.options["limits"]
        durations = [entry["T"] for entry in layout.globals]
        z = ca.SX.sym("z", 10)
        rows = ca.vertcat(z[0], z[1] - z[0], z[1] / (0.2 * ca.sum1(z[2:])))
        bounds = [tuple(limits["step"])] * 2 + [tuple(limits["speed"])]
        at = [self._register(["step", "step", "speed"], bounds)]
        variables = [[layout.right_step, layout.stride] + durations]
        empty, w = ca.SX.sym("c", 0), ca.SX.sym("w", 2)
        self.elements.append(Element("stride", z, empty, w, rows, None, variables, [[]], at))

    # Bounds -------------------------------------------------------------------------------------------------------

    def row_bounds(self, relaxed_touchdown):
        upper = list(self.upper)
        for row in self.touchdown_rows:
            upper[row] = 0.0 if relaxed_touchdown else upper[row]
        return self.lower, upper

    def variable_bounds(self):
        layout, limits, a = self.layout, self.options["limits"], self.options["bounds"]
        lower, upper = np.full(layout.n, -np.inf), np.full(layout.n, np.inf)

        def put(index, low, high):
            lower[index], upper[index] = low / layout.scale[index], high / layout.scale[index]

        torso = max(a["a6"], limits["torso_tolerance"])
        hip, ankle = min(radians(a["a7"]), limits["hip"]), radians(a["a8"])
        prosthetic = limits["prosthetic_ankle"]
        angles = [(-10, 10), (-10, 10), (-torso, torso), (-hip, hip), limits["knee"], (-ankle, ankle), (-hip, hip)]
        angles += [limits["knee"], (max(-ankle, prosthetic[0]), min(ankle, prosthetic[1]))]
        torques = [(-limits["u_hip"], limits["u_hip"]), (-limits["u_knee"], limits["u_knee"]), limits["u_ankle"]]
        torques.append(torques[0])
        torques += [(-limits[key], limits[key]) for key in ("u_prosthetic_knee", "u_prosthetic_ankle")]
        for d, domain in enumerate(self.domains):
            unloading = {"DS3": 4, "SS2": 1}.get(domain.kind)
            # At lift-off the friction vanishes with the vertical force: the vertex of the cone.
            vanishing = {"DS3": (3, 4), "SS2": (1,)}.get(domain.kind, ())
            for k in range(domain.points):
                p = layout.point_start[d][k]
                for i in range(9):
                    put(p + i, *angles[i])
                    speed = min(a["a1"], limits["prosthetic_speed"]) if i >= 7 else a["a1"]
                    put(p + 9 + i, -speed, speed)
                    put(p + 18 + i, -a["a2"], a["a2"])
                for i in range(6):
                    put(p + 27 + i, *torques[i])
                for c, (_, axis) in enumerate(domain.contacts):
                    low, high = (0.0 if axis == 1 else -limits["force_max"]), limits["force_max"]
                    if c == unloading:
                        low = limits["liftoff_force"] * (1 - k / (domain.points - 1))
                    if k == domain.points - 1 and c in vanishing:
                        low = high = 0.0
                    put(p + 33 + c, low, high)
                if self.muscles:
                    fibre = p + 33 + len(domain.contacts)
                    for m, muscle in enumerate(model.MUSCLES):
                        put(fibre + m, *limits["fibre"])
                        put(fibre + 10 + m, -muscle.speed, muscle.speed)
                        put(fibre + 20 + m, 0.0, 1.0)
            entry = layout.globals[d]
            put(entry["T"], limits["T_min"][domain.kind], limits["T_max"][domain.kind])
            put(entry["pa"], -2.0, 2.0)
            for index in entry["alpha"]:
                put(index, -4.0, 4.0)
            landing = {"DS2": 1, "DS3": 2}.get(domain.kind)
            for c, index in enumerate(entry.get("impulse", [])):
                put(index, 0.0 if c == landing else -limits["impulse_max"], limits["impulse_max"])
        for index in layout.vhip:
            put(index, a["a3"], a["a4"])
        put(layout.right_step, 0.1, 2.0)
        put(layout.stride, 0.2, 3.0)
        return lower, upper


def merged(defaults, given):
    """`defaults` updated by `given`; unknown names are errors."""
    result = dict(defaults)
    for key, value in given.items():
        if key not in defaults:
            raise KeyError(f"unknown option {key!r}; known: {', '.join(defaults)}")
        is_table = isinstance(defaults[key], dict)
        result[key] = merged(defaults[key], value) if is_table else value
    return result


def read_reference(path):
    """Columns torso, hip_L, knee_L, ankle_L, hip_R of a reference gait (101 rows)."""
    with open(path) as file:
        lines = [line for line in file if not line.startswith("#")]
    table = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]])
    assert table.shape[0] == 101 and table.shape[1] >= 6, table.shape
    return list(table[:, 1:6].T)
