-- All views. A server drops and creates them at each start, in one transaction. A change of this file needs a new
-- schema version, as one of tables.sql does: readers accept only the views of their version. The build replaces VERDICT_BY
-- and the rule in parentheses by the verdict of `results AS r` by that rule (db/CMakeLists.txt).

-- Jobs of a cell by state, except queued and leased. done: jobs with a result; finished: the sum; taken_over: jobs that
-- reuse a result. (The condition on three states selects the index.)
DROP VIEW IF EXISTS cell_states;
CREATE VIEW cell_states AS
SELECT c.cell_id, c.experiment_id, k.results AS done,
  (SELECT count(*) FROM jobs AS j WHERE j.cell_id = c.cell_id AND j.state IN ('failed', 'dead', 'cancelled')
   AND j.state = 'failed') AS failed,
  (SELECT count(*) FROM jobs AS j WHERE j.cell_id = c.cell_id AND j.state IN ('failed', 'dead', 'cancelled')
   AND j.state = 'dead') AS dead,
  (SELECT count(*) FROM jobs AS j WHERE j.cell_id = c.cell_id AND j.state IN ('failed', 'dead', 'cancelled')
   AND j.state = 'cancelled') AS cancelled,
  k.results + (SELECT count(*) FROM jobs AS j WHERE j.cell_id = c.cell_id
               AND j.state IN ('failed', 'dead', 'cancelled')) AS finished,
  (SELECT count(*) FROM jobs AS j WHERE j.cell_id = c.cell_id AND j.taken_from IS NOT NULL) AS taken_over
FROM cells AS c JOIN cell_results AS k USING (cell_id);

-- Success count, mean cost and mean time of a cell by one rule. n: jobs; solved: jobs judged "success"; cost and
-- time_s: means per waypoint over the solved jobs, NULL if there are none. (Scalar subqueries, so that SQLite
-- computes only the columns that a query reads.)
DROP VIEW IF EXISTS literal_scores;
CREATE VIEW literal_scores AS
SELECT c.cell_id, c.experiment_id, c.method_id, c.task, c.initialization, c.num_jobs AS n,
  (SELECT k.solved_literal FROM cell_results AS k WHERE k.cell_id = c.cell_id) AS solved,
  (SELECT avg(r.cost) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_literal = 1) AS cost,
  (SELECT avg(r.time_s) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_literal = 1) AS time_s
FROM cells AS c;

DROP VIEW IF EXISTS strict_scores;
CREATE VIEW strict_scores AS
SELECT c.cell_id, c.experiment_id, c.method_id, c.task, c.initialization, c.num_jobs AS n,
  (SELECT k.solved_strict FROM cell_results AS k WHERE k.cell_id = c.cell_id) AS solved,
  (SELECT avg(r.cost) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_strict = 1) AS cost,
  (SELECT avg(r.time_s) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_strict = 1) AS time_s
FROM cells AS c;

DROP VIEW IF EXISTS solid_scores;
CREATE VIEW solid_scores AS
SELECT c.cell_id, c.experiment_id, c.method_id, c.task, c.initialization, c.num_jobs AS n,
  (SELECT k.solved_solid FROM cell_results AS k WHERE k.cell_id = c.cell_id) AS solved,
  (SELECT avg(r.cost) FROM results AS r WHERE r.cell_id = c.cell_id AND r.verdict_solid = 'success') AS cost,
  (SELECT avg(r.time_s) FROM results AS r WHERE r.cell_id = c.cell_id AND r.verdict_solid = 'success') AS time_s
FROM cells AS c;

DROP VIEW IF EXISTS physical_scores;
CREATE VIEW physical_scores AS
SELECT c.cell_id, c.experiment_id, c.method_id, c.task, c.initialization, c.num_jobs AS n,
  (SELECT k.solved_physical FROM cell_results AS k WHERE k.cell_id = c.cell_id) AS solved,
  (SELECT avg(r.cost) FROM results AS r WHERE r.cell_id = c.cell_id AND r.verdict_physical = 'success') AS cost,
  (SELECT avg(r.time_s) FROM results AS r WHERE r.cell_id = c.cell_id AND r.verdict_physical = 'success') AS time_s
FROM cells AS c;

-- Success count, mean cost and mean time of a cell by its experiment's rule.
DROP VIEW IF EXISTS rule_scores;
CREATE VIEW rule_scores AS
SELECT c.cell_id, c.experiment_id, c.method_id, c.task, c.initialization, e.rule, c.num_jobs AS n,
  (SELECT CASE e.rule WHEN 'literal' THEN k.solved_literal WHEN 'strict' THEN k.solved_strict
     WHEN 'solid' THEN k.solved_solid ELSE k.solved_physical END FROM cell_results AS k WHERE k.cell_id = c.cell_id)
    AS solved,
  CASE e.rule
    WHEN 'literal' THEN (SELECT avg(r.cost) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_literal = 1)
    WHEN 'strict' THEN (SELECT avg(r.cost) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_strict = 1)
    WHEN 'solid' THEN (SELECT avg(r.cost) FROM results AS r WHERE r.cell_id = c.cell_id AND r.verdict_solid = 'success')
    ELSE (SELECT avg(r.cost) FROM results AS r WHERE r.cell_id = c.cell_id AND r.verdict_physical = 'success')
  END AS cost,
  CASE e.rule
    WHEN 'literal' THEN (SELECT avg(r.time_s) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_literal = 1)
    WHEN 'strict' THEN (SELECT avg(r.time_s) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_strict = 1)
    WHEN 'solid' THEN (SELECT avg(r.time_s) FROM results AS r WHERE r.cell_id = c.cell_id AND r.verdict_solid = 'success')
    ELSE (SELECT avg(r.time_s) FROM results AS r WHERE r.cell_id = c.cell_id AND r.verdict_physical = 'success')
  END AS time_s
FROM cells AS c JOIN experiments AS e USING (experiment_id);

-- One row per cell and rule. finished: jobs in a terminal state.
DROP VIEW IF EXISTS benchmark_cells;
CREATE VIEW benchmark_cells AS
SELECT s.experiment_id, e.name AS experiment, s.method_id, m.name AS method, m.multi_starts, m.sample_size,
  m.incremental, m.collision, s.task, s.initialization, 'literal' AS rule, s.n,
  w.finished,
  s.solved, s.cost, s.time_s
FROM literal_scores AS s JOIN cell_states AS w USING (cell_id) JOIN experiments AS e ON e.experiment_id = s.experiment_id
JOIN methods AS m ON m.method_id = s.method_id
UNION ALL
SELECT s.experiment_id, e.name AS experiment, s.method_id, m.name AS method, m.multi_starts, m.sample_size,
  m.incremental, m.collision, s.task, s.initialization, 'strict' AS rule, s.n,
  w.finished,
  s.solved, s.cost, s.time_s
FROM strict_scores AS s JOIN cell_states AS w USING (cell_id) JOIN experiments AS e ON e.experiment_id = s.experiment_id
JOIN methods AS m ON m.method_id = s.method_id
UNION ALL
SELECT s.experiment_id, e.name AS experiment, s.method_id, m.name AS method, m.multi_starts, m.sample_size,
  m.incremental, m.collision, s.task, s.initialization, 'solid' AS rule, s.n,
  w.finished,
  s.solved, s.cost, s.time_s
FROM solid_scores AS s JOIN cell_states AS w USING (cell_id) JOIN experiments AS e ON e.experiment_id = s.experiment_id
JOIN methods AS m ON m.method_id = s.method_id
UNION ALL
SELECT s.experiment_id, e.name AS experiment, s.method_id, m.name AS method, m.multi_starts, m.sample_size,
  m.incremental, m.collision, s.task, s.initialization, 'physical' AS rule, s.n,
  w.finished,
  s.solved, s.cost, s.time_s
FROM physical_scores AS s JOIN cell_states AS w USING (cell_id) JOIN experiments AS e ON e.experiment_id = s.experiment_id
JOIN methods AS m ON m.method_id = s.method_id;

-- Table I of the paper, by the experiment's rule: one row per method of an experiment, in the order of submission. The
-- columns of a cell that the experiment does not have are NULL. A cell without solved jobs has NULL cost and time.
DROP VIEW IF EXISTS benchmark_table;
CREATE VIEW benchmark_table AS
SELECT g.experiment_id, m.name AS method, m.multi_starts, m.sample_size, m.incremental, m.collision, e.rule,
  pg.n AS posture_good_n, pg.solved AS posture_good_solved,
  pg.cost AS posture_good_cost, pg.time_s AS posture_good_time_s,
  pc.n AS posture_in_collision_n, pc.solved AS posture_in_collision_solved,
  pc.cost AS posture_in_collision_cost, pc.time_s AS posture_in_collision_time_s,
  mg.n AS motion_good_n, mg.solved AS motion_good_solved,
  mg.cost AS motion_good_cost, mg.time_s AS motion_good_time_s,
  mc.n AS motion_in_collision_n, mc.solved AS motion_in_collision_solved,
  mc.cost AS motion_in_collision_cost, mc.time_s AS motion_in_collision_time_s
FROM (SELECT experiment_id, method_id, min(cell_id) AS first_cell FROM cells GROUP BY experiment_id, method_id) AS g
JOIN experiments AS e USING (experiment_id)
JOIN methods AS m USING (method_id)
LEFT JOIN rule_scores AS pg ON pg.experiment_id = g.experiment_id AND pg.method_id = g.method_id
  AND pg.task = 'posture' AND pg.initialization = 'good'
LEFT JOIN rule_scores AS pc ON pc.experiment_id = g.experiment_id AND pc.method_id = g.method_id
  AND pc.task = 'posture' AND pc.initialization = 'in_collision'
LEFT JOIN rule_scores AS mg ON mg.experiment_id = g.experiment_id AND mg.method_id = g.method_id
  AND mg.task = 'motion' AND mg.initialization = 'good'
LEFT JOIN rule_scores AS mc ON mc.experiment_id = g.experiment_id AND mc.method_id = g.method_id
  AND mc.task = 'motion' AND mc.initialization = 'in_collision'
ORDER BY g.experiment_id, g.first_cell;

-- Collisions between the waypoints of the solved motions of a cell, by one rule. scored: solved motions that were
-- checked; free: motions without penetration above 1 mm in any segment; free_share: mean share of such segments;
-- depths: maxima.
DROP VIEW IF EXISTS interpolation_cells;
CREATE VIEW interpolation_cells AS
SELECT c.experiment_id, c.method_id, m.name AS method, m.multi_starts, m.sample_size, m.incremental, m.collision,
  c.initialization, u.rule, c.num_jobs AS n, count(r.job_id) AS solved, count(r.interpolation_free_share) AS scored,
  count(*) FILTER (WHERE r.interpolation_free_share = 1) AS free, avg(r.interpolation_free_share) AS free_share,
  max(r.interpolation_environment_depth_m) AS environment_depth_m, max(r.interpolation_self_depth_m) AS self_depth_m
FROM cells AS c
JOIN methods AS m USING (method_id)
JOIN (SELECT 'literal' AS rule UNION ALL SELECT 'strict' UNION ALL SELECT 'solid'
  UNION ALL SELECT 'physical') AS u
LEFT JOIN results AS r ON r.cell_id = c.cell_id
  AND VERDICT_BY(u.rule) = 'success'
WHERE c.task = 'motion'
GROUP BY c.cell_id, u.rule;

-- Static equilibrium of the solutions of a cell that one rule accepts, as far as it was tested. held: solutions all of
-- whose postures contacts and joints can hold; sums over these solutions of the numbers in the table results.
DROP VIEW IF EXISTS holding_cells;
CREATE VIEW holding_cells AS
SELECT c.experiment_id, c.cell_id, c.method_id, m.name AS method, m.multi_starts, m.sample_size, m.incremental,
  m.collision, c.task, c.initialization, u.rule, c.num_jobs AS n, count(r.job_id) AS solved,
  count(r.holding_postures) AS tested,
  count(*) FILTER (WHERE r.holding_without_equilibrium = 0 AND r.holding_over_torque = 0) AS held,
  sum(r.holding_postures) AS postures, sum(r.holding_without_equilibrium) AS without_equilibrium,
  sum(r.holding_over_torque) AS over_torque, sum(r.halfway_postures) AS halfway_postures,
  sum(r.halfway_without_equilibrium) AS halfway_without_equilibrium, sum(r.halfway_over_torque) AS halfway_over_torque,
  (SELECT max(v.value) FROM violations AS v JOIN results AS t USING (job_id) WHERE t.cell_id = c.cell_id
   AND v.check_name = 'torque') AS largest_torque_ratio
FROM cells AS c
JOIN methods AS m USING (method_id)
JOIN (SELECT 'literal' AS rule UNION ALL SELECT 'strict' UNION ALL SELECT 'solid'
  UNION ALL SELECT 'physical') AS u
LEFT JOIN results AS r ON r.cell_id = c.cell_id
  AND VERDICT_BY(u.rule) = 'success'
GROUP BY c.cell_id, u.rule;

-- One row per job, with its result and worker.
DROP VIEW IF EXISTS job_list;
CREATE VIEW job_list AS
SELECT j.job_id, c.experiment_id, m.name AS method, m.multi_starts, m.sample_size, m.incremental, m.collision, c.task,
  c.initialization, p.problem_id, j.repetition, j.state, j.attempts, j.taken_from, r.solver_status, r.verdict_literal,
  r.verdict_strict, r.verdict_solid, r.verdict_physical, r.windows_solved, r.windows, r.cost, r.time_s, r.wall_us, r.cpu_us,
  r.iterations, r.restarts, r.starts, r.term_evaluations, r.collision_queries,
  r.work_ns, r.margin_relaxed,
  (SELECT max(v.value) FROM violations AS v WHERE v.job_id = j.job_id
   AND v.check_name IN ('environment_collision', 'self_collision', 'containment')) AS solid_depth_m,
  (SELECT max(v.value) FROM violations AS v WHERE v.job_id = j.job_id AND v.check_name = 'step') AS longest_step_m,
  r.interpolation_environment_depth_m, r.interpolation_self_depth_m, r.interpolation_free_share,
  r.holding_postures, r.holding_without_equilibrium, r.holding_over_torque, r.halfway_postures,
  r.halfway_without_equilibrium, r.halfway_over_torque,
  r.duration_s, r.reduced_duration_s, r.velocity_limited_share, r.torque_limited_share, r.contact_limited_share,
  w.name AS worker, w.hostname, w.processor, w.build_id
FROM jobs AS j
JOIN cells AS c USING (cell_id)
JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key)
LEFT JOIN results AS r ON r.job_id = j.job_id
LEFT JOIN attempts AS a ON a.job_id = j.job_id AND a.attempt = j.attempts
LEFT JOIN workers AS w ON w.worker_id = a.worker_id;

-- Jobs that failed, died, or are not solved by their experiment's rule.
DROP VIEW IF EXISTS failures;
CREATE VIEW failures AS
SELECT c.experiment_id, j.job_id, m.name AS method, m.multi_starts, m.sample_size, m.incremental, m.collision, c.task,
  c.initialization, p.problem_id, j.repetition, j.state, e.rule, r.solver_status, r.verdict_literal,
  r.verdict_strict, r.verdict_solid, r.verdict_physical, r.verdict_detail AS detail, a.message
FROM jobs AS j
JOIN cells AS c USING (cell_id)
JOIN experiments AS e ON e.experiment_id = c.experiment_id
JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key)
LEFT JOIN results AS r ON r.job_id = j.job_id
LEFT JOIN attempts AS a ON a.job_id = j.job_id AND a.attempt = j.attempts
WHERE j.state IN ('failed', 'dead') OR 'success' <> VERDICT_BY(e.rule);

-- Results on which the solver and the rules disagree.
DROP VIEW IF EXISTS disagreements;
CREATE VIEW disagreements AS
SELECT c.experiment_id, j.job_id, m.name AS method, m.multi_starts, m.sample_size, m.incremental, m.collision, c.task,
  c.initialization, p.problem_id, j.repetition, r.solver_status, r.verdict_literal, r.verdict_strict, r.verdict_solid,
  r.verdict_physical, r.verdict_detail AS detail, r.solver_violation
FROM results AS r
JOIN jobs AS j ON j.job_id = r.job_id
JOIN cells AS c ON c.cell_id = j.cell_id
JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key)
WHERE (r.solver_status = 'converged_feasible') <> (r.verdict_literal = 'success')
   OR (r.verdict_literal = 'success') <> (r.verdict_strict = 'success')
   OR (r.verdict_strict = 'success') <> (r.verdict_solid = 'success');

-- One row per experiment with the states of its jobs. tags: in alphabetical order, separated by commas; solved: by the
-- experiment's rule. A leased job is one with a running attempt, of which there are few.
DROP VIEW IF EXISTS experiment_list;
CREATE VIEW experiment_list AS
SELECT e.experiment_id, e.name, e.submitter,
  coalesce((SELECT group_concat(t.tag, ',') FROM (SELECT tag FROM experiment_tags
    WHERE experiment_tags.experiment_id = e.experiment_id ORDER BY tag) AS t), '') AS tags,
  e.state, e.hold, e.hold_reason, e.priority, e.builds, e.build_id, e.num_jobs AS jobs,
  e.num_jobs - s.done - s.failed - s.dead - s.cancelled - s.leased AS queued, s.leased, s.done, s.failed, s.dead,
  s.cancelled, s.taken_over,
  (SELECT sum(r.solved) FROM rule_scores AS r WHERE r.experiment_id = e.experiment_id) AS solved, e.rule,
  d.name AS dataset, e.seed, e.repetitions, e.submitted_at_us, e.finished_at_us
FROM experiments AS e
JOIN datasets AS d USING (dataset_id)
JOIN (
  SELECT e.experiment_id, sum(c.done) AS done, sum(c.failed) AS failed, sum(c.dead) AS dead,
    sum(c.cancelled) AS cancelled, sum(c.taken_over) AS taken_over,
    (SELECT count(*) FROM attempts AS a WHERE a.outcome = 'running' AND a.job_id >= e.first_job_id
     AND a.job_id < e.first_job_id + e.num_jobs) AS leased
  FROM experiments AS e JOIN cell_states AS c USING (experiment_id)
  GROUP BY e.experiment_id) AS s USING (experiment_id);

-- Builds and hosts that computed the accepted results of an experiment.
DROP VIEW IF EXISTS result_origins;
CREATE VIEW result_origins AS
SELECT s.experiment_id, w.build_id, w.build, w.hostname, w.processor, max(w.processors) AS processors,
  w.memory_bytes, max(w.load) AS load, count(*) AS workers, sum(s.results) AS results
FROM result_workers AS s JOIN workers AS w USING (worker_id)
WHERE s.results > 0
GROUP BY s.experiment_id, w.build_id, w.build, w.hostname, w.processor, w.memory_bytes;

-- Jobs stopped by the wall-time limit, which are not results of their method: dead jobs whose last attempt it
-- stopped, and results that it ended, which only servers before schema version 7 accepted.
DROP VIEW IF EXISTS clock_stopped;
CREATE VIEW clock_stopped AS
SELECT c.experiment_id, c.cell_id, j.job_id
FROM jobs AS j
JOIN cells AS c ON c.cell_id = j.cell_id
JOIN attempts AS a ON a.job_id = j.job_id AND a.attempt = j.attempts
WHERE j.state IN ('failed', 'dead', 'cancelled') AND j.state = 'dead' AND a.outcome = 'time_limit'
UNION ALL
SELECT c.experiment_id, c.cell_id, r.job_id
FROM results AS r JOIN cells AS c ON c.cell_id = r.cell_id
WHERE r.solver_status = 'time_limit';

-- Results that an identical job may reuse, with all columns that identify it: dataset, method, task, initialisation,
-- problem, repetition, seed, effort limit and build. A job within the time and memory limits would have ended the
-- same way. Not included: runs stopped by the wall-time limit, and results without a build id or a verdict by the
-- physical rule.
DROP VIEW IF EXISTS reusable_results;
CREATE VIEW reusable_results AS
SELECT c.experiment_id, j.job_id, coalesce(j.taken_from, j.job_id) AS solved_as, d.hash AS dataset_hash,
  m.hash AS method_hash, c.task, c.initialization, p.problem_id, j.repetition, e.seed, c.effort_limit, w.build_id,
  r.wall_us, r.peak_memory_bytes, r.verdict_literal, r.verdict_strict, r.verdict_solid, r.verdict_physical
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
  AND r.verdict_physical IS NOT NULL AND w.build_id IS NOT NULL;
