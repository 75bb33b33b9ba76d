-- Who may change what is published. The secrets themselves are nowhere: a key is shown once, when it is made.

CREATE TABLE api_keys (
    -- The public part of a key: it names the row, and may stand in logs.
    id          TEXT COLLATE "C" NOT NULL PRIMARY KEY,
    -- SHA-256 of the secret part, in hex. A secret has 256 random bits, so a slow hash would add nothing.
    digest      TEXT NOT NULL,
    -- What people call it.
    name        TEXT NOT NULL,
    -- What it may do, as a JSON list.
    scopes      TEXT NOT NULL,
    -- In which scenes, as a JSON list; NULL stands for all of them.
    scenes      TEXT,
    created_at  TEXT COLLATE "C" NOT NULL
        DEFAULT to_char(clock_timestamp() AT TIME ZONE 'UTC', 'YYYY-MM-DD"T"HH24:MI:SS.MS"Z"'),
    -- NULL: it does not expire.
    expires_at  TEXT COLLATE "C",
    -- NULL: it is not revoked. A revoked key stays listed, so that its id in a log can still be explained.
    revoked_at  TEXT COLLATE "C"
);
