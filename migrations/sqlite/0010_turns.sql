-- How many jobs of a key have ended lately: whoever has had few comes first.
CREATE INDEX jobs_by_key ON jobs (key_id, ended_at);
