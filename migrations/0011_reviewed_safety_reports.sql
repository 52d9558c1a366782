-- The safety reports that each review decides about. A report is named by the identifier of the presentation, the row of
-- remarks, the lab session or the row of safety_reports that holds it. Their times do not tell which reports a reviewer has
-- seen: an imported one may be from a clock that was ahead.

create table safety_review_reports (
    review_id text not null references safety_reviews (id),
    report_id text not null,
    primary key (review_id, report_id)
) strict, without rowid;

insert or ignore into safety_review_reports (review_id, report_id)
select r.id, p.id
from safety_reviews r
join presentations p on r.trial_id in (p.shown_first, p.shown_second)
join presentation_answers a on a.presentation_id = p.id
where a.answer like 'unsafe%' and a.created_at <= r.said_until
union
select r.id, m.id
from safety_reviews r join remarks m on r.trial_id in (m.first, m.second)
where m.answer like 'unsafe%' and m.created_at <= r.said_until
union
select r.id, s.id
from safety_reviews r join safety_reports s on s.trial_id = r.trial_id
where s.created_at <= r.said_until
union
select r.id, l.id
from safety_reviews r
join lab_sessions l on r.trial_id in (l.gait_one, l.gait_two)
join lab_answers a on a.session_id = l.id
where a.answer like 'unsafe%' and a.created_at <= r.said_until;

create trigger safety_review_reports_no_update before update on safety_review_reports
begin select raise(abort, 'reviews are append-only'); end;
create trigger safety_review_reports_no_delete before delete on safety_review_reports
begin select raise(abort, 'reviews are append-only'); end;
