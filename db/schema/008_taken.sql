-- legopt database, schema version 8: jobs that take the finished result of an equal job over instead of being solved.

-- The job whose solve made this job's result, of another experiment; it may have been deleted since. NULL: this one.
ALTER TABLE jobs ADD COLUMN taken_from INTEGER
  CHECK (taken_from IS NULL OR (taken_from > 0 AND taken_from <> job_id AND state IN ('leased', 'done')));
CREATE INDEX taken_jobs_by_cell ON jobs (cell_id) WHERE taken_from IS NOT NULL;

-- Said once, with the result: what was computed stays computed.
CREATE TRIGGER jobs_are_taken_when_queued BEFORE UPDATE OF taken_from ON jobs
WHEN OLD.taken_from IS NOT NULL OR OLD.state <> 'queued' OR OLD.attempts > 0
BEGIN
  SELECT RAISE(ABORT, 'only a job that was never leased can take a result over');
END;

-- Results that an equal job may take over, with all that decides them: dataset, method, task, start, problem,
-- repetition, seed, limit of effort and build. A job whose limits of time and memory they kept would have ended alike.
-- Not what the clock ended, nor what came of a build without a name or before the third verdict. (UNIQUE (hash, name)
-- of methods is the index by which this is searched.)
CREATE VIEW reusable_results AS
SELECT c.experiment_id, j.job_id, coalesce(j.taken_from, j.job_id) AS solved_as, d.hash AS dataset_hash,
  m.hash AS method_hash, c.task, c.initialization, p.problem_id, j.repetition, e.seed, c.effort_limit, w.build_id,
  r.wall_us, r.peak_memory_bytes, r.solved_literal
FROM methods AS m
JOIN cells AS c ON c.method_id = m.method_id
JOIN experiments AS e ON e.experiment_id = c.experiment_id
JOIN datasets AS d ON d.dataset_id = e.dataset_id
JOIN problems AS p ON p.dataset_id = d.dataset_id AND p.task = c.task
JOIN jobs AS j ON j.cell_id = c.cell_id AND j.problem_key = p.problem_key
JOIN results AS r ON r.job_id = j.job_id
JOIN attempts AS a ON a.job_id = r.job_id AND a.attempt = r.attempt
JOIN workers AS w ON w.worker_id = a.worker_id
WHERE j.state = 'done' AND r.solver_status NOT IN ('not_run', 'time_limit', 'cancelled')
  AND r.verdict_solid IS NOT NULL AND w.build_id IS NOT NULL;

DROP VIEW disagreements;
DROP VIEW job_list;
DROP VIEW experiment_list;

-- As in version 5, with the solid rule beside the strict one.
CREATE VIEW disagreements AS
SELECT c.experiment_id, j.job_id, m.name AS method, m.multi_starts, m.sample_size, m.incremental, m.collision, c.task,
  c.initialization, p.problem_id, j.repetition, r.solver_status, r.verdict_literal, r.verdict_strict, r.verdict_solid,
  r.verdict_detail AS detail, r.solver_violation
FROM results AS r
JOIN jobs AS j ON j.job_id = r.job_id
JOIN cells AS c ON c.cell_id = j.cell_id
JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key)
WHERE (r.solver_status = 'converged_feasible') <> (r.verdict_literal = 'success')
   OR (r.verdict_literal = 'success') <> (r.verdict_strict = 'success')
   OR (r.verdict_strict = 'success') <> (r.verdict_solid = 'success');

-- As in version 7, with taken_from.
CREATE VIEW job_list AS
SELECT j.job_id, c.experiment_id, m.name AS method, m.multi_starts, m.sample_size, m.incremental, m.collision, c.task,
  c.initialization, p.problem_id, j.repetition, j.state, j.attempts, j.taken_from, r.solver_status, r.verdict_literal,
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

-- As in version 6, with the number of results taken over.
CREATE VIEW experiment_list AS
SELECT e.experiment_id, e.name, e.submitter,
  coalesce((SELECT group_concat(t.tag, ',') FROM (SELECT tag FROM experiment_tags
    WHERE experiment_tags.experiment_id = e.experiment_id ORDER BY tag) AS t), '') AS tags,
  e.state, e.hold, e.hold_reason, e.priority, e.builds, e.build_id, e.num_jobs AS jobs,
  count(*) FILTER (WHERE j.state = 'queued') AS queued, count(*) FILTER (WHERE j.state = 'leased') AS leased,
  count(*) FILTER (WHERE j.state = 'done') AS done, count(*) FILTER (WHERE j.state = 'failed') AS failed,
  count(*) FILTER (WHERE j.state = 'dead') AS dead, count(*) FILTER (WHERE j.state = 'cancelled') AS cancelled,
  count(j.taken_from) AS taken_over,
  (SELECT count(*) FROM results AS r JOIN cells AS k USING (cell_id)
   WHERE k.experiment_id = e.experiment_id AND r.solved_literal = 1) AS solved,
  d.name AS dataset, e.seed, e.repetitions, e.submitted_at_us, e.finished_at_us
FROM experiments AS e
JOIN datasets AS d USING (dataset_id)
JOIN cells AS c USING (experiment_id)
JOIN jobs AS j USING (cell_id)
GROUP BY e.experiment_id;
