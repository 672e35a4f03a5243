-- legopt database, schema version 2: indexes for reading, and the views.

-- The benchmark table reads this index alone; its order makes sums independent of the order of arrival.
CREATE INDEX results_by_cell ON results (cell_id, solved_literal, solved_strict, cost, time_s);

-- Jobs that still need work: small whenever it matters.
CREATE INDEX open_jobs_by_cell ON jobs (cell_id) WHERE state IN ('queued', 'leased');

CREATE INDEX cells_by_method ON cells (method_id);
CREATE INDEX events_by_experiment ON events (experiment_id) WHERE experiment_id IS NOT NULL;

-- The judged jobs of a cell by one rule. n: jobs; solved: judged "success"; cost and time_s: means over the solved ones
-- of the values per waypoint, NULL when none was solved. (Scalar subqueries, so that SQLite computes what is asked for.)
CREATE VIEW literal_scores AS
SELECT c.cell_id, c.experiment_id, c.method_id, c.task, c.initialization, c.num_jobs AS n,
  (SELECT count(*) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_literal = 1) AS solved,
  (SELECT avg(r.cost) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_literal = 1) AS cost,
  (SELECT avg(r.time_s) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_literal = 1) AS time_s
FROM cells AS c;

CREATE VIEW strict_scores AS
SELECT c.cell_id, c.experiment_id, c.method_id, c.task, c.initialization, c.num_jobs AS n,
  (SELECT count(*) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_strict = 1) AS solved,
  (SELECT avg(r.cost) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_strict = 1) AS cost,
  (SELECT avg(r.time_s) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_strict = 1) AS time_s
FROM cells AS c;

-- One row per cell and rule. finished: jobs that will not change any more.
CREATE VIEW benchmark_cells AS
SELECT s.experiment_id, e.name AS experiment, s.method_id, m.name AS method, m.multi_starts, m.sample_size,
  m.incremental, s.task, s.initialization, 'literal' AS rule, s.n,
  s.n - (SELECT count(*) FROM jobs AS j WHERE j.cell_id = s.cell_id AND j.state IN ('queued', 'leased')) AS finished,
  s.solved, s.cost, s.time_s
FROM literal_scores AS s JOIN experiments AS e USING (experiment_id) JOIN methods AS m USING (method_id)
UNION ALL
SELECT s.experiment_id, e.name AS experiment, s.method_id, m.name AS method, m.multi_starts, m.sample_size,
  m.incremental, s.task, s.initialization, 'strict' AS rule, s.n,
  s.n - (SELECT count(*) FROM jobs AS j WHERE j.cell_id = s.cell_id AND j.state IN ('queued', 'leased')) AS finished,
  s.solved, s.cost, s.time_s
FROM strict_scores AS s JOIN experiments AS e USING (experiment_id) JOIN methods AS m USING (method_id);

-- Table I of the paper, by the literal rule: one row per method of an experiment, in the order of submission. A cell
-- that the experiment does not have is NULL throughout; one where nothing was solved has NULL cost and time.
CREATE VIEW benchmark_table AS
SELECT g.experiment_id, m.name AS method, m.multi_starts, m.sample_size,
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

-- One row per job with the names of everything it refers to; `worker` had its latest attempt.
CREATE VIEW job_list AS
SELECT j.job_id, c.experiment_id, m.name AS method, c.task, c.initialization, p.problem_id, j.repetition, j.state,
  j.attempts, r.solver_status, r.verdict_literal, r.verdict_strict, r.cost, r.time_s, r.wall_us, r.cpu_us,
  w.name AS worker
FROM jobs AS j
JOIN cells AS c USING (cell_id)
JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key)
LEFT JOIN results AS r ON r.job_id = j.job_id
LEFT JOIN attempts AS a ON a.job_id = j.job_id AND a.attempt = j.attempts
LEFT JOIN workers AS w ON w.worker_id = a.worker_id;

-- Jobs that ended without success (literal rule), and why: the judge's detail, the last attempt's message.
CREATE VIEW failures AS
SELECT c.experiment_id, j.job_id, m.name AS method, c.task, c.initialization, p.problem_id, j.state, r.solver_status,
  r.verdict_literal, r.verdict_strict, r.verdict_detail AS detail, a.message
FROM jobs AS j
JOIN cells AS c USING (cell_id)
JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key)
LEFT JOIN results AS r ON r.job_id = j.job_id
LEFT JOIN attempts AS a ON a.job_id = j.job_id AND a.attempt = j.attempts
WHERE j.state IN ('failed', 'dead') OR r.verdict_literal <> 'success';

-- Where solver and judge, or the two rules of the judge, do not say the same.
CREATE VIEW disagreements AS
SELECT c.experiment_id, j.job_id, m.name AS method, c.task, c.initialization, p.problem_id, r.solver_status,
  r.verdict_literal, r.verdict_strict, r.verdict_detail AS detail, r.solver_violation
FROM results AS r
JOIN jobs AS j ON j.job_id = r.job_id
JOIN cells AS c ON c.cell_id = j.cell_id
JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key)
WHERE (r.solver_status = 'converged_feasible') <> (r.verdict_literal = 'success')
   OR (r.verdict_literal = 'success') <> (r.verdict_strict = 'success');

-- One row per experiment with its jobs by state; solved by the literal rule.
CREATE VIEW experiment_list AS
SELECT e.experiment_id, e.name, e.state, e.num_jobs AS jobs,
  count(*) FILTER (WHERE j.state = 'queued') AS queued, count(*) FILTER (WHERE j.state = 'leased') AS leased,
  count(*) FILTER (WHERE j.state = 'done') AS done, count(*) FILTER (WHERE j.state = 'failed') AS failed,
  count(*) FILTER (WHERE j.state = 'dead') AS dead, count(*) FILTER (WHERE j.state = 'cancelled') AS cancelled,
  (SELECT count(*) FROM results AS r JOIN cells AS k USING (cell_id)
   WHERE k.experiment_id = e.experiment_id AND r.solved_literal = 1) AS solved,
  d.name AS dataset, e.submitted_at_us, e.finished_at_us
FROM experiments AS e
JOIN datasets AS d USING (dataset_id)
JOIN cells AS c USING (experiment_id)
JOIN jobs AS j USING (cell_id)
GROUP BY e.experiment_id;
