-- Number of jobs, and of jobs solved by one rule, of each cell on some problems together. Parameters: :experiment_id,
-- :rule, :problem_keys.
SELECT c.method_id, c.task, c.initialization, count(*) AS n, count(*) FILTER (WHERE VERDICT_BY(:rule) = 'success') AS solved
FROM cells AS c CROSS JOIN jobs AS j USING (cell_id) LEFT JOIN results AS r ON r.job_id = j.job_id
WHERE c.experiment_id = :experiment_id AND j.problem_key IN (:problem_keys)
GROUP BY c.cell_id
