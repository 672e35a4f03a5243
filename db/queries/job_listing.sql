-- Jobs of an experiment for 'legopt list'. Results of old releases have no verdict by the solid rule; the one by the
-- strict rule is shown. Parameters: :experiment_id, :rule; flags for columns :show_multi_starts, :show_sample_size,
-- :show_incremental, :show_collision; optional filters :cell_ids, :state, :verdict, :problem_id, :unsolved (a flag).
-- Order: job.
SELECT job_id AS job, method,
  multi_starts,  -- if :show_multi_starts
  sample_size,  -- if :show_sample_size
  incremental,  -- if :show_incremental
  collision,  -- if :show_collision
  task, initialization, problem_id AS problem, repetition, state, attempts,
  CASE :rule WHEN 'literal' THEN verdict_literal WHEN 'strict' THEN verdict_strict
    WHEN 'solid' THEN coalesce(verdict_solid, verdict_strict) ELSE coalesce(verdict_physical, verdict_solid) END AS verdict,
  solver_status, cost, time_s, worker
FROM job_list
WHERE experiment_id = :experiment_id
  AND state = :state  -- if :state
  AND verdict = :verdict  -- if :verdict
  AND job_id IN (SELECT job_id FROM jobs WHERE cell_id IN (:cell_ids))  -- if :cell_ids
  AND problem_id = :problem_id  -- if :problem_id
  AND (state IN ('failed', 'dead') OR verdict <> 'success')  -- if :unsolved
ORDER BY job_id
