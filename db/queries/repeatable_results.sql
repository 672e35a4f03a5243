-- Results of an experiment with one of the given statuses. Parameters: :experiment_id, :statuses, and optional
-- :cell_ids. Order: job_id.
SELECT r.job_id, r.cell_id
FROM results AS r JOIN cells AS c USING (cell_id)
WHERE c.experiment_id = :experiment_id AND r.solver_status IN (:statuses)
  AND r.cell_id IN (:cell_ids)  -- if :cell_ids
ORDER BY r.job_id
