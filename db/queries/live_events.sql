-- The newest events that may change a user's plans. Parameters: :limit. Order: newest first.
SELECT at_us, kind, experiment_id AS experiment, job_id AS job, worker_id AS worker, detail
FROM events
WHERE kind IN ('worker_lost', 'job_dead', 'job_failed', 'jobs_refused', 'disk_low', 'no_progress',
  'experiment_finished')
ORDER BY event_id DESC LIMIT :limit
