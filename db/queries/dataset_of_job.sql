-- The hash of a job's dataset. Parameters: :job_id.
SELECT d.hash
FROM jobs JOIN cells USING (cell_id) JOIN experiments USING (experiment_id) JOIN datasets AS d USING (dataset_id)
WHERE job_id = :job_id
