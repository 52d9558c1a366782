"""Alternate solves by Gaitwright and by CasADi with IPOPT from the same starts: prints runs, medians and ratios.

    python race.py [--subject 1 2] [--guess 1 2] [--muscles] [--runs 3] [--backend vm|c] [--phases same|own]
        [--ipopt '{"max_soc": 1}'] [--threads 1 2] [--limit 900] [--json FILE]

Each number of threads of Gaitwright is a side of its own; IPOPT has one thread. Intervals of geometric means are those of
10,000 bootstrap samples of the starts (95 %). Two results are the same local optimum if their objectives differ by less
than 1e-4 (relative).

Wall seconds and processor seconds (user + system) are both reported: on a machine that is shared only the latter are
comparable. CasADi's symbolic set-up and compilation are not in its time; posture and motion guess are in ours.
Memory is the peak of the process, CasADi's with Python and set-up.
"""

import argparse
import json
import os
import platform
import random
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
WORKSPACE = HERE.parent.parent.parent
# One thread, because numerical libraries otherwise start one for each core.
ENVIRONMENT = os.environ | {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}


def example(name, package="gait-optimizer"):
    """Path of an example that cargo has built, below CARGO_TARGET_DIR if that is set."""
    command = ["cargo", "build", "--quiet", "--release", "-p", package, "--example", name, "--message-format=json"]
    output = subprocess.run(command, cwd=WORKSPACE, check=True, stdout=subprocess.PIPE, text=True).stdout
    for message in map(json.loads, output.splitlines()):
        if message.get("target", {}).get("name") == name and message.get("executable"):
            return message["executable"]
    raise RuntimeError(f"cargo built no {name}")


def timed(command, limit):
    """Standard output, wall time (s), processor time (s) and peak memory (MB) of a child process."""
    started = time.perf_counter()
    child = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=ENVIRONMENT)
    alarm = threading.Timer(limit, child.kill)
    alarm.start()
    output = child.stdout.read()
    _, status, usage = os.wait4(child.pid, 0)
    alarm.cancel()
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode != 0:
        raise subprocess.CalledProcessError(child.returncode, command)
    wall = time.perf_counter() - started
    return output, wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def run_ours(program, arguments, threads, limit):
    command = [program, "--subject", str(arguments.subject), "--threads", str(threads)]
    command += ["--guess", str(arguments.guess)] + (["--muscles"] if arguments.muscles else [])
    output, _, cpu, memory = timed(command, limit)
    result = json.loads(output)
    report = result["report"]
    return {
        "side": ours(threads),
        "status": report["status"],
        "solved": report["status"] == "converged",
        "iterations": report["iterations"],
        "by_phase": {name: count for name, count in result["iterations_by_phase"]},
        "objective": report["objective"],
        "violation": report["max_violation"],
        "wall": report["seconds_total"],
        "cpu": cpu,
        "memory": memory,
        "evaluation": report["seconds_evaluation"],
    }


def run_casadi(start, arguments, limit, folder):
    problem = {"subject": {"H": start["subject"]["height_m"], "M": start["subject"]["body_mass_kg"]}}
    problem |= {"muscles": arguments.muscles, "bounds": start["bounds"]}
    options = {"problem": problem, "start": start["start"], "backend": arguments.backend, "cache": str(folder)}
    options |= {"phases": arguments.phases, "ipopt": arguments.ipopt}
    given, result = folder / "options.json", folder / "result.json"
    given.write_text(json.dumps(options))
    command = [sys.executable, str(HERE / "gait_casadi.py"), "solve", str(given), str(result)]
    _, _, _, memory = timed(command, limit)
    result = json.loads(result.read_text())
    return {
        "side": "casadi",
        "status": result["status"],
        "solved": result["status"] == "Solve_Succeeded",
        "iterations": result["iterations"],
        "by_phase": {name: phase["iterations"] for name, phase in result["phases"].items()},
        "objective": result["objective"],
        "violation": result["violation"],
        "wall": result["seconds_ipopt"],
        "cpu": result["seconds_ipopt_cpu"],
        "memory": memory,
        "evaluation": result["seconds_evaluation"],
        "setup": result["seconds_setup"],
        "compile": result["seconds_compile"],
    }


def ours(threads):
    """Name of the side with so many threads."""
    return f"ours, {threads} threads" if threads > 1 else "ours, 1 thread"


def processor():
    for line in Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []:
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def race(arguments, program, dump, folder):
    """All runs from one start, alternately."""
    place = ["--subject", str(arguments.subject), "--guess", str(arguments.guess)]
    start = json.loads(subprocess.check_output([dump, *place]))
    runs = []
    for number in range(arguments.runs):
        for threads in [*arguments.threads, None]:
            if threads:
                run = run_ours(program, arguments, threads, arguments.limit)
            else:
                run = run_casadi(start, arguments, arguments.limit, folder)
            run |= {"subject": arguments.subject, "guess": arguments.guess, "load": os.getloadavg()[0]}
            runs.append(run)
            print(
                f"subject {arguments.subject} guess {arguments.guess} {number + 1} {run['side']:15} {run['status']:16} "
                f"{run['iterations']:5} iterations objective {run['objective']:.8f} violation {run['violation']:.1e} "
                f"wall {run['wall']:8.2f} s  cpu {run['cpu']:8.2f} s  evaluation {run['evaluation']:7.2f} s  "
                f"memory {run['memory']:5.0f} MB  load {run['load']:.1f}  {run['by_phase']}",
                flush=True,
            )
    return runs


def medians(runs):
    """Medians of each side."""
    median = {}
    for side in dict.fromkeys(run["side"] for run in runs):
        mine = [run for run in runs if run["side"] == side]
        keys = ("wall", "cpu", "iterations", "objective")
        median[side] = {key: statistics.median(run[key] for run in mine) for key in keys}
        median[side]["not solved"] = [run["status"] for run in mine if not run["solved"]]
    return median


def geometric_mean(ratios):
    """Geometric mean and its bootstrap interval."""
    draws = random.Random(1)
    samples = sorted(statistics.geometric_mean(draws.choices(ratios, k=len(ratios))) for _ in range(10_000))
    return f"{statistics.geometric_mean(ratios):.2f} ({samples[250]:.2f} to {samples[-251]:.2f})"


def compare(starts, side):
    """Prints ratios and local optima of this side and CasADi, over the starts that both solved."""
    both = [start for start in starts if not start[side]["not solved"] and not start["casadi"]["not solved"]]
    print(f"CasADi + IPOPT / {side}, over {len(both)} of {len(starts)} starts that both solved, geometric means:")
    if not both:
        return
    for key in ("wall", "cpu"):
        ratios = [start["casadi"][key] / start[side][key] for start in both]
        print(f"  {key:4} {geometric_mean(ratios)}, smallest {min(ratios):.2f}, largest {max(ratios):.2f}")
    differences = [start[side]["objective"] / start["casadi"]["objective"] - 1 for start in both]
    same = sum(abs(difference) < 1e-4 for difference in differences)
    lower = sum(difference <= -1e-4 for difference in differences)
    print(f"  local optimum: the same {same}, lower objective of ours {lower}, of IPOPT {len(both) - same - lower}")
    for name in (side, "casadi"):
        objectives = [start[name]["objective"] for start in both]
        walls = [start[name]["wall"] for start in both]
        print(
            f"  {name:15} median wall {statistics.median(walls):.2f} s, median objective "
            f"{statistics.median(objectives):.8f}, lowest {min(objectives):.8f}"
        )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--subject", type=int, nargs="+", default=[1], choices=[1, 2])
    parser.add_argument("--muscles", action="store_true")
    parser.add_argument("--phases", default="same", choices=["same", "own"], help="settings of IPOPT in its phases")
    parser.add_argument("--runs", type=int, default=3, help="number of runs from each start")
    parser.add_argument("--backend", default="vm", choices=["vm", "c"])
    parser.add_argument("--guess", type=int, nargs="+", default=[1], help="numbers of the initial guesses of both sides, 1 to 64")
    parser.add_argument("--ipopt", type=json.loads, default={}, help="further options of IPOPT in all phases, as JSON")
    parser.add_argument("--threads", type=int, nargs="+", default=[1], help="threads of Gaitwright")
    parser.add_argument("--limit", type=float, default=900.0, help="time limit of a run, s")
    parser.add_argument("--json", help="file for all results")
    arguments = parser.parse_args()
    program, dump = example("timed_solve"), example("dump_start")
    header = {
        "date": time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime()),
        "processor": processor(),
        "cores": os.cpu_count(),
        "load_before": os.getloadavg()[0],
    }
    print(json.dumps(header))
    runs, starts = [], []
    with tempfile.TemporaryDirectory(prefix="gait_race_") as folder:
        for subject in arguments.subject:
            for guess in arguments.guess:
                one = argparse.Namespace(**vars(arguments) | {"subject": subject, "guess": guess})
                mine = race(one, program, dump, Path(folder))
                runs += mine
                starts.append({"subject": subject, "guess": guess} | medians(mine))
    header["load_after"] = os.getloadavg()[0]
    for threads in arguments.threads:
        compare(starts, ours(threads))
    if arguments.json:
        document = {"machine": header, "arguments": vars(arguments), "runs": runs, "starts": starts}
        Path(arguments.json).write_text(json.dumps(document, indent=2) + "\n")


if __name__ == "__main__":
    main()
