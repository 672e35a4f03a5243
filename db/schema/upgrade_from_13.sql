-- From schema version 13 to 14: the physical rule, its verdict, and numbers of postures that can be held.
ALTER TABLE results ADD COLUMN verdict_physical TEXT CHECK (length(verdict_physical) BETWEEN 1 AND 50 AND
  verdict_physical NOT GLOB '*[^a-z_]*' AND (verdict_physical <> 'success' OR verdict_solid = 'success'));
ALTER TABLE results ADD COLUMN holding_postures INTEGER CHECK (holding_postures >= 1);
ALTER TABLE results ADD COLUMN holding_without_equilibrium INTEGER CHECK (holding_without_equilibrium >= 0);
ALTER TABLE results ADD COLUMN holding_over_torque INTEGER CHECK (holding_over_torque >= 0);
ALTER TABLE results ADD COLUMN halfway_postures INTEGER CHECK (halfway_postures >= 1);
ALTER TABLE results ADD COLUMN halfway_without_equilibrium INTEGER CHECK (halfway_without_equilibrium >= 0);
ALTER TABLE results ADD COLUMN halfway_over_torque INTEGER CHECK (halfway_over_torque >= 0);

CREATE INDEX physical_results_by_cell ON results (cell_id, cost, time_s) WHERE verdict_physical = 'success';

-- Only the text of the CHECKs changes; stored rows stay as they are.
PRAGMA writable_schema = ON;
UPDATE sqlite_schema
SET sql = replace(sql, 'rule IN (''literal'', ''strict'', ''solid'')',
  'rule IN (''literal'', ''strict'', ''solid'', ''physical'')')
WHERE type = 'table' AND name IN ('experiments', 'violations');
PRAGMA writable_schema = RESET;
