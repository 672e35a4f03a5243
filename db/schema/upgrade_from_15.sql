-- From schema version 15 to 16: times are CPU times. tables.sql states the new expression.
DROP INDEX results_by_cell;
DROP INDEX solid_results_by_cell;
DROP INDEX physical_results_by_cell;
PRAGMA writable_schema = ON;
UPDATE sqlite_schema
SET sql = replace(sql, '(wall_us / 1e6 / num_waypoints)',
  '(iif(cpu_us > 0, cpu_us, wall_us) / 1e6 / num_waypoints)')
WHERE type = 'table' AND name = 'results';
PRAGMA writable_schema = RESET;
CREATE INDEX results_by_cell ON results (cell_id, solved_literal, solved_strict, cost, time_s);
CREATE INDEX solid_results_by_cell ON results (cell_id, cost, time_s) WHERE verdict_solid = 'success';
CREATE INDEX physical_results_by_cell ON results (cell_id, cost, time_s) WHERE verdict_physical = 'success';
