-- Ended jobs of a cell by state and verdict of a rule. Parameters: :cell_id, :rule. Order: most frequent first.
SELECT j.state, CASE :rule WHEN 'literal' THEN r.verdict_literal WHEN 'strict' THEN r.verdict_strict
    WHEN 'solid' THEN r.verdict_solid ELSE r.verdict_physical END
  AS verdict, count(*) AS n
FROM jobs AS j LEFT JOIN results AS r ON r.job_id = j.job_id
WHERE j.state IN ('done', 'failed', 'dead') AND j.cell_id = :cell_id
GROUP BY 1, 2
ORDER BY 3 DESC, 2, 1
