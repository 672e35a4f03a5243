-- The events of a job. Parameters: :job_id. Order: event_id.
SELECT strftime('%Y-%m-%d %H:%M:%S', at_us / 1000000, 'unixepoch') AS utc, kind, detail
FROM events
WHERE job_id = :job_id
ORDER BY event_id
