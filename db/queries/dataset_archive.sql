-- The packed dataset of a hash; no row if it is not stored. Parameters: :hash.
SELECT archive FROM dataset_archives JOIN datasets USING (dataset_id) WHERE hash = :hash
