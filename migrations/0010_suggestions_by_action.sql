-- Every preference asks for earlier suggestions about its two actions, and a study may have tens of thousands of answers.

create index feedback_suggestions on feedback (study_id, suggested) where kind = 'suggestion';
