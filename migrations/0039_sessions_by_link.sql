-- How a session was begun: who has just come in by a one-time link may set a password without the present one.
-- Of sessions that are there already it is not known; they count as begun with a password.

alter table sessions add column by_link integer not null default 0 constraint sessions_by_link check (by_link in (0, 1));
