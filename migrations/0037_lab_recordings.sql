-- What was measured in the walks of a lab session, as it was brought, and what was made of the electromyograms. The
-- newest recording of a walk counts; none is ever changed, so that it can be processed anew with other settings.

create table lab_recordings (
    id         text primary key not null,
    session_id text not null references lab_sessions (id),
    walk       integer not null constraint lab_recordings_walk check (walk in (1, 2, 3)),
    kind       text not null constraint lab_recordings_kind check (kind in ('electromyogram', 'motion')),
    -- How the file is to be read, JSON.
    reading    text not null constraint lab_recordings_reading check (json_valid(reading)),
    -- The file, zstd-compressed.
    raw        blob not null,
    raw_sha256 text not null,
    actor      text not null,
    created_at text not null
) strict;

create index lab_recordings_by_session on lab_recordings (session_id, kind, walk);

create table emg_results (
    id         text primary key not null,
    session_id text not null references lab_sessions (id),
    -- Settings and curves, JSON.
    document   text not null constraint emg_results_document check (json_valid(document)),
    actor      text not null,
    created_at text not null
) strict;

create index emg_results_by_session on emg_results (session_id);

create trigger lab_recordings_no_update before update on lab_recordings
begin select raise(abort, 'recordings are append-only'); end;
create trigger lab_recordings_no_delete before delete on lab_recordings
begin select raise(abort, 'recordings are append-only'); end;
create trigger emg_results_no_update before update on emg_results
begin select raise(abort, 'results are append-only'); end;
create trigger emg_results_no_delete before delete on emg_results
begin select raise(abort, 'results are append-only'); end;

create trigger lab_recordings_need_consent before insert on lab_recordings
when (select s.subject_id from lab_sessions l join studies s on s.id = l.study_id where l.id = new.session_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
create trigger emg_results_need_consent before insert on emg_results
when (select s.subject_id from lab_sessions l join studies s on s.id = l.study_id where l.id = new.session_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
