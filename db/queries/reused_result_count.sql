-- n: number of reused results. Parameters: :experiment_id.
SELECT count(*) AS n FROM jobs JOIN cells USING (cell_id)
WHERE taken_from IS NOT NULL AND experiment_id = :experiment_id
