-- Ids of movers, which several servers of one catalogue draw in blocks, so that none is ever used twice.

CREATE TABLE mover_ids (
    -- The first that nobody has drawn.
    next        BIGINT NOT NULL
);

INSERT INTO mover_ids (next)
SELECT COALESCE(MAX(object) + 1, 100000000) FROM kept_movers;
