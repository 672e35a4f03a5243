-- The trace of a result. Parameters: :job_id.
SELECT trace FROM results WHERE job_id = :job_id
