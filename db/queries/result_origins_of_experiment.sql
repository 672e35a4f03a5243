-- Builds and hosts of an experiment's results. Parameters: :experiment_id. Order: most results first.
SELECT coalesce(build_id, '') AS build_id, build, hostname, processor, processors, memory_bytes, load, workers, results
FROM result_origins
WHERE experiment_id = :experiment_id
ORDER BY results DESC, hostname, build_id, processor
