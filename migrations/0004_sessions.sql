-- Sessions that can be listed and ended one by one, tokens that know their maker, failed sign-ins that a restart does not
-- forget, and the latest instant that the service has seen.

-- A session is named by its identifier; its hash stays with the browser's secret.
alter table sessions add column id text;
-- Where it was begun: address of the client, and what its browser says of itself.
alter table sessions add column address text;
alter table sessions add column browser text;
-- Hash of a cookie that stays in the browser when the session ends: others in the same network, who guess passwords, do
-- not make this browser wait.
alter table sessions add column browser_hash text;

update sessions set id = lower(
    hex(randomblob(4)) || '-' || hex(randomblob(2)) || '-7' || substr(hex(randomblob(2)), 2) || '-8'
    || substr(hex(randomblob(2)), 2) || '-' || hex(randomblob(6))
);

create unique index sessions_by_id on sessions (id);
create index sessions_by_browser on sessions (browser_hash) where browser_hash is not null;

-- The user who made the token; null: the program, or a version that did not keep it.
alter table tokens add column maker text references users (id);

-- Failed sign-ins by name and source: the network of the client, or a browser in which this user has signed in before.
create table sign_in_failures (
    name        text not null,
    source      text not null,
    -- Passwords that were compared and wrong, or whose sender went away before that.
    failures    integer not null,
    last_at     text not null,
    -- Until then no password of this name is compared for this source.
    waits_until text not null,
    primary key (name, source)
) strict, without rowid;

create index sign_in_failures_by_age on sign_in_failures (last_at);

-- All failed sign-ins of a network, whatever the name.
create table sign_in_sources (
    network  text primary key not null,
    -- With those that were refused without a look at the password.
    attempts integer not null,
    -- Different names.
    names    integer not null,
    first_at text not null,
    last_at  text not null
) strict, without rowid;

create index sign_in_sources_by_age on sign_in_sources (last_at);

-- The latest instant that access was decided at. What has ended by then stays ended when the machine's clock is set back.
create table clock (
    id     integer primary key not null constraint clock_one_row check (id = 1),
    latest text not null
) strict;
