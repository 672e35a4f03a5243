-- From schema version 12 to 13: the figures of the judge move from columns of results to the table violations, and the
-- names of verdicts are not repeated in the schema.
CREATE TABLE violations (
  job_id INTEGER NOT NULL REFERENCES results,
  check_name TEXT NOT NULL CHECK (length(check_name) BETWEEN 1 AND 50 AND check_name NOT GLOB '*[^a-z_]*'),
  rule TEXT NOT NULL CHECK (rule IN ('literal', 'strict', 'solid')),
  waypoint INTEGER CHECK (waypoint >= 0),  -- NULL: unknown
  subject TEXT NOT NULL DEFAULT '',  -- contact, joint, link or pair; empty for the value 0, or if unknown
  value REAL NOT NULL CHECK (value >= 0),  -- in the unit of the check
  PRIMARY KEY (job_id, check_name, rule)
) STRICT, WITHOUT ROWID;

-- The largest depth by the solid rule was one figure of three checks. It goes to the check of the verdict, or to
-- containment.
INSERT INTO violations (job_id, check_name, rule, value)
SELECT job_id, 'foot_pose', 'literal', foot_violation FROM results WHERE foot_violation >= 0 UNION ALL
SELECT job_id, 'com', 'literal', com_violation_m FROM results WHERE com_violation_m >= 0 UNION ALL
SELECT job_id, 'joint_limit', 'literal', limit_violation FROM results WHERE limit_violation >= 0 UNION ALL
SELECT job_id, 'environment_collision', 'literal', environment_depth_m FROM results WHERE environment_depth_m >= 0
UNION ALL
SELECT job_id, 'self_collision', 'literal', self_depth_literal_m FROM results WHERE self_depth_literal_m >= 0 UNION ALL
SELECT job_id, 'self_collision', 'strict', self_depth_strict_m FROM results
WHERE self_depth_strict_m > coalesce(self_depth_literal_m, -1) UNION ALL
SELECT job_id, iif(verdict_solid IN ('environment_collision', 'self_collision'), verdict_solid, 'containment'), 'solid',
  solid_depth_m FROM results
WHERE solid_depth_m > max(coalesce(environment_depth_m, -1), coalesce(self_depth_literal_m, -1),
  coalesce(self_depth_strict_m, -1)) UNION ALL
SELECT job_id, 'step', 'solid', longest_step_m FROM results WHERE longest_step_m >= 0;

DROP VIEW IF EXISTS job_list;
ALTER TABLE results DROP COLUMN foot_violation;
ALTER TABLE results DROP COLUMN com_violation_m;
ALTER TABLE results DROP COLUMN limit_violation;
ALTER TABLE results DROP COLUMN environment_depth_m;
ALTER TABLE results DROP COLUMN self_depth_literal_m;
ALTER TABLE results DROP COLUMN self_depth_strict_m;
ALTER TABLE results DROP COLUMN solid_depth_m;
ALTER TABLE results DROP COLUMN longest_step_m;

-- Only the text of the CHECKs changes; stored rows stay as they are.
PRAGMA writable_schema = ON;
UPDATE sqlite_schema
SET sql = substr(sql, 1, instr(sql, 'verdict_literal IN (') - 1)
  || 'length(verdict_literal) BETWEEN 1 AND 50 AND verdict_literal NOT GLOB ''*[^a-z_]*'''
  || substr(substr(sql, instr(sql, 'verdict_literal IN (')), instr(substr(sql, instr(sql, 'verdict_literal IN (')), ')') + 1)
WHERE type = 'table' AND name = 'results';
UPDATE sqlite_schema
SET sql = substr(sql, 1, instr(sql, 'verdict_strict IN (') - 1)
  || 'length(verdict_strict) BETWEEN 1 AND 50 AND verdict_strict NOT GLOB ''*[^a-z_]*'''
  || substr(substr(sql, instr(sql, 'verdict_strict IN (')), instr(substr(sql, instr(sql, 'verdict_strict IN (')), ')') + 1)
WHERE type = 'table' AND name = 'results';
UPDATE sqlite_schema
SET sql = substr(sql, 1, instr(sql, 'verdict_solid IN (') - 1)
  || 'length(verdict_solid) BETWEEN 1 AND 50 AND verdict_solid NOT GLOB ''*[^a-z_]*'''
  || substr(substr(sql, instr(sql, 'verdict_solid IN (')), instr(substr(sql, instr(sql, 'verdict_solid IN (')), ')') + 1)
WHERE type = 'table' AND name = 'results';
PRAGMA writable_schema = RESET;

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
