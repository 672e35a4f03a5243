-- legopt database, schema version 5: who submitted what, tags, joint names, solves that the clock stopped tried again,
-- experiments deleted, and views that tell rows of one name apart.

ALTER TABLE experiments ADD COLUMN submitter TEXT NOT NULL DEFAULT '' CHECK (length(submitter) <= 200);

CREATE TABLE experiment_tags (
  experiment_id INTEGER NOT NULL REFERENCES experiments,
  tag TEXT NOT NULL CHECK (length(tag) BETWEEN 1 AND 100 AND tag NOT GLOB '*,*'),  -- lists are separated by commas
  PRIMARY KEY (experiment_id, tag)
) STRICT, WITHOUT ROWID;

-- JSON array of the robot's joints in the order in which a solution holds them. NULL: nobody told.
ALTER TABLE datasets ADD COLUMN joint_names TEXT CHECK (joint_names LIKE '["%"]');

-- The largest identifiers that deleted experiments had: they are never given again.
CREATE TABLE deleted_ids (
  kind TEXT PRIMARY KEY CHECK (kind IN ('experiment', 'job', 'cell')),
  largest INTEGER NOT NULL CHECK (largest > 0)
) STRICT, WITHOUT ROWID;

CREATE INDEX events_by_job ON events (job_id) WHERE job_id IS NOT NULL;

-- A terminal job stays as it is, but for one that is tried again: it died or failed, or its result has gone, which
-- results_stay allows for one reason only. None of its attempts so far is charged then.
DROP TRIGGER jobs_terminal_is_final;
CREATE TRIGGER jobs_terminal_is_final BEFORE UPDATE OF state, attempts, returned ON jobs
WHEN OLD.state = 'cancelled' OR (OLD.state IN ('done', 'failed', 'dead')
  AND NOT (NEW.state = 'queued' AND NEW.attempts = OLD.attempts AND NEW.returned = OLD.attempts
    AND NOT EXISTS (SELECT 1 FROM results WHERE job_id = OLD.job_id)))
BEGIN
  SELECT RAISE(ABORT, 'a terminal job cannot change');
END;

-- An accepted result stays, unless the clock stopped its solve and it is kept among the stale ones, or its experiment
-- has been deleted. What belongs to an experiment goes after it, never before.
CREATE TRIGGER results_stay BEFORE DELETE ON results
WHEN EXISTS (SELECT 1 FROM cells JOIN experiments USING (experiment_id) WHERE cells.cell_id = OLD.cell_id)
  AND NOT (OLD.solver_status = 'time_limit' AND EXISTS (
    SELECT 1 FROM stale_results AS s
    WHERE s.job_id = OLD.job_id AND s.attempt = OLD.attempt AND s.solver_status = 'time_limit'))
BEGIN
  SELECT RAISE(ABORT, 'an accepted result cannot be deleted');
END;

CREATE TRIGGER waypoints_stay BEFORE DELETE ON waypoints
WHEN EXISTS (SELECT 1 FROM results AS r JOIN cells USING (cell_id) JOIN experiments USING (experiment_id)
             WHERE r.job_id = OLD.job_id)
BEGIN
  SELECT RAISE(ABORT, 'the solution of an accepted result cannot be deleted');
END;

CREATE TRIGGER stale_results_stay BEFORE DELETE ON stale_results
WHEN EXISTS (SELECT 1 FROM jobs JOIN cells USING (cell_id) JOIN experiments USING (experiment_id)
             WHERE jobs.job_id = OLD.job_id)
BEGIN
  SELECT RAISE(ABORT, 'a stale result cannot be deleted');
END;

CREATE TRIGGER attempts_stay BEFORE DELETE ON attempts
WHEN EXISTS (SELECT 1 FROM jobs JOIN cells USING (cell_id) JOIN experiments USING (experiment_id)
             WHERE jobs.job_id = OLD.job_id)
BEGIN
  SELECT RAISE(ABORT, 'an attempt cannot be deleted');
END;

CREATE TRIGGER jobs_stay BEFORE DELETE ON jobs
WHEN EXISTS (SELECT 1 FROM cells JOIN experiments USING (experiment_id) WHERE cells.cell_id = OLD.cell_id)
BEGIN
  SELECT RAISE(ABORT, 'a job cannot be deleted');
END;

CREATE TRIGGER experiments_are_closed_first BEFORE DELETE ON experiments
WHEN OLD.state = 'active'
BEGIN
  SELECT RAISE(ABORT, 'an active experiment cannot be deleted');
END;

DROP VIEW benchmark_table;
DROP VIEW job_list;
DROP VIEW failures;
DROP VIEW disagreements;
DROP VIEW experiment_list;

-- As in version 3, with `incremental`.
CREATE VIEW benchmark_table AS
SELECT g.experiment_id, m.name AS method, m.multi_starts, m.sample_size, m.incremental, m.collision,
  pg.n AS posture_good_n, pg.solved AS posture_good_solved,
  pg.cost AS posture_good_cost, pg.time_s AS posture_good_time_s,
  pc.n AS posture_in_collision_n, pc.solved AS posture_in_collision_solved,
  pc.cost AS posture_in_collision_cost, pc.time_s AS posture_in_collision_time_s,
  mg.n AS motion_good_n, mg.solved AS motion_good_solved,
  mg.cost AS motion_good_cost, mg.time_s AS motion_good_time_s,
  mc.n AS motion_in_collision_n, mc.solved AS motion_in_collision_solved,
  mc.cost AS motion_in_collision_cost, mc.time_s AS motion_in_collision_time_s
FROM (SELECT experiment_id, method_id, min(cell_id) AS first_cell FROM cells GROUP BY experiment_id, method_id) AS g
JOIN methods AS m USING (method_id)
LEFT JOIN literal_scores AS pg ON pg.experiment_id = g.experiment_id AND pg.method_id = g.method_id
  AND pg.task = 'posture' AND pg.initialization = 'good'
LEFT JOIN literal_scores AS pc ON pc.experiment_id = g.experiment_id AND pc.method_id = g.method_id
  AND pc.task = 'posture' AND pc.initialization = 'in_collision'
LEFT JOIN literal_scores AS mg ON mg.experiment_id = g.experiment_id AND mg.method_id = g.method_id
  AND mg.task = 'motion' AND mg.initialization = 'good'
LEFT JOIN literal_scores AS mc ON mc.experiment_id = g.experiment_id AND mc.method_id = g.method_id
  AND mc.task = 'motion' AND mc.initialization = 'in_collision'
ORDER BY g.experiment_id, g.first_cell;

-- As in version 3, with all that tells methods of one name apart.
CREATE VIEW job_list AS
SELECT j.job_id, c.experiment_id, m.name AS method, m.multi_starts, m.sample_size, m.incremental, m.collision, c.task,
  c.initialization, p.problem_id, j.repetition, j.state, j.attempts, r.solver_status, r.verdict_literal,
  r.verdict_strict, r.windows_solved, r.windows, r.cost, r.time_s, r.wall_us, r.cpu_us,
  r.interpolation_environment_depth_m, r.interpolation_self_depth_m, r.interpolation_free_share, w.name AS worker
FROM jobs AS j
JOIN cells AS c USING (cell_id)
JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key)
LEFT JOIN results AS r ON r.job_id = j.job_id
LEFT JOIN attempts AS a ON a.job_id = j.job_id AND a.attempt = j.attempts
LEFT JOIN workers AS w ON w.worker_id = a.worker_id;

CREATE VIEW failures AS
SELECT c.experiment_id, j.job_id, m.name AS method, m.multi_starts, m.sample_size, m.incremental, m.collision, c.task,
  c.initialization, p.problem_id, j.repetition, j.state, r.solver_status, r.verdict_literal, r.verdict_strict,
  r.verdict_detail AS detail, a.message
FROM jobs AS j
JOIN cells AS c USING (cell_id)
JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key)
LEFT JOIN results AS r ON r.job_id = j.job_id
LEFT JOIN attempts AS a ON a.job_id = j.job_id AND a.attempt = j.attempts
WHERE j.state IN ('failed', 'dead') OR r.verdict_literal <> 'success';

CREATE VIEW disagreements AS
SELECT c.experiment_id, j.job_id, m.name AS method, m.multi_starts, m.sample_size, m.incremental, m.collision, c.task,
  c.initialization, p.problem_id, j.repetition, r.solver_status, r.verdict_literal, r.verdict_strict,
  r.verdict_detail AS detail, r.solver_violation
FROM results AS r
JOIN jobs AS j ON j.job_id = r.job_id
JOIN cells AS c ON c.cell_id = j.cell_id
JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key)
WHERE (r.solver_status = 'converged_feasible') <> (r.verdict_literal = 'success')
   OR (r.verdict_literal = 'success') <> (r.verdict_strict = 'success');

-- As in version 4, with submitter, tags (in alphabetical order, separated by commas), seed and repetitions.
CREATE VIEW experiment_list AS
SELECT e.experiment_id, e.name, e.submitter,
  coalesce((SELECT group_concat(t.tag, ',') FROM (SELECT tag FROM experiment_tags
    WHERE experiment_tags.experiment_id = e.experiment_id ORDER BY tag) AS t), '') AS tags,
  e.state, e.hold, e.hold_reason, e.priority, e.num_jobs AS jobs,
  count(*) FILTER (WHERE j.state = 'queued') AS queued, count(*) FILTER (WHERE j.state = 'leased') AS leased,
  count(*) FILTER (WHERE j.state = 'done') AS done, count(*) FILTER (WHERE j.state = 'failed') AS failed,
  count(*) FILTER (WHERE j.state = 'dead') AS dead, count(*) FILTER (WHERE j.state = 'cancelled') AS cancelled,
  (SELECT count(*) FROM results AS r JOIN cells AS k USING (cell_id)
   WHERE k.experiment_id = e.experiment_id AND r.solved_literal = 1) AS solved,
  d.name AS dataset, e.seed, e.repetitions, e.submitted_at_us, e.finished_at_us
FROM experiments AS e
JOIN datasets AS d USING (dataset_id)
JOIN cells AS c USING (experiment_id)
JOIN jobs AS j USING (cell_id)
GROUP BY e.experiment_id;
