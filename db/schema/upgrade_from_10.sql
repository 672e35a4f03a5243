-- From schema version 10 to 11: the verdict 'window_unsolved', and the best point of an unsolved window. Older
-- results of such motions keep the verdict 'wrong_waypoint_count'.

-- Only the text of the CHECKs changes; stored rows stay as they are.
PRAGMA writable_schema = ON;
UPDATE sqlite_schema
SET sql = replace(sql, '''wrong_waypoint_count''', '''wrong_waypoint_count'', ''window_unsolved''')
WHERE type = 'table' AND name = 'results';
PRAGMA writable_schema = RESET;

ALTER TABLE results ADD COLUMN window_verdict TEXT CHECK (window_verdict IS NULL OR
  (verdict_literal = 'window_unsolved' AND length(window_verdict) BETWEEN 1 AND 50
   AND window_verdict NOT GLOB '*[^a-z_]*'));

CREATE TABLE unsolved_waypoints (
  job_id INTEGER NOT NULL REFERENCES results,
  waypoint INTEGER NOT NULL CHECK (waypoint >= 0),
  x BLOB NOT NULL CHECK (length(x) > 0 AND length(x) % 8 = 0),
  PRIMARY KEY (job_id, waypoint)
) STRICT, WITHOUT ROWID;

CREATE TRIGGER unsolved_waypoints_stay BEFORE DELETE ON unsolved_waypoints
WHEN EXISTS (SELECT 1 FROM results AS r JOIN cells USING (cell_id) JOIN experiments USING (experiment_id)
             WHERE r.job_id = OLD.job_id)
BEGIN
  SELECT RAISE(ABORT, 'the waypoints of an accepted result cannot be deleted');
END;
