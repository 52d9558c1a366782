"""Lists, which the service returns in pages."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Generic, Optional, TypeVar

from .transport import Transport

T = TypeVar("T")


class Pages(Generic[T]):
    """The entries of a list. Iterating requests each page when it is needed, and begins again each time."""

    def __init__(
        self,
        transport: Transport,
        path: str,
        at: Optional[Mapping[str, str]] = None,
        *,
        query: Mapping[str, object],
    ) -> None:
        self.transport = transport
        self.path = path
        self.at = at
        self.query = query

    def pages(self) -> Iterator[list[T]]:
        query = dict(self.query)
        while True:
            page = self.transport.request_json("GET", self.path, self.at, query=query)
            yield page["items"]
            if page["next"] is None:
                return
            query["cursor"] = page["next"]

    def __iter__(self) -> Iterator[T]:
        for page in self.pages():
            yield from page
