-- A preference asks for earlier suggestions and trials of its actions, while a study may have ten thousand trials.

create index feedback_suggestions on feedback (study_id, suggested) where kind = 'suggestion';
create index trials_by_action on trials (study_id, action_index);
