"""Runs a whole study through the client that openapi-python-client generates.

    python study.py ADDRESS
"""

import sys
from http import HTTPStatus

from gaitwright_client import Client
from gaitwright_client.api.scripts import ask_for_trial, tell_outcome
from gaitwright_client.api.studies import create_study, get_study, get_study_history
from gaitwright_client.api.subjects import list_subjects
from gaitwright_client.api.trials import list_trials
from gaitwright_client.models import Ask, Evaluation, NewStudy, Outcome, StudyState, Tell

BUDGET = 10


def measure(bounds):
    """Gait RMSE of a made-up walker, rad; None where it stumbles."""
    if bounds.a5 > 0.03 and bounds.a6 < 0.15:
        return None
    return 0.1 + 3 * abs(bounds.a5 - 0.026) + abs(bounds.a6 - 0.3) / 2


def main():
    client = Client(base_url=sys.argv[1])
    subject = next(one for one in list_subjects.sync(client=client).items if one.pseudonym == "paper-1")
    new = NewStudy(subject_id=subject.id, name="python", evaluation=Evaluation.SCRIPT, trial_budget=BUDGET)
    study = create_study.sync(client=client, body=new)
    while True:
        asked = ask_for_trial.sync_detailed(study.id, client=client, body=Ask(worker="treadmill"))
        if asked.status_code == HTTPStatus.CONFLICT:
            break
        trial, rmse = asked.parsed, measure(asked.parsed.action)
        told = (
            Tell(outcome=Outcome.NOT_CONVERGED, reason="the walker stumbled")
            if rmse is None
            else Tell(outcome=Outcome.CONVERGED, gait_rmse_rad=rmse)
        )
        tell_outcome.sync(trial.id, client=client, body=told)
    trials, cursor = [], None
    while True:
        page = list_trials.sync(study.id, client=client, limit=3, **({"cursor": cursor} if cursor else {}))
        trials += page.items
        cursor = page.next_
        if cursor is None:
            break
    assert len(trials) == BUDGET, trials
    best = get_study_history.sync(study.id, client=client).items[-1]
    assert get_study.sync(study.id, client=client).state == StudyState.FINISHED
    print(f"python: {len(trials)} trials, best: trial {best.number}, {best.gait_rmse_rad:.4f} rad")


if __name__ == "__main__":
    main()
