-- One job with its experiment, method and limits, for 'legopt show'. Parameters: :job_id.
SELECT j.job_id, c.experiment_id, e.name AS experiment, e.submitter, d.name AS dataset, d.hash AS dataset_hash,
  d.joint_names, m.name AS method, m.hash AS method_hash, m.multi_starts, m.sample_size, m.incremental, m.collision,
  c.task, c.initialization, p.problem_id, j.repetition, e.seed, m.options_json AS method_options, j.state, j.attempts,
  j.max_attempts, j.taken_from, c.effort_limit, coalesce(c.wall_limit_us, e.wall_limit_us) / 1e6 AS wall_limit_s,
  e.memory_limit_bytes
FROM jobs AS j
JOIN cells AS c USING (cell_id)
JOIN experiments AS e USING (experiment_id)
JOIN datasets AS d USING (dataset_id)
JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key)
WHERE j.job_id = :job_id
