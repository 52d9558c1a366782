"""Operations with the tag `scripts`.

Made by generate.py from server/openapi.json.
"""

from __future__ import annotations

from typing import Optional, cast

from ..schemas import (
    AskRequest,
    StudyId,
    TellRequest,
    Trial,
    TrialId,
)
from ..transport import Transport
from ..unpack import Unpack


class ScriptsMethods(Transport):
    """Operations with the tag `scripts`."""

    def ask_for_trial(
        self,
        study_id: StudyId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[AskRequest],
    ) -> Trial:
        """Ask for a trial to evaluate.

        Returns the same trial until its result is reported.

        Fields: optionally script.
        """
        return cast(
            Trial,
            self.request_json(
                "POST",
                "/api/v1/studies/{id}/ask",
                {"id": study_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def tell_result(
        self,
        trial_id: TrialId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[TellRequest],
    ) -> Trial:
        """Tell the service the result of a trial.

        `not_converged` is also a result. If the script fails, cancel the trial instead.

        Fields: label; optionally cost_of_transport, gait_rmse_rad, reason.
        """
        return cast(
            Trial,
            self.request_json(
                "POST",
                "/api/v1/trials/{id}/tell",
                {"id": trial_id},
                body=body,
                key=idempotency_key,
            ),
        )
