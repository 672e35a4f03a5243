-- n: number of jobs of an export, with or without a result. Parameters: as exported_results.
SELECT count(*) AS n
FROM jobs AS j JOIN cells AS c USING (cell_id) JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key) LEFT JOIN results AS r ON r.job_id = j.job_id
WHERE c.experiment_id = :experiment_id
  AND c.cell_id IN (:cell_ids)  -- if :cell_ids
