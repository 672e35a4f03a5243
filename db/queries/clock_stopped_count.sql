-- n: number of jobs stopped by the wall-time limit. Parameters: :experiment_id.
SELECT count(*) AS n FROM clock_stopped WHERE experiment_id = :experiment_id
