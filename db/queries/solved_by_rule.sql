-- solved: number of jobs of each cell solved by one rule. Parameters: :experiment_id, :rule.
SELECT method_id, task, initialization, solved
FROM benchmark_cells
WHERE experiment_id = :experiment_id AND rule = :rule
