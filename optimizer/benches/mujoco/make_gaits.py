"""Makes the gaits of the comparison: random actions of Table I, default gaits, nearest of four, tuned gaits.

    python make_gaits.py PROGRAM FOLDER

PROGRAM is a built `gaitwright`. A gait that exists is kept, so the command continues after a stop.
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

from tuned_gait import tune

# Table I of the paper.
LEVELS: dict[str, tuple[float, ...]] = {
    "a1": (15, 20),
    "a2": (70, 80, 90),
    "a3": (0.3, 0.4, 0.5),
    "a4": (1.2, 1.3, 1.4),
    "a5": (0, 0.013, 0.026, 0.039),
    "a6": (0, 0.1, 0.2, 0.3, 0.4, 0.5),
    "a7": (20, 35, 50),
    "a8": (20, 30, 40),
}
RANDOM_ACTIONS = 12
SEED = 26
# Two gaits that no table reports, for work on the controllers.
DEVELOPMENT_SEED = 1


def random_actions(seed: int, count: int) -> list[str]:
    """Actions with independent levels, as `--bounds` takes them."""
    random = np.random.default_rng(seed)
    return [",".join(f"{name}={random.choice(levels):g}" for name, levels in LEVELS.items()) for _ in range(count)]


def solve(program: str, out: Path, subject: int, options: list[str]) -> None:
    """Solves one gait into `out`. A solve that does not converge leaves no file."""
    if out.exists():
        return
    unfinished = out.with_suffix(".unfinished")
    command = [program, "solve", "--muscles", "on", "--subject", str(subject), "--json", "--out", str(unfinished)]
    result = subprocess.run([*command, *options], capture_output=True, text=True, check=False)
    status = json.loads(unfinished.read_text())["report"]["status"] if unfinished.exists() else "no result"
    print(f"{out.stem}: {status}", *options, flush=True)
    if result.returncode == 0 and status == "converged":
        unfinished.rename(out)


def main() -> None:
    program, folder = sys.argv[1], Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    for subject in (1, 2):
        [action] = random_actions(DEVELOPMENT_SEED + subject, 1)
        solve(program, folder / f"development-{subject}.json", subject, ["--bounds", action])
    for subject in (1, 2):
        solve(program, folder / f"default-{subject}.json", subject, [])
        nearest = ["--initial-guesses", "4", "--nearest-within", "3"]
        solve(program, folder / f"nearest-{subject}.json", subject, nearest)
    for number in range(RANDOM_ACTIONS):
        for subject in (1, 2):
            action = random_actions(SEED + subject, RANDOM_ACTIONS)[number]
            solve(program, folder / f"random-{subject}-{number + 1:02}.json", subject, ["--bounds", action])
    for seed in (1, 2, 3):
        for subject in (1, 2):
            tune(program, folder / f"tuned-{subject}-{seed}.json", subject, seed)


if __name__ == "__main__":
    main()
