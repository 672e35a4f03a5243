-- One row if a result of the experiment has no verdict by the rule, which it has since schema version 7 (solid) or 14
-- (physical). Parameters: :experiment_id, :rule.
SELECT cell_id FROM cell_results JOIN cells USING (cell_id)
WHERE experiment_id = :experiment_id
  AND CASE :rule WHEN 'solid' THEN unjudged_solid WHEN 'physical' THEN unjudged_physical ELSE 0 END > 0
LIMIT 1
