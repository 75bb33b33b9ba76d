-- What of live sessions outlives the server.

-- Movers that were created to stay, by the id that nothing else ever gets.
CREATE TABLE kept_movers (
    object      BIGINT NOT NULL PRIMARY KEY,
    scene       TEXT COLLATE "C" NOT NULL,
    -- Who shows this may speak for it; this table is as secret as they are.
    token       TEXT NOT NULL,
    -- What it is (JSON), with the pose that it was created with.
    mover       TEXT NOT NULL,
    -- The last pose that was kept (JSON), if there was one since.
    pose        TEXT
);

CREATE INDEX kept_movers_by_scene ON kept_movers (scene);

-- How doors stand that were ever moved. Their ids are those of a revision.
CREATE TABLE kept_doors (
    scene       TEXT COLLATE "C" NOT NULL,
    revision    TEXT COLLATE "C" NOT NULL,
    object      BIGINT NOT NULL,
    -- The box around it (JSON).
    bounds      TEXT NOT NULL,
    open        BIGINT NOT NULL CHECK (open IN (0, 1)),
    PRIMARY KEY (scene, object)
);
