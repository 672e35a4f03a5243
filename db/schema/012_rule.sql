-- legopt database, schema version 12: the rule by which an experiment is counted.

-- The suite's rule. Experiments of earlier releases are counted by the solid rule if all their results have a verdict
-- by it, else by the original evaluator's.
ALTER TABLE experiments ADD COLUMN rule TEXT NOT NULL DEFAULT 'solid' CHECK (rule IN ('literal', 'strict', 'solid'));
UPDATE experiments SET rule = coalesce(json_extract(spec_json, '$.rule'),
  CASE WHEN EXISTS (SELECT 1 FROM cells AS c JOIN results AS r USING (cell_id)
                    WHERE c.experiment_id = experiments.experiment_id AND r.verdict_solid IS NULL)
    THEN 'literal' ELSE 'solid' END);

DROP VIEW benchmark_table;
DROP VIEW failures;
DROP VIEW experiment_list;
DROP VIEW reusable_results;

-- Success count, mean cost and mean time of a cell by its experiment's rule.
CREATE VIEW rule_scores AS
SELECT c.cell_id, c.experiment_id, c.method_id, c.task, c.initialization, e.rule, c.num_jobs AS n,
  CASE e.rule
    WHEN 'literal' THEN (SELECT count(*) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_literal = 1)
    WHEN 'strict' THEN (SELECT count(*) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_strict = 1)
    ELSE (SELECT count(*) FROM results AS r WHERE r.cell_id = c.cell_id AND r.verdict_solid = 'success')
  END AS solved,
  CASE e.rule
    WHEN 'literal' THEN (SELECT avg(r.cost) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_literal = 1)
    WHEN 'strict' THEN (SELECT avg(r.cost) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_strict = 1)
    ELSE (SELECT avg(r.cost) FROM results AS r WHERE r.cell_id = c.cell_id AND r.verdict_solid = 'success')
  END AS cost,
  CASE e.rule
    WHEN 'literal' THEN (SELECT avg(r.time_s) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_literal = 1)
    WHEN 'strict' THEN (SELECT avg(r.time_s) FROM results AS r WHERE r.cell_id = c.cell_id AND r.solved_strict = 1)
    ELSE (SELECT avg(r.time_s) FROM results AS r WHERE r.cell_id = c.cell_id AND r.verdict_solid = 'success')
  END AS time_s
FROM cells AS c JOIN experiments AS e USING (experiment_id);

-- As in version 5, by the experiment's rule.
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

-- As in version 5, by the experiment's rule.
CREATE VIEW failures AS
SELECT c.experiment_id, j.job_id, m.name AS method, m.multi_starts, m.sample_size, m.incremental, m.collision, c.task,
  c.initialization, p.problem_id, j.repetition, j.state, e.rule, r.solver_status, r.verdict_literal,
  r.verdict_strict, r.verdict_solid, r.verdict_detail AS detail, a.message
FROM jobs AS j
JOIN cells AS c USING (cell_id)
JOIN experiments AS e ON e.experiment_id = c.experiment_id
JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key)
LEFT JOIN results AS r ON r.job_id = j.job_id
LEFT JOIN attempts AS a ON a.job_id = j.job_id AND a.attempt = j.attempts
WHERE j.state IN ('failed', 'dead') OR 'success' <>
  CASE e.rule WHEN 'literal' THEN r.verdict_literal WHEN 'strict' THEN r.verdict_strict ELSE r.verdict_solid END;

-- As in version 8, by the experiment's rule.
CREATE VIEW experiment_list AS
SELECT e.experiment_id, e.name, e.submitter,
  coalesce((SELECT group_concat(t.tag, ',') FROM (SELECT tag FROM experiment_tags
    WHERE experiment_tags.experiment_id = e.experiment_id ORDER BY tag) AS t), '') AS tags,
  e.state, e.hold, e.hold_reason, e.priority, e.builds, e.build_id, e.num_jobs AS jobs,
  count(*) FILTER (WHERE j.state = 'queued') AS queued, count(*) FILTER (WHERE j.state = 'leased') AS leased,
  count(*) FILTER (WHERE j.state = 'done') AS done, count(*) FILTER (WHERE j.state = 'failed') AS failed,
  count(*) FILTER (WHERE j.state = 'dead') AS dead, count(*) FILTER (WHERE j.state = 'cancelled') AS cancelled,
  count(j.taken_from) AS taken_over,
  (SELECT sum(s.solved) FROM rule_scores AS s WHERE s.experiment_id = e.experiment_id) AS solved, e.rule,
  d.name AS dataset, e.seed, e.repetitions, e.submitted_at_us, e.finished_at_us
FROM experiments AS e
JOIN datasets AS d USING (dataset_id)
JOIN cells AS c USING (experiment_id)
JOIN jobs AS j USING (cell_id)
GROUP BY e.experiment_id;

-- As in version 8, with all verdicts: the reusing experiment may have another rule.
CREATE VIEW reusable_results AS
SELECT c.experiment_id, j.job_id, coalesce(j.taken_from, j.job_id) AS solved_as, d.hash AS dataset_hash,
  m.hash AS method_hash, c.task, c.initialization, p.problem_id, j.repetition, e.seed, c.effort_limit, w.build_id,
  r.wall_us, r.peak_memory_bytes, r.verdict_literal, r.verdict_strict, r.verdict_solid
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
