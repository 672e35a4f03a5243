-- legopt database, schema version 1: the tables.
-- Times *_at_us are microseconds since 1970 (UTC); durations *_us are microseconds. See README.md for the picture.

CREATE TABLE datasets (
  dataset_id INTEGER PRIMARY KEY,
  name TEXT NOT NULL CHECK (length(name) BETWEEN 1 AND 200),
  hash TEXT NOT NULL UNIQUE CHECK (length(hash) = 64 AND hash NOT GLOB '*[^0-9a-f]*')
) STRICT;

-- Equal hash: equal options. The name is what tables show, so one set of options may have several.
CREATE TABLE methods (
  method_id INTEGER PRIMARY KEY,
  name TEXT NOT NULL CHECK (length(name) BETWEEN 1 AND 200),
  hash TEXT NOT NULL CHECK (length(hash) = 64 AND hash NOT GLOB '*[^0-9a-f]*'),
  options_json TEXT NOT NULL CHECK (options_json GLOB '{*}'),
  multi_starts INTEGER NOT NULL CHECK (multi_starts >= 0),
  sample_size INTEGER NOT NULL CHECK (sample_size BETWEEN 1 AND 100),
  incremental INTEGER NOT NULL CHECK (incremental IN (0, 1)),
  UNIQUE (hash, name)
) STRICT;

CREATE TABLE problems (
  problem_key INTEGER PRIMARY KEY,
  dataset_id INTEGER NOT NULL REFERENCES datasets,
  task TEXT NOT NULL CHECK (task IN ('posture', 'motion')),
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
  wall_limit_us INTEGER NOT NULL CHECK (wall_limit_us > 0),
  memory_limit_bytes INTEGER NOT NULL CHECK (memory_limit_bytes > 0),
  first_job_id INTEGER NOT NULL UNIQUE CHECK (first_job_id > 0),
  num_jobs INTEGER NOT NULL CHECK (num_jobs >= 1),
  spec_json TEXT NOT NULL CHECK (spec_json GLOB '{*}'),
  spec_hash TEXT NOT NULL CHECK (length(spec_hash) = 64 AND spec_hash NOT GLOB '*[^0-9a-f]*'),
  submitted_at_us INTEGER NOT NULL,
  finished_at_us INTEGER,
  CHECK ((state = 'active') = (finished_at_us IS NULL))
) STRICT;

-- A cell of the benchmark table: all jobs of one method, task and initialisation of an experiment.
CREATE TABLE cells (
  cell_id INTEGER PRIMARY KEY CHECK (cell_id > 0),
  experiment_id INTEGER NOT NULL REFERENCES experiments,
  method_id INTEGER NOT NULL REFERENCES methods,
  task TEXT NOT NULL CHECK (task IN ('posture', 'motion')),
  initialization TEXT NOT NULL CHECK (initialization IN ('good', 'in_collision')),
  num_jobs INTEGER NOT NULL CHECK (num_jobs >= 1),
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
  last_seen_at_us INTEGER NOT NULL
) STRICT;

-- Every lease ever given. 'returned' attempts are not charged to the job.
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
    'iteration_limit', 'time_limit', 'numerical_failure', 'cancelled')),
  iterations INTEGER NOT NULL CHECK (iterations >= 0),
  restarts INTEGER NOT NULL CHECK (restarts >= 0),
  wall_us INTEGER NOT NULL CHECK (wall_us >= 0),
  cpu_us INTEGER NOT NULL CHECK (cpu_us >= 0),
  involuntary_context_switches INTEGER NOT NULL CHECK (involuntary_context_switches >= 0),
  peak_memory_bytes INTEGER NOT NULL CHECK (peak_memory_bytes >= 0),
  solver_cost REAL,
  solver_violation REAL,
  verdict_literal TEXT NOT NULL CHECK (verdict_literal IN ('success', 'wrong_waypoint_count', 'wrong_size',
    'not_finite', 'foot_pose', 'com', 'joint_limit', 'environment_collision', 'self_collision')),
  verdict_strict TEXT NOT NULL CHECK (verdict_strict IN ('success', 'wrong_waypoint_count', 'wrong_size',
    'not_finite', 'foot_pose', 'com', 'joint_limit', 'environment_collision', 'self_collision')),
  verdict_detail TEXT NOT NULL DEFAULT '',
  failed_waypoint INTEGER CHECK (failed_waypoint >= 0),
  cost REAL,  -- per waypoint, by the judge
  foot_violation REAL,
  com_violation_m REAL,
  limit_violation REAL,
  environment_depth_m REAL,
  self_depth_literal_m REAL,
  self_depth_strict_m REAL,
  num_waypoints INTEGER NOT NULL CHECK (num_waypoints >= 1),
  history_json TEXT,
  received_at_us INTEGER NOT NULL,
  time_s REAL GENERATED ALWAYS AS (wall_us / 1e6 / num_waypoints) VIRTUAL,  -- per waypoint
  solved_literal INTEGER GENERATED ALWAYS AS (verdict_literal = 'success') VIRTUAL,
  solved_strict INTEGER GENERATED ALWAYS AS (verdict_strict = 'success') VIRTUAL,
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

-- Reports that came too late for their attempt, for audit. They never count.
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

-- What happened, for people.
CREATE TABLE events (
  event_id INTEGER PRIMARY KEY,
  at_us INTEGER NOT NULL,
  kind TEXT NOT NULL CHECK (length(kind) BETWEEN 1 AND 50 AND kind NOT GLOB '*[^a-z_]*'),
  experiment_id INTEGER REFERENCES experiments,
  job_id INTEGER REFERENCES jobs,
  worker_id INTEGER REFERENCES workers,
  detail TEXT NOT NULL DEFAULT ''
) STRICT;

-- A terminal job stays as it is.
CREATE TRIGGER jobs_terminal_is_final BEFORE UPDATE OF state, attempts, returned ON jobs
WHEN OLD.state IN ('done', 'failed', 'dead', 'cancelled')
BEGIN
  SELECT RAISE(ABORT, 'a terminal job cannot change');
END;

-- Done means: has its result. (Only leased jobs get one, see below, so no other state can have it.)
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

-- An accepted result is history.
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

-- An experiment is closed when all its jobs are.
CREATE TRIGGER experiments_close_last BEFORE UPDATE OF state ON experiments
WHEN NEW.state <> 'active' AND EXISTS (
  SELECT 1 FROM cells JOIN jobs USING (cell_id)
  WHERE cells.experiment_id = NEW.experiment_id AND jobs.state IN ('queued', 'leased'))
BEGIN
  SELECT RAISE(ABORT, 'an experiment with open jobs cannot be closed');
END;
