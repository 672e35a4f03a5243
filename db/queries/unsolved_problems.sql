-- Those of the problems that no job of an experiment solves by one rule. Parameters: :experiment_id, :rule, :problem_keys.
SELECT p.problem_key
FROM problems AS p
WHERE p.problem_key IN (:problem_keys)
  AND NOT EXISTS (
    SELECT 1
    FROM cells AS c CROSS JOIN jobs AS j USING (cell_id) CROSS JOIN results AS r USING (job_id)
    WHERE c.experiment_id = :experiment_id AND c.task = p.task AND j.problem_key = p.problem_key
      AND VERDICT_BY(:rule) = 'success')
