-- Who reaches which study. Raters reach the studies that they are members of. Staff and programs reach every study that is
-- not restricted, and restricted ones as members. Administrators reach every study.
--
-- These rows say nothing of a subject: who may no longer see a study must be removable after a withdrawal, too.

create table study_members (
    id         text primary key not null,
    study_id   text not null references studies (id),
    user_id    text references users (id),
    token_id   text references tokens (id),
    actor      text not null constraint study_members_actor_length check (length(actor) between 1 and 120),
    created_at text not null,
    constraint study_members_user_or_token check ((user_id is null) <> (token_id is null))
) strict;

create index study_members_by_study on study_members (study_id);
create index study_members_by_user on study_members (user_id) where user_id is not null;
create index study_members_by_token on study_members (token_id) where token_id is not null;

-- A membership ends once; who comes back becomes a member anew.
create table study_member_ends (
    member_id  text primary key not null references study_members (id),
    actor      text not null constraint study_member_ends_actor_length check (length(actor) between 1 and 120),
    created_at text not null
) strict;

-- A study is restricted to its members or open to staff; the newest row counts, and a study without one is open.
create table study_restrictions (
    seq        integer primary key autoincrement,
    study_id   text not null references studies (id),
    restricted integer not null constraint study_restrictions_bool check (restricted in (0, 1)),
    actor      text not null constraint study_restrictions_actor_length check (length(actor) between 1 and 120),
    created_at text not null
) strict;

create index study_restrictions_by_study on study_restrictions (study_id, seq);

create view current_study_members as
select m.*, coalesce(m.user_id, m.token_id) as principal from study_members m
where not exists (select 1 from study_member_ends e where e.member_id = m.id);

create view restricted_studies as
select r.study_id from study_restrictions r
where r.restricted = 1
and not exists (select 1 from study_restrictions n where n.study_id = r.study_id and n.seq > r.seq);

create trigger study_members_once before insert on study_members
when exists (
    select 1 from current_study_members
    where study_id = new.study_id and principal = coalesce(new.user_id, new.token_id)
)
begin select raise(abort, 'a member of this study already'); end;

create trigger study_members_no_update before update on study_members
begin select raise(abort, 'study members are append-only'); end;
create trigger study_members_no_delete before delete on study_members
begin select raise(abort, 'study members are append-only'); end;
create trigger study_member_ends_no_update before update on study_member_ends
begin select raise(abort, 'ends of memberships are append-only'); end;
create trigger study_member_ends_no_delete before delete on study_member_ends
begin select raise(abort, 'ends of memberships are append-only'); end;
create trigger study_restrictions_no_update before update on study_restrictions
begin select raise(abort, 'study restrictions are append-only'); end;
create trigger study_restrictions_no_delete before delete on study_restrictions
begin select raise(abort, 'study restrictions are append-only'); end;
