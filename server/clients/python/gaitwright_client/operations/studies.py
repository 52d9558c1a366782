"""Operations with the tag `studies`.

Made by generate.py from server/openapi.json.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, Optional, cast

from ..events import Event, follow
from ..paging import Pages
from ..schemas import (
    Atlas,
    HistoryEntry,
    Import,
    NewStudy,
    Recommendation,
    StateChangeReason,
    StudyChange,
    StudyClone,
    StudyComparison,
    StudyExtension,
    StudyId,
    StudyState,
    StudyWithCommands,
    SubjectId,
)
from ..transport import Transport
from ..unpack import Unpack


class StudiesMethods(Transport):
    """Operations with the tag `studies`."""

    def list_studies(
        self,
        *,
        subject_id: Optional[SubjectId] = None,
        text: Optional[str] = None,
        tag: Optional[str] = None,
        state: Optional[StudyState] = None,
        archived: Optional[bool] = None,
        sort: Optional[Literal["created_at", "-created_at", "name", "-name", "state", "-state"]] = None,
        page_size: Optional[int] = None,
    ) -> Pages[StudyWithCommands]:
        """List studies.

        Newest first, unless `sort` names another order.

        subject_id: Only studies of this subject.

        text: Only studies whose name, tags, notes or subject's pseudonym contains this text.

        tag: Only studies with this tag.

        state: Only studies in this state.

        archived: If true, only archived studies. If false (the default), only studies that are not archived.

        sort: Column to sort by: `created_at`, `name` or `state`. A leading minus sorts in descending order.
        """
        return Pages(
            self,
            "/api/v1/studies",
            query={"subject_id": subject_id, "text": text, "tag": tag, "state": state, "archived": archived, "sort": sort, "limit": page_size},
        )

    def create_study(self, *, idempotency_key: Optional[str] = None, **body: Unpack[NewStudy]) -> StudyWithCommands:
        """Create a study.

        Starts the study, unless `start` is false.

        Fields: subject_id; optionally answer_source, atlas, base_bounds, device_id, evaluation, gait_settings, learner,
        muscles, name, number_of_trials, parallel_trials, priority, reference_gait_id, repeat_results, restricted,
        search_space, seed, simulated_walks, solve_options, solve_seconds_budget, start, unchanged_limit,
        warm_start_from.
        """
        return cast(StudyWithCommands, self.request_json("POST", "/api/v1/studies", body=body, key=idempotency_key))

    def get_study(self, study_id: StudyId) -> StudyWithCommands:
        """Get a study.

        The ETag is the revision of the study.
        """
        return cast(StudyWithCommands, self.request_json("GET", "/api/v1/studies/{id}", {"id": study_id}))

    def update_study(
        self,
        study_id: StudyId,
        *,
        revision: Optional[int] = None,
        idempotency_key: Optional[str] = None,
        **body: Unpack[StudyChange],
    ) -> StudyWithCommands:
        """Update a study.

        Changes the name, tags, notes, priority, number of parallel trials or archived state. Absent fields keep their
        values.

        Fields: optionally archived, name, notes, parallel_trials, priority, tags.
        """
        return cast(
            StudyWithCommands,
            self.request_json(
                "PATCH",
                "/api/v1/studies/{id}",
                {"id": study_id},
                revision=revision,
                body=body,
                key=idempotency_key,
            ),
        )

    def get_study_archive(self, study_id: StudyId) -> bytes:
        """Download a study as an archive.

        The archive has every row of the study except concealed allocations, as `gaitwright export` writes it.
        """
        return self.request_bytes("GET", "/api/v1/studies/{id}/archive", {"id": study_id})

    def get_atlas(self, study_id: StudyId) -> Atlas:
        """Get the atlas of a study.

        How many actions have a result, and the best gait so far. Start an atlas with `POST /studies/{id}/clone` and
        `atlas` `make`; the commands for studies pause, resume and stop it.
        """
        return cast(Atlas, self.request_json("GET", "/api/v1/studies/{id}/atlas", {"id": study_id}))

    def get_atlas_csv(self, study_id: StudyId) -> str:
        """Download the atlas as CSV.

        The bounds of each action that has a result, and the gait that it has. Of a gait that the record no longer has,
        or from which nothing can be computed, only the results of its solve are given.
        """
        return self.request_text("GET", "/api/v1/studies/{id}/atlas.csv", {"id": study_id})

    def clone_study(
        self,
        study_id: StudyId,
        *,
        idempotency_key: Optional[str] = None,
        **body: Unpack[StudyClone],
    ) -> StudyWithCommands:
        """Clone a study.

        Creates a study with the same set-up, without the trials.

        Fields: optionally answer_source, atlas, muscles, name, number_of_trials, seed, start.
        """
        return cast(
            StudyWithCommands,
            self.request_json(
                "POST",
                "/api/v1/studies/{id}/clone",
                {"id": study_id},
                body=body,
                key=idempotency_key,
            ),
        )

    def follow_study_events(self, study_id: StudyId, *, after: Optional[int] = None) -> Iterator[Event]:
        """Follow the events of a study.

        Sends `study_state` with the current state first, then the recorded events, each with an id, and `progress`
        events of running solves. A client that sends `Last-Event-ID` receives the recorded events that followed it. The
        stream stays open after the end of the study, because the study can be extended.

        after: Start after this event.
        """
        return follow(self, "/api/v1/studies/{id}/events", {"id": study_id}, query={"after": after})

    def extend_study(
        self,
        study_id: StudyId,
        *,
        revision: Optional[int] = None,
        idempotency_key: Optional[str] = None,
        **body: Unpack[StudyExtension],
    ) -> StudyWithCommands:
        """Extend a study.

        If the study has ended, it resumes.

        Fields: number_of_trials.
        """
        return cast(
            StudyWithCommands,
            self.request_json(
                "POST",
                "/api/v1/studies/{id}/extend",
                {"id": study_id},
                revision=revision,
                body=body,
                key=idempotency_key,
            ),
        )

    def list_study_history(self, study_id: StudyId, *, page_size: Optional[int] = None) -> Pages[HistoryEntry]:
        """List the history of the recommendation.

        The best trial after each iteration of the study, that is, after each result. Sorted by iteration.
        """
        return Pages(self, "/api/v1/studies/{id}/history", {"id": study_id}, query={"limit": page_size})

    def get_study_history_csv(self, study_id: StudyId) -> str:
        """Download the history as CSV.

        The best trial after each iteration of the study, that is, after each result.
        """
        return self.request_text("GET", "/api/v1/studies/{id}/history.csv", {"id": study_id})

    def list_study_imports(self, study_id: StudyId, *, page_size: Optional[int] = None) -> Pages[Import]:
        """List the imports of a study.

        One entry for each time the study was imported into a record, oldest first. Empty if the study was created in
        this record.
        """
        return Pages(self, "/api/v1/studies/{id}/imports", {"id": study_id}, query={"limit": page_size})

    def pause_study(
        self,
        study_id: StudyId,
        *,
        revision: Optional[int] = None,
        idempotency_key: Optional[str] = None,
        **body: Unpack[StateChangeReason],
    ) -> StudyWithCommands:
        """Pause a study.

        Running solves finish, and no new one starts.

        Fields: optionally reason.
        """
        return cast(
            StudyWithCommands,
            self.request_json(
                "POST",
                "/api/v1/studies/{id}/pause",
                {"id": study_id},
                revision=revision,
                body=body,
                key=idempotency_key,
            ),
        )

    def get_recommendation(self, study_id: StudyId) -> Recommendation:
        """Get the recommendation of a study.

        Of the actions tried, the one with the highest utility.
        """
        return cast(Recommendation, self.request_json("GET", "/api/v1/studies/{id}/recommendation", {"id": study_id}))

    def get_recommendation_csv(self, study_id: StudyId) -> str:
        """Download the recommended bounds as CSV.

        Each bound with its side (`at least` or `at most`), its unit and what it limits.
        """
        return self.request_text("GET", "/api/v1/studies/{id}/recommendation.csv", {"id": study_id})

    def resume_study(
        self,
        study_id: StudyId,
        *,
        revision: Optional[int] = None,
        idempotency_key: Optional[str] = None,
        **body: Unpack[StateChangeReason],
    ) -> StudyWithCommands:
        """Resume a study.

        Possible while the study is `paused`.

        Fields: optionally reason.
        """
        return cast(
            StudyWithCommands,
            self.request_json(
                "POST",
                "/api/v1/studies/{id}/resume",
                {"id": study_id},
                revision=revision,
                body=body,
                key=idempotency_key,
            ),
        )

    def start_study(
        self,
        study_id: StudyId,
        *,
        revision: Optional[int] = None,
        idempotency_key: Optional[str] = None,
        **body: Unpack[StateChangeReason],
    ) -> StudyWithCommands:
        """Start a study.

        Possible while the study is `not_started`.

        Fields: optionally reason.
        """
        return cast(
            StudyWithCommands,
            self.request_json(
                "POST",
                "/api/v1/studies/{id}/start",
                {"id": study_id},
                revision=revision,
                body=body,
                key=idempotency_key,
            ),
        )

    def stop_study(
        self,
        study_id: StudyId,
        *,
        revision: Optional[int] = None,
        idempotency_key: Optional[str] = None,
        **body: Unpack[StateChangeReason],
    ) -> StudyWithCommands:
        """Stop a study.

        Cancels open trials.

        Fields: optionally reason.
        """
        return cast(
            StudyWithCommands,
            self.request_json(
                "POST",
                "/api/v1/studies/{id}/stop",
                {"id": study_id},
                revision=revision,
                body=body,
                key=idempotency_key,
            ),
        )

    def list_compared_studies(self, *, ids: str, page_size: Optional[int] = None) -> Pages[StudyComparison]:
        """List studies for comparison.

        Properties and results of several studies. A page has at most 5 studies, because each needs a posterior. Sorted
        as in `ids`.

        ids: 2 to 20 comma-separated identifiers of different studies.
        """
        return Pages(self, "/api/v1/study-comparison", query={"ids": ids, "limit": page_size})
