-- First and last problem of each task, and n > 0 if the task has a problem. Parameters: :experiment_id, :problem_id.
SELECT task, min(problem_id) AS first, max(problem_id) AS last, count(*) FILTER (WHERE problem_id = :problem_id) AS n
FROM (
  SELECT DISTINCT c.task, p.problem_id
  FROM cells AS c JOIN jobs AS j USING (cell_id) JOIN problems AS p USING (problem_key)
  WHERE c.experiment_id = :experiment_id)
GROUP BY task
