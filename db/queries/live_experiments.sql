-- Experiments as a server's status has them. Order: id.
SELECT experiment_id AS id, name, iif(state <> 'active' OR hold = 'none', state, 'paused') AS state, jobs, queued, leased,
  done, failed, dead, cancelled, solved, '' AS waiting_for, NULL AS eta_s
FROM experiment_list
ORDER BY experiment_id
