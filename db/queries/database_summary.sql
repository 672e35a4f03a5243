-- Number of experiments and of their jobs.
SELECT count(*), coalesce(sum(num_jobs), 0) FROM experiments
