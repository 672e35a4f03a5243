-- Jobs with a solution, an unsolved window or a trace. solved: by one rule. Parameters: :experiment_id, :rule, and
-- optional :cell_ids. Order: cell, problem, repetition.
SELECT j.job_id, c.method_id, c.task, p.problem_id, r.failed_waypoint,
  VERDICT_BY(:rule) = 'success' AS solved
FROM results AS r
JOIN jobs AS j USING (job_id)
JOIN cells AS c ON c.cell_id = j.cell_id
JOIN problems AS p USING (problem_key)
WHERE c.experiment_id = :experiment_id
  AND c.cell_id IN (:cell_ids)  -- if :cell_ids
  AND (r.trace IS NOT NULL OR EXISTS (SELECT 1 FROM waypoints AS w WHERE w.job_id = r.job_id)
    OR EXISTS (SELECT 1 FROM unsolved_waypoints AS u WHERE u.job_id = r.job_id))
ORDER BY c.cell_id, p.problem_id, j.repetition
