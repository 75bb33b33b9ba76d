-- Uploaded scenes on their way to being published. The uploaded bytes lie in the data folder, `uploads/{job}/{scene}`.

CREATE TABLE jobs (
    -- Nothing else ever has this name, and nobody guesses it: whoever knows it may ask how the job is doing.
    job         TEXT    NOT NULL PRIMARY KEY,
    scene       TEXT    NOT NULL,
    title       TEXT,
    state       TEXT    NOT NULL CHECK (state IN ('queued', 'running', 'done', 'failed', 'cancelled')),
    source_bytes INTEGER NOT NULL CHECK (source_bytes >= 0),
    -- Whose upload it is, for quotas and for the record.
    key_id      TEXT    NOT NULL,
    -- How often a server has ended while it was baked.
    interrupted INTEGER NOT NULL DEFAULT 0,
    -- Of a job that failed: what to tell (JSON).
    error       TEXT,
    -- Of a job that is done: the bake's report (JSON).
    report      TEXT,
    created_at  TEXT    NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ', 'now')),
    started_at  TEXT,
    ended_at    TEXT
) STRICT;

CREATE INDEX jobs_by_state ON jobs (state);
