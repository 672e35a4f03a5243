-- From schema version 16 to 17: numbers of results by cell, and indexes of ended jobs and of results by arrival.
-- tables.sql states the new column.
DROP INDEX dead_jobs_by_cell;
CREATE INDEX jobs_without_result_by_cell ON jobs (cell_id, state) WHERE state IN ('failed', 'dead', 'cancelled');
CREATE INDEX results_by_arrival ON results (received_at_us);

CREATE TABLE cell_results (
  cell_id INTEGER PRIMARY KEY REFERENCES cells,
  results INTEGER NOT NULL DEFAULT 0 CHECK (results >= 0),
  solved_literal INTEGER NOT NULL DEFAULT 0 CHECK (solved_literal >= 0),
  solved_strict INTEGER NOT NULL DEFAULT 0 CHECK (solved_strict >= 0),
  solved_solid INTEGER NOT NULL DEFAULT 0 CHECK (solved_solid >= 0),
  solved_physical INTEGER NOT NULL DEFAULT 0 CHECK (solved_physical >= 0),
  unjudged_solid INTEGER NOT NULL DEFAULT 0 CHECK (unjudged_solid >= 0),
  unjudged_physical INTEGER NOT NULL DEFAULT 0 CHECK (unjudged_physical >= 0)
) STRICT;

INSERT INTO cell_results (cell_id) SELECT cell_id FROM cells;
UPDATE cell_results SET
  results = r.results,
  solved_literal = r.solved_literal,
  solved_strict = r.solved_strict,
  solved_solid = r.solved_solid,
  solved_physical = r.solved_physical,
  unjudged_solid = r.unjudged_solid,
  unjudged_physical = r.unjudged_physical
FROM (
  SELECT cell_id, count(*) AS results,
    count(*) FILTER (WHERE verdict_literal = 'success') AS solved_literal,
    count(*) FILTER (WHERE verdict_strict = 'success') AS solved_strict,
    count(*) FILTER (WHERE verdict_solid = 'success') AS solved_solid,
    count(*) FILTER (WHERE verdict_physical = 'success') AS solved_physical,
    count(*) FILTER (WHERE verdict_solid IS NULL) AS unjudged_solid,
    count(*) FILTER (WHERE verdict_physical IS NULL) AS unjudged_physical
  FROM results GROUP BY cell_id) AS r
WHERE r.cell_id = cell_results.cell_id;

DROP TRIGGER results_are_counted;
DROP TRIGGER results_are_counted_down;

CREATE TRIGGER cells_are_counted AFTER INSERT ON cells
BEGIN
  INSERT INTO cell_results (cell_id) VALUES (NEW.cell_id);
END;

CREATE TRIGGER results_are_counted AFTER INSERT ON results
BEGIN
  INSERT INTO result_workers (experiment_id, worker_id, results)
  SELECT c.experiment_id, a.worker_id, 1 FROM cells AS c, attempts AS a
  WHERE c.cell_id = NEW.cell_id AND a.job_id = NEW.job_id AND a.attempt = NEW.attempt
  ON CONFLICT (experiment_id, worker_id) DO UPDATE SET results = results + 1;
  UPDATE cell_results SET
    results = results + 1,
    solved_literal = solved_literal + (NEW.verdict_literal IS 'success'),
    solved_strict = solved_strict + (NEW.verdict_strict IS 'success'),
    solved_solid = solved_solid + (NEW.verdict_solid IS 'success'),
    solved_physical = solved_physical + (NEW.verdict_physical IS 'success'),
    unjudged_solid = unjudged_solid + (NEW.verdict_solid IS NULL),
    unjudged_physical = unjudged_physical + (NEW.verdict_physical IS NULL)
  WHERE cell_id = NEW.cell_id;
END;

CREATE TRIGGER results_are_counted_down AFTER DELETE ON results
BEGIN
  UPDATE result_workers SET results = results - 1
  WHERE experiment_id = (SELECT experiment_id FROM cells WHERE cell_id = OLD.cell_id)
    AND worker_id = (SELECT worker_id FROM attempts WHERE job_id = OLD.job_id AND attempt = OLD.attempt);
  UPDATE cell_results SET
    results = results - 1,
    solved_literal = solved_literal - (OLD.verdict_literal IS 'success'),
    solved_strict = solved_strict - (OLD.verdict_strict IS 'success'),
    solved_solid = solved_solid - (OLD.verdict_solid IS 'success'),
    solved_physical = solved_physical - (OLD.verdict_physical IS 'success'),
    unjudged_solid = unjudged_solid - (OLD.verdict_solid IS NULL),
    unjudged_physical = unjudged_physical - (OLD.verdict_physical IS NULL)
  WHERE cell_id = OLD.cell_id;
END;
