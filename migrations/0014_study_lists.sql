-- Tags, notes and archived studies: how people find a study again. They are no part of its plan. Null where there are none,
-- because the seals of older rows do not cover them.

alter table studies add column tags text
    constraint studies_tags check (json_valid(tags) and length(tags) <= 1000);
alter table studies add column notes text
    constraint studies_notes_length check (length(notes) between 1 and 4000);
alter table studies add column archived_at text;
