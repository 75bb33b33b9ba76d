-- Uploaded scenes on their way to being published. The uploaded bytes lie in the store, `uploads/{job}/{scene}`.

CREATE TABLE jobs (
    -- Nothing else ever has this name, and nobody guesses it: whoever knows it may ask how the job is doing.
    job         TEXT COLLATE "C" NOT NULL PRIMARY KEY,
    scene       TEXT COLLATE "C" NOT NULL,
    title       TEXT,
    state       TEXT COLLATE "C" NOT NULL CHECK (state IN ('queued', 'running', 'done', 'failed', 'cancelled')),
    source_bytes BIGINT NOT NULL CHECK (source_bytes >= 0),
    -- Whose upload it is, for quotas and for the record.
    key_id      TEXT COLLATE "C" NOT NULL,
    -- How often a server has ended while it was baked.
    interrupted BIGINT NOT NULL DEFAULT 0,
    -- Of a job that failed: what to tell (JSON).
    error       TEXT,
    -- Of a job that is done: the bake's report (JSON).
    report      TEXT,
    created_at  TEXT COLLATE "C" NOT NULL
        DEFAULT to_char(clock_timestamp() AT TIME ZONE 'UTC', 'YYYY-MM-DD"T"HH24:MI:SS.MS"Z"'),
    started_at  TEXT COLLATE "C",
    ended_at    TEXT COLLATE "C"
);

CREATE INDEX jobs_by_state ON jobs (state);
