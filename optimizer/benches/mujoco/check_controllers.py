"""Whether the controllers are those of `gaitwright simulate`: undisturbed walks on the same force law of the ground.

    python check_controllers.py PROGRAM GAIT.json...

MuJoCo's contact solver is left out here, so that only dynamics and controllers can differ.
"""

import json
import subprocess
import sys
from functools import partial
from pathlib import Path

import mujoco

from disturbances import Disturbance, undisturbed
from force_law_ground import ForceLawGround
from gait_file import read_gait
from planned_stride import CONTROL_PERIOD_S
from simulated_walk import Plant, SimulatedWalker
from walker_model import DOCUMENTED

STRIDES = 20
STEP_S = 0.0005


class ForceLawPlant(Plant):
    """A walker on the documented force law of level ground."""

    def __init__(self, yield_m: float, model: mujoco.MjModel, disturbance: Disturbance) -> None:
        super().__init__(model, disturbance)
        self._ground = ForceLawGround(model, self.data, yield_m, STEP_S)

    def loads_n(self) -> tuple[float, float]:
        return self._ground.loads_n

    def period(self) -> None:
        for _ in range(round(CONTROL_PERIOD_S / STEP_S)):
            self._ground.step()


def main() -> None:
    program = sys.argv[1]
    for gait_file in map(Path, sys.argv[2:]):
        command = [program, "simulate", str(gait_file), "--simulated-walks", "1", "--ground", "0", "--json"]
        gait = read_gait(gait_file)
        report = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
        for rung in report["strides_by_yield"]:
            plant = partial(ForceLawPlant, rung["yield_m"])
            outcome = SimulatedWalker(gait, DOCUMENTED, plant).walk(undisturbed(), STRIDES)
            print(
                f"{gait_file.stem:14} yield {1e3 * rung['yield_m']:4.0f} mm: {outcome.strides:2} strides here, "
                f"{rung['strides']:2} in gaitwright simulate",
                flush=True,
            )


if __name__ == "__main__":
    main()
