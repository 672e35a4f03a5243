-- The newest events after an event. Parameters: :after, :limit, and optional :experiment_id, :kinds. Order:
-- event_id.
SELECT * FROM (
  SELECT event_id, strftime('%Y-%m-%d %H:%M:%S', at_us / 1000000, 'unixepoch') AS utc, kind,
    experiment_id AS experiment, job_id AS job, worker_id AS worker, detail
  FROM events
  WHERE event_id > :after
    AND experiment_id = :experiment_id  -- if :experiment_id
    AND kind IN (:kinds)  -- if :kinds
  ORDER BY event_id DESC LIMIT :limit)
ORDER BY event_id
