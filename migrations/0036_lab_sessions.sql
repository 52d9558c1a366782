-- Lab sessions: one person walks without the device and with two gaits of a study, in an order that the server draws
-- and keeps to itself. Walk 1 is the one without the device; which gait is walk 2 follows from gait_one_first.

create table lab_sessions (
    id             text primary key not null,
    study_id       text not null references studies (id),
    -- 1, 2, ... of this study.
    number         integer not null constraint lab_sessions_number check (number >= 1),
    gait_one       text not null references trials (id),
    gait_two       text not null references trials (id),
    gait_one_first integer not null constraint lab_sessions_order check (gait_one_first in (0, 1)),
    notes          text not null default '' constraint lab_sessions_notes check (length(notes) <= 2000),
    actor          text not null,
    created_at     text not null,
    constraint lab_sessions_number_unique unique (study_id, number),
    constraint lab_sessions_two_gaits check (gait_one <> gait_two)
) strict;

-- What happened to a session; each of these happens once.
create table lab_acts (
    session_id text not null references lab_sessions (id),
    act        text not null
               constraint lab_acts_act check (act in ('walk_1', 'walk_2', 'walk_3', 'unblinded', 'closed')),
    note       text not null default '' constraint lab_acts_note check (length(note) <= 2000),
    actor      text not null,
    created_at text not null,
    primary key (session_id, act)
) strict;

create trigger lab_sessions_no_update before update on lab_sessions
begin select raise(abort, 'lab sessions are append-only'); end;
create trigger lab_sessions_no_delete before delete on lab_sessions
begin select raise(abort, 'lab sessions are append-only'); end;
create trigger lab_acts_no_update before update on lab_acts
begin select raise(abort, 'acts are append-only'); end;
create trigger lab_acts_no_delete before delete on lab_acts
begin select raise(abort, 'acts are append-only'); end;

create trigger lab_sessions_same_study before insert on lab_sessions
when exists (select 1 from trials where id in (new.gait_one, new.gait_two) and study_id <> new.study_id)
begin select raise(abort, 'a lab session names a trial of another study'); end;
create trigger lab_sessions_need_consent before insert on lab_sessions
when (select subject_id from studies where id = new.study_id) in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
create trigger lab_acts_need_consent before insert on lab_acts
when (select s.subject_id from lab_sessions l join studies s on s.id = l.study_id where l.id = new.session_id)
    in (select subject_id from withdrawn_subjects)
begin select raise(abort, 'the subject withdrew consent'); end;
