-- legopt database, schema version 7: solves that end by their effort, not by the clock, and how they converged.

-- 'effort_limit': the job's term evaluations ran out, a result of the method like any other. (A word more in a CHECK is
-- how SQLite wants it; nothing that is stored changes.)
PRAGMA writable_schema = ON;
UPDATE sqlite_schema
SET sql = replace(sql, '''iteration_limit'', ''time_limit''', '''iteration_limit'', ''effort_limit'', ''time_limit''')
WHERE type = 'table' AND name = 'results';
PRAGMA writable_schema = RESET;

-- Term evaluations that a job of the cell may use. NULL: as many as it likes, as in every experiment before version 7.
ALTER TABLE cells ADD COLUMN effort_limit INTEGER CHECK (effort_limit > 0);

-- How the solve converged, compressed (docs/database.md, "Traces"). Results before version 7 have history_json instead.
ALTER TABLE results ADD COLUMN trace BLOB CHECK (length(trace) > 0);

-- Jobs that the clock ended, so that they say nothing about their method: dead ones whose last attempt it stopped, and
-- results that it cut short, which only servers before version 7 have taken.
CREATE INDEX dead_jobs_by_cell ON jobs (cell_id) WHERE state = 'dead';
CREATE INDEX time_limited_results_by_cell ON results (cell_id) WHERE solver_status = 'time_limit';
CREATE VIEW clock_stopped AS
SELECT c.experiment_id, c.cell_id, j.job_id
FROM jobs AS j
JOIN cells AS c ON c.cell_id = j.cell_id
JOIN attempts AS a ON a.job_id = j.job_id AND a.attempt = j.attempts
WHERE j.state = 'dead' AND a.outcome = 'time_limit'
UNION ALL
SELECT c.experiment_id, c.cell_id, r.job_id
FROM results AS r JOIN cells AS c ON c.cell_id = r.cell_id
WHERE r.solver_status = 'time_limit';
