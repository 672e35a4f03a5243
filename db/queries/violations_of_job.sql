-- Values of the judge's checks for the result of a job. Parameters: :job_id. Order: check_name, rule.
SELECT check_name, rule, waypoint, subject, value
FROM violations
WHERE job_id = :job_id
ORDER BY check_name, rule
