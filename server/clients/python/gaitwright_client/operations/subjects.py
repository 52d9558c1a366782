"""Operations with the tag `subjects`.

Made by generate.py from server/openapi.json.
"""

from __future__ import annotations

from typing import Optional, cast

from ..paging import Pages
from ..schemas import (
    Consent,
    ConsentWithdrawal,
    Correction,
    MuscleParameters,
    NewConsent,
    NewCorrection,
    NewSubject,
    ReferenceGaitMatch,
    Subject,
    SubjectId,
)
from ..transport import Transport
from ..unpack import Unpack


class SubjectsMethods(Transport):
    """Operations with the tag `subjects`."""

    def list_subjects(self, *, page_size: Optional[int] = None) -> Pages[Subject]:
        """List subjects.

        Newest first.
        """
        return Pages(self, "/api/v1/subjects", query={"limit": page_size})

    def create_subject(self, *, idempotency_key: Optional[str] = None, **body: Unpack[NewSubject]) -> Subject:
        """Create a subject.

        A pseudonym belongs to one subject. `create_consent` then records the consent of the subject.

        Fields: body_mass_kg, height_m, pseudonym; optionally notes.
        """
        return cast(Subject, self.request_json("POST", "/api/v1/subjects", body=body, key=idempotency_key))

    def get_subject(self, subject_id: SubjectId) -> Subject:
        """Get a subject.

        Height and mass are the corrected ones; `list_subject_corrections` has the earlier ones.
        """
        return cast(Subject, self.request_json("GET", "/api/v1/subjects/{id}", {"id": subject_id}))

    def list_consents(self, subject_id: SubjectId, *, page_size: Optional[int] = None) -> Pages[Consent]:
        """List consents of a subject.

        Consents and withdrawals, oldest first. The last entry applies.
        """
        return Pages(self, "/api/v1/subjects/{id}/consents", {"id": subject_id}, query={"limit": page_size})

    def create_consent(
        self,
        subject_id: SubjectId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[NewConsent],
    ) -> Consent:
        """Create a consent.

        Records that the subject consented.

        Fields: form.
        """
        return cast(
            Consent,
            self.request_json(
                "POST",
                "/api/v1/subjects/{id}/consents",
                {"id": subject_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def list_subject_corrections(self, subject_id: SubjectId, *, page_size: Optional[int] = None) -> Pages[Correction]:
        """List corrections of a subject's height and mass.

        Corrections of height and mass, oldest first. The last entry applies.
        """
        return Pages(self, "/api/v1/subjects/{id}/corrections", {"id": subject_id}, query={"limit": page_size})

    def create_subject_correction(
        self,
        subject_id: SubjectId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[NewCorrection],
    ) -> Correction:
        """Create a correction of a subject's height and mass.

        Corrects height and mass. New studies use the corrected values. Existing studies keep theirs.

        Fields: body_mass_kg, height_m, reason.
        """
        return cast(
            Correction,
            self.request_json(
                "POST",
                "/api/v1/subjects/{id}/corrections",
                {"id": subject_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def get_subject_muscles(self, subject_id: SubjectId) -> MuscleParameters:
        """Get measured muscle values of a subject.

        Values that override the default muscle values.
        """
        return cast(MuscleParameters, self.request_json("GET", "/api/v1/subjects/{id}/muscles", {"id": subject_id}))

    def set_subject_muscles(
        self,
        subject_id: SubjectId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[MuscleParameters],
    ) -> MuscleParameters:
        """Set measured muscle values of a subject.

        New studies use these values.

        Fields: optionally gas, glu, ham, hfl, scaled_to_body, sol, ta, vas.
        """
        return cast(
            MuscleParameters,
            self.request_json(
                "PUT",
                "/api/v1/subjects/{id}/muscles",
                {"id": subject_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def list_reference_gaits_by_distance(
        self,
        subject_id: SubjectId,
        *,
        page_size: Optional[int] = None,
    ) -> Pages[ReferenceGaitMatch]:
        """List the reference gaits nearest to a subject.

        Sorted by distance in height and body mass, the nearest first. Those without height and mass come last.
        """
        return Pages(self, "/api/v1/subjects/{id}/reference-gaits", {"id": subject_id}, query={"limit": page_size})

    def withdraw_consent(
        self,
        subject_id: SubjectId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[ConsentWithdrawal],
    ) -> Consent:
        """Withdraw consent.

        Stops every study of the subject. The subject's data are kept, but they can no longer be extended, shown or
        exported.

        Fields: reason.
        """
        return cast(
            Consent,
            self.request_json(
                "POST",
                "/api/v1/subjects/{id}/withdraw",
                {"id": subject_id},
                body=body,
                key=idempotency_key,
            ),
        )
