"""Walks with the same gaits in MuJoCo and in `gaitwright simulate`, and how well both agree on the order of the gaits.

    python compare_plants.py PROGRAM FOLDER [WALKS]

The results of each gait are kept in FOLDER/results, so the command continues after a stop.
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

from disturbances import random, undisturbed
from gait_file import read_gait
from rank_correlation import spearman
from simulated_walk import Outcome, SimulatedWalker
from walker_model import DEFAULT, DOCUMENTED, Contact

STRIDES = 20
SEED = 7
GROUNDS_MM = (0, 5)
PLANTS = ("gaitwright", "documented", "default")

# Mean strides and share of complete walks on each ground, and strides of the undisturbed walk.
Result = dict[str, float]


def in_mujoco(gait_file: Path, contact: Contact, walks: int) -> Result:
    """Walks of a gait in MuJoCo."""
    walker = SimulatedWalker(read_gait(gait_file), contact)
    result: Result = {"undisturbed": walker.walk(undisturbed(), STRIDES).strides}
    for ground_mm in GROUNDS_MM:
        outcomes: list[Outcome] = []
        for number in range(walks):
            pushed_within_s = 0.5 * STRIDES * walker.stride_s
            disturbance = random(SEED, number, 1e-3 * ground_mm, walker.step_m, pushed_within_s)
            outcomes.append(walker.walk(disturbance, STRIDES))
        result[f"strides {ground_mm}"] = float(np.mean([o.strides for o in outcomes]))
        result[f"share {ground_mm}"] = float(np.mean([o.end == "completed" for o in outcomes]))
    return result


def in_gaitwright(program: str, gait_file: Path, walks: int) -> Result:
    """Walks of a gait in the plant of Gaitwright."""
    result: Result = {}
    for ground_mm in GROUNDS_MM:
        options = ["--walks", str(walks), "--ground", str(ground_mm), "--seed", str(SEED), "--json"]
        command = [program, "simulate", str(gait_file), *options]
        report = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
        [ground] = report["grounds"]
        result["undisturbed"] = report["undisturbed_strides"]
        result[f"strides {ground_mm}"] = ground["mean_strides"]
        result[f"share {ground_mm}"] = ground["completed_share"]
    return result


def result_of(plant: str, program: str, gait_file: Path, walks: int) -> Result:
    """The result in a plant, from the folder of results if it is there."""
    kept = gait_file.parent / "results" / f"{gait_file.stem}-{plant}-{walks}.json"
    if kept.exists():
        return json.loads(kept.read_text())
    if plant == "gaitwright":
        result = in_gaitwright(program, gait_file, walks)
    else:
        result = in_mujoco(gait_file, {"documented": DOCUMENTED, "default": DEFAULT}[plant], walks)
    kept.parent.mkdir(exist_ok=True)
    kept.write_text(json.dumps(result))
    return result


def print_table(results: dict[str, dict[str, Result]]) -> None:
    """A row for each gait, three plants in each column."""
    print("Plants: gaitwright, MuJoCo with the documented contact, MuJoCo with its default contact")
    columns = ["undisturbed", *(f"{what} {mm}" for mm in GROUNDS_MM for what in ("strides", "share"))]
    print(f"{'gait':14}" + "".join(f"{column:>24}" for column in columns))
    for name, plants in results.items():
        cells = [" ".join(f"{plants[plant][column]:5.2f}" for plant in PLANTS) for column in columns]
        print(f"{name:14}" + "".join(f"{cell:>24}" for cell in cells))


def print_correlations(results: dict[str, dict[str, Result]]) -> None:
    """Rank correlations of all gaits, and of those of each subject."""

    def values(names: list[str], plant: str, column: str) -> np.ndarray:
        return np.array([results[name][plant][column] for name in names])

    groups = {"all": list(results)}
    for subject in ("1", "2"):
        groups[f"subject {subject}"] = [name for name in results if name.split("-")[1] == subject]
    for column in [f"{what} {mm}" for mm in GROUNDS_MM for what in ("strides", "share")]:
        for group, names in groups.items():
            for first, second in (("gaitwright", "documented"), ("gaitwright", "default"), ("documented", "default")):
                text = spearman(values(names, first, column), values(names, second, column))
                print(f"{column:10} {group:9} ({len(names):2} gaits) {first:10} with {second:10}: {text}")


def main() -> None:
    program, folder = sys.argv[1], Path(sys.argv[2])
    walks = int(sys.argv[3]) if len(sys.argv) > 3 else 50
    gait_files = [file for file in sorted(folder.glob("*.json")) if not file.stem.startswith("development")]
    results: dict[str, dict[str, Result]] = {file.stem: {} for file in gait_files}
    for plant in PLANTS:
        for file in gait_files:
            results[file.stem][plant] = result_of(plant, program, file, walks)
            print(plant, file.stem, file=sys.stderr, flush=True)
    print_table(results)
    print_correlations(results)


if __name__ == "__main__":
    main()
