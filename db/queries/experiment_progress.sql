-- progress: a text that changes with the state and the number of ended jobs of the experiments. Parameters:
-- :experiment_ids (none: all), :newest (set: only the newest).
SELECT coalesce(group_concat(experiment_id || ':' || state || ':' || (jobs - queued - leased)), '') AS progress
FROM (
  SELECT * FROM experiment_list
  WHERE experiment_id IN (:experiment_ids)  -- if :experiment_ids
  ORDER BY experiment_id DESC
  LIMIT 1  -- if :newest
)
