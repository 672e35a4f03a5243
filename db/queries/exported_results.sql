-- The results of an export without their solutions. Parameters: :experiment_id, and optional :cell_ids.
-- Order: job_id.
SELECT j.job_id, c.method_id, m.name AS method, m.multi_starts, m.sample_size, m.collision, c.initialization,
  j.repetition, c.task, p.problem_id, iif(r.cpu_us > 0, r.cpu_us, r.wall_us) AS solve_us, r.verdict_literal, r.num_waypoints
FROM jobs AS j JOIN cells AS c USING (cell_id) JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key) LEFT JOIN results AS r ON r.job_id = j.job_id
WHERE c.experiment_id = :experiment_id
  AND c.cell_id IN (:cell_ids)  -- if :cell_ids
  AND r.job_id IS NOT NULL
ORDER BY j.job_id
