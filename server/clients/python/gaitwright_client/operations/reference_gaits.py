"""Operations with the tag `reference-gaits`.

Made by generate.py from server/openapi.json.
"""

from __future__ import annotations

from typing import Optional, cast

from ..paging import Pages
from ..schemas import (
    NewReferenceGait,
    ReferenceGait,
    ReferenceGaitId,
)
from ..transport import Transport
from ..unpack import Unpack


class ReferenceGaitsMethods(Transport):
    """Operations with the tag `reference-gaits`."""

    def list_reference_gaits(self, *, page_size: Optional[int] = None) -> Pages[ReferenceGait]:
        """List reference gaits.

        Newest first.
        """
        return Pages(self, "/api/v1/reference-gaits", query={"limit": page_size})

    def create_reference_gait(
        self,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[NewReferenceGait],
    ) -> ReferenceGait:
        """Create a reference gait from a recording.

        Segments the recording at right heel strikes and averages its strides. If the recording was already imported,
        the response contains the existing reference gait.

        Fields: name, recording; optionally body_mass_kg, columns, force_column, forces, format, heel_strikes_s,
        height_m, strikes, unit.
        """
        return cast(ReferenceGait, self.request_json("POST", "/api/v1/reference-gaits", body=body, key=idempotency_key))

    def get_reference_gait(self, reference_gait_id: ReferenceGaitId) -> ReferenceGait:
        """Get a reference gait.

        Its definition has the joint angles over one stride, deviations where there are any, and the provenance.
        """
        return cast(ReferenceGait, self.request_json("GET", "/api/v1/reference-gaits/{id}", {"id": reference_gait_id}))
