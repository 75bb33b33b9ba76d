-- The catalogue: which scenes there are, which revisions each has had, and which blobs each revision needs.
-- Blobs themselves are in the store, named by their content; nothing here is needed to serve one.
--
-- The same tables as those of SQLite. Times are texts in UTC with milliseconds; names and times are compared byte by
-- byte, as SQLite and the program do, whatever the collation of the database.

-- One immutable bake of a scene. Publishing the same one again only makes it the newest.
CREATE TABLE revisions (
    scene       TEXT COLLATE "C" NOT NULL,
    revision    TEXT COLLATE "C" NOT NULL,
    -- The pointer document (JSON) that is served while this revision is current.
    pointer     TEXT NOT NULL,
    -- What it was baked from: a key over the settings, and the files read, as JSON [[name, sha256], …].
    source_key  TEXT NOT NULL,
    sources     TEXT NOT NULL,
    -- The bake's report (JSON), for `inspect`.
    report      TEXT NOT NULL,
    published_at TEXT COLLATE "C" NOT NULL
        DEFAULT to_char(clock_timestamp() AT TIME ZONE 'UTC', 'YYYY-MM-DD"T"HH24:MI:SS.MS"Z"'),
    PRIMARY KEY (scene, revision)
);

-- The one thing that changes: which revision of a scene is current. Moving it is the last step of publishing.
CREATE TABLE scenes (
    scene       TEXT COLLATE "C" NOT NULL PRIMARY KEY,
    revision    TEXT COLLATE "C" NOT NULL,
    FOREIGN KEY (scene, revision) REFERENCES revisions (scene, revision)
);

-- Which blobs a revision needs; a blob that no row names is garbage.
CREATE TABLE revision_blobs (
    scene       TEXT COLLATE "C" NOT NULL,
    revision    TEXT COLLATE "C" NOT NULL,
    -- `{hash}.{ext}`
    blob        TEXT COLLATE "C" NOT NULL,
    bytes       BIGINT NOT NULL CHECK (bytes >= 0),
    PRIMARY KEY (scene, revision, blob),
    FOREIGN KEY (scene, revision) REFERENCES revisions (scene, revision) ON DELETE CASCADE
);

CREATE INDEX revision_blobs_by_blob ON revision_blobs (blob);
