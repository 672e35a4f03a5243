-- Experiments with the states of their jobs, for 'legopt status'. Parameters: :experiment_id (none: all). Order:
-- experiment.
SELECT experiment_id AS experiment, name,
  iif(state <> 'active' OR hold = 'none', state, 'paused' || iif(hold_reason = '', '', ': ' || hold_reason)) AS state, priority,
  jobs, queued, leased, done, failed, dead, cancelled, solved, submitter, dataset,
  (SELECT group_concat(name, ', ') FROM (SELECT m.name FROM cells AS c JOIN methods AS m USING (method_id)
    WHERE c.experiment_id = l.experiment_id GROUP BY m.name ORDER BY min(c.cell_id))) AS methods, tags
FROM experiment_list AS l
WHERE experiment_id = :experiment_id  -- if :experiment_id
ORDER BY experiment_id
