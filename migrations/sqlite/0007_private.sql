-- Which scenes are not for everybody. A row may stand before its scene is published, so that nobody ever sees that scene.
-- A program that knows no such table serves these scenes to all: replace every node before the first one is made private.

CREATE TABLE private_scenes (
    scene       TEXT    NOT NULL PRIMARY KEY,
    -- What its links are signed with; this table is as secret as they are.
    link_key    TEXT    NOT NULL,
    since       TEXT    NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ', 'now'))
) STRICT;
