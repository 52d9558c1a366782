"""Operations with the tag `operation`.

Made by generate.py from server/openapi.json.
"""

from __future__ import annotations

from typing import Optional, cast

from ..paging import Pages
from ..schemas import (
    AccessLogEntry,
    AuditEntry,
    Backup,
    BackupId,
    Job,
    JobKind,
    StudyId,
    SubjectId,
    Worker,
)
from ..transport import Transport


class OperationMethods(Transport):
    """Operations with the tag `operation`."""

    def list_access_log(
        self,
        *,
        text: Optional[str] = None,
        subject_id: Optional[SubjectId] = None,
        page_size: Optional[int] = None,
    ) -> Pages[AccessLogEntry]:
        """List the access log.

        Views and exports of subjects' data, and refusals, newest first.

        text: Text to find in the kind, actor, address, object, study or pseudonym.

        subject_id: Only rows of this subject.
        """
        return Pages(self, "/api/v1/access-log", query={"text": text, "subject_id": subject_id, "limit": page_size})

    def list_audit_trail(self, *, text: Optional[str] = None, page_size: Optional[int] = None) -> Pages[AuditEntry]:
        """List the audit trail.

        Every change by a user or a program, newest first.

        text: Text to find in the actor, the kind of change or the object.
        """
        return Pages(self, "/api/v1/audit", query={"text": text, "limit": page_size})

    def request_backup(self, *, idempotency_key: Optional[str] = None) -> Job:
        """Request a backup.

        Writes a backup next to the database and verifies it. The backup is completed even if the caller disconnects.
        """
        return cast(Job, self.request_json("POST", "/api/v1/backups", key=idempotency_key))

    def get_backup(self, backup_id: BackupId) -> Backup:
        """Get a backup.

        File name, size and time of the backup, without its contents.
        """
        return cast(Backup, self.request_json("GET", "/api/v1/backups/{id}", {"id": backup_id}))

    def list_jobs(
        self,
        *,
        kind: Optional[JobKind] = None,
        study_id: Optional[StudyId] = None,
        page_size: Optional[int] = None,
    ) -> Pages[Job]:
        """List jobs.

        Jobs that have not ended: backups, and those of studies that the caller can access. Sorted by kind and age.

        kind: Only jobs of this kind.

        study_id: Only jobs of this study.
        """
        return Pages(self, "/api/v1/jobs", query={"kind": kind, "study_id": study_id, "limit": page_size})

    def get_job(self, job_id: str) -> Job:
        """Get a job.

        Includes jobs that have ended.
        """
        return cast(Job, self.request_json("GET", "/api/v1/jobs/{id}", {"id": job_id}))

    def cancel_job(self, job_id: str, *, idempotency_key: Optional[str] = None) -> Job:
        """Cancel a job.

        A solve stops within one iteration, and its trial is cancelled. Cancelling a backup requires the `administer`
        right.
        """
        return cast(Job, self.request_json("POST", "/api/v1/jobs/{id}/cancel", {"id": job_id}, key=idempotency_key))

    def list_workers(self, *, page_size: Optional[int] = None) -> Pages[Worker]:
        """List workers.

        The workers that are running solves. Sorted by name.
        """
        return Pages(self, "/api/v1/workers", query={"limit": page_size})
