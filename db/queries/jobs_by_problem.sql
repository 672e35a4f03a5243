-- Number of jobs, and of jobs solved by one rule, of each method, task, initialization and problem. Parameters:
-- :experiment_id, :rule.
SELECT c.method_id, c.task, c.initialization, p.problem_id, count(*) AS n,
  count(*) FILTER (WHERE VERDICT_BY(:rule) = 'success') AS solved
FROM cells AS c JOIN jobs AS j USING (cell_id) JOIN problems AS p USING (problem_key)
LEFT JOIN results AS r ON r.job_id = j.job_id
WHERE c.experiment_id = :experiment_id
GROUP BY c.cell_id, p.problem_id
