-- legopt database, schema version 9: collision models that no table lists.

-- What they are stands in words/collision.h; a table only asks for the shape of a word, as for tasks since version 6.
PRAGMA writable_schema = ON;
UPDATE sqlite_schema
SET sql = replace(sql, 'CHECK (collision IN (''solid'', ''surface''))',
  'CHECK (length(collision) BETWEEN 1 AND 50 AND collision NOT GLOB ''*[^a-z_]*'')')
WHERE type = 'table' AND name = 'methods';
PRAGMA writable_schema = RESET;
