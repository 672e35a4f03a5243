-- The solutions of jobs. Parameters: :job_ids. Order: job_id, waypoint.
SELECT job_id, x FROM waypoints WHERE job_id IN (:job_ids) ORDER BY job_id, waypoint
