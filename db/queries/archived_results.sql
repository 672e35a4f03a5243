-- The results of an experiment for an archive, without their solutions. Parameters: :experiment_id. Order: job_id.
SELECT j.job_id, c.method_id, c.task, c.initialization, p.problem_id, j.repetition, coalesce(w.build_id, '') AS build_id,
  coalesce(w.build, '') AS build, coalesce(w.processor, '') AS processor,
  r.solver_status, iif(r.cpu_us > 0, r.cpu_us, r.wall_us) AS cpu_us, coalesce(r.work_ns, 0) AS work_ns, coalesce(r.term_evaluations, 0) AS term_evaluations,
  coalesce(r.collision_queries, 0) AS collision_queries, r.iterations, r.restarts, r.solver_cost, r.solver_violation,
  coalesce(r.windows, 0) AS windows, coalesce(r.windows_solved, 0) AS windows_solved, r.window_verdict,
  coalesce(r.starts, 0) AS starts, coalesce(r.margin_relaxed, 0.0) AS margin_relaxed,
  r.verdict_literal, r.verdict_strict, r.verdict_solid, r.verdict_physical, r.cost, r.num_waypoints
FROM results AS r
JOIN jobs AS j USING (job_id)
JOIN cells AS c USING (cell_id)
JOIN problems AS p USING (problem_key)
LEFT JOIN attempts AS a ON a.job_id = r.job_id AND a.attempt = r.attempt
LEFT JOIN workers AS w USING (worker_id)
WHERE c.experiment_id = :experiment_id
ORDER BY j.job_id
