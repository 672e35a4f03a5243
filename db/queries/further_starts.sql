-- Initial points of results beyond the first one of each window, by method; results of old releases do not count.
-- Parameters: :experiment_id, :method_ids, :cell_ids (none: all cells).
SELECT c.method_id, avg(max(r.starts - coalesce(r.windows, 1), 0)) AS mean, max(r.starts - coalesce(r.windows, 1)) AS largest
FROM cells AS c JOIN results AS r USING (cell_id)
WHERE c.experiment_id = :experiment_id AND c.method_id IN (:method_ids) AND r.starts IS NOT NULL
  AND c.cell_id IN (:cell_ids)  -- if :cell_ids
GROUP BY c.method_id
