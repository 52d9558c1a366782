"""Operations with the tag `blind`.

Made by generate.py from server/openapi.json.
"""

from __future__ import annotations

from typing import Literal, Optional, cast

from ..paging import Pages
from ..schemas import (
    AnswerReceipt,
    BlindMotion,
    NextBlindPair,
    RaterAnswer,
    RaterReliability,
    RaterUnblinding,
    StudyId,
    UnblindedPair,
    UnblindedRater,
)
from ..transport import Transport
from ..unpack import Unpack


class BlindMethods(Transport):
    """Operations with the tag `blind`."""

    def answer_blind_pair(
        self,
        code: str,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[RaterAnswer],
    ) -> AnswerReceipt:
        """Answer a blind pair.

        The first answer to a pair counts. A safety report takes effect at once.

        Fields: answer; optionally note, response_ms.
        """
        return cast(
            AnswerReceipt,
            self.request_json(
                "POST",
                "/api/v1/blind-pairs/{code}/answer",
                {"code": code},
                body=body,
                key=idempotency_key,
            ),
        )

    def get_blind_motion(self, code: str, side: Literal["first", "second"]) -> BlindMotion:
        """Get a motion of a blind pair.

        The phase at which motions start differs between pairs, and is the same for both motions of a pair.
        """
        return cast(
            BlindMotion,
            self.request_json(
                "GET",
                "/api/v1/blind-pairs/{code}/motions/{side}",
                {"code": code, "side": side},
            ),
        )

    def draw_blind_pair(self, study_id: StudyId, *, idempotency_key: Optional[str] = None) -> NextBlindPair:
        """Draw the next pair for a rater.

        Returns the same pair until it is answered.
        """
        return cast(
            NextBlindPair,
            self.request_json(
                "POST",
                "/api/v1/studies/{id}/blind-pairs/next",
                {"id": study_id},
                key=idempotency_key,
            ),
        )

    def list_raters(self, study_id: StudyId, *, page_size: Optional[int] = None) -> Pages[RaterReliability]:
        """List raters with their reliability.

        Agreement of raters with their own earlier answers, position bias of unblinded raters, and the number of answers
        that are not blind. Sorted by name.
        """
        return Pages(self, "/api/v1/studies/{id}/raters", {"id": study_id}, query={"limit": page_size})

    def unblind_rater(
        self,
        study_id: StudyId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[RaterUnblinding],
    ) -> UnblindedRater:
        """Unblind a rater.

        Reveals which gait the rater saw on which side: `GET /studies/{id}/unblinded-pairs` lists it from now on. The
        audit trail records the unblinding, and later answers of the rater do not count as blind.

        Fields: rater, reason.
        """
        return cast(
            UnblindedRater,
            self.request_json(
                "POST",
                "/api/v1/studies/{id}/raters/unblind",
                {"id": study_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def list_unblinded_pairs(
        self,
        study_id: StudyId,
        *,
        rater: Optional[str] = None,
        page_size: Optional[int] = None,
    ) -> Pages[UnblindedPair]:
        """List the pairs of unblinded raters.

        Which gait an unblinded rater saw on which side, and the answer. Oldest first.

        rater: Only the pairs of this rater. Default: those of all unblinded raters.
        """
        return Pages(
            self,
            "/api/v1/studies/{id}/unblinded-pairs",
            {"id": study_id},
            query={"rater": rater, "limit": page_size},
        )
