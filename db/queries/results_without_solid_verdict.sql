-- One row if a result of the experiment has no verdict by the solid rule. Parameters: :experiment_id.
SELECT job_id FROM results JOIN cells USING (cell_id)
WHERE experiment_id = :experiment_id AND verdict_solid IS NULL
LIMIT 1
