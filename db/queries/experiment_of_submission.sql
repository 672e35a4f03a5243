-- The experiment of a submission; no row if there is none. Parameters: :submission_id.
SELECT experiment_id FROM experiments WHERE submission_id = :submission_id
