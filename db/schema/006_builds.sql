-- legopt database, schema version 6: which build on which machine made a result, and words of tasks that no table lists.

-- What a task is stands in words/task.h; a table only asks for the shape of a word. (This is how SQLite wants a CHECK to
-- be taken away: nothing that is stored changes.)
PRAGMA writable_schema = ON;
UPDATE sqlite_schema
SET sql = replace(sql, 'CHECK (task IN (''posture'', ''motion''))',
  'CHECK (length(task) BETWEEN 1 AND 50 AND task NOT GLOB ''*[^a-z_]*'')')
WHERE type = 'table' AND name IN ('problems', 'cells');
PRAGMA writable_schema = RESET;

-- 'one': finished by the build that took the first job, build_id from then on. NULL: no job was taken since version 6.
ALTER TABLE experiments ADD COLUMN builds TEXT NOT NULL DEFAULT 'one' CHECK (builds IN ('one', 'any'));
ALTER TABLE experiments ADD COLUMN build_id TEXT CHECK (length(build_id) BETWEEN 1 AND 64);

-- What a solve has cost, in counts that no load changes. NULL: not counted.
-- starts: points that a descent was begun from; of LegOpt-best several inside an attempt.
ALTER TABLE results ADD COLUMN starts INTEGER CHECK (starts >= 1);
-- term_evaluations: calls of terms of the objective, for values or derivatives.
ALTER TABLE results ADD COLUMN term_evaluations INTEGER CHECK (term_evaluations >= 1);
-- collision_queries: contacts of the robot at one configuration, asked for by the solver.
ALTER TABLE results ADD COLUMN collision_queries INTEGER CHECK (collision_queries >= 1);

-- Equal build_id: the same bits. processors: granted to the worker; memory_bytes and load (mean number of running
-- processes in a minute, at the worker's last sighting): of its host. NULL: not known.
ALTER TABLE workers ADD COLUMN build_id TEXT CHECK (length(build_id) BETWEEN 1 AND 64);
ALTER TABLE workers ADD COLUMN processor TEXT NOT NULL DEFAULT '';
ALTER TABLE workers ADD COLUMN processors INTEGER CHECK (processors >= 1);
ALTER TABLE workers ADD COLUMN memory_bytes INTEGER CHECK (memory_bytes > 0);
ALTER TABLE workers ADD COLUMN load REAL CHECK (load >= 0);

-- How many accepted results of an experiment each worker made: kept by the triggers, for captions of large tables.
CREATE TABLE result_workers (
  experiment_id INTEGER NOT NULL REFERENCES experiments,
  worker_id INTEGER NOT NULL REFERENCES workers,
  results INTEGER NOT NULL CHECK (results >= 0),
  PRIMARY KEY (experiment_id, worker_id)
) STRICT, WITHOUT ROWID;

INSERT INTO result_workers
SELECT c.experiment_id, a.worker_id, count(*)
FROM results AS r JOIN cells AS c USING (cell_id) JOIN attempts AS a ON a.job_id = r.job_id AND a.attempt = r.attempt
GROUP BY c.experiment_id, a.worker_id;

CREATE TRIGGER results_are_counted AFTER INSERT ON results
BEGIN
  INSERT INTO result_workers (experiment_id, worker_id, results)
  SELECT c.experiment_id, a.worker_id, 1 FROM cells AS c, attempts AS a
  WHERE c.cell_id = NEW.cell_id AND a.job_id = NEW.job_id AND a.attempt = NEW.attempt
  ON CONFLICT (experiment_id, worker_id) DO UPDATE SET results = results + 1;
END;

CREATE TRIGGER results_are_counted_down AFTER DELETE ON results
BEGIN
  UPDATE result_workers SET results = results - 1
  WHERE experiment_id = (SELECT experiment_id FROM cells WHERE cell_id = OLD.cell_id)
    AND worker_id = (SELECT worker_id FROM attempts WHERE job_id = OLD.job_id AND attempt = OLD.attempt);
END;

-- Where the accepted results of an experiment come from.
CREATE VIEW result_origins AS
SELECT s.experiment_id, w.build_id, w.build, w.hostname, w.processor, max(w.processors) AS processors,
  w.memory_bytes, max(w.load) AS load, count(*) AS workers, sum(s.results) AS results
FROM result_workers AS s JOIN workers AS w USING (worker_id)
WHERE s.results > 0
GROUP BY s.experiment_id, w.build_id, w.build, w.hostname, w.processor, w.memory_bytes;

DROP VIEW job_list;
DROP VIEW experiment_list;

-- As in version 5, with the effort of a solve, and the host, its processor and the build of the worker.
CREATE VIEW job_list AS
SELECT j.job_id, c.experiment_id, m.name AS method, m.multi_starts, m.sample_size, m.incremental, m.collision, c.task,
  c.initialization, p.problem_id, j.repetition, j.state, j.attempts, r.solver_status, r.verdict_literal,
  r.verdict_strict, r.windows_solved, r.windows, r.cost, r.time_s, r.wall_us, r.cpu_us,
  r.iterations, r.restarts, r.starts, r.term_evaluations, r.collision_queries,
  r.interpolation_environment_depth_m, r.interpolation_self_depth_m, r.interpolation_free_share, w.name AS worker,
  w.hostname, w.processor, w.build_id
FROM jobs AS j
JOIN cells AS c USING (cell_id)
JOIN methods AS m USING (method_id)
JOIN problems AS p USING (problem_key)
LEFT JOIN results AS r ON r.job_id = j.job_id
LEFT JOIN attempts AS a ON a.job_id = j.job_id AND a.attempt = j.attempts
LEFT JOIN workers AS w ON w.worker_id = a.worker_id;

-- As in version 5, with the build.
CREATE VIEW experiment_list AS
SELECT e.experiment_id, e.name, e.submitter,
  coalesce((SELECT group_concat(t.tag, ',') FROM (SELECT tag FROM experiment_tags
    WHERE experiment_tags.experiment_id = e.experiment_id ORDER BY tag) AS t), '') AS tags,
  e.state, e.hold, e.hold_reason, e.priority, e.builds, e.build_id, e.num_jobs AS jobs,
  count(*) FILTER (WHERE j.state = 'queued') AS queued, count(*) FILTER (WHERE j.state = 'leased') AS leased,
  count(*) FILTER (WHERE j.state = 'done') AS done, count(*) FILTER (WHERE j.state = 'failed') AS failed,
  count(*) FILTER (WHERE j.state = 'dead') AS dead, count(*) FILTER (WHERE j.state = 'cancelled') AS cancelled,
  (SELECT count(*) FROM results AS r JOIN cells AS k USING (cell_id)
   WHERE k.experiment_id = e.experiment_id AND r.solved_literal = 1) AS solved,
  d.name AS dataset, e.seed, e.repetitions, e.submitted_at_us, e.finished_at_us
FROM experiments AS e
JOIN datasets AS d USING (dataset_id)
JOIN cells AS c USING (experiment_id)
JOIN jobs AS j USING (cell_id)
GROUP BY e.experiment_id;
