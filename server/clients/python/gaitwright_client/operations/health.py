"""Operations with the tag `health`.

Made by generate.py from server/openapi.json.
"""

from __future__ import annotations

from typing import cast

from ..schemas import (
    Health,
)
from ..transport import Transport


class HealthMethods(Transport):
    """Operations with the tag `health`."""

    def get_health(self) -> Health:
        """Get the health of the service.

        Succeeds if the database responds. Requires no sign-in. It reveals nothing about solves, because a rater could
        infer the effect of an answer from them.
        """
        return cast(Health, self.request_json("GET", "/api/v1/health"))
