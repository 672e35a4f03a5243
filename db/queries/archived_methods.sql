-- The methods of an experiment. Parameters: :experiment_id. Order: as in its table.
SELECT method_id, name, hash, options_json, multi_starts, sample_size
FROM methods JOIN (SELECT method_id, min(cell_id) AS first FROM cells WHERE experiment_id = :experiment_id GROUP BY method_id)
  USING (method_id)
ORDER BY first
