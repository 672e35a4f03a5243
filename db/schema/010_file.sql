-- legopt database, schema version 10: which log belongs to the file, and the datasets of the results.

-- One row. A write-ahead log that lies beside another file would replace its pages, so each session of a writer has an
-- id, which is also in the file FILE.lock while the session has a log, and a copy gets an id of its own.
CREATE TABLE file_state (
  file_state_id INTEGER PRIMARY KEY CHECK (file_state_id = 1),
  session TEXT NOT NULL CHECK (length(session) = 32 AND session NOT GLOB '*[^0-9a-f]*'),
  commits INTEGER NOT NULL CHECK (commits >= 0)  -- each commit changes this row, so that every log names its session
) STRICT;
INSERT INTO file_state VALUES (1, lower(hex(randomblob(16))), 0);

-- The dataset's files as 'legopt dataset pack' writes them: results can be drawn, exported and solved again from this
-- file alone. A dataset that was not stored has no row.
CREATE TABLE dataset_archives (
  dataset_id INTEGER PRIMARY KEY REFERENCES datasets,
  archive BLOB NOT NULL CHECK (length(archive) > 0)
) STRICT;
