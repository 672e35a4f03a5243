-- Workers with running jobs, as a server's status has them. Order: id.
SELECT w.worker_id AS id, w.name, w.hostname, w.slots, count(*) AS leases, 1 AS online, 0 AS draining,
  NULL AS silent_s, NULL AS load, w.build_id
FROM attempts AS a JOIN workers AS w USING (worker_id)
WHERE a.outcome = 'running'
GROUP BY w.worker_id
ORDER BY w.worker_id
