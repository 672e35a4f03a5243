-- From schema version 11 to 12: the rule of an experiment. It is the suite's rule if the suite has one. Else it is the
-- solid rule if all results have a verdict by it, and the original evaluator's rule if not.
ALTER TABLE experiments ADD COLUMN rule TEXT NOT NULL DEFAULT 'solid' CHECK (rule IN ('literal', 'strict', 'solid'));
UPDATE experiments SET rule = coalesce(json_extract(spec_json, '$.rule'),
  CASE WHEN EXISTS (SELECT 1 FROM cells AS c JOIN results AS r USING (cell_id)
                    WHERE c.experiment_id = experiments.experiment_id AND r.verdict_solid IS NULL)
    THEN 'literal' ELSE 'solid' END);
