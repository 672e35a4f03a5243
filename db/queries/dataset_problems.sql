-- All problems of the dataset of an experiment, of the tasks that it has. Parameters: :experiment_id.
SELECT p.problem_key, p.task, p.problem_id
FROM problems AS p JOIN experiments AS e USING (dataset_id)
WHERE e.experiment_id = :experiment_id
  AND p.task IN (SELECT task FROM cells AS c WHERE c.experiment_id = :experiment_id)
