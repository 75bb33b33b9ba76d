-- Which sessions there are and which server holds each, so that another one goes on with them when that one is gone.

-- Runs of servers that hold sessions or held some: a server that is started again is another home.
CREATE TABLE session_homes (
    home        TEXT    NOT NULL PRIMARY KEY,
    -- Rises while the server runs; what stands still is gone.
    beats       INTEGER NOT NULL DEFAULT 0,
    -- The server has said that it ends.
    ended       INTEGER NOT NULL DEFAULT 0 CHECK (ended IN (0, 1)),
    -- How many sessions others have taken from it.
    robbed      INTEGER NOT NULL DEFAULT 0
) STRICT;

CREATE TABLE sessions (
    -- The number of its name; its token is the signature of that.
    session     INTEGER NOT NULL PRIMARY KEY,
    scene       TEXT    NOT NULL,
    home        TEXT    NOT NULL REFERENCES session_homes (home) ON DELETE CASCADE,
    -- How often it has got another home.
    taken       INTEGER NOT NULL DEFAULT 0,
    -- What it was opened with (JSON).
    visitor     TEXT    NOT NULL,
    -- Whether it hears of objects that do not move.
    statics     INTEGER NOT NULL CHECK (statics IN (0, 1)),
    -- Where it stood last, and how far it looked (JSON), if that was kept since.
    stand       TEXT
) STRICT;

CREATE INDEX sessions_by_home ON sessions (home);

-- What tokens of sessions are signed with, by all servers alike; this table is as secret as they are.
CREATE TABLE session_key (
    one         INTEGER NOT NULL PRIMARY KEY CHECK (one = 1),
    secret      TEXT    NOT NULL
) STRICT;
