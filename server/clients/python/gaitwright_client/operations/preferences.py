"""Operations with the tag `preferences`.

Made by generate.py from server/openapi.json.
"""

from __future__ import annotations

from typing import Optional, cast

from ..paging import Pages
from ..schemas import (
    AnswerRetraction,
    AnswerUndo,
    Assessment,
    AssessmentId,
    CreatedPreference,
    FeedbackId,
    NewAssessment,
    NewPreference,
    NewSafetyReport,
    NewSafetyReview,
    NewSuggestion,
    Preference,
    RestoredAnswer,
    SafetyReport,
    SafetyReview,
    StudyId,
    Suggestion,
    TrialId,
)
from ..transport import Transport
from ..unpack import Unpack


class PreferencesMethods(Transport):
    """Operations with the tag `preferences`."""

    def get_assessment(self, assessment_id: AssessmentId) -> Assessment:
        """Get an assessment.

        Retracted assessments are returned, too, with their retraction.
        """
        return cast(Assessment, self.request_json("GET", "/api/v1/assessments/{id}", {"id": assessment_id}))

    def retract_assessment(
        self,
        assessment_id: AssessmentId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[AnswerRetraction],
    ) -> Assessment:
        """Retract an assessment.

        The assessment stays on record. The learner no longer uses the preference derived from it.

        Fields: reason; optionally author.
        """
        return cast(
            Assessment,
            self.request_json(
                "POST",
                "/api/v1/assessments/{id}/retract",
                {"id": assessment_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def undo_assessment(
        self,
        assessment_id: AssessmentId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[AnswerUndo],
    ) -> RestoredAnswer:
        """Undo an assessment.

        Retracts an assessment that was recorded in the last two minutes. If it replaced an answer, a copy of that
        answer with the same author is recorded, and counts in its place. An undo cannot be undone, nor can a safety
        report.

        Fields: optionally author.
        """
        return cast(
            RestoredAnswer,
            self.request_json(
                "POST",
                "/api/v1/assessments/{id}/undo",
                {"id": assessment_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def get_preference(self, preference_id: FeedbackId) -> Preference:
        """Get a preference.

        Retracted preferences are returned, too, with their retraction.
        """
        return cast(Preference, self.request_json("GET", "/api/v1/preferences/{id}", {"id": preference_id}))

    def retract_preference(
        self,
        preference_id: FeedbackId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[AnswerRetraction],
    ) -> Preference:
        """Retract a preference.

        The preference stays on record, but the learner no longer uses it. An answer that it replaced does not count
        again; to restore that answer, undo the preference instead.

        Fields: reason; optionally author.
        """
        return cast(
            Preference,
            self.request_json(
                "POST",
                "/api/v1/preferences/{id}/retract",
                {"id": preference_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def undo_preference(
        self,
        preference_id: FeedbackId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[AnswerUndo],
    ) -> RestoredAnswer:
        """Undo a preference.

        Retracts a preference that was recorded in the last two minutes. If it replaced an answer, a copy of that answer
        with the same author is recorded, and counts in its place. An undo cannot be undone.

        Fields: optionally author.
        """
        return cast(
            RestoredAnswer,
            self.request_json(
                "POST",
                "/api/v1/preferences/{id}/undo",
                {"id": preference_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def list_assessments(self, study_id: StudyId, *, page_size: Optional[int] = None) -> Pages[Assessment]:
        """List assessments of a study.

        Answers about two gaits that state no preference, retracted ones included, oldest first.
        """
        return Pages(self, "/api/v1/studies/{id}/assessments", {"id": study_id}, query={"limit": page_size})

    def create_assessment(
        self,
        study_id: StudyId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[NewAssessment],
    ) -> Assessment:
        """Create an assessment of two gaits.

        States that the author cannot tell which gait is better, or that a gait is unsafe. An unsafe gait is not
        recommended, compared or planned for lab sessions until staff have cleared the gait.

        Fields: answer, trial_a, trial_b; optionally author, note, replaces, source.
        """
        return cast(
            Assessment,
            self.request_json(
                "POST",
                "/api/v1/studies/{id}/assessments",
                {"id": study_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def list_preferences(self, study_id: StudyId, *, page_size: Optional[int] = None) -> Pages[Preference]:
        """List preferences of a study.

        Includes retracted preferences. Oldest first.
        """
        return Pages(self, "/api/v1/studies/{id}/preferences", {"id": study_id}, query={"limit": page_size})

    def create_preference(
        self,
        study_id: StudyId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[NewPreference],
    ) -> CreatedPreference:
        """Create a preference.

        Records which of two gaits is better, or that there is no difference. Both gaits must be walkable. An author can
        give only one answer per pair of gaits; to change an answer, name it in `replaces`.

        Fields: answer, trial_a, trial_b; optionally author, note, replaces, source.
        """
        return cast(
            CreatedPreference,
            self.request_json(
                "POST",
                "/api/v1/studies/{id}/preferences",
                {"id": study_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def get_preferences_csv(self, study_id: StudyId) -> str:
        """Download preferences as CSV.

        In a preference, `trial_a` is the winner.
        """
        return self.request_text("GET", "/api/v1/studies/{id}/preferences.csv", {"id": study_id})

    def list_safety_reports(self, study_id: StudyId, *, page_size: Optional[int] = None) -> Pages[SafetyReport]:
        """List safety reports of a study.

        Includes safety reports from raters, assessments and lab sessions, and reports about a single gait. A report
        stays in the list after its gait is cleared for walking. A report from a blinded lab session is listed for both
        of its gaits. Oldest first.
        """
        return Pages(self, "/api/v1/studies/{id}/safety-reports", {"id": study_id}, query={"limit": page_size})

    def list_suggestions(self, study_id: StudyId, *, page_size: Optional[int] = None) -> Pages[Suggestion]:
        """List suggestions of a study.

        Includes retracted suggestions. Oldest first.
        """
        return Pages(self, "/api/v1/studies/{id}/suggestions", {"id": study_id}, query={"limit": page_size})

    def create_suggestion(
        self,
        study_id: StudyId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[NewSuggestion],
    ) -> Suggestion:
        """Create a suggestion.

        The learner uses it like a preference.

        Fields: bounds, over; optionally author, note, source.
        """
        return cast(
            Suggestion,
            self.request_json(
                "POST",
                "/api/v1/studies/{id}/suggestions",
                {"id": study_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def get_suggestion(self, suggestion_id: FeedbackId) -> Suggestion:
        """Get a suggestion.

        Retracted suggestions are returned, too, with their retraction.
        """
        return cast(Suggestion, self.request_json("GET", "/api/v1/suggestions/{id}", {"id": suggestion_id}))

    def retract_suggestion(
        self,
        suggestion_id: FeedbackId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[AnswerRetraction],
    ) -> Suggestion:
        """Retract a suggestion.

        The suggestion stays on record, but the learner no longer uses it.

        Fields: reason; optionally author.
        """
        return cast(
            Suggestion,
            self.request_json(
                "POST",
                "/api/v1/suggestions/{id}/retract",
                {"id": suggestion_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def create_safety_report(
        self,
        trial_id: TrialId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[NewSafetyReport],
    ) -> SafetyReport:
        """Create a safety report.

        Until staff have cleared the gait, neither the gait nor any other trial of the subject with the same motion is
        recommended, compared or used for walking. The report does not reach the learner.

        Fields: optionally author, note, source.
        """
        return cast(
            SafetyReport,
            self.request_json(
                "POST",
                "/api/v1/trials/{id}/safety-reports",
                {"id": trial_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def create_safety_review(
        self,
        trial_id: TrialId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[NewSafetyReview],
    ) -> SafetyReview:
        """Create a review of safety reports.

        If the gait is cleared, it can again be recommended, compared and used in lab sessions, and the preferences
        derived from the reports are retracted. If a lab session with a report about the gait is unblinded later, that
        report makes the gait unsafe again.

        Fields: decision, reason; optionally author, reports.
        """
        return cast(
            SafetyReview,
            self.request_json(
                "POST",
                "/api/v1/trials/{id}/safety-reviews",
                {"id": trial_id},
                body=body,
                key=idempotency_key,
            ),
        )
