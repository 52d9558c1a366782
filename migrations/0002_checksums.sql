-- One hash for each row of a table that changes or is pruned with the work: events, jobs, sessions, sign-in links, kept
-- answers, and the list of migrations. Rows that stay for ever are sealed instead. `gaitwright audit verify` compares the
-- rows with both.
create table checksums (
    -- The table of the row, and its primary key.
    evidence text not null,
    key      text not null,
    sha256   text not null constraint checksums_sha256_length check (length(sha256) = 64),
    primary key (evidence, key)
) strict, without rowid;
