-- Identity and state of a job. Parameters: :job_id.
SELECT job_id, experiment_id, method, task, initialization, problem_id, repetition, state, attempts
FROM job_list
WHERE job_id = :job_id
