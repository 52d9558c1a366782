"""A lab that evaluates trials itself: ask, measure, tell, until the study is finished.

    python3 server/clients/python/example.py http://127.0.0.1:8080 [TOKEN]

`measure` stands in for the treadmill. Its Gait RMSE is lowest at a foot clearance of 0.026 m and a torso lean of 0.3 rad.
"""

import sys

from gaitwright_client import Client, Problem


def measure(action):
    """Gait RMSE of a made-up walker, rad; None where it stumbles."""
    if action["a5"] > 0.03 and action["a6"] < 0.15:
        return None
    return 0.1 + 3 * abs(action["a5"] - 0.026) + abs(action["a6"] - 0.3) / 2


def main():
    client = Client(sys.argv[1] if len(sys.argv) > 1 else "http://127.0.0.1:8080", *sys.argv[2:3])
    subject = next(s for s in client.subjects() if s["pseudonym"] == "paper-1")
    study = client.make_study(subject["id"], name="treadmill", evaluation="script", trial_budget=10)["id"]
    while True:
        try:
            trial = client.ask(study, worker="treadmill")
        except Problem as problem:
            # All trials have been handed out, or the study has ended.
            if problem.status == 409:
                break
            raise
        rmse = measure(trial["action"])
        if rmse is None:
            client.tell_not_converged(trial["id"], "the walker stumbled")
        else:
            client.tell_converged(trial["id"], gait_rmse_rad=rmse)
        print(f"trial {trial['number']}: {'stumbled' if rmse is None else f'{rmse:.4f} rad'}")
    best = list(client.history(study))[-1]
    print(f"best: trial {best['number']}, {best['gait_rmse_rad']:.4f} rad")


if __name__ == "__main__":
    main()
