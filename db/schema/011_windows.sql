-- legopt database, schema version 11: motions that ended at a window without a solution of it.

-- 'window_unsolved' is a verdict of its own, by all rules at once. Results before version 11 have 'wrong_waypoint_count'.
-- (A word more in a CHECK is how SQLite wants it; nothing that is stored changes.)
PRAGMA writable_schema = ON;
UPDATE sqlite_schema
SET sql = replace(sql, '''wrong_waypoint_count''', '''wrong_waypoint_count'', ''window_unsolved''')
WHERE type = 'table' AND name = 'results';
PRAGMA writable_schema = RESET;

-- What the judge says of the best point of that window. NULL: no window is unsolved, or the window was not begun.
ALTER TABLE results ADD COLUMN window_verdict TEXT CHECK (window_verdict IS NULL OR
  (verdict_literal = 'window_unsolved' AND length(window_verdict) BETWEEN 1 AND 50
   AND window_verdict NOT GLOB '*[^a-z_]*'));

-- The best point of the window without a solution, as in the table waypoints, without time stamps. `waypoint` is the
-- number in the whole motion: the first ones may be among the waypoints of the window before, too. Apart from the table
-- waypoints, so that no query takes it for a part of a solution.
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
