-- One experiment with its dataset and rule. Parameters: :experiment_id (none: the newest).
SELECT e.experiment_id, e.name, e.state, d.name AS dataset, d.hash, e.num_jobs,
  coalesce(json_extract(e.spec_json, '$.split'), 'all') AS split, e.rule
FROM experiments AS e JOIN datasets AS d USING (dataset_id)
WHERE e.experiment_id = :experiment_id  -- if :experiment_id
ORDER BY e.experiment_id DESC LIMIT 1
