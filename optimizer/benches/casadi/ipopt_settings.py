"""Which settings make IPOPT fastest on the gait problem: the other side of `race.py` is to have its best ones.

    python ipopt_settings.py [--subject 1 2] [--guess 41 42 43] [--muscles] [--backend vm|c] [--limit 300]

Prints for each set of settings the starts that it solves, its iterations and processor time as a share of that of the first
set over the starts that both solve, and the median objective. Choose with these starts; race from others.
"""

import argparse
import json
import statistics
import subprocess
import tempfile
from pathlib import Path

from race import example, run_casadi

ADAPTIVE = {"mu_strategy": "adaptive"}
# What Gaitwright has as well: bound multipliers from the barrier parameter, at most one second-order correction.
OURS = {"bound_mult_init_method": "mu-based", "max_soc": 1}
METIS = {"mumps_pivot_order": 5}
SETTINGS = {
    "phases same": ("same", {}),
    "phases own": ("own", {}),
    "same, as ours": ("same", OURS),
    "own, as ours": ("own", OURS),
    "same, METIS": ("same", METIS),
    "same, adaptive, quality function": ("same", ADAPTIVE),
    "same, adaptive, probing": ("same", ADAPTIVE | {"mu_oracle": "probing"}),
    "same, adaptive, LOQO": ("same", ADAPTIVE | {"mu_oracle": "loqo"}),
    "same, adaptive, obj-constr-filter": ("same", ADAPTIVE | {"adaptive_mu_globalization": "obj-constr-filter"}),
    "same, as ours, adaptive": ("same", OURS | ADAPTIVE),
    "same, Mehrotra": ("same", {"mehrotra_algorithm": "yes"}),
    "same, kappa_epsilon 1": ("same", {"barrier_tol_factor": 1.0}),
    "same, linear decrease .1": ("same", {"mu_linear_decrease_factor": 0.1}),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--subject", type=int, nargs="+", default=[1, 2], choices=[1, 2])
    parser.add_argument("--guess", type=int, nargs="+", default=[41, 42, 43], help="numbers of initial guesses, 1 to 64")
    parser.add_argument("--muscles", action="store_true")
    parser.add_argument("--backend", default="vm", choices=["vm", "c"])
    parser.add_argument("--limit", type=float, default=300.0, help="time limit of a run, s")
    arguments = parser.parse_args()
    dump, first = example("dump_start"), {}
    with tempfile.TemporaryDirectory(prefix="ipopt_settings_") as folder:
        for name, (phases, ipopt) in SETTINGS.items():
            one = argparse.Namespace(**vars(arguments) | {"phases": phases, "ipopt": ipopt})
            runs = {}
            for subject in arguments.subject:
                for guess in arguments.guess:
                    start = json.loads(subprocess.check_output([dump, "--subject", str(subject), "--guess", str(guess)]))
                    try:
                        run = run_casadi(start, one, arguments.limit, Path(folder))
                    except subprocess.CalledProcessError:
                        continue  # killed by the limit
                    if run["solved"]:
                        runs[subject, guess] = run
            first = first or runs
            both = runs.keys() & first.keys()
            if not both:
                print(f"{name:36} solved 0", flush=True)
                continue
            iterations, cpu = (
                statistics.geometric_mean(runs[start][key] / first[start][key] for start in both)
                for key in ("iterations", "cpu")
            )
            objective = statistics.median(runs[start]["objective"] for start in both)
            print(
                f"{name:36} solved {len(runs)} of {len(arguments.subject) * len(arguments.guess)}, iterations "
                f"{iterations:.2f}, processor time {cpu:.2f}, median objective {objective:.8f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
