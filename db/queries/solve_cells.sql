-- The cells of an experiment with method and limits. Parameters: :experiment_id. Order: cell_id.
SELECT c.cell_id, c.num_jobs, c.task, c.initialization, coalesce(c.wall_limit_us, e.wall_limit_us) AS wall_limit_us,
  c.effort_limit IS NOT NULL AS effort_limited, e.seed, e.repetitions, m.method_id, m.name, m.multi_starts,
  m.sample_size, m.incremental, m.collision, m.hash,
  iif(json_valid(m.options_json), coalesce(json_extract(m.options_json, '$.options.rescues'), 0), 0) AS inner_starts
FROM cells AS c JOIN experiments AS e USING (experiment_id) JOIN methods AS m USING (method_id)
WHERE c.experiment_id = :experiment_id
ORDER BY c.cell_id
