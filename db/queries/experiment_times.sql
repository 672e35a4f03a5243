-- Times (UTC) of submission and of the newest end of an attempt. Parameters: :experiment_id.
SELECT datetime(submitted_at_us / 1000000, 'unixepoch') AS submitted,
  datetime((SELECT max(a.ended_at_us) FROM attempts AS a JOIN jobs AS j USING (job_id) JOIN cells AS c USING (cell_id)
    WHERE c.experiment_id = e.experiment_id) / 1000000, 'unixepoch') AS newest
FROM experiments AS e
WHERE experiment_id = :experiment_id
