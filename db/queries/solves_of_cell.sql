-- The jobs of a cell with their results; solved: by one rule; tolerance_used: largest value of :checks by :rules that is
-- within :tolerance. A larger one of a solved job is a finding that does not count for its dataset.
-- Parameters: :cell_id, :rule, :checks, :rules, :tolerance. Order: problem, repetition.
SELECT j.job_id, p.problem_id, p.waypoints AS num_waypoints, j.state,
  VERDICT_BY(:rule) = 'success' AS solved,
  r.cost, r.work_ns, r.wall_us, r.cpu_us, r.involuntary_context_switches, r.solver_status,
  r.starts - coalesce(r.windows, 1) AS further_starts,
  (SELECT max(v.value) FROM violations AS v
   WHERE v.job_id = r.job_id
     AND +v.check_name IN (:checks) AND +v.rule IN (:rules)  -- +: one search, not one per check
     AND v.value <= CAST(:tolerance AS REAL)) AS tolerance_used
FROM jobs AS j JOIN problems AS p USING (problem_key) LEFT JOIN results AS r ON r.job_id = j.job_id
WHERE j.cell_id = :cell_id
ORDER BY p.problem_id, j.repetition
