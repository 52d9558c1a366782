-- A rater who was allowed to read before is not blind: each answer of a rater asks for the roles that the rater had.

create index audit_role_changes on audit (object) where action = 'user.role';
