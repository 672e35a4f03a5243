-- One row if a result of the experiment has no verdict by the rule, which it has since schema version 7 (solid) or 14
-- (physical). Parameters: :experiment_id, :rule.
SELECT job_id FROM results JOIN cells USING (cell_id)
WHERE experiment_id = :experiment_id
  AND CASE :rule WHEN 'solid' THEN verdict_solid WHEN 'physical' THEN verdict_physical ELSE '' END IS NULL
LIMIT 1
