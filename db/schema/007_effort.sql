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

-- How the solve converged, compressed (docs/reference/database.md, "Traces"). Results before version 7 have
-- history_json instead.
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

-- The judge's third verdict, by the solid rule, with its figures. Results before version 7 have none.
ALTER TABLE results ADD COLUMN verdict_solid TEXT CHECK (verdict_solid IN ('success', 'wrong_waypoint_count',
  'wrong_size', 'not_finite', 'foot_pose', 'com', 'joint_limit', 'environment_collision', 'self_collision',
  'containment', 'step') AND (verdict_solid <> 'success' OR verdict_strict = 'success'));
ALTER TABLE results ADD COLUMN solid_depth_m REAL CHECK (solid_depth_m >= 0);
ALTER TABLE results ADD COLUMN longest_step_m REAL CHECK (longest_step_m >= 0);
CREATE INDEX solid_results_by_cell ON results (cell_id, cost, time_s) WHERE verdict_solid = 'success';

CREATE VIEW solid_scores AS
SELECT c.cell_id, c.experiment_id, c.method_id, c.task, c.initialization, c.num_jobs AS n,
  (SELECT count(*) FROM results AS r WHERE r.cell_id = c.cell_id AND r.verdict_solid = 'success') AS solved,
  (SELECT avg(r.cost) FROM results AS r WHERE r.cell_id = c.cell_id AND r.verdict_solid = 'success') AS cost,
  (SELECT avg(r.time_s) FROM results AS r WHERE r.cell_id = c.cell_id AND r.verdict_solid = 'success') AS time_s
FROM cells AS c;

DROP VIEW benchmark_cells;
DROP VIEW interpolation_cells;
DROP VIEW job_list;

-- As in version 3, with the solid rule.
CREATE VIEW benchmark_cells AS
SELECT s.experiment_id, e.name AS experiment, s.method_id, m.name AS method, m.multi_starts, m.sample_size,
  m.incremental, m.collision, s.task, s.initialization, 'literal' AS rule, s.n,
  s.n - (SELECT count(*) FROM jobs AS j WHERE j.cell_id = s.cell_id AND j.state IN ('queued', 'leased')) AS finished,
  s.solved, s.cost, s.time_s
FROM literal_scores AS s JOIN experiments AS e USING (experiment_id) JOIN methods AS m USING (method_id)
UNION ALL
SELECT s.experiment_id, e.name AS experiment, s.method_id, m.name AS method, m.multi_starts, m.sample_size,
  m.incremental, m.collision, s.task, s.initialization, 'strict' AS rule, s.n,
  s.n - (SELECT count(*) FROM jobs AS j WHERE j.cell_id = s.cell_id AND j.state IN ('queued', 'leased')) AS finished,
  s.solved, s.cost, s.time_s
FROM strict_scores AS s JOIN experiments AS e USING (experiment_id) JOIN methods AS m USING (method_id)
UNION ALL
SELECT s.experiment_id, e.name AS experiment, s.method_id, m.name AS method, m.multi_starts, m.sample_size,
  m.incremental, m.collision, s.task, s.initialization, 'solid' AS rule, s.n,
  s.n - (SELECT count(*) FROM jobs AS j WHERE j.cell_id = s.cell_id AND j.state IN ('queued', 'leased')) AS finished,
  s.solved, s.cost, s.time_s
FROM solid_scores AS s JOIN experiments AS e USING (experiment_id) JOIN methods AS m USING (method_id);

CREATE VIEW interpolation_cells AS
SELECT c.experiment_id, c.method_id, m.name AS method, m.multi_starts, m.sample_size, m.incremental, m.collision,
  c.initialization, u.rule, c.num_jobs AS n, count(r.job_id) AS solved, count(r.interpolation_free_share) AS scored,
  count(*) FILTER (WHERE r.interpolation_free_share = 1) AS free, avg(r.interpolation_free_share) AS free_share,
  max(r.interpolation_environment_depth_m) AS environment_depth_m, max(r.interpolation_self_depth_m) AS self_depth_m
FROM cells AS c
JOIN methods AS m USING (method_id)
JOIN (SELECT 'literal' AS rule UNION ALL SELECT 'strict' UNION ALL SELECT 'solid') AS u
LEFT JOIN results AS r ON r.cell_id = c.cell_id
  AND CASE u.rule WHEN 'literal' THEN r.verdict_literal WHEN 'strict' THEN r.verdict_strict ELSE r.verdict_solid END
    = 'success'
WHERE c.task = 'motion'
GROUP BY c.cell_id, u.rule;

-- As in version 6, with the verdict by the solid rule and its figures.
CREATE VIEW job_list AS
SELECT j.job_id, c.experiment_id, m.name AS method, m.multi_starts, m.sample_size, m.incremental, m.collision, c.task,
  c.initialization, p.problem_id, j.repetition, j.state, j.attempts, r.solver_status, r.verdict_literal,
  r.verdict_strict, r.verdict_solid, r.windows_solved, r.windows, r.cost, r.time_s, r.wall_us, r.cpu_us,
  r.iterations, r.restarts, r.starts, r.term_evaluations, r.collision_queries, r.solid_depth_m, r.longest_step_m,
  r.interpolation_environment_depth_m, r.interpolation_self_depth_m, r.interpolation_free_share, w.name AS worker,
  w.hostname, w.processor, w.build_id
FROM jobs AS j
JOIN cells AS c USING (cell_id)
JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key)
LEFT JOIN results AS r ON r.job_id = j.job_id
LEFT JOIN attempts AS a ON a.job_id = j.job_id AND a.attempt = j.attempts
LEFT JOIN workers AS w ON w.worker_id = a.worker_id;
