-- Which sessions there are and which server holds each, so that another one goes on with them when that one is gone.

-- Runs of servers that hold sessions or held some: a server that is started again is another home.
CREATE TABLE session_homes (
    home        TEXT COLLATE "C" NOT NULL PRIMARY KEY,
    -- Rises while the server runs; what stands still is gone.
    beats       BIGINT NOT NULL DEFAULT 0,
    -- The server has said that it ends.
    ended       BIGINT NOT NULL DEFAULT 0 CHECK (ended IN (0, 1)),
    -- How many sessions others have taken from it.
    robbed      BIGINT NOT NULL DEFAULT 0
);

CREATE TABLE sessions (
    -- The number of its name; its token is the signature of that.
    session     BIGINT NOT NULL PRIMARY KEY,
    scene       TEXT COLLATE "C" NOT NULL,
    home        TEXT COLLATE "C" NOT NULL REFERENCES session_homes (home) ON DELETE CASCADE,
    -- How often it has got another home.
    taken       BIGINT NOT NULL DEFAULT 0,
    -- What it was opened with (JSON).
    visitor     TEXT NOT NULL,
    -- Whether it hears of objects that do not move.
    statics     BIGINT NOT NULL CHECK (statics IN (0, 1)),
    -- Where it stood last, and how far it looked (JSON), if that was kept since.
    stand       TEXT
);

CREATE INDEX sessions_by_home ON sessions (home);

-- What tokens of sessions are signed with, by all servers alike; this table is as secret as they are.
CREATE TABLE session_key (
    one         BIGINT NOT NULL PRIMARY KEY CHECK (one = 1),
    secret      TEXT NOT NULL
);
