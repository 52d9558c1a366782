"""Waiting for jobs and studies."""

from __future__ import annotations

import time
from typing import Callable, Optional, TypeVar

from .schemas import Job

T = TypeVar("T")


class JobFailed(Exception):
    """A job that failed or was cancelled."""

    def __init__(self, job: Job) -> None:
        self.job = job
        super().__init__(f"{job['id']}: {job.get('reason') or job['state']}")


def until(
    get: Callable[[], T],
    ended: Callable[[T], bool],
    progress: Optional[Callable[[T], object]],
    timeout_s: Optional[float],
    poll_s: float,
) -> T:
    """Gets an object until it has ended, and passes each change to `progress`.

    `timeout_s` ends the wait between two requests; a request that is under way is not cut off.
    """
    begun = time.monotonic()
    last: Optional[T] = None
    while True:
        now = get()
        if progress and now != last:
            progress(now)
        if ended(now):
            return now
        left = poll_s if timeout_s is None else begun + timeout_s - time.monotonic()
        if left <= 0:
            raise TimeoutError(f"the job or study did not end within {timeout_s} s")
        last = now
        time.sleep(min(poll_s, left))
