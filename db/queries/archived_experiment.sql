-- The specification of an experiment as submitted. Parameters: :experiment_id.
SELECT spec_json FROM experiments WHERE experiment_id = :experiment_id
