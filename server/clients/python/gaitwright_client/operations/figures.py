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

        Muscle activity, joint angles and limit cycles.

        Names: `emg-` and one of `left-rectus-femoris`, `left-tibialis-anterior`, `left-biceps-femoris`, `left-
        gastrocnemius`, `right-rectus-femoris` and `right-biceps-femoris`; `angle-` and a joint; `limit-cycle-`, a
        joint, a hyphen, and `without-the-device`, `gait-a` or `gait-b`, or `walk-` and the number of the walk as long
        as its condition is blinded. Joints are `torso-lean`, `left-hip`, `left-knee`, `left-ankle`, `right-hip`,
        `right-knee` and `right-ankle`.
        """
        return self.request_bytes(
            "GET",
            "/api/v1/lab-sessions/{id}/figures/{file}",
            {"id": lab_session_id, "file": file},
        )

    def get_reference_gait_figure(self, reference_gait_id: ReferenceGaitId, file: str) -> bytes:
        """Download a figure of a reference gait.

        Joint angles over the cycle of each leg.

        Names: `reference-hip`, `reference-knee`, `reference-ankle` and `reference-torso-lean`.
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

        Names: `utility-a1-coordinate-velocity-s`, `utility-a2-coordinate-acceleration-s`, `utility-a3-minimum-hip-
        velocity-m-s`, `utility-a4-maximum-hip-velocity-m-s`, `utility-a5-swing-foot-clearance-m`, `utility-a6-torso-
        lean`, `utility-a7-hip-angle` and `utility-a8-ankle-angle`, for tuned bounds; `trials-by-` and a tuned bound;
        `x-y-utility` and `x-y-probability-of-converging`, with the two bounds in place of `x` and `y`; `cost-of-
        transport-and-gait-rmse`; `bounds-and-result-of-each-trial`.

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

        Names: `course-gait-rmse-of-the-best-action-by-iteration`; `angles-` and one of `left-hip`, `right-hip`, `left-
        knee`, `right-knee-prosthesis`, `left-ankle`, `right-ankle-prosthesis` and `torso-lean`; `limit-cycles-` and one
        of `torso-lean`, `left-hip`, `left-knee`, `left-ankle`, `right-hip`, `right-knee` and `right-ankle`; `gait-of-`
        and the name of a study; `warm-starts-of-` and the name of the study; `utility-of-the-recommended-gait`. Names
        of studies are in lower case, and one hyphen replaces each run of characters other than the letters a to z and
        digits. A figure without data does not exist.

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

        Names: `the-stride` and `walking`; `angles-` and `limit-cycles-`, each with `hip`, `knee`, `ankle` or `torso-
        lean`; `torques-`, `powers-` and `accelerations-`, each with `hip`, `knee` or `ankle`; `forces-vertical` and
        `forces-forward`; `phase-hip-velocity` and `phase-phase`; with muscles, `muscles-`, `muscle-forces-` and
        `fibres-`, each with `hamstrings`, `gluteus`, `hip-flexors`, `vasti`, `gastrocnemius`, `soleus` or `tibialis-
        anterior`; `solve-violation-dual-infeasibility-barrier-parameter-and-objective`, the only one while the solve is
        running. With `other`, only `angles-`, `torques-` and `powers-`, each with `left-hip`, `right-hip`, `left-knee`,
        `right-knee-prosthesis`, `left-ankle` or `right-ankle-prosthesis`; and `angles-torso-lean`. With
        `local_optimum`, only `the-stride` and `walking`.

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
