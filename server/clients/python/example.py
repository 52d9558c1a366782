"""A lab that evaluates trials itself: ask, measure, tell, until the study is finished.

    python3 example.py http://127.0.0.1:8080 [TOKEN]

`measure` stands in for the treadmill. Its Gait RMSE is lowest at a foot clearance of 0.026 m and a torso lean of 0.3 rad.
"""

import sys
from typing import Optional

from gaitwright_client import Client, Problem
from gaitwright_client.schemas import Bounds


def measure(action: Bounds) -> Optional[float]:
    """Gait RMSE of a made-up walker, rad; None where it stumbles."""
    if action["a5"] > 0.03 and action["a6"] < 0.15:
        return None
    return 0.1 + 3 * abs(action["a5"] - 0.026) + abs(action["a6"] - 0.3) / 2


def main() -> None:
    client = Client(sys.argv[1] if len(sys.argv) > 1 else "http://127.0.0.1:8080", *sys.argv[2:3])
    subject = next(subject for subject in client.list_subjects() if subject["pseudonym"] == "paper-1")
    study = client.create_study(subject_id=subject["id"], evaluation="script", number_of_trials=10)
    while True:
        try:
            trial = client.ask_for_trial(study["id"], script="treadmill")
        except Problem as problem:
            # All trials have been handed out, or the study has ended.
            if problem.status == 409:
                break
            raise
        rmse = measure(trial["action"])
        if rmse is None:
            client.tell_result(trial["id"], label="not_converged", reason="the walker stumbled")
        else:
            client.tell_result(trial["id"], label="converged", gait_rmse_rad=rmse)
        print(f"trial {trial['number']}: {'stumbled' if rmse is None else f'{rmse:.4f} rad'}")
    study = client.wait(study)
    best = list(client.list_study_history(study["id"]))[-1]
    print(f"{study['state']}; best: trial {best['number']}, {best['gait_rmse_rad']:.4f} rad")


if __name__ == "__main__":
    main()
