-- The attempts of a job with worker, cause and log. Parameters: :job_id. Order: attempt.
SELECT attempt, outcome, w.name AS worker, w.hostname, w.build_id AS build, w.processor, exit_signal,
  (ended_at_us - leased_at_us) / 1e6 AS seconds,
  strftime('%Y-%m-%d %H:%M:%S', leased_at_us / 1000000, 'unixepoch') AS leased_utc, message, log_tail
FROM attempts JOIN workers AS w USING (worker_id)
WHERE job_id = :job_id
ORDER BY attempt
