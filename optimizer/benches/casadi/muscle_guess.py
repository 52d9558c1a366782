"""Muscle states for a gait without muscles: forces by bounded least squares, then tendon, fibre, activation."""

import numpy as np

import walker as model

REST_FORCE, REST_WEIGHT = 0.02, 0.03


def nonnegative_least_squares(a, b):
    """Minimises |a x - b| over x >= 0 by the active-set method of Lawson and Hanson."""
    n = a.shape[1]
    passive, x = np.zeros(n, dtype=bool), np.zeros(n)
    for _ in range(10 * n):
        slope = a.T @ (b - a @ x)
        slope[passive] = -np.inf
        entering = int(np.argmax(slope))
        if slope[entering] <= 1e-12:
            return x
        passive[entering] = True
        while True:
            trial = np.zeros(n)
            trial[passive] = np.linalg.lstsq(a[:, passive], b, rcond=None)[0]
            if trial[passive].min(initial=np.inf) > 0:
                x = trial
                break
            blocking = passive & (trial <= 0)
            step = (x[blocking] / (x[blocking] - trial[blocking])).min()
            x = x + step * (trial - x)
            passive &= x > 1e-14
            x[~passive] = 0.0
    raise RuntimeError("non-negative least squares did not end")


def forces(q, u):
    """Forces in units of F_max that produce the four muscle-driven torques."""
    arms = np.zeros((4, 10))
    for m, muscle in enumerate(model.MUSCLES):
        for joint in muscle.joints:
            arms[joint[0] - 3, m] += float(model.joint_length_and_arm(joint, q[joint[0]])[1]) * muscle.force / 100
    a = np.vstack([arms, REST_WEIGHT * np.eye(10)])
    b = np.concatenate([u[:4] / 100, np.full(10, REST_WEIGHT * REST_FORCE)])
    return np.clip(nonnegative_least_squares(a, b), 1e-3, 1.2)


def guess(plain, full, x):
    """Converts the scaled variables of `plain` (without muscles) to the layout of `full` (with muscles)."""
    result = np.zeros(full.layout.n)
    tail = plain.layout.vhip[0]
    result[full.layout.vhip[0] :] = x[tail:]
    for d, domain in enumerate(full.domains):
        T = x[plain.layout.globals[d]["T"]] * 0.2
        step = T / (domain.points - 1)
        points = [x[plain.layout.point(d, k)] for k in range(domain.points)]
        force = np.array([forces(p[:9], p[27:33] * 100.0) for p in points])
        length = np.zeros_like(force)
        for k, p in enumerate(points):
            for m, muscle in enumerate(model.MUSCLES):
                tendon = muscle.slack * (1 + 0.04 * np.sqrt(force[k, m]))
                length[k, m] = (float(model.unit_length(muscle, p[:9])) - tendon) / muscle.optimal
        length = np.clip(length, 0.35, 1.55)
        velocity = np.gradient(length, step, axis=0)
        for m, muscle in enumerate(model.MUSCLES):
            velocity[:, m] = np.clip(velocity[:, m], -muscle.speed / 2, muscle.speed / 2)
        for k, p in enumerate(points):
            capacity = [
                float(model.force_length(length[k, m])) * float(model.force_velocity(velocity[k, m] / muscle.speed))
                for m, muscle in enumerate(model.MUSCLES)
            ]
            activation = np.clip(force[k] / np.maximum(capacity, 0.05), 0.01, 0.95)
            result[full.layout.point(d, k)] = np.concatenate([p, length[k], velocity[k] / 3.0, activation])
    return result
