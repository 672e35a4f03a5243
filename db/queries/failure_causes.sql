-- Ended jobs of a cell by state and verdict of a rule. Parameters: :cell_id, :rule. Order: most frequent first.
SELECT j.state, VERDICT_BY(:rule) AS verdict, count(*) AS n
FROM jobs AS j LEFT JOIN results AS r ON r.job_id = j.job_id
WHERE j.state IN ('done', 'failed', 'dead') AND j.cell_id = :cell_id
GROUP BY 1, 2
ORDER BY 3 DESC, 2, 1
