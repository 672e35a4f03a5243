-- Static equilibrium of the solutions that one rule accepts, by cell. Parameters: :experiment_id, :rule, and optional
-- :cell_ids. Order: methods by their first cell, task, initialization.
SELECT method, multi_starts, sample_size, collision, task, initialization, n, solved, tested, held, postures,
  without_equilibrium, over_torque, largest_torque_ratio, halfway_postures, halfway_without_equilibrium,
  halfway_over_torque
FROM holding_cells AS h
WHERE experiment_id = :experiment_id AND rule = :rule
  AND cell_id IN (:cell_ids)  -- if :cell_ids
ORDER BY (SELECT min(cell_id) FROM cells AS c WHERE c.experiment_id = h.experiment_id AND c.method_id = h.method_id),
  cell_id
