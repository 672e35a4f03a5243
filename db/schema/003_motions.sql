-- legopt database, schema version 3: motions. What lies between the waypoints, how far a solve came, the collision
-- model as a column, and time limits by task.

-- Obstacles as the solver sees them; stands among the options, too. (No generated column: functions of JSON are not
-- allowed in a schema that is not trusted.)
ALTER TABLE methods ADD COLUMN collision TEXT NOT NULL DEFAULT 'solid' CHECK (collision IN ('solid', 'surface'));
UPDATE methods SET collision = 'surface'
WHERE json_valid(options_json) AND json_extract(options_json, '$.options.collision') = 'surface';

-- Wall-time limit of the cell's jobs; experiments.wall_limit_us is the largest of its cells.
ALTER TABLE cells ADD COLUMN wall_limit_us INTEGER CHECK (wall_limit_us > 0);
UPDATE cells
SET wall_limit_us = (SELECT e.wall_limit_us FROM experiments AS e WHERE e.experiment_id = cells.experiment_id);

-- Motions are solved window by window. NULL: not solved by windows.
ALTER TABLE results ADD COLUMN windows INTEGER CHECK (windows >= 1);
ALTER TABLE results ADD COLUMN windows_solved INTEGER CHECK (windows_solved BETWEEN 0 AND windows);

-- Interpolation between consecutive waypoints, by the exact meshes. NULL: not a motion, or older than this column.
ALTER TABLE results ADD COLUMN interpolation_environment_depth_m REAL CHECK (interpolation_environment_depth_m >= 0);
ALTER TABLE results ADD COLUMN interpolation_self_depth_m REAL CHECK (interpolation_self_depth_m >= 0);
ALTER TABLE results ADD COLUMN interpolation_free_share REAL CHECK (interpolation_free_share BETWEEN 0 AND 1);

DROP VIEW benchmark_cells;
DROP VIEW benchmark_table;
DROP VIEW job_list;

-- As in version 2, with the method's collision model.
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
FROM strict_scores AS s JOIN experiments AS e USING (experiment_id) JOIN methods AS m USING (method_id);

CREATE VIEW benchmark_table AS
SELECT g.experiment_id, m.name AS method, m.multi_starts, m.sample_size, m.collision,
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

-- Between the waypoints of the solved motions of a cell, by one rule. scored: solved motions that were looked at; free:
-- those without penetration above 1 mm in any transition; free_share: mean share of such transitions; depths: largest.
CREATE VIEW interpolation_cells AS
SELECT c.experiment_id, c.method_id, m.name AS method, m.multi_starts, m.sample_size, m.incremental, m.collision,
  c.initialization, u.rule, c.num_jobs AS n, count(r.job_id) AS solved, count(r.interpolation_free_share) AS scored,
  count(*) FILTER (WHERE r.interpolation_free_share = 1) AS free, avg(r.interpolation_free_share) AS free_share,
  max(r.interpolation_environment_depth_m) AS environment_depth_m, max(r.interpolation_self_depth_m) AS self_depth_m
FROM cells AS c
JOIN methods AS m USING (method_id)
JOIN (SELECT 'literal' AS rule UNION ALL SELECT 'strict') AS u
LEFT JOIN results AS r ON r.cell_id = c.cell_id
  AND iif(u.rule = 'literal', r.verdict_literal, r.verdict_strict) = 'success'
WHERE c.task = 'motion'
GROUP BY c.cell_id, u.rule;

-- As in version 2, with the collision model, the windows and the figures of the interpolation.
CREATE VIEW job_list AS
SELECT j.job_id, c.experiment_id, m.name AS method, m.collision, c.task, c.initialization, p.problem_id, j.repetition,
  j.state, j.attempts, r.solver_status, r.verdict_literal, r.verdict_strict, r.windows_solved, r.windows, r.cost,
  r.time_s, r.wall_us, r.cpu_us, r.interpolation_environment_depth_m, r.interpolation_self_depth_m,
  r.interpolation_free_share, w.name AS worker
FROM jobs AS j
JOIN cells AS c USING (cell_id)
JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key)
LEFT JOIN results AS r ON r.job_id = j.job_id
LEFT JOIN attempts AS a ON a.job_id = j.job_id AND a.attempt = j.attempts
LEFT JOIN workers AS w ON w.worker_id = a.worker_id;
