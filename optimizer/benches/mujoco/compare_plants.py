"""Walks with the same gaits in MuJoCo and in `gaitwright simulate`, and how well both agree on the order of the gaits.

    python compare_plants.py PROGRAM FOLDER [--contact documented] [--grounds 0 5] [--simulated-walks 10]

Walks are kept in FOLDER/walks: the command continues after a stop, and more walks in MuJoCo extend those that are there.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from disturbances import random, undisturbed
from gait_file import Gait, read_gait
from rank_correlation import spearman
from simulated_walk import Outcome, SimulatedWalker
from walker_model import DEFAULT, DOCUMENTED, Contact

STRIDES = 20
SEED = 7
CONTACTS = {"documented": DOCUMENTED, "default": DEFAULT}
# Largest difference of a coordinate by which two files have the same gait, m or rad.
SAME_GAIT = 1e-3
# Mean strides on the first ground in Gaitwright up to which a gait falls early.
EARLY_STRIDES = 3.0


@dataclass(frozen=True)
class OnGround:
    """Walks of a gait on one ground: mean strides, and the share of complete walks."""

    strides: float
    share: float


Results = dict[str, dict[int, OnGround]]


def is_same(a: Gait, b: Gait) -> bool:
    """Whether two gaits are one: bounds that are not active do not change a gait."""
    pairs = zip(a.domains, b.domains, strict=True)
    return a.height_m == b.height_m and all(np.abs(x.q - y.q).max() < SAME_GAIT for x, y in pairs)


def distinct(folder: Path) -> list[Path]:
    """The files of the reported gaits, the first one of each gait."""
    kept: list[tuple[Path, Gait]] = []
    for file in sorted(folder.glob("*.json")):
        if file.stem.startswith("development"):
            continue
        gait = read_gait(file)
        same = [other.stem for other, known in kept if is_same(gait, known)]
        if same:
            print(f"{file.stem} has the gait of {same[0]}")
        else:
            kept.append((file, gait))
    return [file for file, _ in kept]


def in_mujoco(file: Path, contact: Contact, name: str, ground_mm: int, walks: int) -> OnGround:
    """Walks of a gait in MuJoCo."""
    path = file.parent / "walks" / f"{file.stem}-{name}-{ground_mm}.json"
    outcomes = [Outcome(**kept) for kept in json.loads(path.read_text())] if path.exists() else []
    walker = SimulatedWalker(read_gait(file), contact)
    pushed_within_s = 0.5 * STRIDES * walker.stride_s
    for number in range(len(outcomes), walks):
        disturbance = random(SEED, number, 1e-3 * ground_mm, walker.step_m, pushed_within_s)
        outcomes.append(walker.walk(disturbance, STRIDES))
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps([vars(outcome) for outcome in outcomes]))
    done = outcomes[:walks]
    share = float(np.mean([outcome.end == "completed" for outcome in done]))
    return OnGround(float(np.mean([outcome.strides for outcome in done])), share)


def in_gaitwright(program: str, file: Path, ground_mm: int, walks: int) -> OnGround:
    """Walks of a gait in the plant of Gaitwright."""
    path = file.parent / "walks" / f"{file.stem}-gaitwright-{ground_mm}-{walks}.json"
    if path.exists():
        return OnGround(**json.loads(path.read_text()))
    options = ["--simulated-walks", str(walks), "--ground", str(ground_mm), "--seed", str(SEED), "--json"]
    result = subprocess.run([program, "simulate", str(file), *options], capture_output=True, text=True, check=True)
    [ground] = json.loads(result.stdout)["grounds"]
    found = OnGround(ground["mean_strides"], ground["completed_share"])
    path.write_text(json.dumps(vars(found)))
    return found


def of_all(files: list[Path], grounds_mm: list[int], what: str, walk: Callable[[Path, int], OnGround]) -> Results:
    """The results of all gaits on each ground."""
    results: Results = {}
    for file in files:
        results[file.stem] = {ground_mm: walk(file, ground_mm) for ground_mm in grounds_mm}
        print(what, file.stem, file=sys.stderr, flush=True)
    return results


def print_table(grounds_mm: list[int], gaitwright: Results, mujoco: Results) -> None:
    """A row for each gait: Gaitwright first, MuJoCo second."""
    print(f"{'':14}" + "".join(f"{f'+-{mm} mm: strides':>20}{'complete':>15}" for mm in grounds_mm))
    for name, ours in gaitwright.items():
        cells = [
            f"{a.strides:13.2f} {b.strides:6.2f}{a.share:9.2f} {b.share:5.2f}"
            for a, b in ((ours[mm], mujoco[name][mm]) for mm in grounds_mm)
        ]
        print(f"{name:14}" + "".join(cells))


def print_correlations(grounds_mm: list[int], gaitwright: Results, mujoco: Results) -> None:
    """Rank correlations over all gaits, those of each subject, and those that fall early or walk on in Gaitwright."""
    groups = {"all": list(gaitwright)}
    for subject in ("1", "2"):
        groups[f"subject {subject}"] = [name for name in gaitwright if name.split("-")[1] == subject]
    first = grounds_mm[0]
    groups["walk on"] = [name for name, ours in gaitwright.items() if ours[first].strides > EARLY_STRIDES]
    groups["fall early"] = [name for name in gaitwright if name not in groups["walk on"]]
    for mm in grounds_mm:
        for group, names in groups.items():
            for what in ("strides", "share"):
                ours = np.array([getattr(gaitwright[name][mm], what) for name in names])
                theirs = np.array([getattr(mujoco[name][mm], what) for name in names])
                print(f"+-{mm} mm, {what:7}, {group:10} ({len(names):2} gaits): {spearman(ours, theirs)}")


def main() -> None:
    arguments = argparse.ArgumentParser()
    arguments.add_argument("program")
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("--contact", choices=CONTACTS, default="documented")
    arguments.add_argument("--simulated-walks", type=int, default=10)
    arguments.add_argument("--simulated-walks-in-gaitwright", type=int, default=50)
    arguments.add_argument("--grounds", type=int, nargs="+", default=[0, 5])
    given = arguments.parse_args()
    files, contact, grounds_mm = distinct(given.folder), CONTACTS[given.contact], given.grounds

    def mujoco_walks(file: Path, mm: int) -> OnGround:
        return in_mujoco(file, contact, given.contact, mm, given.simulated_walks)

    def gaitwright_walks(file: Path, mm: int) -> OnGround:
        return in_gaitwright(given.program, file, mm, given.simulated_walks_in_gaitwright)

    mujoco = of_all(files, grounds_mm, "MuJoCo", mujoco_walks)
    gaitwright = of_all(files, grounds_mm, "Gaitwright", gaitwright_walks)
    print(f"{len(files)} gaits; {given.simulated_walks_in_gaitwright} simulated walks in Gaitwright, {given.simulated_walks} in MuJoCo")
    print_table(grounds_mm, gaitwright, mujoco)
    print_correlations(grounds_mm, gaitwright, mujoco)


if __name__ == "__main__":
    main()
