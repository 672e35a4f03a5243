-- A job with all inputs and figures that a replay needs. Parameters: :job_id.
SELECT c.experiment_id, c.task, c.initialization, p.problem_id, j.repetition, j.state, e.seed,
  coalesce(c.wall_limit_us, e.wall_limit_us) / 1e6 AS wall_limit_s, c.effort_limit, m.name AS method,
  m.hash AS method_hash, m.options_json, d.name AS dataset, d.hash AS dataset_hash,
  coalesce(w.build_id, '') AS build_id, r.solver_status, r.verdict_literal, r.verdict_strict, r.verdict_solid,
  r.verdict_physical,
  r.iterations, r.restarts, r.starts, r.term_evaluations, r.collision_queries, r.work_ns, r.margin_relaxed, r.solver_cost, r.solver_violation,
  r.cost, r.trace
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
