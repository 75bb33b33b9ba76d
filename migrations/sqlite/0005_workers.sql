-- Who bakes a job, so that servers of several data folders can share a catalogue.

-- The server that bakes it, while it is running.
ALTER TABLE jobs ADD COLUMN worker TEXT;
-- Until when that server has said that it is at work; a job whose time has run out waits again.
ALTER TABLE jobs ADD COLUMN lease_until TEXT;
-- Whether somebody has asked for its end.
ALTER TABLE jobs ADD COLUMN cancelling INTEGER NOT NULL DEFAULT 0 CHECK (cancelling IN (0, 1));

-- One bake of a scene at a time, whoever is at work.
CREATE UNIQUE INDEX jobs_one_bake_of_a_scene ON jobs (scene) WHERE state = 'running';
