-- Which gait comes first, in lab sessions and in the pairs of raters. Drawn by the operating system when it is made, and
-- kept apart from everything that is served: only store/allocations.rs reads these tables, and each of its statements says
-- why the order may be known.
--
-- The columns of the baseline keep what they hold for rows of the baseline, and say nothing about newer rows:
-- lab_sessions.gait_one_first is 0, and presentations.shown_first and shown_second are the two gaits of the pair with the
-- newer one first. An answer in presentation_answers is about that pair: 'first' is presentations.shown_first.

create table lab_allocations (
    session_id     text primary key not null references lab_sessions (id),
    -- Whether walk 2 is with gait one.
    gait_one_first integer not null constraint lab_allocations_order check (gait_one_first in (0, 1)),
    -- Sessions with the same number balance each other, subject by subject, in blocks: this session's place in a block of
    -- that size. Null: it belongs to no block here, because an earlier version or another service drew it.
    stratum        integer constraint lab_allocations_stratum check (stratum is null or stratum >= 1),
    block_size     integer constraint lab_allocations_block check (block_size is null or block_size in (2, 4)),
    place          integer constraint lab_allocations_place check (place is null or place between 1 and block_size),
    -- Random, so that the hash of the row (in seals) tells nothing about the order.
    nonce          text not null constraint lab_allocations_nonce check (length(nonce) = 64),
    created_at     text not null,
    constraint lab_allocations_block_whole check (
        (stratum is null) = (block_size is null) and (block_size is null) = (place is null)
    )
) strict;

create index lab_allocations_by_stratum on lab_allocations (stratum);

create table presentation_allocations (
    presentation_id text primary key not null references presentations (id),
    -- Whether the second gait of the pair is shown first.
    swapped         integer not null constraint presentation_allocations_swapped check (swapped in (0, 1)),
    nonce           text not null constraint presentation_allocations_nonce check (length(nonce) = 64),
    created_at      text not null
) strict;

-- Who got the controller file of a walk. The file tells which gait the walk is with, so a person who takes it knows.
create table lab_device_files (
    id         text primary key not null,
    session_id text not null references lab_sessions (id),
    walk       integer not null constraint lab_device_files_walk check (walk in (2, 3)),
    -- 1: a token that can do nothing else, the device's own. 0: somebody who reads.
    to_device  integer not null constraint lab_device_files_reader check (to_device in (0, 1)),
    actor      text not null,
    created_at text not null
) strict;

create index lab_device_files_by_session on lab_device_files (session_id);

-- Whether whoever answered could have known which gait is which; null: answered before this was recorded.
alter table presentation_answers
add column could_have_known integer
constraint presentation_answers_could_have_known check (could_have_known is null or could_have_known in (0, 1));

-- Orders that the baseline drew from the seed of the study. Whoever knew the seed could compute them.
insert into lab_allocations (session_id, gait_one_first, nonce, created_at)
select id, gait_one_first, lower(hex(randomblob(32))), created_at from lab_sessions;
insert into presentation_allocations (presentation_id, swapped, nonce, created_at)
select id, 0, lower(hex(randomblob(32))), created_at from presentations;

create trigger lab_allocations_no_update before update on lab_allocations
begin select raise(abort, 'allocations are append-only'); end;
create trigger lab_allocations_no_delete before delete on lab_allocations
begin select raise(abort, 'allocations are append-only'); end;
create trigger presentation_allocations_no_update before update on presentation_allocations
begin select raise(abort, 'allocations are append-only'); end;
create trigger presentation_allocations_no_delete before delete on presentation_allocations
begin select raise(abort, 'allocations are append-only'); end;
create trigger lab_device_files_no_update before update on lab_device_files
begin select raise(abort, 'device files are append-only'); end;
create trigger lab_device_files_no_delete before delete on lab_device_files
begin select raise(abort, 'device files are append-only'); end;

create trigger lab_device_files_need_consent before insert on lab_device_files
when (select s.subject_id from lab_sessions l join studies s on s.id = l.study_id where l.id = new.session_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
