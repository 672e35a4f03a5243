-- Results of an experiment with one of the given statuses. Parameters: :experiment_id, :statuses. Order: job_id.
SELECT r.job_id, r.cell_id
FROM results AS r JOIN cells AS c USING (cell_id)
WHERE c.experiment_id = :experiment_id AND r.solver_status IN (:statuses)
ORDER BY r.job_id
