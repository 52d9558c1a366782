-- Who did what, when and why: one row per change, in the transaction of the change, chained by hashes.
-- And the answers to requests that may be repeated.

create table audit (
    seq        integer primary key autoincrement,
    at         text not null,
    actor      text not null constraint audit_actor_length check (length(actor) between 1 and 120),
    action     text not null constraint audit_action_length check (length(action) between 1 and 60),
    -- What was changed: `study 0190...`.
    object     text not null,
    detail     text not null constraint audit_detail_json check (json_valid(detail)),
    -- SHA-256 of the row before, and of this row with it.
    previous   text not null constraint audit_previous_length check (length(previous) = 64),
    hash       text not null constraint audit_hash_unique unique constraint audit_hash_length check (length(hash) = 64)
) strict;

create trigger audit_no_update before update on audit
begin select raise(abort, 'the audit trail is append-only'); end;
create trigger audit_no_delete before delete on audit
begin select raise(abort, 'the audit trail is append-only'); end;

create table idempotency_keys (
    actor      text not null,
    key        text not null constraint idempotency_key_length check (length(key) between 1 and 200),
    -- SHA-256 of method, path and body: the same key with another request is a mistake.
    request    text not null,
    status     integer not null,
    location   text,
    body       text not null,
    created_at text not null,
    constraint idempotency_keys_unique primary key (actor, key)
) strict, without rowid;
