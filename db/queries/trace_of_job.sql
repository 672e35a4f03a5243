-- State, trace and older history of a job; job_id is NULL without a result. Parameters: :job_id.
SELECT j.state, r.job_id, r.trace, r.history_json
FROM jobs AS j LEFT JOIN results AS r ON r.job_id = j.job_id
WHERE j.job_id = :job_id
