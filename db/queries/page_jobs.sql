-- All jobs of an experiment with their results, for the page. Parameters: :experiment_id, and optional
-- :cell_ids. Order: job.
SELECT j.job_id AS job, c.method_id AS method, c.task, c.initialization, p.problem_id AS problem, j.repetition, j.state,
  r.solver_status AS status, r.verdict_literal AS literal, r.verdict_strict AS strict, r.verdict_solid AS solid, r.verdict_physical AS physical, r.cost,
  r.wall_us, r.cpu_us, r.involuntary_context_switches AS switches, r.iterations, r.restarts, r.term_evaluations,
  r.failed_waypoint, r.verdict_detail AS detail
FROM jobs AS j JOIN cells AS c USING (cell_id) JOIN problems AS p USING (problem_key)
LEFT JOIN results AS r ON r.job_id = j.job_id
WHERE c.experiment_id = :experiment_id
  AND c.cell_id IN (:cell_ids)  -- if :cell_ids
ORDER BY j.job_id
