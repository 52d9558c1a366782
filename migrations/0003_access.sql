-- Who may do what: people with roles, one-time sign-in links, sessions, tokens of scripts.
--
-- No secret is stored: passwords as argon2id, everything random as SHA-256. Nobody is deleted, only disabled: the
-- audit trail keeps speaking of people who exist.

create table users (
    id          text primary key not null,
    name        text not null collate nocase
                constraint users_name_unique unique
                constraint users_name_length check (length(name) between 1 and 80),
    role        text not null constraint users_role check (role in ('admin', 'clinician', 'rater')),
    -- argon2id, in PHC form; null: this person signs in with one-time links alone.
    password    text,
    disabled_at text,
    created_at  text not null
) strict;

create table sign_in_links (
    hash       text primary key not null constraint sign_in_links_hash_length check (length(hash) = 64),
    user_id    text not null references users (id),
    created_at text not null,
    expires_at text not null,
    used_at    text
) strict;

create table sessions (
    hash       text primary key not null constraint sessions_hash_length check (length(hash) = 64),
    user_id    text not null references users (id),
    created_at text not null,
    -- When the person last did something; idle sessions end.
    seen_at    text not null,
    ended_at   text
) strict;

create index sessions_by_user on sessions (user_id);

create table tokens (
    id         text primary key not null,
    name       text not null
               constraint tokens_name_unique unique
               constraint tokens_name_length check (length(name) between 1 and 80),
    hash       text not null
               constraint tokens_hash_unique unique
               constraint tokens_hash_length check (length(hash) = 64),
    scopes     text not null constraint tokens_scopes_json check (json_valid(scopes)),
    created_by text not null,
    created_at text not null,
    expires_at text,
    revoked_at text
) strict;

create trigger users_no_delete before delete on users
begin select raise(abort, 'users are disabled, never deleted'); end;
create trigger tokens_no_delete before delete on tokens
begin select raise(abort, 'tokens are revoked, never deleted'); end;
