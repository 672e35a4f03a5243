-- From schema version 9 to 10: the tables file_state and dataset_archives of tables.sql.
CREATE TABLE file_state (
  file_state_id INTEGER PRIMARY KEY CHECK (file_state_id = 1),
  session TEXT NOT NULL CHECK (length(session) = 32 AND session NOT GLOB '*[^0-9a-f]*'),
  commits INTEGER NOT NULL CHECK (commits >= 0)
) STRICT;
INSERT INTO file_state VALUES (1, lower(hex(randomblob(16))), 0);

CREATE TABLE dataset_archives (
  dataset_id INTEGER PRIMARY KEY REFERENCES datasets,
  archive BLOB NOT NULL CHECK (length(archive) > 0)
) STRICT;
