-- The catalogue: which scenes there are, which revisions each has had, and which blobs each revision needs.
-- Blobs themselves are files in the store, named by their content; nothing here is needed to serve one.

-- One immutable bake of a scene. Publishing the same one again only makes it the newest.
CREATE TABLE revisions (
    scene       TEXT    NOT NULL,
    revision    TEXT    NOT NULL,
    -- The pointer document (JSON) that is served while this revision is current.
    pointer     TEXT    NOT NULL,
    -- What it was baked from: a key over the settings, and the files read, as JSON [[name, sha256], …]. A bake whose
    -- key and files are the same would give the same revision, so it is not run again.
    source_key  TEXT    NOT NULL,
    sources     TEXT    NOT NULL,
    -- The bake's report (JSON), for `inspect`.
    report      TEXT    NOT NULL,
    published_at TEXT   NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ', 'now')),
    PRIMARY KEY (scene, revision)
) STRICT;

-- The one thing that changes: which revision of a scene is current. Moving it is the last step of publishing.
CREATE TABLE scenes (
    scene       TEXT    NOT NULL PRIMARY KEY,
    revision    TEXT    NOT NULL,
    FOREIGN KEY (scene, revision) REFERENCES revisions (scene, revision)
) STRICT;

-- Which blobs a revision needs; a blob that no row names is garbage.
CREATE TABLE revision_blobs (
    scene       TEXT    NOT NULL,
    revision    TEXT    NOT NULL,
    -- `{hash}.{ext}`
    blob        TEXT    NOT NULL,
    bytes       INTEGER NOT NULL CHECK (bytes >= 0),
    PRIMARY KEY (scene, revision, blob),
    FOREIGN KEY (scene, revision) REFERENCES revisions (scene, revision) ON DELETE CASCADE
) STRICT, WITHOUT ROWID;

CREATE INDEX revision_blobs_by_blob ON revision_blobs (blob);
