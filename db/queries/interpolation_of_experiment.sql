-- Collisions between waypoints by method and initialization, by one rule. Parameters: :experiment_id, :rule, :task
-- (the task of the view interpolation_cells). Order: methods by their first cell, initialization.
SELECT b.*, e.name AS experiment,
  iif(json_valid(m.options_json), coalesce(json_extract(m.options_json, '$.options.rescues'), 0), 0) AS inner_starts,
  (SELECT count(*) FROM clock_stopped AS k JOIN cells AS c USING (cell_id)
   WHERE k.experiment_id = :experiment_id AND c.method_id = b.method_id AND c.initialization = b.initialization
     AND c.task = :task) AS clock_stopped
FROM interpolation_cells AS b JOIN experiments AS e USING (experiment_id) JOIN methods AS m USING (method_id)
WHERE b.experiment_id = :experiment_id AND b.rule = :rule
ORDER BY (SELECT min(cell_id) FROM cells AS c WHERE c.experiment_id = b.experiment_id AND c.method_id = b.method_id),
  initialization
