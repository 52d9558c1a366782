-- Whoever answers a comparison is told who else has: found without reading all that a study has heard.

create index feedback_by_pair on feedback (trial_a, trial_b, author, source);
