"""Runs whole studies through the client that openapi-python-client generates.

    python study.py ADDRESS
"""

import sys
import time
from http import HTTPStatus
from typing import TypeVar
from uuid import UUID, uuid4

from gaitwright_client import AuthenticatedClient as Client
from gaitwright_client.api.access import create_token
from gaitwright_client.api.figures import get_study_figure
from gaitwright_client.api.operation import get_job
from gaitwright_client.api.preferences import create_preference, get_preference, list_preferences
from gaitwright_client.api.scripts import ask_for_trial, tell_result
from gaitwright_client.api.studies import (
    create_study,
    get_recommendation,
    get_study,
    get_study_archive,
    list_study_history,
)
from gaitwright_client.api.subjects import create_subject, get_subject
from gaitwright_client.api.trials import get_certificate, list_trials, request_certificate
from gaitwright_client.models import (
    AnswerSource,
    AskRequest,
    Bounds,
    Certificate,
    CreatedPreference,
    CreatedToken,
    Dimension,
    DimensionName,
    Evaluation,
    Job,
    JobState,
    HistoryEntryPage,
    NewPreference,
    NewStudy,
    NewSubject,
    NewToken,
    NewTokenScopesItem,
    PairAnswer,
    Preference,
    PreferencePage,
    Problem,
    Recommendation,
    ReportedLabel,
    SearchSpace,
    StudyState,
    StudyWithCommands,
    Subject,
    TellRequest,
    Trial,
    TrialPage,
    TrialState,
)
from gaitwright_client.types import UNSET, File, Response, Unset

TRIALS = 10
SECONDS = 60
FIGURE = "progress-gait-rmse-of-the-best-action-by-iteration"

ARCHIVE = b"gaitwright study"

T = TypeVar("T")
Made = TypeVar("Made", CreatedToken, CreatedPreference, StudyWithCommands, Subject)


def given(kind: type[T], reply: object) -> T:
    """The answer of this kind, or an exception with what the problem says."""
    if isinstance(reply, Problem):
        raise RuntimeError(reply.detail)
    assert isinstance(reply, kind), reply
    return reply


def created(kind: type[Made], path: str, reply: Response[Made | Problem]) -> Made:
    """What a 201 made, whose address is `path` and its identifier."""
    made = given(kind, reply.parsed)
    assert reply.status_code == HTTPStatus.CREATED, reply.status_code
    assert reply.headers["Location"] == f"/api/v1/{path}/{made.id}", reply.headers
    return made


def measure(bounds: Bounds) -> float | None:
    """Gait RMSE of a made-up walker, rad; None where it stumbles."""
    if bounds.a5 > 0.03 and bounds.a6 < 0.15:
        return None
    return 0.1 + 3 * abs(bounds.a5 - 0.026) + abs(bounds.a6 - 0.3) / 2


def trials_of(client: Client, study: UUID) -> list[Trial]:
    """All trials in order, three at a time."""
    trials: list[Trial] = []
    cursor: str | Unset = UNSET
    while True:
        page = given(TrialPage, list_trials.sync(study, client=client, limit=3, cursor=cursor))
        trials += page.items
        if page.next_ is None or isinstance(page.next_, Unset):
            break
        assert len(page.items) == 3, page
        cursor = page.next_
    return sorted(trials, key=lambda trial: trial.number)


def by_script(client: Client, subject: UUID) -> None:
    """A script evaluates every trial."""
    new = NewStudy(subject_id=subject, evaluation=Evaluation.SCRIPT, number_of_trials=TRIALS)
    study = created(StudyWithCommands, "studies", create_study.sync_detailed(client=client, body=new))
    while True:
        asked = ask_for_trial.sync_detailed(study.id, client=client, body=AskRequest(script="treadmill"))
        if asked.status_code == HTTPStatus.CONFLICT:
            break
        trial = given(Trial, asked.parsed)
        rmse = measure(trial.action)
        told = (
            TellRequest(label=ReportedLabel.NOT_CONVERGED, reason="the walker stumbled")
            if rmse is None
            else TellRequest(label=ReportedLabel.CONVERGED, gait_rmse_rad=rmse)
        )
        given(Trial, tell_result.sync(trial.id, client=client, body=told))
    trials = trials_of(client, study.id)
    assert [trial.number for trial in trials] == list(range(1, TRIALS + 1)), trials
    best = given(HistoryEntryPage, list_study_history.sync(study.id, client=client)).items[-1]
    wait_until(client, study.id, StudyState.FINISHED)
    print(f"python: {len(trials)} trials, best: trial {best.number}, {best.gait_rmse_rad:.4f} rad")


def wait_until(client: Client, study: UUID, *states: StudyState) -> StudyState:
    """Waits until the study has one of these states."""
    for _ in range(SECONDS * 20):
        state = given(StudyWithCommands, get_study.sync(study, client=client)).state
        if state in states:
            return state
        time.sleep(0.05)
    raise TimeoutError(f"the study is {state}")


def by_a_person(administrator: Client, client: Client, subject: UUID) -> None:
    """A person answers the comparisons."""
    space = SearchSpace(
        dimensions=[
            Dimension(name=DimensionName.A5, values=[0.013, 0.026], lengthscale=0.013),
            Dimension(name=DimensionName.A6, values=[0.05, 0.1, 0.15, 0.2], lengthscale=0.05),
        ]
    )
    new = NewStudy(subject_id=subject, answer_source=AnswerSource.PEOPLE, search_space=space, number_of_trials=4)
    study = created(StudyWithCommands, "studies", create_study.sync_detailed(client=client, body=new)).id
    compared = 1
    while wait_until(client, study, StudyState.WAITING, StudyState.FINISHED) == StudyState.WAITING:
        trials = trials_of(client, study)
        if len(trials) == compared:
            time.sleep(0.05)
            continue
        newest = trials[-1]
        for trial in trials[:-1]:
            assert isinstance(trial.gait_rmse_rad, float) and isinstance(newest.gait_rmse_rad, float), trial
            answer = PairAnswer.A if trial.gait_rmse_rad < newest.gait_rmse_rad else PairAnswer.B
            body = NewPreference(trial_a=trial.id, trial_b=newest.id, answer=answer)
            reply = create_preference.sync_detailed(study, client=client, body=body)
            said = created(CreatedPreference, "preferences", reply)
            assert given(Preference, get_preference.sync(said.id, client=client)).seq == said.seq
        compared = len(trials)
    assert len(given(PreferencePage, list_preferences.sync(study, client=client)).items) == 6
    best = given(Recommendation, get_recommendation.sync(study, client=client))
    picture = get_study_figure.sync_detailed(study, f"{FIGURE}.png", client=client)
    assert picture.headers["Content-Type"] == "image/png", picture.headers
    assert picture.content.startswith(b"\x89PNG\r\n\x1a\n"), picture.content[:8]
    table = given(str, get_study_figure.sync(study, f"{FIGURE}.csv", client=client))
    archive = given(File, get_study_archive.sync(study, client=administrator)).payload.read()
    assert archive.startswith(ARCHIVE), archive[:16]
    print(
        f"python: recommends trial {best.number}, {len(picture.content)} bytes of a picture, "
        f"{len(table.splitlines())} lines of a table, {len(archive)} bytes of an archive"
    )


def with_a_job(client: Client, subject: UUID) -> None:
    """Gait RMSE answers the comparisons; a certificate is made on request."""
    new = NewStudy(subject_id=subject, number_of_trials=TRIALS)
    study = created(StudyWithCommands, "studies", create_study.sync_detailed(client=client, body=new)).id
    wait_until(client, study, StudyState.FINISHED)
    followed = 0
    for trial in trials_of(client, study):
        if trial.state != TrialState.CONVERGED:
            continue
        asked = request_certificate.sync_detailed(trial.id, client=client)
        if asked.status_code == HTTPStatus.OK:
            assert given(Job, asked.parsed).state == JobState.DONE, asked
            continue
        assert asked.status_code == HTTPStatus.ACCEPTED, asked
        job = given(Job, asked.parsed)
        assert asked.headers["Location"] == f"/api/v1/jobs/{job.id}", asked.headers
        begun = time.monotonic()
        while job.state in (JobState.QUEUED, JobState.RUNNING):
            assert time.monotonic() < begun + SECONDS, job
            time.sleep(0.05)
            job = given(Job, get_job.sync(job.id, client=client))
        assert job.state == JobState.DONE, job
        assert job.result == f"/api/v1/trials/{trial.id}/certificate", job
        given(Certificate, get_certificate.sync(trial.id, client=client))
        followed += 1
    assert followed > 0, "every gait had a certificate"
    print(f"python: followed {followed} jobs")


def main() -> None:
    # The service runs without sign-in, so requests without a token have all rights. Scripts normally send a token.
    administrator = Client(base_url=sys.argv[1], token="none", auth_header_name="X-Without-Sign-In")
    scopes = [NewTokenScopesItem.READ, NewTokenScopesItem.RUN, NewTokenScopesItem.ANSWER]
    reply = create_token.sync_detailed(client=administrator, body=NewToken(name="python", scopes=scopes))
    client = Client(base_url=sys.argv[1], token=created(CreatedToken, "tokens", reply).secret)
    new = NewSubject(pseudonym=f"python-{uuid4().hex[:4]}", height_m=1.75, body_mass_kg=70)
    subject = created(Subject, "subjects", create_subject.sync_detailed(client=client, body=new))
    assert given(Subject, get_subject.sync(subject.id, client=client)) == subject
    by_script(client, subject.id)
    by_a_person(administrator, client, subject.id)
    with_a_job(client, subject.id)


if __name__ == "__main__":
    main()
