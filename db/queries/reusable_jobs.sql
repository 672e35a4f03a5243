-- Finished results that a submission would reuse, of one task. Parameters: :method_hashes, :dataset_hash, :seed,
-- :repetitions, :memory_bytes, :initializations, :task, :wall_us, :effort_limit (none: unlimited).
SELECT DISTINCT build_id, method_hash, task, initialization, problem_id, repetition
FROM reusable_results
WHERE method_hash IN (:method_hashes) AND dataset_hash = :dataset_hash AND seed = :seed AND repetition < :repetitions
  AND peak_memory_bytes <= :memory_bytes AND initialization IN (:initializations) AND task = :task
  AND wall_us <= :wall_us AND effort_limit IS :effort_limit
