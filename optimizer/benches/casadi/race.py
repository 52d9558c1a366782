"""Ours against CasADi + IPOPT, alternately, from the same start: prints every run, medians and the ratio.

    python race.py [--subject 1] [--muscles] [--runs 3] [--backend vm|c] [--guess 1] [--threads 1] [--limit 900]
        [--json FILE]

Wall seconds and processor seconds (user + system) are both reported: on a machine that is shared only the latter are
comparable. CasADi's symbolic set-up and compilation are not in its time; posture and motion guess are in ours.
Memory is the peak of the process, CasADi's with Python and set-up.
"""

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
WORKSPACE = HERE.parent.parent.parent
# One thread each: numerical libraries would otherwise start as many as there are cores.
ENVIRONMENT = os.environ | {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}


def cargo(*arguments):
    command = ["cargo", *arguments[:1], "--quiet", "--release", "-p", "gait-optimizer", *arguments[1:]]
    return subprocess.run(command, cwd=WORKSPACE, check=True, stdout=subprocess.PIPE, text=True).stdout


def example(name):
    """Path of a built example, as cargo reports it."""
    lines = cargo("build", "--example", name, "--message-format=json").splitlines()
    for message in map(json.loads, lines):
        if message.get("target", {}).get("name") == name and message.get("executable"):
            return message["executable"]
    raise RuntimeError(f"cargo built no {name}")


def timed(command, limit):
    """Standard output, wall seconds, processor seconds and peak memory (MB) of a child."""
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


def run_ours(program, arguments, limit):
    command = [program, "--subject", str(arguments.subject), "--threads", str(arguments.threads)]
    command += ["--guess", str(arguments.guess)] + (["--muscles"] if arguments.muscles else [])
    output, _, cpu, memory = timed(command, limit)
    result = json.loads(output)
    report = result["report"]
    return {
        "side": "ours",
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


def processor():
    for line in Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []:
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--subject", type=int, default=1, choices=[1, 2])
    parser.add_argument("--muscles", action="store_true")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--backend", default="vm", choices=["vm", "c"])
    parser.add_argument("--guess", type=int, default=1, help="number of our guess in the catalogue")
    parser.add_argument("--threads", type=int, default=1, help="of ours; IPOPT's linear algebra has one")
    parser.add_argument("--limit", type=float, default=900.0, help="seconds after which a single run is given up")
    parser.add_argument("--json", help="file for all figures")
    arguments = parser.parse_args()
    ours = example("timed_solve")
    start = json.loads(subprocess.check_output([example("dump_start"), "--subject", str(arguments.subject)]))
    runs = []
    header = {
        "date": time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime()),
        "processor": processor(),
        "cores": os.cpu_count(),
        "load_before": os.getloadavg()[0],
    }
    print(json.dumps(header))
    with tempfile.TemporaryDirectory(prefix="gait_race_") as folder:
        for number in range(arguments.runs):
            for side in ("ours", "casadi"):
                if side == "ours":
                    run = run_ours(ours, arguments, arguments.limit)
                else:
                    run = run_casadi(start, arguments, arguments.limit, Path(folder))
                run["load"] = os.getloadavg()[0]
                runs.append(run)
                print(
                    f"{number + 1} {side:7} {run['status']:20} {run['iterations']:5} iterations "
                    f"objective {run['objective']:.8f} violation {run['violation']:.1e} "
                    f"wall {run['wall']:8.2f} s  cpu {run['cpu']:8.2f} s  evaluation {run['evaluation']:7.2f} s  "
                    f"memory {run['memory']:5.0f} MB  "
                    f"load {run['load']:.1f}  {run['by_phase']}",
                    flush=True,
                )
    header["load_after"] = os.getloadavg()[0]
    median = {}
    for side in ("ours", "casadi"):
        mine = [run for run in runs if run["side"] == side]
        failed = [run["status"] for run in mine if not run["solved"]]
        median[side] = {key: statistics.median(run[key] for run in mine) for key in ("wall", "cpu", "iterations")}
        print(
            f"{side:7} median wall {median[side]['wall']:.2f} s, cpu {median[side]['cpu']:.2f} s, "
            f"{median[side]['iterations']:.0f} iterations; not solved: {failed or 'none'}"
        )
    for key in ("wall", "cpu"):
        print(f"CasADi + IPOPT / ours, {key}: {median['casadi'][key] / median['ours'][key]:.2f}")
    if arguments.json:
        document = {"machine": header, "arguments": vars(arguments), "runs": runs, "median": median}
        Path(arguments.json).write_text(json.dumps(document, indent=2) + "\n")


if __name__ == "__main__":
    main()
