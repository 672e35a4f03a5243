-- From schema version 13 to 14: the physical rule. tables.sql states the new columns.
CREATE INDEX physical_results_by_cell ON results (cell_id, cost, time_s) WHERE verdict_physical = 'success';

-- Only the text of the CHECKs changes; stored rows stay as they are.
PRAGMA writable_schema = ON;
UPDATE sqlite_schema
SET sql = replace(sql, 'rule IN (''literal'', ''strict'', ''solid'')',
  'rule IN (''literal'', ''strict'', ''solid'', ''physical'')')
WHERE type = 'table' AND name IN ('experiments', 'violations');
PRAGMA writable_schema = RESET;
