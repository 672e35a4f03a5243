-- The methods of an experiment. Parameters: :experiment_id. Order: method_id.
SELECT DISTINCT m.method_id, m.name AS method, m.multi_starts, m.sample_size, m.incremental, m.collision
FROM cells AS c JOIN methods AS m USING (method_id)
WHERE c.experiment_id = :experiment_id
ORDER BY m.method_id
