-- n: number of reused results. Parameters: :experiment_id.
SELECT sum(taken_over) AS n FROM cell_states WHERE experiment_id = :experiment_id
