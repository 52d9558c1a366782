"""The gait problem in CasADi with IPOPT (MUMPS): an independent reference, and the other side of `race.py`.

    python gait_casadi.py solve OPTIONS.json RESULT.json    solve from a given start (see README.md)
    python gait_casadi.py check                             compare with the fixtures and the golden gaits
    python gait_casadi.py time OPTIONS.json RESULT.json     time one evaluation of f, g, gradient, Jacobian, Hessian
"""

import argparse
import hashlib
import json
import subprocess
import sys
import tempfile
import time
from collections import OrderedDict
from pathlib import Path

import casadi as ca
import numpy as np

import muscle_guess
from program import DEFAULTS, Gait, read_reference

HERE = Path(__file__).resolve().parent
CRATE = HERE.parent.parent
REFERENCE = CRATE / "data" / "reference_gait_falisse_2019.csv"
FIXTURES = CRATE / "tests" / "data"

TRACKING = {"relaxed": True}
COST = {"w": [1.0, 0.0], "relaxed": False, "tol": 1e-6, "constr_viol_tol": 1e-7}
ROUGH = {"tol": 1e-2, "constr_viol_tol": 1e-3, "compl_inf_tol": 1e-2}
FIRM = {"tol": 1e-3, "constr_viol_tol": 1e-5, "acceptable_tol": 1e-2, "acceptable_iter": 5}
PUSHED = {"bound_push": 0.1, "bound_frac": 0.1}
# Phase settings: `same` are those of the crate, without a second tracking phase; `own` were chosen for IPOPT.
PHASES = {
    "same": {
        "tracking": TRACKING | ROUGH | PUSHED | {"w": [0.0, 3.0], "mu_init": 1e-3},
        "cost": COST | PUSHED | {"mu_init": 1e-6},
        "muscle_cost": COST | PUSHED | {"mu_init": 1e-5},
    },
    "own": {
        "tracking": TRACKING | FIRM | {"w": [0.0, 10.0], "mu_init": 1e-3},
        "muscle_tracking": TRACKING | FIRM | {"w": [0.0, 10.0], "mu_init": 1e-2},
        "cost": COST | {"mu_init": 1e-4},
        "muscle_cost": COST | {"mu_init": 1e-4},
    },
}


class Solver:
    """A gait problem with its functions, interpreted or compiled, and IPOPT as its solver."""

    def __init__(self, options, backend="vm", cache=None):
        started = time.perf_counter()
        self.gait = Gait(options, read_reference(REFERENCE))
        self.functions = self.gait.program.functions()
        self.setup_s = time.perf_counter() - started
        self.compile_s = 0.0
        if backend == "c":
            started = time.perf_counter()
            self._compile(cache)
            self.compile_s = time.perf_counter() - started
        self.f, self.g, self.grad_f, self.jac_g, self.hess_lag = self.functions
        self.backend = backend

    def _compile(self, cache):
        """Compiles all functions through C. `cache` keeps libraries by their source text."""
        generator = ca.CodeGenerator("gait.c")
        for function in self.functions:
            generator.add(function)
        text = generator.dump()
        if cache is None:
            self.directory = tempfile.TemporaryDirectory(prefix="gait_casadi_")
            cache = self.directory.name
        library = Path(cache) / f"{hashlib.sha256(text.encode()).hexdigest()[:16]}.so"
        if not library.exists():
            source = library.with_suffix(".c")
            source.write_text(text)
            # -O2 takes more than fifteen minutes with muscles, -O1 one minute.
            flags = ["-O1", "-march=native", "-fPIC", "-shared"]
            subprocess.run(["gcc", *flags, str(source), "-o", str(library), "-lm"], check=True)
        self.functions = [ca.external(function.name(), str(library)) for function in self.functions]

    def solve(self, x0, phase, extra=None, quiet=True):
        """Solves a phase from x0; returns x and a report."""
        gait = self.gait
        x, p = ca.MX.sym("x", gait.layout.n), ca.MX.sym("p", 2)
        ipopt = {
            "linear_solver": "mumps",
            "mu_strategy": "monotone",
            "nlp_scaling_method": "none",
            "bound_relax_factor": 1e-8,
            "max_iter": 1000,
            "print_level": 0 if quiet else 5,
            "sb": "yes",
        }
        names = ("mu_init", "tol", "constr_viol_tol", "compl_inf_tol", "acceptable_tol", "acceptable_iter")
        names += ("bound_push", "bound_frac")
        ipopt |= {key: phase[key] for key in names if key in phase}
        ipopt |= extra or {}
        options = {
            "ipopt": ipopt,
            "print_time": False,
            "record_time": True,
            "calc_lam_p": False,
            "no_nlp_grad": True,
            "grad_f": self.grad_f,
            "jac_g": self.jac_g,
            "hess_lag": self.hess_lag,
        }
        started = time.perf_counter()
        nlp = {"x": x, "p": p, "f": self.f(x, p), "g": self.g(x, p)}
        solver = ca.nlpsol("solver", "ipopt", nlp, options)
        setup = time.perf_counter() - started
        lbx, ubx = gait.variable_bounds()
        lbg, ubg = gait.row_bounds(phase["relaxed"])
        result = solver(x0=x0, p=phase["w"], lbx=lbx, ubx=ubx, lbg=lbg, ubg=ubg)
        stats = solver.stats()
        x = np.array(result["x"]).flatten()
        g = np.array(result["g"]).flatten()
        violation = max(np.max(np.array(lbg) - g), np.max(g - np.array(ubg)), np.max(lbx - x), np.max(x - ubx), 0.0)
        evaluation = sum(stats[key] for key in stats if key.startswith("t_wall_nlp_"))
        return x, {
            "status": stats["return_status"],
            "iterations": stats["iter_count"],
            "objective": float(result["f"]),
            "violation": float(violation),
            "seconds_ipopt": stats["t_wall_total"],
            "seconds_ipopt_cpu": stats["t_proc_total"],
            "seconds_evaluation": evaluation,
            "seconds_setup": setup,
        }

    def cost(self, x):
        """(mCoT, regularisation, tracking)."""
        f = [float(self.f(x, w)) for w in ([0, 0], [1, 0], [0, 1])]
        return f[1] - f[0], f[0], f[2] - f[0]


def solve(options):
    """All phases of a cold start from scaled variables x without muscles."""
    problem = options["problem"]
    start = np.array(options["start"], dtype=float)
    backend = options.get("backend", "vm")
    quiet = not options.get("verbose", False)
    settings = PHASES[options.get("phases", "same")]
    cache, extra = options.get("cache"), options.get("ipopt", {})
    plain = Solver(problem | {"muscles": False}, backend, cache)
    assert start.size == plain.gait.layout.n, f"start has {start.size} variables, not {plain.gait.layout.n}"
    phases, setup, compilation = OrderedDict(), plain.setup_s, plain.compile_s
    x, phases["tracking"] = plain.solve(start, settings["tracking"], extra, quiet)
    last = plain
    guess_s = 0.0
    if problem.get("muscles", False):
        last = Solver(problem, backend, cache)
        setup, compilation = setup + last.setup_s, compilation + last.compile_s
        started = time.perf_counter()
        x = muscle_guess.guess(plain.gait, last.gait, x)
        guess_s = time.perf_counter() - started
        if "muscle_tracking" in settings:
            x, phases["muscle_tracking"] = last.solve(x, settings["muscle_tracking"], extra, quiet)
    x, phases["cost"] = last.solve(x, settings["muscle_cost" if last is not plain else "cost"], extra, quiet)
    mcot, reg, _ = last.cost(x)
    final = phases["cost"]
    return {
        "status": final["status"],
        "iterations": sum(p["iterations"] for p in phases.values()),
        "objective": final["objective"],
        "cost_of_transport": mcot,
        "regularisation": reg,
        "violation": final["violation"],
        "seconds_ipopt": sum(p["seconds_ipopt"] for p in phases.values()),
        "seconds_ipopt_cpu": sum(p["seconds_ipopt_cpu"] for p in phases.values()),
        "seconds_evaluation": sum(p["seconds_evaluation"] for p in phases.values()),
        "seconds_setup": setup + sum(p["seconds_setup"] for p in phases.values()),
        "seconds_compile": compilation,
        "seconds_muscle_guess": guess_s,
        "backend": backend,
        "versions": {"casadi": ca.__version__, "python": sys.version.split()[0]},
        "phases": phases,
        "x": x.tolist(),
    }


def time_functions(options):
    """Time of an evaluation of each function, s; median of `repetitions`."""
    backend = options.get("backend", "vm")
    solver = Solver(options["problem"], backend, options.get("cache"))
    x = np.array(options["x"], dtype=float)
    m = solver.g.size1_out(0)
    arguments = {
        "nlp_f": [x, [1, 0]],
        "nlp_g": [x, [1, 0]],
        "nlp_grad_f": [x, [1, 0]],
        "nlp_jac_g": [x, [1, 0]],
        "nlp_hess_l": [x, [1, 0], 1.0, np.cos(np.arange(m))],
    }
    result = {"backend": backend, "setup_s": solver.setup_s, "compile_s": solver.compile_s}
    for function in (solver.f, solver.g, solver.grad_f, solver.jac_g, solver.hess_lag):
        # Buffers avoid the conversion of arguments and results to Python objects.
        buffer, run = function.buffer()
        given = [ca.DM(a) for a in arguments[function.name()]]
        dense = [np.array(ca.densify(a)).flatten().astype(float) for a in given]
        for i, a in enumerate(dense):
            buffer.set_arg(i, memoryview(a))
        outputs = [np.zeros(function.nnz_out(i)) for i in range(function.n_out())]
        for i, out in enumerate(outputs):
            buffer.set_res(i, memoryview(out))
        times = []
        for _ in range(options.get("repetitions", 50)):
            started = time.perf_counter()
            run()
            times.append(time.perf_counter() - started)
        assert all(np.isfinite(out).all() for out in outputs)
        result[function.name()] = float(np.median(times))
        result[function.name() + "_best"] = float(np.min(times))
    return result


# Checks ---------------------------------------------------------------------------------------------------------------


def golden_x(gait, data):
    """Scaled variables of a golden gait."""
    layout = gait.layout
    x = np.zeros(layout.n)

    def put(index, values):
        index = np.atleast_1d(index)
        x[index] = np.asarray(values, dtype=float).flatten() / layout.scale[index]

    for d, (domain, source) in enumerate(zip(gait.domains, data["domains"])):
        for k in range(domain.points):
            keys = ["q", "dq", "ddq", "u", "lam"] + (["lce_norm", "vce", "act"] if gait.muscles else [])
            put(layout.point(d, k), np.concatenate([source[key][k] for key in keys]))
        entry = layout.globals[d]
        put(entry["T"], source["T"])
        put(entry["pa"], source["pa"])
        if "pb" in entry:
            put(entry["pb"], source["pb"])
        put(entry["alpha"], np.array(source["alpha"]).flatten(order="F"))
        if "impulse" in entry:
            put(entry["impulse"], source["impulse"])
    put(layout.vhip, data["vhip"])
    put(layout.right_step, data["xL"])
    put(layout.stride, data["D"])
    return x


def check_fixture(letter):
    """Compares group sums of rows and parts of the objective at the disturbed point."""
    data = json.loads((FIXTURES / f"nlp_s1_{letter}.json").read_text())
    solver = Solver({"subject": data["subject"], "muscles": data["muscles"]})
    x = np.array(data["x"])
    g = np.array(solver.g(x, [1, 0])).flatten()
    sums = {}
    for tag, value in zip(solver.gait.tags, g):
        sums.setdefault(tag, []).append(value)
    worst = 0.0
    for name, count, total, squares, *_ in data["groups"]:
        values = np.array(sums.pop(name))
        assert values.size == count, (name, values.size, count)
        scale = max(1.0, np.abs(values).sum())
        worst = max(worst, abs(values.sum() - total) / scale)
        worst = max(worst, abs((values**2).sum() - squares) / max(1.0, squares))
    assert not sums, f"rows the fixture lacks: {list(sums)}"
    assert worst < 1e-8, f"row sums differ by {worst}"
    parts = solver.cost(x)
    for ours, key in zip(parts, ("mcot", "reg", "track")):
        assert abs(ours - data[key]) < 1e-8 * max(1.0, abs(data[key])), (key, ours, data[key])
    print(f"nlp_s1_{letter}: row sums agree to {worst:.1e}, objective parts agree")
    return solver, x


def check_derivatives(solver, x):
    """Compares assembled derivatives with those of CasADi for the whole problem in random directions."""
    gait = solver.gait
    generator = np.random.default_rng(1)
    d, e = generator.standard_normal((2, gait.layout.n))
    lam = generator.standard_normal(len(gait.tags))
    X, t, r = ca.MX.sym("x", gait.layout.n), ca.MX.sym("t"), ca.MX.sym("r")
    p = ca.DM([1.0, 0.3])
    moved = X + t * d + r * e
    lagrangian = 1.7 * solver.f(moved, p) + ca.dot(lam, solver.g(moved, p))
    first = ca.Function("first", [X, t, r], [ca.jacobian(solver.g(moved, p), t), ca.jacobian(solver.f(moved, p), t)])
    second = ca.Function("second", [X, t, r], [ca.jacobian(ca.jacobian(lagrangian, t), r)])
    along, slope = first(x, 0, 0)
    jacobian = solver.jac_g(x, p)[1]
    gradient = solver.grad_f(x, p)[1]
    hessian = solver.hess_lag(x, p, 1.7, lam)
    whole = hessian + hessian.T - ca.diag(ca.diag(hessian))
    for what, a, b in (
        ("Jacobian", jacobian @ d, along),
        ("gradient", gradient.T @ d, slope),
        ("Hessian", ca.dot(d, whole @ e), second(x, 0, 0)),
    ):
        a, b = np.array(a).flatten(), np.array(b).flatten()
        error = np.max(np.abs(a - b)) / max(1.0, np.max(np.abs(b)))
        assert error < 1e-10, f"{what}: {error}"
        print(f"  {what}: {error:.1e}")


def check_golden(subject, letter):
    """Checks that IPOPT stays at the golden gait."""
    data = json.loads((FIXTURES / f"golden_s{subject}_{letter}.json").read_text())
    problem = {key: data["problem"][key] for key in ("subject", "bounds", "muscles", "intervals")}
    solver = Solver(problem)
    x = golden_x(solver.gait, data)
    objective = float(solver.f(x, [1, 0]))
    assert abs(objective - data["obj"]) < 1e-10, (objective, data["obj"])
    phase = COST | {"mu_init": 1e-6 / 11}
    stay, figures = solver.solve(x, phase, {"bound_push": 1e-9, "bound_frac": 1e-9, "max_iter": 60})
    difference = abs(figures["objective"] - data["obj"]) / data["obj"]
    print(
        f"golden_s{subject}_{letter}: {figures['status']} after {figures['iterations']} iterations, "
        f"objective differs by {difference:.1e}, violation {figures['violation']:.1e}, moved {np.abs(stay - x).max():.1e}"
    )
    assert figures["status"] == "Solve_Succeeded", figures
    assert difference < 1e-6, difference


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("command", choices=["solve", "check", "time"])
    parser.add_argument("options", nargs="?")
    parser.add_argument("result", nargs="?")
    arguments = parser.parse_args()
    if arguments.command == "check":
        for letter in "nm":
            solver, x = check_fixture(letter)
            check_derivatives(solver, x)
        for subject, letter in ((1, "n"), (2, "n"), (1, "m"), (2, "m")):
            check_golden(subject, letter)
        return
    if not (arguments.options and arguments.result):
        parser.error(f"{arguments.command} needs OPTIONS.json and RESULT.json")
    options = json.loads(Path(arguments.options).read_text())
    result = solve(options) if arguments.command == "solve" else time_functions(options)
    Path(arguments.result).write_text(json.dumps(result))
    print(json.dumps({key: value for key, value in result.items() if key != "x"}, indent=2))


if __name__ == "__main__":
    main()
