-- Jobs that ended after a time without a solution by one rule. Parameters: :after_us, :rule, :limit. Order: newest
-- first.
SELECT a.job_id AS job, c.experiment_id AS experiment, m.name AS method, c.task, c.initialization,
  p.problem_id AS problem,
  coalesce(VERDICT_BY(:rule), j.state) AS outcome,
  a.ended_at_us AS at_us
FROM attempts AS a
JOIN jobs AS j ON j.job_id = a.job_id AND j.attempts = a.attempt
JOIN cells AS c USING (cell_id)
JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key)
LEFT JOIN results AS r ON r.job_id = j.job_id
WHERE a.ended_at_us > :after_us AND j.state IN ('done', 'failed', 'dead')
  AND coalesce(VERDICT_BY(:rule), '') <> 'success'
ORDER BY a.ended_at_us DESC, a.job_id LIMIT :limit
