-- Number and mean CPU time of the results of methods, by task and dataset. Parameters: :method_hashes.
SELECT m.hash AS method, c.task, d.hash AS dataset, count(*) AS results, avg(r.cpu_us) / 1e6 AS cpu_s
FROM methods AS m
JOIN cells AS c USING (method_id)
JOIN experiments AS e USING (experiment_id)
JOIN datasets AS d USING (dataset_id)
JOIN results AS r USING (cell_id)
WHERE m.hash IN (:method_hashes)
GROUP BY m.hash, c.task, d.hash
