-- The packed dataset of a hash, and its name; no row if it is not stored. Parameters: :hash.
SELECT archive, name FROM dataset_archives JOIN datasets USING (dataset_id) WHERE hash = :hash
