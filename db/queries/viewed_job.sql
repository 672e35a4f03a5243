-- A job with its result, and whether it has waypoints or a trace to draw. Parameters: :job_id.
SELECT c.experiment_id, e.name AS experiment, e.rule, e.seed, c.task, c.initialization, p.problem_id AS problem, j.repetition,
  j.state, m.name AS method, m.hash AS method_hash, d.name AS dataset, d.hash AS dataset_hash,
  coalesce(w.build_id, '') AS build_id, r.solver_status AS status, r.verdict_literal AS literal,
  r.verdict_strict AS strict, r.verdict_solid AS solid, r.verdict_physical AS physical, r.verdict_detail AS detail, r.failed_waypoint, r.cost,
  r.wall_us, r.cpu_us, r.iterations, r.restarts,
  (SELECT count(*) FROM waypoints AS x WHERE x.job_id = j.job_id)
    + (SELECT count(*) FROM unsolved_waypoints AS x WHERE x.job_id = j.job_id) AS waypoints,
  r.trace IS NOT NULL AS traced
FROM jobs AS j
JOIN cells AS c USING (cell_id)
JOIN experiments AS e USING (experiment_id)
JOIN datasets AS d USING (dataset_id)
JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key)
LEFT JOIN results AS r ON r.job_id = j.job_id
LEFT JOIN attempts AS a ON a.job_id = r.job_id AND a.attempt = r.attempt
LEFT JOIN workers AS w ON w.worker_id = a.worker_id
WHERE j.job_id = :job_id
