"""Server-sent events."""

from __future__ import annotations

import http.client
import json
import time
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple, Optional

from .problem import Problem
from .transport import NOT_READY, Transport


class Event(NamedTuple):
    """An event of a study: its name, its number if it is recorded, and its data."""

    name: str
    id: Optional[int]
    data: Any


def parse(lines: Iterable[bytes]) -> Iterator[Event]:
    """The events in the lines of a stream."""
    fields: dict[str, str] = {}
    for raw in lines:
        line = raw.decode().rstrip("\r\n")
        if line:
            # A comment, which keeps the connection open, has an empty name.
            name, _, value = line.partition(":")
            value = value[1:] if value.startswith(" ") else value
            fields[name] = f"{fields[name]}\n{value}" if name == "data" and name in fields else value
        elif "data" in fields:
            number = fields.get("id")
            yield Event(fields.get("event", "message"), int(number) if number else None, json.loads(fields["data"]))
            fields = {}
        else:
            fields = {}


def follow(
    transport: Transport, path: str, at: Mapping[str, str], *, query: Mapping[str, object]
) -> Iterator[Event]:
    """The events as they arrive. A stream that breaks or ends is continued after the last recorded event."""
    headers = {"accept": "text/event-stream"}
    failures = 0
    while True:
        broke = False
        try:
            with transport.open(transport.request("GET", path, at, query, headers)) as stream:
                for event in parse(stream):
                    failures = 0
                    if event.id is not None:
                        headers["last-event-id"] = str(event.id)
                    yield event
        except Problem as problem:
            broke = True
            if problem.status not in NOT_READY or failures + 1 >= transport.tries:
                raise
        except (OSError, http.client.HTTPException):
            broke = True
            if failures + 1 >= transport.tries:
                raise
        # A proxy may end a quiet stream again and again, which is no failure.
        failures = failures + 1 if broke else 0
        time.sleep(0.1 * 2 ** min(failures, 6))
