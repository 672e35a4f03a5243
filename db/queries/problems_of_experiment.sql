-- All problems of an experiment, solved or not. Parameters: :experiment_id.
SELECT DISTINCT c.task, p.problem_id AS problem
FROM jobs AS j JOIN cells AS c USING (cell_id) JOIN problems AS p USING (problem_key)
WHERE c.experiment_id = :experiment_id
