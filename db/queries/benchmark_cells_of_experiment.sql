-- The cells of the benchmark table by one rule. Finished jobs without a result are dead, failed or cancelled. Parameters:
-- :experiment_id, :rule. Order: methods by their first cell, task, initialization.
WITH s AS MATERIALIZED (
  SELECT b.*, c.cell_id, e.repetitions, w.dead, w.failed, w.cancelled, w.taken_over
  FROM benchmark_cells AS b
  JOIN cells AS c USING (experiment_id, method_id, task, initialization)
  JOIN cell_states AS w ON w.cell_id = c.cell_id
  JOIN experiments AS e ON e.experiment_id = c.experiment_id
  WHERE b.experiment_id = :experiment_id AND b.rule = :rule),
stopped AS MATERIALIZED (  -- once for all cells
  SELECT cell_id, count(*) AS n FROM clock_stopped WHERE experiment_id = :experiment_id GROUP BY cell_id)
SELECT method_id, method, multi_starts, sample_size, collision, task, initialization, n, finished, solved, cost, time_s,
  experiment, dead, failed, cancelled, n / repetitions AS problems, repetitions,
  coalesce((SELECT n FROM stopped AS k WHERE k.cell_id = s.cell_id), 0) AS clock_stopped, taken_over,
  (SELECT iif(json_valid(m.options_json), coalesce(json_extract(m.options_json, '$.options.rescues'), 0), 0)
   FROM methods AS m WHERE m.method_id = s.method_id) AS inner_starts
FROM s
ORDER BY (SELECT min(cell_id) FROM s AS m WHERE m.method_id = s.method_id), task, initialization
