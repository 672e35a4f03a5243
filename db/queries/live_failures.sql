-- Jobs that ended after a time without a solution by one rule, among the newest :examined results and events.
-- Parameters: :after_us, :rule, :examined, :limit. Order: newest first.
WITH ended AS (
  SELECT job_id, received_at_us AS at_us FROM (
    SELECT job_id, received_at_us, verdict_literal, verdict_strict, verdict_solid, verdict_physical
    FROM results WHERE received_at_us > :after_us ORDER BY received_at_us DESC LIMIT :examined) AS r
  WHERE VERDICT_BY(:rule) IS NOT 'success'
  UNION ALL
  SELECT job_id, at_us FROM (SELECT job_id, at_us, kind FROM events ORDER BY event_id DESC LIMIT :examined)
  WHERE at_us > :after_us AND kind IN ('job_dead', 'job_failed'))
SELECT j.job_id AS job, c.experiment_id AS experiment, m.name AS method, c.task, c.initialization,
  p.problem_id AS problem,
  coalesce(VERDICT_BY(:rule), j.state) AS outcome, max(e.at_us) AS at_us
FROM ended AS e
JOIN jobs AS j USING (job_id)
JOIN cells AS c USING (cell_id)
JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key)
LEFT JOIN results AS r ON r.job_id = j.job_id
WHERE j.state IN ('done', 'failed', 'dead') AND VERDICT_BY(:rule) IS NOT 'success'  -- a retry may have solved it
GROUP BY j.job_id
ORDER BY 8 DESC, 1 LIMIT :limit
