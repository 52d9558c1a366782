"""The client."""

from __future__ import annotations

from typing import Callable, Optional, Union, cast, overload

from .operations import Operations
from .schemas import Job, StudyWithCommands
from .waiting import JobFailed, until


class Client(Operations):
    """Talks to one service: every operation of its REST interface as a method, and `wait`."""

    @overload
    def wait(
        self,
        work: Job,
        *,
        progress: Optional[Callable[[Job], object]] = None,
        timeout_s: Optional[float] = None,
        poll_s: float = 1.0,
    ) -> Job: ...

    @overload
    def wait(
        self,
        work: StudyWithCommands,
        *,
        progress: Optional[Callable[[StudyWithCommands], object]] = None,
        timeout_s: Optional[float] = None,
        poll_s: float = 1.0,
    ) -> StudyWithCommands: ...

    def wait(
        self,
        work: Union[Job, StudyWithCommands],
        *,
        progress: Union[Callable[[Job], object], Callable[[StudyWithCommands], object], None] = None,
        timeout_s: Optional[float] = None,
        poll_s: float = 1.0,
    ) -> Union[Job, StudyWithCommands]:
        """Waits until a job is done or a study no longer runs, and returns its new state.

        `progress` is called with the job or study at first and after each change. A job that failed or was cancelled
        raises `JobFailed`. A study no longer runs when it has ended, is paused, or waits for an answer.
        """
        if "kind" in work:
            watch = cast(Optional[Callable[[Job], object]], progress)
            job = until(lambda: self.get_job(work["id"]), job_ended, watch, timeout_s, poll_s)
            if job["state"] != "done":
                raise JobFailed(job)
            return job
        look = cast(Optional[Callable[[StudyWithCommands], object]], progress)
        return until(lambda: self.get_study(work["id"]), study_ended, look, timeout_s, poll_s)


def job_ended(job: Job) -> bool:
    return job["state"] not in ("queued", "running")


def study_ended(study: StudyWithCommands) -> bool:
    return study["state"] != "running"
