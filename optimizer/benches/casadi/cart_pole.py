"""Alternate solves of the swing-up of a cart-pole (Sleipnir's benchmark) by Gaitwright and by CasADi with IPOPT.

    python cart_pole.py [--intervals 100 150 200 250 300] [--runs 5]

Prints every run and the medians. IPOPT at its defaults (tolerance 1e-8, as ours), exact derivatives from CasADi's scalar graphs;
its time is that of the solve alone, without set-up. The published times are for other machines.
"""

import argparse
import csv
import io
import statistics
import subprocess
import time

import casadi as ca
import numpy as np

from race import example

DURATION_S = 5.0
CART, POLE, LENGTH, GRAVITY = 5.0, 0.5, 0.5, 9.806
FIRST, LAST = np.zeros(4), np.array([1.0, np.pi, 0.0, 0.0])


def rates(state, force):
    """M(q) q'' = tau - C q' + B u of the cart and its pole, which hangs down at 0."""
    angle, turning = state[1], state[3]
    mass = ca.vertcat(
        ca.horzcat(CART + POLE, POLE * LENGTH * ca.cos(angle)),
        ca.horzcat(POLE * LENGTH * ca.cos(angle), POLE * LENGTH**2),
    )
    force = ca.vertcat(force + POLE * LENGTH * turning**2 * ca.sin(angle), -POLE * GRAVITY * LENGTH * ca.sin(angle))
    return ca.vertcat(state[2:], ca.solve(mass, force))


def program(intervals):
    """The solver with its starting point and bounds."""
    step = DURATION_S / intervals
    state, force = ca.SX.sym("state", 4), ca.SX.sym("force")
    a = rates(state, force)
    b = rates(state + 0.5 * step * a, force)
    c = rates(state + 0.5 * step * b, force)
    d = rates(state + step * c, force)
    reached = ca.Function("step", [state, force], [state + step / 6 * (a + 2 * b + 2 * c + d)])
    states, forces = ca.SX.sym("X", 4, intervals + 1), ca.SX.sym("U", 1, intervals)
    gaps = [states[:, k + 1] - reached(states[:, k], forces[k]) for k in range(intervals)]
    x = ca.vertcat(ca.vec(states), forces.T)
    problem = {"x": x, "f": ca.sumsqr(forces), "g": ca.vertcat(*gaps)}
    quiet = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes"}}
    solver = ca.nlpsol("solver", "ipopt", problem, quiet)
    share = np.linspace(0.0, 1.0, intervals + 1)
    guess = np.outer(np.array([LAST[0], LAST[1], 0.0, 0.0]), share)
    lower, upper = np.full((4, intervals + 1), -np.inf), np.full((4, intervals + 1), np.inf)
    lower[0], upper[0] = 0.0, 2.0
    for at, value in ((0, FIRST), (-1, LAST)):
        lower[:, at] = upper[:, at] = value

    def whole(states, force):
        return np.concatenate([states.ravel(order="F"), np.full(intervals, force)])

    return solver, {
        "x0": whole(guess, 0.0),
        "lbx": whole(lower, -20.0),
        "ubx": whole(upper, 20.0),
        "lbg": 0.0,
        "ubg": 0.0,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--intervals", type=int, nargs="+", default=[100, 150, 200, 250, 300])
    parser.add_argument("--runs", type=int, default=5)
    arguments = parser.parse_args()
    ours = example("cart_pole", "interior-point")
    print("intervals,ours,ours_iterations,ours_objective,ours_s,ipopt_iterations,ipopt_objective,ipopt_s,ratio")
    for intervals in arguments.intervals:
        solver, given = program(intervals)
        ours_s, theirs_s = [], []
        for _ in range(arguments.runs):
            output = subprocess.check_output([ours, str(intervals)], text=True)
            row = next(csv.DictReader(io.StringIO(output)))
            ours_s.append(float(row["seconds"]))
            started = time.perf_counter()
            solution = solver(**given)
            theirs_s.append(time.perf_counter() - started)
            stats = solver.stats()
            assert stats["success"], stats["return_status"]
        mine, theirs = statistics.median(ours_s), statistics.median(theirs_s)
        print(
            f"{intervals},{row['status']},{row['iterations']},{row['objective']},{mine:.4f},"
            f"{stats['iter_count']},{float(solution['f']):.6f},{theirs:.4f},{theirs / mine:.1f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
