"""The error of a refused request."""

from __future__ import annotations

import json
from typing import Any, Optional


class Problem(Exception):
    """A request that the service refused, with its problem document (RFC 9457)."""

    def __init__(self, status: int, document: dict[str, Any]) -> None:
        self.status = status
        self.document = document
        self.type: str = document.get("type", "about:blank")
        self.title: str = document.get("title", "")
        self.detail: str = document.get("detail", self.title)
        self.field: Optional[str] = document.get("field")
        self.value: Any = document.get("value")
        self.allowed: Optional[str] = document.get("allowed")
        self.request_id: Optional[str] = document.get("request_id")
        super().__init__(f"{status}: {self.detail}")

    @classmethod
    def of(cls, status: int, reason: str, body: bytes) -> Problem:
        """The problem in the body of a response, or one with the reason if the body is something else."""
        try:
            document = json.loads(body)
        except ValueError:
            document = None
        return cls(status, document if isinstance(document, dict) else {"title": reason})
