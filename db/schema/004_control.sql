-- legopt database, schema version 4: experiments that people pause, hold, favour and try again.

-- 'paused': no job is leased; 'held': the same, and what ran was given back, for the reason given.
ALTER TABLE experiments ADD COLUMN hold TEXT NOT NULL DEFAULT 'none' CHECK (hold IN ('none', 'paused', 'held'));
ALTER TABLE experiments ADD COLUMN hold_reason TEXT NOT NULL DEFAULT '' CHECK ((hold = 'held') = (hold_reason <> ''));
-- Jobs of the experiment with the largest priority are leased first; among equals, of the oldest.
ALTER TABLE experiments ADD COLUMN priority INTEGER NOT NULL DEFAULT 0 CHECK (priority BETWEEN -1000 AND 1000);

-- A terminal job stays as it is, but for one that died or failed: it may be tried again, and then none of its attempts
-- so far is charged.
DROP TRIGGER jobs_terminal_is_final;
CREATE TRIGGER jobs_terminal_is_final BEFORE UPDATE OF state, attempts, returned ON jobs
WHEN OLD.state IN ('done', 'cancelled') OR (OLD.state IN ('failed', 'dead')
  AND NOT (NEW.state = 'queued' AND NEW.attempts = OLD.attempts AND NEW.returned = OLD.attempts))
BEGIN
  SELECT RAISE(ABORT, 'a terminal job cannot change');
END;

-- As in version 2, with what holds an experiment back.
DROP VIEW experiment_list;
CREATE VIEW experiment_list AS
SELECT e.experiment_id, e.name, e.state, e.hold, e.hold_reason, e.priority, e.num_jobs AS jobs,
  count(*) FILTER (WHERE j.state = 'queued') AS queued, count(*) FILTER (WHERE j.state = 'leased') AS leased,
  count(*) FILTER (WHERE j.state = 'done') AS done, count(*) FILTER (WHERE j.state = 'failed') AS failed,
  count(*) FILTER (WHERE j.state = 'dead') AS dead, count(*) FILTER (WHERE j.state = 'cancelled') AS cancelled,
  (SELECT count(*) FROM results AS r JOIN cells AS k USING (cell_id)
   WHERE k.experiment_id = e.experiment_id AND r.solved_literal = 1) AS solved,
  d.name AS dataset, e.submitted_at_us, e.finished_at_us
FROM experiments AS e
JOIN datasets AS d USING (dataset_id)
JOIN cells AS c USING (experiment_id)
JOIN jobs AS j USING (cell_id)
GROUP BY e.experiment_id;
