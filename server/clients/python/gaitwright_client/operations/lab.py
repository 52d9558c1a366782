"""Operations with the tag `lab`.

Made by generate.py from server/openapi.json.
"""

from __future__ import annotations

from typing import Optional, cast

from ..paging import Pages
from ..schemas import (
    ControllerFile,
    EmgProcessing,
    LabSession,
    LabSessionClosing,
    LabSessionId,
    LabSessionProgress,
    LabSessionUnblinding,
    LimitCycles,
    MeasurementFile,
    MeasurementFileId,
    NewEmg,
    NewJointAngles,
    NewLabAnswer,
    NewLabSession,
    ProcessedEmg,
    RecordedWalk,
    StudyId,
)
from ..transport import Transport
from ..unpack import Unpack


class LabMethods(Transport):
    """Operations with the tag `lab`."""

    def get_lab_session(self, lab_session_id: LabSessionId) -> LabSession:
        """Get a lab session.

        The response omits blinded data.
        """
        return cast(LabSession, self.request_json("GET", "/api/v1/lab-sessions/{id}", {"id": lab_session_id}))

    def answer_lab_session(
        self,
        lab_session_id: LabSessionId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[NewLabAnswer],
    ) -> LabSessionProgress:
        """Answer a lab session.

        States which walk was better, that there is no difference, that the subject cannot tell, or that a walk was
        unsafe. The answer reaches the learner at unblinding; a safety report takes effect at once.

        Fields: answer, number; optionally note.
        """
        return cast(
            LabSessionProgress,
            self.request_json(
                "POST",
                "/api/v1/lab-sessions/{id}/answers",
                {"id": lab_session_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def close_lab_session(
        self,
        lab_session_id: LabSessionId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[LabSessionClosing],
    ) -> LabSession:
        """Close a lab session.

        A closed session accepts no more data except safety reports.

        Fields: optionally note.
        """
        return cast(
            LabSession,
            self.request_json(
                "POST",
                "/api/v1/lab-sessions/{id}/close",
                {"id": lab_session_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def get_walk_controller_file(
        self,
        lab_session_id: LabSessionId,
        *,
        walk: int,
        rate_hz: Optional[float] = None,
    ) -> ControllerFile:
        """Download the controller file of a lab walk.

        The file does not name the trial, but comparing it with the controller files of both gaits reveals the
        allocation. It is meant for the device, which uses a token with only the `device` scope. If anybody else fetches
        the file, the session and the audit trail record this, and later answers of that caller do not count as blind.

        walk: Number of the walk, 2 or 3. Walk 1 is without the device.

        rate_hz: Sampling rate, 10 to 5000 Hz. Default 200.
        """
        return cast(
            ControllerFile,
            self.request_json(
                "GET",
                "/api/v1/lab-sessions/{id}/controller.json",
                {"id": lab_session_id},
                query={"walk": walk, "rate_hz": rate_hz},
            ),
        )

    def get_emg_result(self, lab_session_id: LabSessionId) -> ProcessedEmg:
        """Get the newest EMG result.

        The newest result. After unblinding, includes the muscle activity of the model. Without a result, the status is
        404.
        """
        return cast(
            ProcessedEmg,
            self.request_json(
                "GET",
                "/api/v1/lab-sessions/{id}/emg-results",
                {"id": lab_session_id},
            ),
        )

    def create_emg_result(
        self,
        lab_session_id: LabSessionId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[EmgProcessing],
    ) -> ProcessedEmg:
        """Create an EMG result.

        Filters, segments and normalises the newest EMG recording of each walk. Can be repeated with other settings.

        Fields: optionally settings.
        """
        return cast(
            ProcessedEmg,
            self.request_json(
                "POST",
                "/api/v1/lab-sessions/{id}/emg-results",
                {"id": lab_session_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def list_limit_cycles(self, lab_session_id: LabSessionId, *, page_size: Optional[int] = None) -> Pages[LimitCycles]:
        """List limit cycles.

        Angle and velocity of every recorded joint, from the newest joint angles of each walk. Sorted by walk.
        """
        return Pages(self, "/api/v1/lab-sessions/{id}/limit-cycles", {"id": lab_session_id}, query={"limit": page_size})

    def list_measurement_files(
        self,
        lab_session_id: LabSessionId,
        *,
        page_size: Optional[int] = None,
    ) -> Pages[MeasurementFile]:
        """List measurement files of a lab session.

        Oldest first. The newest file of each kind and walk is used.
        """
        return Pages(
            self,
            "/api/v1/lab-sessions/{id}/measurement-files",
            {"id": lab_session_id},
            query={"limit": page_size},
        )

    def create_emg_file(
        self,
        lab_session_id: LabSessionId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[NewEmg],
    ) -> MeasurementFile:
        """Create a measurement file with EMG.

        An incomplete file, or one without a complete stride, is refused.

        Fields: recording, walk; optionally reading.
        """
        return cast(
            MeasurementFile,
            self.request_json(
                "POST",
                "/api/v1/lab-sessions/{id}/measurement-files/emg",
                {"id": lab_session_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def create_joint_angle_file(
        self,
        lab_session_id: LabSessionId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[NewJointAngles],
    ) -> MeasurementFile:
        """Create a measurement file with joint angles.

        Limit cycles are computed from the file.

        Fields: recording, walk; optionally reading.
        """
        return cast(
            MeasurementFile,
            self.request_json(
                "POST",
                "/api/v1/lab-sessions/{id}/measurement-files/joint-angles",
                {"id": lab_session_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def get_next_walk(self, lab_session_id: LabSessionId) -> LabSessionProgress:
        """Get the next walk of a lab session.

        The response omits all data that would reveal a gait.
        """
        return cast(
            LabSessionProgress,
            self.request_json(
                "GET",
                "/api/v1/lab-sessions/{id}/next-walk",
                {"id": lab_session_id},
            ),
        )

    def retract_lab_answer(
        self,
        lab_session_id: LabSessionId,
        *,
        idempotency_key: Optional[str] = None,
    ) -> LabSessionProgress:
        """Retract the answer of the subject.

        Possible until the session is closed or unblinded. A safety report cannot be retracted.
        """
        return cast(
            LabSessionProgress,
            self.request_json(
                "POST",
                "/api/v1/lab-sessions/{id}/retract-answer",
                {"id": lab_session_id},
                key=idempotency_key,
            ),
        )

    def unblind_lab_session(
        self,
        lab_session_id: LabSessionId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[LabSessionUnblinding],
    ) -> LabSession:
        """Unblind a lab session.

        Reveals to everyone who can access the study which gait each walk used. The audit trail records the unblinding,
        later walks are marked as recorded after it, and the answer of the subject becomes a preference of the study.

        Fields: reason.
        """
        return cast(
            LabSession,
            self.request_json(
                "POST",
                "/api/v1/lab-sessions/{id}/unblind",
                {"id": lab_session_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def record_walk(
        self,
        lab_session_id: LabSessionId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[RecordedWalk],
    ) -> LabSessionProgress:
        """Record a walk.

        Walks are recorded in order. Recording a walk cannot be undone.

        Fields: walk; optionally note.
        """
        return cast(
            LabSessionProgress,
            self.request_json(
                "POST",
                "/api/v1/lab-sessions/{id}/walks",
                {"id": lab_session_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def get_measurement_file(self, measurement_file_id: MeasurementFileId) -> MeasurementFile:
        """Get the description of a measurement file.

        `get_measurement_file_content` has the file itself.
        """
        return cast(
            MeasurementFile,
            self.request_json(
                "GET",
                "/api/v1/measurement-files/{id}",
                {"id": measurement_file_id},
            ),
        )

    def get_measurement_file_content(self, measurement_file_id: MeasurementFileId) -> str:
        """Download a measurement file.

        The file as uploaded, byte for byte. Its ETag is its SHA-256.
        """
        return self.request_text("GET", "/api/v1/measurement-files/{id}/content", {"id": measurement_file_id})

    def list_lab_sessions(self, study_id: StudyId, *, page_size: Optional[int] = None) -> Pages[LabSession]:
        """List lab sessions of a study.

        The response omits blinded data. Sorted by number.
        """
        return Pages(self, "/api/v1/studies/{id}/lab-sessions", {"id": study_id}, query={"limit": page_size})

    def create_lab_session(
        self,
        study_id: StudyId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[NewLabSession],
    ) -> LabSession:
        """Create a lab session.

        The session consists of a walk without the device, then one with each gait. The order of the gaits is drawn at
        random when the session is planned, and concealed.

        Fields: trial_a, trial_b; optionally notes.
        """
        return cast(
            LabSession,
            self.request_json(
                "POST",
                "/api/v1/studies/{id}/lab-sessions",
                {"id": study_id},
                body=body,
                key=idempotency_key,
            ),
        )
