-- Tables, indexes and triggers of a new legopt database. Views: views.sql. docs/reference/database.md describes both.
-- Times *_at_us are microseconds since 1970 (UTC); durations *_us are microseconds.
-- A column's place must not change: upgraded files have the same order of columns. "since N" after a column: upgrades add
-- it to the tables of versions before N; values of older rows are NULL.

CREATE TABLE datasets (
  dataset_id INTEGER PRIMARY KEY,
  name TEXT NOT NULL CHECK (length(name) BETWEEN 1 AND 200),
  hash TEXT NOT NULL UNIQUE CHECK (length(hash) = 64 AND hash NOT GLOB '*[^0-9a-f]*'),
  joint_names TEXT CHECK (joint_names LIKE '["%"]')  -- JSON array in the order of a solution; NULL: unknown
) STRICT;

-- Methods with equal hashes have equal options. Tables show the name, so one set of options may have several names.
CREATE TABLE methods (
  method_id INTEGER PRIMARY KEY,
  name TEXT NOT NULL CHECK (length(name) BETWEEN 1 AND 200),
  hash TEXT NOT NULL CHECK (length(hash) = 64 AND hash NOT GLOB '*[^0-9a-f]*'),
  options_json TEXT NOT NULL CHECK (options_json GLOB '{*}'),
  multi_starts INTEGER NOT NULL CHECK (multi_starts >= 0),
  sample_size INTEGER NOT NULL CHECK (sample_size BETWEEN 1 AND 100),
  incremental INTEGER NOT NULL CHECK (incremental IN (0, 1)),
  -- Collision model of the solver, repeated from the options. SQLite does not allow JSON functions in a generated
  -- column of an untrusted schema.
  collision TEXT NOT NULL DEFAULT 'solid' CHECK (length(collision) BETWEEN 1 AND 50 AND collision NOT GLOB '*[^a-z_]*'),
  UNIQUE (hash, name)  -- the view reusable_results searches this index
) STRICT;

-- legopt/types/task.h lists the tasks; the schema checks the form of a name only.
CREATE TABLE problems (
  problem_key INTEGER PRIMARY KEY,
  dataset_id INTEGER NOT NULL REFERENCES datasets,
  task TEXT NOT NULL CHECK (length(task) BETWEEN 1 AND 50 AND task NOT GLOB '*[^a-z_]*'),
  problem_id INTEGER NOT NULL CHECK (problem_id >= 0),
  waypoints INTEGER NOT NULL CHECK (waypoints >= 1),
  UNIQUE (dataset_id, task, problem_id)
) STRICT;

CREATE TABLE experiments (
  experiment_id INTEGER PRIMARY KEY CHECK (experiment_id > 0),
  submission_id TEXT NOT NULL UNIQUE CHECK (length(submission_id) BETWEEN 1 AND 200),
  name TEXT NOT NULL CHECK (length(name) BETWEEN 1 AND 200),
  state TEXT NOT NULL DEFAULT 'active' CHECK (state IN ('active', 'done', 'cancelled')),
  dataset_id INTEGER NOT NULL REFERENCES datasets,
  seed INTEGER NOT NULL CHECK (seed >= 0),
  repetitions INTEGER NOT NULL CHECK (repetitions >= 1),
  max_attempts INTEGER NOT NULL CHECK (max_attempts BETWEEN 1 AND 100),
  wall_limit_us INTEGER NOT NULL CHECK (wall_limit_us > 0),  -- the largest limit of its cells
  memory_limit_bytes INTEGER NOT NULL CHECK (memory_limit_bytes > 0),
  first_job_id INTEGER NOT NULL UNIQUE CHECK (first_job_id > 0),
  num_jobs INTEGER NOT NULL CHECK (num_jobs >= 1),
  spec_json TEXT NOT NULL CHECK (spec_json GLOB '{*}'),
  spec_hash TEXT NOT NULL CHECK (length(spec_hash) = 64 AND spec_hash NOT GLOB '*[^0-9a-f]*'),
  submitted_at_us INTEGER NOT NULL,
  finished_at_us INTEGER,
  -- 'paused': no job is leased. 'held': running jobs were released too, for the reason in hold_reason.
  hold TEXT NOT NULL DEFAULT 'none' CHECK (hold IN ('none', 'paused', 'held')),
  hold_reason TEXT NOT NULL DEFAULT '' CHECK ((hold = 'held') = (hold_reason <> '')),
  -- The server leases jobs of the largest priority first, and of the oldest experiment among equals.
  priority INTEGER NOT NULL DEFAULT 0 CHECK (priority BETWEEN -1000 AND 1000),
  submitter TEXT NOT NULL DEFAULT '' CHECK (length(submitter) <= 200),
  -- 'one': only the build that took the first job, build_id, may finish the experiment. NULL: no job taken yet.
  builds TEXT NOT NULL DEFAULT 'one' CHECK (builds IN ('one', 'any')),
  build_id TEXT CHECK (length(build_id) BETWEEN 1 AND 64),
  rule TEXT NOT NULL DEFAULT 'solid' CHECK (rule IN ('literal', 'strict', 'solid', 'physical')),  -- decides which results count
  CHECK ((state = 'active') = (finished_at_us IS NULL))
) STRICT;

-- A cell of the benchmark table: all jobs of one method, task and initialisation of an experiment.
CREATE TABLE cells (
  cell_id INTEGER PRIMARY KEY CHECK (cell_id > 0),
  experiment_id INTEGER NOT NULL REFERENCES experiments,
  method_id INTEGER NOT NULL REFERENCES methods,
  task TEXT NOT NULL CHECK (length(task) BETWEEN 1 AND 50 AND task NOT GLOB '*[^a-z_]*'),
  initialization TEXT NOT NULL CHECK (initialization IN ('good', 'in_collision')),
  num_jobs INTEGER NOT NULL CHECK (num_jobs >= 1),
  wall_limit_us INTEGER CHECK (wall_limit_us > 0),
  effort_limit INTEGER CHECK (effort_limit > 0),  -- term evaluations of a job; NULL: unlimited
  UNIQUE (experiment_id, method_id, task, initialization)
) STRICT;

CREATE TABLE jobs (
  job_id INTEGER PRIMARY KEY CHECK (job_id > 0),
  cell_id INTEGER NOT NULL REFERENCES cells,
  problem_key INTEGER NOT NULL REFERENCES problems,
  repetition INTEGER NOT NULL CHECK (repetition >= 0),
  state TEXT NOT NULL DEFAULT 'queued' CHECK (state IN ('queued', 'leased', 'done', 'failed', 'dead', 'cancelled')),
  attempts INTEGER NOT NULL DEFAULT 0 CHECK (attempts >= 0),
  returned INTEGER NOT NULL DEFAULT 0 CHECK (returned BETWEEN 0 AND attempts),  -- attempts that are not charged
  max_attempts INTEGER NOT NULL CHECK (max_attempts BETWEEN 1 AND 100),
  -- Job of another experiment whose result this job reuses; it may have been deleted. NULL: solved by this job.
  taken_from INTEGER CHECK (taken_from IS NULL OR
    (taken_from > 0 AND taken_from <> job_id AND state IN ('leased', 'done'))),
  CHECK (attempts - returned <= max_attempts),
  CHECK (attempts > 0 OR state IN ('queued', 'cancelled')),
  UNIQUE (cell_id, problem_key, repetition),
  UNIQUE (job_id, cell_id)  -- for the foreign key of results
) STRICT;

CREATE TABLE workers (
  worker_id INTEGER PRIMARY KEY CHECK (worker_id > 0),
  endpoint INTEGER NOT NULL UNIQUE CHECK (endpoint > 0),  -- address of the process on the bus
  name TEXT NOT NULL,
  hostname TEXT NOT NULL,
  pid INTEGER NOT NULL CHECK (pid >= 0),
  slots INTEGER NOT NULL CHECK (slots >= 1),
  build TEXT NOT NULL,
  first_seen_at_us INTEGER NOT NULL,
  last_seen_at_us INTEGER NOT NULL,
  build_id TEXT CHECK (length(build_id) BETWEEN 1 AND 64),  -- builds with equal ids compute the same bits
  processor TEXT NOT NULL DEFAULT '',
  processors INTEGER CHECK (processors >= 1),  -- number granted to the worker; NULL: unknown
  memory_bytes INTEGER CHECK (memory_bytes > 0),  -- memory of the host; NULL: unknown
  load REAL CHECK (load >= 0)  -- one-minute load average of the host at last_seen_at_us; NULL: unknown
) STRICT;

-- All leases. Attempts with the outcome 'returned' are not charged to the job.
CREATE TABLE attempts (
  job_id INTEGER NOT NULL REFERENCES jobs,
  attempt INTEGER NOT NULL CHECK (attempt >= 1),
  worker_id INTEGER NOT NULL REFERENCES workers,
  token INTEGER NOT NULL CHECK (token > 0),
  outcome TEXT NOT NULL DEFAULT 'running' CHECK (outcome IN ('running', 'finished', 'crashed', 'time_limit',
    'memory_limit', 'error', 'expired', 'cancelled', 'returned')),
  exit_signal INTEGER CHECK (exit_signal > 0),
  message TEXT NOT NULL DEFAULT '',
  log_tail TEXT NOT NULL DEFAULT '',
  leased_at_us INTEGER NOT NULL,
  ended_at_us INTEGER,
  CHECK ((outcome = 'running') = (ended_at_us IS NULL)),
  PRIMARY KEY (job_id, attempt)
) STRICT, WITHOUT ROWID;

CREATE UNIQUE INDEX one_running_attempt_per_job ON attempts (job_id) WHERE outcome = 'running';

-- The accepted result of a job: at most one, by the primary key.
CREATE TABLE results (
  job_id INTEGER PRIMARY KEY,
  cell_id INTEGER NOT NULL,  -- that of the job, repeated here so that one index serves the benchmark table
  attempt INTEGER NOT NULL,
  solver_status TEXT NOT NULL CHECK (solver_status IN ('not_run', 'converged_feasible', 'converged_infeasible',
    'iteration_limit', 'effort_limit', 'time_limit', 'numerical_failure', 'cancelled')),
  iterations INTEGER NOT NULL CHECK (iterations >= 0),
  restarts INTEGER NOT NULL CHECK (restarts >= 0),
  wall_us INTEGER NOT NULL CHECK (wall_us >= 0),
  cpu_us INTEGER NOT NULL CHECK (cpu_us >= 0),
  involuntary_context_switches INTEGER NOT NULL CHECK (involuntary_context_switches >= 0),
  peak_memory_bytes INTEGER NOT NULL CHECK (peak_memory_bytes >= 0),
  solver_cost REAL,
  solver_violation REAL,
  verdict_literal TEXT NOT NULL CHECK (length(verdict_literal) BETWEEN 1 AND 50
    AND verdict_literal NOT GLOB '*[^a-z_]*'),
  verdict_strict TEXT NOT NULL CHECK (length(verdict_strict) BETWEEN 1 AND 50
    AND verdict_strict NOT GLOB '*[^a-z_]*'),
  verdict_detail TEXT NOT NULL DEFAULT '',
  failed_waypoint INTEGER CHECK (failed_waypoint >= 0),
  cost REAL,  -- per waypoint, by the judge
  num_waypoints INTEGER NOT NULL CHECK (num_waypoints >= 1),
  history_json TEXT,  -- convergence of results stored before schema version 7, which have no trace
  received_at_us INTEGER NOT NULL,
  -- CPU time per waypoint; wall time of results without CPU time.
  time_s REAL GENERATED ALWAYS AS (iif(cpu_us > 0, cpu_us, wall_us) / 1e6 / num_waypoints) VIRTUAL,
  solved_literal INTEGER GENERATED ALWAYS AS (verdict_literal = 'success') VIRTUAL,
  solved_strict INTEGER GENERATED ALWAYS AS (verdict_strict = 'success') VIRTUAL,
  windows INTEGER CHECK (windows >= 1),  -- NULL: not solved by windows
  windows_solved INTEGER CHECK (windows_solved BETWEEN 0 AND windows),
  -- Collisions between consecutive waypoints, with the exact meshes. NULL: no motion, or stored before schema version
  -- 3.
  interpolation_environment_depth_m REAL CHECK (interpolation_environment_depth_m >= 0),
  interpolation_self_depth_m REAL CHECK (interpolation_self_depth_m >= 0),
  interpolation_free_share REAL CHECK (interpolation_free_share BETWEEN 0 AND 1),
  -- Effort of the solve, in counts that do not depend on the load. NULL: stored before schema version 6.
  starts INTEGER CHECK (starts >= 1),  -- number of initial points; LegOpt-best uses several inside an attempt
  term_evaluations INTEGER CHECK (term_evaluations >= 1),  -- calls of terms, for values or derivatives
  collision_queries INTEGER CHECK (collision_queries >= 1),  -- configurations at which the solver computed contacts
  trace BLOB CHECK (length(trace) > 0),  -- convergence, compressed: docs/reference/database.md, "Traces"
  -- Verdict by the solid rule. NULL: stored before schema version 7.
  verdict_solid TEXT CHECK (length(verdict_solid) BETWEEN 1 AND 50 AND verdict_solid NOT GLOB '*[^a-z_]*'
    AND (verdict_solid <> 'success' OR verdict_strict = 'success')),
  -- Verdict on the best point of the unsolved window. NULL: no unsolved window, or that window was not started.
  window_verdict TEXT CHECK (window_verdict IS NULL OR (verdict_literal = 'window_unsolved'
    AND length(window_verdict) BETWEEN 1 AND 50 AND window_verdict NOT GLOB '*[^a-z_]*')),
  -- Verdict by the physical rule.
  verdict_physical TEXT CHECK (length(verdict_physical) BETWEEN 1 AND 50 AND verdict_physical NOT GLOB '*[^a-z_]*'
    AND (verdict_physical <> 'success' OR verdict_solid = 'success')),  -- since 14
  -- Number of postures at and half way between waypoints that were tested for static equilibrium, of those that have
  -- none, and of those in equilibrium that need more than an effort limit. NULL: none was tested.
  holding_postures INTEGER CHECK (holding_postures >= 1),  -- since 14
  holding_without_equilibrium INTEGER CHECK (holding_without_equilibrium >= 0),  -- since 14
  holding_over_torque INTEGER CHECK (holding_over_torque >= 0),  -- since 14
  halfway_postures INTEGER CHECK (halfway_postures >= 1),  -- since 14
  halfway_without_equilibrium INTEGER CHECK (halfway_without_equilibrium >= 0),  -- since 14
  halfway_over_torque INTEGER CHECK (halfway_over_torque >= 0),  -- since 14
  -- Shortest duration of a timed motion, the same with 80 % of friction and effort limits, and the shares of it in
  -- which a velocity, a torque or the force of a contact is nearest its limit. NULL: no timed motion, or no time law.
  duration_s REAL CHECK (duration_s >= 0),  -- since 15
  reduced_duration_s REAL CHECK (reduced_duration_s >= 0),  -- since 15
  velocity_limited_share REAL CHECK (velocity_limited_share BETWEEN 0 AND 1),  -- since 15
  torque_limited_share REAL CHECK (torque_limited_share BETWEEN 0 AND 1),  -- since 15
  contact_limited_share REAL CHECK (contact_limited_share BETWEEN 0 AND 1),  -- since 15
  -- Term evaluations, each with the weight of its kind of term. NULL: not counted.
  work_ns INTEGER CHECK (work_ns >= 1),  -- since 16
  -- Largest share of the terms' margins that the solver relaxed for the solution; 0: none.
  margin_relaxed REAL CHECK (margin_relaxed BETWEEN 0 AND 1),  -- since 17
  CHECK (cost IS NOT NULL OR (verdict_literal <> 'success' AND verdict_strict <> 'success')),
  FOREIGN KEY (job_id, attempt) REFERENCES attempts (job_id, attempt),
  FOREIGN KEY (job_id, cell_id) REFERENCES jobs (job_id, cell_id)
) STRICT;

-- Solutions: one row per waypoint, joints, base position, base quaternion (w x y z) as little-endian float64.
CREATE TABLE waypoints (
  job_id INTEGER NOT NULL REFERENCES results,
  waypoint INTEGER NOT NULL CHECK (waypoint >= 0),
  x BLOB NOT NULL CHECK (length(x) > 0 AND length(x) % 8 = 0),
  PRIMARY KEY (job_id, waypoint)
) STRICT, WITHOUT ROWID;

-- Reports that came too late for their attempt, kept for audits. They are never counted.
CREATE TABLE stale_results (
  job_id INTEGER NOT NULL,
  attempt INTEGER NOT NULL,
  outcome TEXT NOT NULL CHECK (outcome IN ('finished', 'crashed', 'time_limit', 'memory_limit', 'error', 'cancelled')),
  reason TEXT NOT NULL CHECK (length(reason) > 0),
  message TEXT NOT NULL DEFAULT '',
  received_at_us INTEGER NOT NULL,
  solver_status TEXT,
  iterations INTEGER,
  wall_us INTEGER,
  cpu_us INTEGER,
  verdict_literal TEXT,
  verdict_strict TEXT,
  verdict_detail TEXT,
  cost REAL,
  num_waypoints INTEGER,
  waypoint_size INTEGER,
  x BLOB,  -- all waypoints, row by row, as in the table waypoints
  CHECK ((outcome = 'finished') = (solver_status IS NOT NULL)),
  PRIMARY KEY (job_id, attempt),
  FOREIGN KEY (job_id, attempt) REFERENCES attempts (job_id, attempt)
) STRICT;

-- Log of the server, for people.
CREATE TABLE events (
  event_id INTEGER PRIMARY KEY,
  at_us INTEGER NOT NULL,
  kind TEXT NOT NULL CHECK (length(kind) BETWEEN 1 AND 50 AND kind NOT GLOB '*[^a-z_]*'),
  experiment_id INTEGER REFERENCES experiments,
  job_id INTEGER REFERENCES jobs,
  worker_id INTEGER REFERENCES workers,
  detail TEXT NOT NULL DEFAULT ''
) STRICT;

CREATE TABLE experiment_tags (
  experiment_id INTEGER NOT NULL REFERENCES experiments,
  tag TEXT NOT NULL CHECK (length(tag) BETWEEN 1 AND 100 AND tag NOT GLOB '*,*'),  -- lists are separated by commas
  PRIMARY KEY (experiment_id, tag)
) STRICT, WITHOUT ROWID;

-- Largest identifiers of deleted experiments: the server never uses them again.
CREATE TABLE deleted_ids (
  kind TEXT PRIMARY KEY CHECK (kind IN ('experiment', 'job', 'cell')),
  largest INTEGER NOT NULL CHECK (largest > 0)
) STRICT, WITHOUT ROWID;

-- Numbers of accepted results of each cell, kept by triggers, so that tables of millions of results need not count them.
-- solved_*: judged "success". unjudged_*: without a verdict by a newer rule.
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

-- Number of accepted results of each worker and experiment. Triggers keep it, so that captions of large tables are
-- fast.
CREATE TABLE result_workers (
  experiment_id INTEGER NOT NULL REFERENCES experiments,
  worker_id INTEGER NOT NULL REFERENCES workers,
  results INTEGER NOT NULL CHECK (results >= 0),
  PRIMARY KEY (experiment_id, worker_id)
) STRICT, WITHOUT ROWID;

-- One row. A write-ahead log beside another file would replace that file's pages. So each session of a writer has an
-- id, which is also in FILE.lock while the session has a log, and each copy gets a new id.
CREATE TABLE file_state (
  file_state_id INTEGER PRIMARY KEY CHECK (file_state_id = 1),
  session TEXT NOT NULL CHECK (length(session) = 32 AND session NOT GLOB '*[^0-9a-f]*'),
  commits INTEGER NOT NULL CHECK (commits >= 0)  -- each commit changes this row, so that every log names its session
) STRICT;
INSERT INTO file_state VALUES (1, lower(hex(randomblob(16))), 0);

-- The dataset's files, packed as by 'legopt dataset pack'. Results can be drawn, exported and solved again from this
-- file alone. A dataset that was not stored has no row.
CREATE TABLE dataset_archives (
  dataset_id INTEGER PRIMARY KEY REFERENCES datasets,
  archive BLOB NOT NULL CHECK (length(archive) > 0)
) STRICT;

-- Best point of an unsolved window, as in the table waypoints, without time stamps. `waypoint` is the number in the
-- whole motion; the first ones may also be waypoints of the window before. Not in the table waypoints, so that no query
-- takes it for a part of a solution.
CREATE TABLE unsolved_waypoints (
  job_id INTEGER NOT NULL REFERENCES results,
  waypoint INTEGER NOT NULL CHECK (waypoint >= 0),
  x BLOB NOT NULL CHECK (length(x) > 0 AND length(x) % 8 = 0),
  PRIMARY KEY (job_id, waypoint)
) STRICT, WITHOUT ROWID;

-- Largest value of each of the judge's checks over the waypoints of a solution, by the most lenient rule that counts it
-- (legopt/types/check.h, docs/reference/checks.md). The value by a rule is the maximum of this rule's and the more
-- lenient ones'. A check that was not made has no row.
CREATE TABLE violations (
  job_id INTEGER NOT NULL REFERENCES results,
  check_name TEXT NOT NULL CHECK (length(check_name) BETWEEN 1 AND 50 AND check_name NOT GLOB '*[^a-z_]*'),
  rule TEXT NOT NULL CHECK (rule IN ('literal', 'strict', 'solid', 'physical')),
  waypoint INTEGER CHECK (waypoint >= 0),  -- NULL: unknown
  subject TEXT NOT NULL DEFAULT '',  -- contact, joint, link or pair; empty for the value 0, or if unknown
  value REAL NOT NULL CHECK (value >= 0),  -- in the unit of the check
  PRIMARY KEY (job_id, check_name, rule)
) STRICT, WITHOUT ROWID;

-- ---- Indexes ----

-- The benchmark table reads this index alone; its order makes sums independent of the order of arrival.
CREATE INDEX results_by_cell ON results (cell_id, solved_literal, solved_strict, cost, time_s);
CREATE INDEX open_jobs_by_cell ON jobs (cell_id) WHERE state IN ('queued', 'leased');
CREATE INDEX cells_by_method ON cells (method_id);
CREATE INDEX events_by_experiment ON events (experiment_id) WHERE experiment_id IS NOT NULL;
CREATE INDEX events_by_job ON events (job_id) WHERE job_id IS NOT NULL;
CREATE INDEX jobs_without_result_by_cell ON jobs (cell_id, state) WHERE state IN ('failed', 'dead', 'cancelled');
CREATE INDEX time_limited_results_by_cell ON results (cell_id) WHERE solver_status = 'time_limit';
CREATE INDEX solid_results_by_cell ON results (cell_id, cost, time_s) WHERE verdict_solid = 'success';
CREATE INDEX physical_results_by_cell ON results (cell_id, cost, time_s) WHERE verdict_physical = 'success';
CREATE INDEX taken_jobs_by_cell ON jobs (cell_id) WHERE taken_from IS NOT NULL;
CREATE INDEX results_by_arrival ON results (received_at_us);

-- ---- Triggers ----

-- A job that is done has a result. (Only leased jobs get one, see below, so no other state can have it.)
CREATE TRIGGER jobs_done_has_result BEFORE UPDATE OF state ON jobs
WHEN NEW.state = 'done' AND NOT EXISTS (SELECT 1 FROM results WHERE job_id = NEW.job_id)
BEGIN
  SELECT RAISE(ABORT, 'a job cannot be done without its result');
END;

-- A result belongs to the running attempt of a leased job.
CREATE TRIGGER results_need_current_lease BEFORE INSERT ON results
WHEN NOT EXISTS (SELECT 1 FROM jobs JOIN attempts USING (job_id)
                 WHERE jobs.job_id = NEW.job_id AND jobs.state = 'leased' AND jobs.attempts = NEW.attempt
                   AND attempts.attempt = NEW.attempt AND attempts.outcome = 'running')
BEGIN
  SELECT RAISE(ABORT, 'a result needs the current lease of its job');
END;

CREATE TRIGGER results_are_final BEFORE UPDATE ON results
BEGIN
  SELECT RAISE(ABORT, 'an accepted result cannot change');
END;

-- An attempt is the next one of a leased job.
CREATE TRIGGER attempts_follow_jobs BEFORE INSERT ON attempts
WHEN NOT EXISTS (SELECT 1 FROM jobs WHERE job_id = NEW.job_id AND state = 'leased' AND attempts = NEW.attempt)
BEGIN
  SELECT RAISE(ABORT, 'an attempt needs a job leased for the same attempt');
END;

CREATE TRIGGER experiments_close_last BEFORE UPDATE OF state ON experiments
WHEN NEW.state <> 'active' AND EXISTS (
  SELECT 1 FROM cells JOIN jobs USING (cell_id)
  WHERE cells.experiment_id = NEW.experiment_id AND jobs.state IN ('queued', 'leased'))
BEGIN
  SELECT RAISE(ABORT, 'an experiment with open jobs cannot be closed');
END;

-- A terminal job changes only when it is retried: it died or failed, or its result was deleted, which results_stay
-- restricts. A retried job is not charged for earlier attempts.
CREATE TRIGGER jobs_terminal_is_final BEFORE UPDATE OF state, attempts, returned ON jobs
WHEN OLD.state = 'cancelled' OR (OLD.state IN ('done', 'failed', 'dead')
  AND NOT (NEW.state = 'queued' AND NEW.attempts = OLD.attempts AND NEW.returned = OLD.attempts
    AND NOT EXISTS (SELECT 1 FROM results WHERE job_id = OLD.job_id)))
BEGIN
  SELECT RAISE(ABORT, 'a terminal job cannot change');
END;

-- An accepted result may be deleted only if its solve was stopped by the wall-time limit and a copy is in
-- stale_results, or after its experiment. Rows of an experiment are deleted after the experiment, never before.
CREATE TRIGGER results_stay BEFORE DELETE ON results
WHEN EXISTS (SELECT 1 FROM cells JOIN experiments USING (experiment_id) WHERE cells.cell_id = OLD.cell_id)
  AND NOT (OLD.solver_status = 'time_limit' AND EXISTS (
    SELECT 1 FROM stale_results AS s
    WHERE s.job_id = OLD.job_id AND s.attempt = OLD.attempt AND s.solver_status = 'time_limit'))
BEGIN
  SELECT RAISE(ABORT, 'an accepted result cannot be deleted');
END;

CREATE TRIGGER waypoints_stay BEFORE DELETE ON waypoints
WHEN EXISTS (SELECT 1 FROM results AS r JOIN cells USING (cell_id) JOIN experiments USING (experiment_id)
             WHERE r.job_id = OLD.job_id)
BEGIN
  SELECT RAISE(ABORT, 'the solution of an accepted result cannot be deleted');
END;

CREATE TRIGGER stale_results_stay BEFORE DELETE ON stale_results
WHEN EXISTS (SELECT 1 FROM jobs JOIN cells USING (cell_id) JOIN experiments USING (experiment_id)
             WHERE jobs.job_id = OLD.job_id)
BEGIN
  SELECT RAISE(ABORT, 'a stale result cannot be deleted');
END;

CREATE TRIGGER attempts_stay BEFORE DELETE ON attempts
WHEN EXISTS (SELECT 1 FROM jobs JOIN cells USING (cell_id) JOIN experiments USING (experiment_id)
             WHERE jobs.job_id = OLD.job_id)
BEGIN
  SELECT RAISE(ABORT, 'an attempt cannot be deleted');
END;

CREATE TRIGGER jobs_stay BEFORE DELETE ON jobs
WHEN EXISTS (SELECT 1 FROM cells JOIN experiments USING (experiment_id) WHERE cells.cell_id = OLD.cell_id)
BEGIN
  SELECT RAISE(ABORT, 'a job cannot be deleted');
END;

CREATE TRIGGER experiments_are_closed_first BEFORE DELETE ON experiments
WHEN OLD.state = 'active'
BEGIN
  SELECT RAISE(ABORT, 'an active experiment cannot be deleted');
END;

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

-- A reused result stays reused.
CREATE TRIGGER jobs_are_taken_when_queued BEFORE UPDATE OF taken_from ON jobs
WHEN OLD.taken_from IS NOT NULL OR OLD.state <> 'queued' OR OLD.attempts > 0
BEGIN
  SELECT RAISE(ABORT, 'only a job that was never leased can take a result over');
END;

CREATE TRIGGER unsolved_waypoints_stay BEFORE DELETE ON unsolved_waypoints
WHEN EXISTS (SELECT 1 FROM results AS r JOIN cells USING (cell_id) JOIN experiments USING (experiment_id)
             WHERE r.job_id = OLD.job_id)
BEGIN
  SELECT RAISE(ABORT, 'the waypoints of an accepted result cannot be deleted');
END;

CREATE TRIGGER violations_stay BEFORE DELETE ON violations
WHEN EXISTS (SELECT 1 FROM results AS r JOIN cells USING (cell_id) JOIN experiments USING (experiment_id)
             WHERE r.job_id = OLD.job_id)
BEGIN
  SELECT RAISE(ABORT, 'the violations of an accepted result cannot be deleted');
END;

CREATE TRIGGER violations_are_final BEFORE UPDATE ON violations
BEGIN
  SELECT RAISE(ABORT, 'the violations of an accepted result cannot change');
END;
