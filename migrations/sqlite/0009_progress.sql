-- How far a bake is, as its worker has said last (JSON), so that other servers of the catalogue can tell it.
ALTER TABLE jobs ADD COLUMN progress TEXT;
