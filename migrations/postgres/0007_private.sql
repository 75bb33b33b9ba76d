-- Which scenes are not for everybody. A row may stand before its scene is published, so that nobody ever sees that scene.
-- A program that knows no such table serves these scenes to all: replace every node before the first one is made private.

CREATE TABLE private_scenes (
    scene       TEXT COLLATE "C" NOT NULL PRIMARY KEY,
    -- What its links are signed with; this table is as secret as they are.
    link_key    TEXT NOT NULL,
    since       TEXT COLLATE "C" NOT NULL
        DEFAULT to_char(clock_timestamp() AT TIME ZONE 'UTC', 'YYYY-MM-DD"T"HH24:MI:SS.MS"Z"')
);
