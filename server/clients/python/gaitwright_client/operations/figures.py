"""Operations with the tag `figures`.

Made by generate.py from server/openapi.json.
"""

from __future__ import annotations

from typing import Literal, Optional

from ..schemas import (
    LabSessionId,
    ReferenceGaitId,
    StudyId,
    TrialId,
)
from ..transport import Transport


class FiguresMethods(Transport):
    """Operations with the tag `figures`."""

    def get_lab_session_figure(self, lab_session_id: LabSessionId, file: str) -> bytes:
        """Download a figure of a lab session.

        Muscle activity and limit cycles.
        """
        return self.request_bytes(
            "GET",
            "/api/v1/lab-sessions/{id}/figures/{file}",
            {"id": lab_session_id, "file": file},
        )

    def get_reference_gait_figure(self, reference_gait_id: ReferenceGaitId, file: str) -> bytes:
        """Download a figure of a reference gait.

        Joint angles over the cycle of each leg.
        """
        return self.request_bytes(
            "GET",
            "/api/v1/reference-gaits/{id}/figures/{file}",
            {"id": reference_gait_id, "file": file},
        )

    def get_analysis_figure(
        self,
        study_id: StudyId,
        file: str,
        *,
        x: Optional[Literal["a1", "a2", "a3", "a4", "a5", "a6", "a7", "a8"]] = None,
        y: Optional[Literal["a1", "a2", "a3", "a4", "a5", "a6", "a7", "a8"]] = None,
    ) -> bytes:
        """Download a figure of the posterior.

        Effects of the bounds, maps over two bounds, and the trials over the bounds.

        x: Bound on the horizontal axis of a map. The most important one by default.

        y: Bound on the vertical axis of a map. The second most important one by default.
        """
        return self.request_bytes(
            "GET",
            "/api/v1/studies/{id}/analysis/figures/{file}",
            {"id": study_id, "file": file},
            query={"x": x, "y": y},
        )

    def get_study_figure(self, study_id: StudyId, file: str, *, other: Optional[str] = None) -> bytes:
        """Download a figure of a study.

        Progress, answers, and curves of the recommended gait; with `other`, of all these studies.

        other: 1 to 5 comma-separated identifiers of studies for comparison.
        """
        return self.request_bytes(
            "GET",
            "/api/v1/studies/{id}/figures/{file}",
            {"id": study_id, "file": file},
            query={"other": other},
        )

    def get_trial_figure(
        self,
        trial_id: TrialId,
        file: str,
        *,
        other: Optional[str] = None,
        local_optimum: Optional[int] = None,
    ) -> bytes:
        """Download a figure of a trial.

        While the solve is running, shows its progress. With other trials, shows the joint angles, torques and powers of
        all of them, a figure for each joint of each leg. With a local optimum, shows the gait of that one.

        other: 1 to 3 comma-separated identifiers of converged trials of the same study with different gaits, which are
        overlaid on that of this trial.

        local_optimum: Number of another local optimum of the trial. Without `other`.
        """
        return self.request_bytes(
            "GET",
            "/api/v1/trials/{id}/figures/{file}",
            {"id": trial_id, "file": file},
            query={"other": other, "local_optimum": local_optimum},
        )
