-- Tables and columns get the words of the glossary: assessments (before: remarks), measurement files (lab_recordings), and
-- the decision of a safety review (verdict). Rows of a renamed table are copied, because a seal names its table.

create table assessments (
    id          text primary key not null,
    study_id    text not null references studies (id),
    first       text not null references trials (id),
    second      text not null references trials (id),
    answer      text not null
                constraint assessments_answer check (answer in ('cannot_tell', 'unsafe_first', 'unsafe_second', 'unsafe_both')),
    source      text not null constraint assessments_source check (source in ('subject', 'clinician', 'script')),
    author      text not null constraint assessments_author_length check (length(author) between 1 and 80),
    note        text not null default '' constraint assessments_note_length check (length(note) <= 2000),
    -- The preference that the learner received; null if none.
    feedback_id text references feedback (id),
    created_at  text not null,
    constraint assessments_two_gaits check (first <> second)
) strict;

insert into assessments (id, study_id, first, second, answer, source, author, note, feedback_id, created_at)
select id, study_id, first, second, answer, source, author, note, feedback_id, created_at from remarks order by rowid;

create table assessment_retractions (
    assessment_id text primary key not null references assessments (id),
    author        text not null constraint assessment_retractions_author_length check (length(author) between 1 and 80),
    reason        text not null constraint assessment_retractions_reason_length check (length(reason) between 1 and 2000),
    created_at    text not null
) strict;

insert into assessment_retractions (assessment_id, author, reason, created_at)
select remark_id, author, reason, created_at from remark_retractions order by rowid;

create table measurement_files (
    id         text primary key not null,
    session_id text not null references lab_sessions (id),
    walk       integer not null constraint measurement_files_walk check (walk in (1, 2, 3)),
    kind       text not null constraint measurement_files_kind check (kind in ('electromyogram', 'motion')),
    -- How the file is to be read, JSON.
    reading    text not null constraint measurement_files_reading check (json_valid(reading)),
    -- The file, zstd-compressed.
    raw        blob not null,
    raw_sha256 text not null,
    actor      text not null,
    created_at text not null
) strict;

insert into measurement_files (id, session_id, walk, kind, reading, raw, raw_sha256, actor, created_at)
select id, session_id, walk, kind, reading, raw, raw_sha256, actor, created_at from lab_recordings order by rowid;

drop table remark_retractions;
drop table remarks;
drop table lab_recordings;

create index assessments_by_study on assessments (study_id);
create index measurement_files_by_session on measurement_files (session_id, kind, walk);

create trigger assessments_no_update before update on assessments
begin select raise(abort, 'assessments are append-only'); end;
create trigger assessments_no_delete before delete on assessments
begin select raise(abort, 'assessments are append-only'); end;
create trigger assessments_same_study before insert on assessments
when exists (select 1 from trials where id in (new.first, new.second) and study_id <> new.study_id)
begin select raise(abort, 'an assessment names a trial of another study'); end;
create trigger assessments_need_consent before insert on assessments
when (select subject_id from studies where id = new.study_id) in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

create trigger assessment_retractions_no_update before update on assessment_retractions
begin select raise(abort, 'retractions are append-only'); end;
create trigger assessment_retractions_no_delete before delete on assessment_retractions
begin select raise(abort, 'retractions are append-only'); end;

create trigger measurement_files_no_update before update on measurement_files
begin select raise(abort, 'measurement files are append-only'); end;
create trigger measurement_files_no_delete before delete on measurement_files
begin select raise(abort, 'measurement files are append-only'); end;
create trigger measurement_files_need_consent before insert on measurement_files
when (select s.subject_id from lab_sessions l join studies s on s.id = l.study_id where l.id = new.session_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;

-- A seal contains the names of the columns, so the rows are written again.
drop trigger safety_reviews_no_update;
alter table safety_reviews rename column verdict to decision;
update safety_reviews set decision = decision;
create trigger safety_reviews_no_update before update on safety_reviews
begin select raise(abort, 'reviews are append-only'); end;
